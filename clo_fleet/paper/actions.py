"""All that the robot could do in a problem, for strategies that look for shorter ways: grounded once, kept for the run.

The newcomers do not count: no strategy that asks for actions looks at them.
"""

from dataclasses import dataclass, field

from clo_fleet.clo.operators import Operators
from clo_fleet.clo.task import Condition, State
from clo_fleet.planning.formulas import TRUE, AllOf, Atom, Formula, Literal, Same
from clo_fleet.planning.grounding import Change, LiftedAction, LiftedTask, grounding
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import EQUALS, Domain, Schema

__all__ = ["KnownActions", "lifted"]


@dataclass(slots=True)
class KnownActions:
    """The ground actions of a problem, as an executive asks for them. They are made when it first does."""

    domain: Domain
    task: PlanningTask
    _operators: Operators | None = field(default=None, init=False)

    def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
        """The operators of the whole problem, whatever the state: what can be reached, could from the start."""
        if self._operators is None:
            self._operators = Operators(grounding(lifted(self.domain, self.task)).task.actions, goals)
        return self._operators


def lifted(domain: Domain, task: PlanningTask) -> LiftedTask:
    """The task as the grounding wants it."""
    objects = dict(task.objects)
    named = {type_: _names(domain, objects, type_) for schema in domain.schemas for _, type_ in schema.parameters}
    return LiftedTask(
        name=task.robot,
        predicates=frozenset(name for name, _ in domain.predicates),
        facts=task.facts,
        goal=AllOf(tuple(map(Literal, task.goals))),
        actions=tuple(_lifted_action(schema, named) for schema in domain.schemas),
        costs=dict(task.costs),
    )


def _names(domain: Domain, objects: dict[str, tuple[str, ...]], type_: str) -> tuple[str, ...]:
    constants = tuple(name for name, kind in domain.constants if domain.is_a(kind, type_))
    return constants + tuple(name for kind, names in objects.items() if domain.is_a(kind, type_) for name in names)


def _lifted_action(schema: Schema, named: dict[str, tuple[str, ...]]) -> LiftedAction:
    places = {variable: place for place, (variable, _) in enumerate(schema.parameters)}

    def atom(terms: tuple[str, ...]) -> Atom:
        return (terms[0], *(places.get(term, term) for term in terms[1:]))

    def formula(need: Condition) -> Formula:
        if need.fact[0] == EQUALS:
            _, left, right = atom(need.fact)
            return Same(left, right, need.positive)
        return Literal(atom(need.fact), need.positive)

    changes = [Change(atom(fact), True, TRUE) for fact in schema.adds]
    changes += [Change(atom(fact), False, TRUE) for fact in schema.deletes if fact not in schema.adds]
    return LiftedAction(
        name=schema.name,
        parameters=tuple(named[type_] for _, type_ in schema.parameters),
        needs=AllOf(tuple(map(formula, schema.needs))),
        changes=tuple(changes),
        cost=schema.cost if isinstance(schema.cost, int) else atom(schema.cost),
    )
