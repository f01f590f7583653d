"""The words of a plan as plain data for JSON, and back: facts, conditions, actions, steps, causes, flips.

Sets are written sorted, so that equal ones give the same bytes.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.task import Action, Condition, Fact

__all__ = [
    "plain_action",
    "plain_cause",
    "plain_conditions",
    "plain_facts",
    "plain_flip",
    "plain_plan",
    "read_action",
    "read_cause",
    "read_conditions",
    "read_facts",
    "read_flip",
    "read_plan",
]


def plain_facts(facts: Iterable[Fact]) -> list[list[str]]:
    """A set of facts."""
    return sorted(map(list, facts))


def read_facts(plain: Iterable[Sequence[str]]) -> frozenset[Fact]:
    """What ``plain_facts`` wrote."""
    return frozenset(map(tuple, plain))


def plain_conditions(conditions: Iterable[Condition]) -> list[object]:
    """Conditions in their order."""
    return [[list(condition.fact), condition.positive] for condition in conditions]


def read_conditions(plain: Iterable[Any]) -> tuple[Condition, ...]:
    """What ``plain_conditions`` wrote."""
    return tuple(Condition(tuple(fact), positive) for fact, positive in plain)


def plain_cause(cause: Cause | None) -> list[object] | None:
    """Whose action changed something, if somebody's did."""
    return None if cause is None else [cause.robot, cause.action, cause.event]


def read_cause(plain: Sequence[Any] | None) -> Cause | None:
    """What ``plain_cause`` wrote."""
    return None if plain is None else Cause(*plain)


def plain_flip(flip: Flip) -> list[object]:
    """A fact that turned.

    >>> plain_flip(Flip(("holding", "r1", "o2"), True, Cause("r2", "give(r2, r1, o2, l1)", 7)))
    [['holding', 'r1', 'o2'], True, ['r2', 'give(r2, r1, o2, l1)', 7]]
    """
    return [list(flip.fact), flip.value, plain_cause(flip.cause)]


def read_flip(plain: Sequence[Any]) -> Flip:
    """What ``plain_flip`` wrote."""
    fact, value, cause = plain
    return Flip(tuple(fact), value, read_cause(cause))


def plain_action(action: Action) -> dict[str, object]:
    """An action."""
    return {
        "schema": action.schema,
        "args": list(action.args),
        "needs": plain_conditions(action.needs),
        "adds": plain_facts(action.adds),
        "deletes": plain_facts(action.deletes),
        "cost": action.cost,
    }


def read_action(plain: Mapping[str, Any]) -> Action:
    """What ``plain_action`` wrote."""
    return Action(
        schema=plain["schema"],
        args=tuple(plain["args"]),
        needs=read_conditions(plain["needs"]),
        adds=read_facts(plain["adds"]),
        deletes=read_facts(plain["deletes"]),
        cost=plain["cost"],
    )


def plain_plan(plan: Iterable[Step]) -> list[dict[str, object]]:
    """Steps in their order."""
    return [{"id": step.id, "action": plain_action(step.action)} for step in plan]


def read_plan(plain: Iterable[Mapping[str, Any]]) -> Plan:
    """What ``plain_plan`` wrote."""
    return tuple(Step(step["id"], read_action(step["action"])) for step in plain)
