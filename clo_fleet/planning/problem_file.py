"""Reads PDDL problems of a domain that our own reader has read."""

from clo_fleet.planning.problem import PlanningTask, check
from clo_fleet.world.pddl import TOTAL_COST
from clo_fleet.world.pddl_forms import Form, atom, conjuncts, literal, parse, sections, typed, whole
from clo_fleet.world.schemas import EQUALS, Atom, Domain

__all__ = ["read_problem"]


def read_problem(text: str, domain: Domain) -> PlanningTask:
    """The task that the PDDL problem ``text`` states, under the problem's name.

    Raises:
        PddlError: if it is not a PDDL problem, or uses what is not supported.
        PlanningTaskError: if it does not fit the domain.
    """
    form = parse(text, "problem")
    parts = sections(form, {":domain", ":requirements", ":objects", ":init", ":goal", ":metric"})
    objects: dict[str, list[str]] = {}
    for name, type_ in typed(parts[":objects"].items[1:] if ":objects" in parts else ()):
        objects.setdefault(type_, []).append(name)
    init = parts[":init"].items[1:] if ":init" in parts else ()
    values = [_value(value) for value in init if value.head == EQUALS]
    goals = [literal(part) for part in conjuncts(parts[":goal"].items[-1])] if ":goal" in parts else []
    if not all(goal.positive for goal in goals):
        raise parts[":goal"].error("a negative goal is not supported")
    task = PlanningTask(
        robot=form.items[1].items[-1].name,
        objects=tuple((type_, tuple(names)) for type_, names in objects.items()),
        facts=frozenset(atom(fact) for fact in init if fact.head != EQUALS),
        goals=tuple(goal.fact for goal in goals),
        costs=tuple(value for value in values if value[0] != (TOTAL_COST,)),
    )
    check(task, domain)
    return task


def _value(form: Form) -> tuple[Atom, int]:
    if len(form.items) != 3:
        raise form.error("expected (= (NAME OBJECT ...) VALUE)")
    return atom(form.items[1]), whole(form.items[2])
