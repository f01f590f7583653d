"""What an opportunity would save if it came true now, and how long it would still be of use.

An opportunity is a condition, of either sign, that some causal link of a plan is on. Its *value* is the cost of the
steps that a repair would drop if the condition came to hold at this moment. Its *windows* are the stretches of the
plan in which coming to hold would still make a step needless. Perception and radio choose by them what to look at
and what to tell.

Why windows need no trial of each place: take the step p that makes the condition hold for later steps. Links follow
the value of a fact, so the condition fails from the last step before p that touched the fact until p. Wherever in
that stretch it comes to hold by itself, nothing undoes it before p, so p loses all its links on it, and no other step
loses any. Hence p is needless then exactly if it has no other links, and only with p can more steps become needless.

The worked example of Borrajo and Veloso 2024. Holding the second object saves most: the way to it as well.

>>> from clo_fleet.clo.plan import number
>>> from clo_fleet.clo.task import Action, parse_fact
>>> def act(name, needs, adds, deletes=()):
...     schema, *args = name.split()
...     return Action(schema=schema, args=tuple(args), needs=tuple(Condition(parse_fact(fact)) for fact in needs),
...                   adds=frozenset(map(parse_fact, adds)), deletes=frozenset(map(parse_fact, deletes)))
>>> def move(a, b):
...     return act(f"move {a} {b}", [f"(at-robot {a})"], [f"(at-robot {b})"], [f"(at-robot {a})"])
>>> def prepare(o, l):
...     return act(f"prepare {o} {l}", [f"(at-object {o} {l})", f"(at-robot {l})"], [f"(prepared {o})"])
>>> def grasp(o, l):
...     needs = [f"(at-object {o} {l})", f"(at-robot {l})", f"(prepared {o})"]
...     return act(f"grasp {o} {l}", needs, [f"(holding {o})"], [f"(at-object {o} {l})"])
>>> plan = number([move("l3", "l1"), prepare("o1", "l1"), grasp("o1", "l1"),
...                move("l1", "l2"), prepare("o2", "l2"), grasp("o2", "l2")], first=1)
>>> state = set(map(parse_fact, ["(at-robot l3)", "(at-object o1 l1)", "(at-object o2 l2)"]))
>>> goals = (Condition(("holding", "o1")), Condition(("holding", "o2")))
>>> for worth in worths(state, plan, goals):
...     helps = ", ".join(f"{plan[window.first]} .. {plan[window.last]}" for window in worth.windows)
...     print(f"{worth.condition!s:14}", worth.value, "saved; of use before", helps)
(holding o2)   3 saved; of use before move(l3, l1) .. grasp(o2, l2)
(holding o1)   2 saved; of use before move(l3, l1) .. grasp(o1, l1)
(at-robot l1)  1 saved; of use before move(l3, l1) .. move(l3, l1)
(at-robot l2)  1 saved; of use before move(l3, l1) .. move(l1, l2)
(prepared o1)  1 saved; of use before move(l3, l1) .. prepare(o1, l1)
(prepared o2)  1 saved; of use before move(l3, l1) .. prepare(o2, l2)
"""

from collections.abc import Iterable
from dataclasses import dataclass

from clo_fleet.clo.deletion import delete
from clo_fleet.clo.links import Links, causal_links
from clo_fleet.clo.plan import Plan
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Condition, Fact, State, holds

__all__ = ["Window", "Worth", "worths"]


@dataclass(frozen=True, slots=True, order=True)
class Window:
    """Places of a plan, ``first`` to ``last``, counted from 0: a change *before* the step there would help."""

    first: int
    last: int

    def __contains__(self, place: int) -> bool:
        return self.first <= place <= self.last


@dataclass(frozen=True, slots=True)
class Worth:
    """What an opportunity is good for.

    Attributes:
        condition: the opportunity.
        value: the cost that a repair would drop if it came to hold now; 0 as well if the plan would break by it.
        steps: how many steps that repair would drop.
        windows: where in the plan it could come to hold and make a step needless, in order, apart from one another.
            They follow from links alone: that it could end a loop opens no window.
    """

    condition: Condition
    value: int
    steps: int
    windows: tuple[Window, ...]


def worths(
    state: State, plan: Plan, goals: Iterable[Condition], unknown: frozenset[Fact] = frozenset()
) -> tuple[Worth, ...]:
    """The worth of every opportunity of ``plan``, the most valuable first, equals in the order of their conditions.

    Args:
        state: what is true now.
        plan: the steps still to be done, as a repair leaves them: none needless.
        goals: what must hold at the end.
        unknown: facts of which it is not known whether they hold.

    Cost: linear in the plan's conditions, and for each opportunity what a repair touches, there and back.
    """
    goals = tuple(goals)
    links = causal_links(state, plan, goals, unknown)
    supports = Supports(state, plan, goals, unknown)
    windows = _windows(plan, links)
    found = []
    for condition in sorted(links.opportunities):
        held = condition.fact not in unknown and holds(condition, state)
        value, steps = (0, 0) if held else _saved(supports, condition)
        found.append(Worth(condition, value, steps, tuple(windows.get(condition, ()))))
    return tuple(sorted(found, key=lambda worth: -worth.value))


def _saved(supports: Supports, condition: Condition) -> tuple[int, int]:
    """The cost and the number of the steps that a repair drops when ``condition`` comes to hold."""
    mark = supports.mark()
    found = delete(supports, {condition.fact: condition.positive})
    supports.undo(mark)
    if found.gaps:
        return 0, 0
    return sum(drop.step.action.cost for drop in found.drops), len(found.drops)


def _windows(plan: Plan, links: Links) -> dict[Condition, list[Window]]:
    """For each condition the stretches that end with a step whose links are all on it."""
    uses: dict[int, set[Condition]] = {}
    for link in links.links:
        uses.setdefault(link.producer, set()).add(link.condition)
    windows: dict[Condition, list[Window]] = {}
    touched: dict[Fact, int] = {}  # fact -> the place of the last step that adds or deletes it
    for place, step in enumerate(plan):
        conditions = uses.get(step.id, ())
        if len(conditions) == 1:
            (condition,) = conditions
            windows.setdefault(condition, []).append(Window(touched.get(condition.fact, -1) + 1, place))
        touched.update(dict.fromkeys(step.action.adds | step.action.deletes, place))
    return windows
