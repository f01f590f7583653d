"""Grounding: a problem with variables becomes one without.

The ground actions are those that ``reachability`` finds. An action that falls apart into several cases becomes several,
told apart by numbers after its name, and a goal with several cases is noted by actions of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from clo_fleet.clo.task import Action, Condition, Fact
from clo_fleet.planning.formulas import Case, TooManyCasesError, cases
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.planning.lifted_task import Change, LiftedAction, LiftedTask
from clo_fleet.planning.reachability import GroundingError, Name, Reachability, conditions

__all__ = ["Change", "Grounding", "GroundingError", "LiftedAction", "LiftedTask", "Name", "grounding"]

GOAL = "goal-reached"  # the fact that stands for a goal with several cases
NEVER = Condition(("never",))  # the goal that stands for one that cannot be reached


@dataclass(frozen=True, slots=True)
class Grounding:
    """A ground task, and where it came from.

    Attributes:
        static: the facts that were true at the start and that no action can change.
        origins: the name and arguments of the lifted action of each ground one, by its schema and arguments; ``None``
            for an action that only notes that a goal is reached.
    """

    task: GroundTask
    static: frozenset[Fact]
    origins: Mapping[Name, Name | None]


def grounding(lifted: LiftedTask) -> Grounding:
    """The problem without its variables.

    Raises:
        GroundingError: if it has too many actions, an action too many cases, or a cost no value.
    """
    static = lifted.predicates - {str(change.atom[0]) for action in lifted.actions for change in action.changes}
    try:
        goal = cases(lifted.goal, (), static, lifted.facts)
    except TooManyCasesError as error:
        raise GroundingError("the goal", str(error)) from error
    variants = Reachability(lifted, static).variants()
    goals, variants, notes = _single_goal(goal, variants, lifted.predicates)
    origins: dict[Name, Name | None] = {}
    actions = []
    for name, group in variants.items():
        for number, action in enumerate(sorted(group, key=_order), start=1):
            if len(group) > 1:
                action = replace(action, schema=f"{action.schema}/{number}")
            actions.append(action)
            origins[action.schema, action.args] = name if name not in notes else None
    state = frozenset(fact for fact in lifted.facts if fact[0] not in static)
    task = GroundTask(lifted.name, state, goals, tuple(sorted(actions, key=_order)))
    return Grounding(task, lifted.facts - state, origins)


def _order(action: Action) -> tuple[object, ...]:
    return action.schema, action.args, action.needs, sorted(action.adds), sorted(action.deletes)


def _single_goal(
    goal: tuple[Case, ...], variants: Mapping[Name, list[Action]], predicates: frozenset[str]
) -> tuple[tuple[Condition, ...], dict[Name, list[Action]], set[Name]]:
    """The goal as conditions that all have to hold; the actions, and the names of those added for that.

    If the goal has several cases, an action for each notes that it is reached; what changes a fact that the goal is
    about takes the note away.
    """
    if len(goal) < 2:
        return (conditions(goal[0]) if goal else (NEVER,)), dict(variants), set()
    schema = GOAL
    while schema in predicates or any(name == schema for name, _ in variants):
        schema += "'"
    note = (schema,)
    concerned = {fact for case in goal for fact in case}
    changed = {
        name: [
            action
            if concerned.isdisjoint(action.adds | action.deletes)
            else replace(action, deletes=action.deletes | {note})
            for action in group
        ]
        for name, group in variants.items()
    }
    changed[schema, ()] = [
        Action(schema=schema, args=(), needs=conditions(case), adds=frozenset({note}), deletes=frozenset(), cost=0)
        for case in goal
    ]
    return (Condition(note),), changed, {(schema, ())}
