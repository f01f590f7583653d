"""Plans as sequences of steps, and the plain run through one that every cleverer check is judged by."""

from collections.abc import Iterable
from dataclasses import dataclass

from clo_fleet.clo.task import Action, Condition, Fact, State, apply, holds, unmet

__all__ = ["Fault", "Plan", "Step", "cost", "first_fault", "goals_of", "number"]


@dataclass(frozen=True, slots=True)
class Step:
    """One action at one place of a plan. The id stays the same however the plan around it shrinks."""

    id: int
    action: Action

    def __str__(self) -> str:
        return self.action.name


Plan = tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Fault:
    """Where a plan breaks: at ``step`` (``None``: at its end, for a goal), for want of ``missing``."""

    step: Step | None
    missing: tuple[Condition, ...]


def number(actions: Iterable[Action], first: int = 0) -> Plan:
    """The actions as steps with consecutive ids from ``first``."""
    return tuple(Step(first + i, action) for i, action in enumerate(actions))


def goals_of(facts: Iterable[Fact]) -> tuple[Condition, ...]:
    """The facts as goals, each to be true."""
    return tuple(Condition(fact) for fact in facts)


def cost(plan: Plan) -> int:
    """The sum of the costs of the plan's actions."""
    return sum(step.action.cost for step in plan)


def first_fault(state: State, plan: Plan, goals: Iterable[Condition]) -> Fault | None:
    """The first fault met when the plan is run forward from ``state``; ``None`` if it reaches its goals.

    Linear in the conditions of the plan. This is the oracle: nothing here is shared with the repair.
    """
    for step in plan:
        if missing := unmet(step.action, state):
            return Fault(step, missing)
        state = apply(state, step.action)
    if missing := tuple(goal for goal in goals if not holds(goal, state)):
        return Fault(None, missing)
    return None
