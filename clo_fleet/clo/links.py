"""Causal links: which step makes a condition true for which other step, and what is taken from now.

Borrajo and Veloso 2024, Algorithm 1, with another support rule (DECISIONS 3). Their links name the *last*
producer before a consumer. Ours follow the value of each fact forward through the plan: the condition of a
consumer is supported by *now* whenever it holds now and nothing before the consumer changes it, otherwise by
the step that made it hold and after which it stayed so. A link so chosen has no threat between its ends.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import Enum

from clo_fleet.clo.plan import Plan
from clo_fleet.clo.task import Condition, Fact, State, holds

__all__ = ["Consumer", "End", "Guard", "Link", "Links", "Unsupported", "causal_links"]


class End(Enum):
    """The consumer of the goals: the end of the plan, the paper's action A-infinity."""

    GOAL = "goal"


Consumer = int | End


@dataclass(frozen=True, slots=True)
class Link:
    """``producer`` (a step's id) makes ``condition`` hold for ``consumer`` (a step's id, or the goal)."""

    producer: int
    condition: Condition
    consumer: Consumer


@dataclass(frozen=True, slots=True)
class Guard:
    """``consumer`` takes ``condition`` from the present state: if it breaks, so does the plan."""

    condition: Condition
    consumer: Consumer


@dataclass(frozen=True, slots=True)
class Unsupported:
    """Nothing makes ``condition`` hold for ``consumer``."""

    condition: Condition
    consumer: Consumer


@dataclass(frozen=True, slots=True)
class Links:
    """What holds a plan together: its links, its guards, and where it is broken."""

    links: tuple[Link, ...] = ()
    guards: tuple[Guard, ...] = ()
    unsupported: tuple[Unsupported, ...] = ()

    @property
    def opportunities(self) -> frozenset[Condition]:
        """Conditions which, if they came to hold by themselves, could make steps needless."""
        return frozenset(link.condition for link in self.links)

    @property
    def watched(self) -> frozenset[Fact]:
        """The facts worth looking at: those of the opportunities and of the guards."""
        conditions = (*(link.condition for link in self.links), *(guard.condition for guard in self.guards))
        return frozenset(condition.fact for condition in conditions)


def causal_links(state: State, plan: Plan, goals: Iterable[Condition], unknown: Collection[Fact] = ()) -> Links:
    """The links, guards and gaps of ``plan``, run from ``state``. Linear in the plan's conditions.

    Facts ``unknown`` are neither true nor false until a step makes them so: they support nothing.

    >>> from clo_fleet.clo.task import Action
    >>> from clo_fleet.clo.plan import number
    >>> here, there = ("at-robot", "l1"), ("at-robot", "l2")
    >>> move = Action(schema="move", args=("l1", "l2"), needs=(Condition(here),),
    ...               adds=frozenset({there}), deletes=frozenset({here}))
    >>> found = causal_links({here}, number([move]), [Condition(there)])
    >>> print(*(f"{link.producer} {link.condition} {link.consumer.name}" for link in found.links))
    0 (at-robot l2) GOAL
    >>> print(*(f"{guard.condition} {guard.consumer}" for guard in found.guards))
    (at-robot l1) 0
    """
    value = set(state)
    unclear = set(unknown)
    since: dict[Fact, int] = {}  # fact -> the step that last changed its value
    links: list[Link] = []
    guards: list[Guard] = []
    unsupported: list[Unsupported] = []

    def support(conditions: Iterable[Condition], consumer: Consumer) -> None:
        for condition in conditions:
            if condition.fact in unclear or not holds(condition, value):
                unsupported.append(Unsupported(condition, consumer))
            elif (producer := since.get(condition.fact)) is None:
                guards.append(Guard(condition, consumer))
            else:
                links.append(Link(producer, condition, consumer))

    for step in plan:
        support(step.action.needs, step.id)
        deletes, adds = step.action.deletes, step.action.adds
        for fact in deletes & value:
            since[fact] = step.id
        for fact in adds - value:
            since[fact] = step.id
        for fact in unclear & (deletes | adds) if unclear else ():
            since[fact] = step.id
            unclear.discard(fact)
        value -= deletes
        value |= adds
    support(goals, End.GOAL)
    return Links(tuple(links), tuple(guards), tuple(unsupported))
