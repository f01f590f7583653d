"""Everything that the event log can say. One class a kind; values only; times in simulated seconds.

A line of ``events.jsonl`` is ``{"id": n, "t": seconds, "kind": "action_started", ...}``: the kind is the class's
name in lower case, the other keys its fields. Ids count from 0 in the order of the log. The format is
versioned by ``EVENTS_FORMAT``, which the first line (``run_started``) carries.
"""

import re
from dataclasses import dataclass, fields
from typing import Protocol

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Fact, fact_text

__all__ = [
    "EVENTS_FORMAT",
    "ActionCalledOff",
    "ActionEnded",
    "ActionStarted",
    "AlsoHappened",
    "Body",
    "Disturbed",
    "Event",
    "FactChanged",
    "GaveUp",
    "GoalsReached",
    "OfferAnswered",
    "OfferClosed",
    "OfferMade",
    "PlanAnnounced",
    "PlanFailed",
    "PlanFollowed",
    "PlanLinked",
    "PlanMended",
    "PlanRequested",
    "Poses",
    "Recorder",
    "RepairFailed",
    "Rerouted",
    "RunEnded",
    "RunStarted",
    "Sensed",
    "StepsLeftOut",
    "Waiting",
    "credit",
    "kind",
    "kind_of",
    "plain",
]

EVENTS_FORMAT = "clo-fleet/events/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunStarted:
    """The first event: what is run. ``checkpoint_every``: how often the run is saved, which changes it a little [s]."""

    format: str
    version: str
    world: str
    map: str
    strategy: str
    seed: int
    until: float
    robots: tuple[str, ...]
    objects: tuple[str, ...]
    checkpoint_every: float | None = None


@dataclass(frozen=True, slots=True)
class PlanRequested:
    """A robot asked its planner for a plan."""

    robot: str
    why: str


@dataclass(frozen=True, slots=True)
class PlanFollowed:
    """A plan came and is followed. ``steps`` as ``[id, action]``; ``superseded``: steps of the old plan."""

    robot: str
    steps: tuple[tuple[int, str], ...]
    superseded: tuple[str, ...]
    expansions: int
    cost: int


@dataclass(frozen=True, slots=True)
class PlanFailed:
    """The planner brought no plan."""

    robot: str
    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class PlanAnnounced:
    """A robot told the others by radio the steps that it still means to do."""

    robot: str
    steps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ActionStarted:
    """A robot began to carry out a step of its plan."""

    robot: str
    step: int
    action: str


@dataclass(frozen=True, slots=True)
class ActionCalledOff:
    """A robot means to stop what it is doing: why, and what made that needless, if a fact did, and whose doing that is.

    It stops where that is safe, and then the action ends as ``cancelled``; it may be too late for that.
    """

    robot: str
    step: int
    action: str
    reason: str
    fact: Fact | None
    by: str | None
    cause: int | None


@dataclass(frozen=True, slots=True)
class ActionEnded:
    """How an action ended: ``finished``, ``failed`` (``reason``) or ``cancelled``. ``started``: that event's id."""

    robot: str
    step: int
    action: str
    ending: str
    reason: str
    started: int


@dataclass(frozen=True, slots=True)
class AlsoHappened:
    """A fact came about along with the effects of a robot's action, by chance: whose doing it is, and the action.

    ``started``: the id of the action's start. Changes that are ``by`` somebody else than a robot have such an event for
    their ``cause``.
    """

    robot: str
    action: str
    fact: Fact
    by: str
    started: int


@dataclass(frozen=True, slots=True)
class FactChanged:
    """A fact of the truth changed. ``by``, ``cause``: the robot, and its action's start, if one did it."""

    fact: Fact
    value: bool
    by: str | None
    cause: int | None


@dataclass(frozen=True, slots=True)
class Sensed:
    """A robot learnt a fact that it did not believe.

    ``source``: sight or radio; ``opportunity``: whether a step of its plan was there to bring it about;
    ``by``, ``cause``: who did it.
    """

    robot: str
    fact: Fact
    value: bool
    source: str
    opportunity: bool
    by: str | None
    cause: int | None


@dataclass(frozen=True, slots=True)
class StepsLeftOut:
    """Steps left a robot's plan: why, and the fact that took their place, and whose action brought it about."""

    robot: str
    steps: tuple[tuple[int, str], ...]
    reason: str
    fact: Fact | None
    by: str | None
    cause: int | None


@dataclass(frozen=True, slots=True)
class PlanMended:
    """A plan got new steps, or another order, without the planner: the whole of it, and by what means."""

    robot: str
    added: tuple[tuple[int, str], ...]
    steps: tuple[tuple[int, str], ...]
    means: str


@dataclass(frozen=True, slots=True)
class PlanLinked:
    """What holds a robot's plan together, told whenever the plan has changed.

    Attributes:
        robot: whose plan.
        links: producer (a step's id), condition and consumer (a step's id; ``None``: the goals).
        watch: the facts that the robot watches; ``None``: all.
    """

    robot: str
    links: tuple[tuple[int, str, int | None], ...]
    watch: tuple[str, ...] | None


@dataclass(frozen=True, slots=True)
class RepairFailed:
    """A plan could not be repaired: what it lacks."""

    robot: str
    why: str


@dataclass(frozen=True, slots=True)
class Waiting:
    """A robot has nothing to do for now, or stands: what for.

    ``cause``, ``where``: why it stands, and at which door, corridor, room or object; ``on``: the robots without which
    it cannot go on.
    """

    robot: str
    why: str
    cause: str = ""
    where: str = ""
    on: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Rerouted:
    """A robot that drives from room to room goes another way from now on: why."""

    robot: str
    why: str


@dataclass(frozen=True, slots=True)
class GoalsReached:
    """A robot believes that all its goals hold."""

    robot: str


@dataclass(frozen=True, slots=True)
class GaveUp:
    """A robot stopped for good."""

    robot: str
    outcome: str
    why: str


@dataclass(frozen=True, slots=True)
class OfferMade:
    """A robot stands ready to hand an object over."""

    offer: int
    robot: str
    to: str
    object: str
    place: str


@dataclass(frozen=True, slots=True)
class OfferAnswered:
    """The other robot's answer."""

    offer: int
    accepted: bool
    why: str


@dataclass(frozen=True, slots=True)
class OfferClosed:
    """The handover took place, or came to nothing."""

    offer: int
    kept: bool


@dataclass(frozen=True, slots=True)
class Disturbed:
    """Something befell somebody: its kind, whom, and what exactly; without ``effect``, why nothing came of it."""

    disturbance: str
    subject: str
    detail: str
    effect: bool = True


Body = tuple[str, float, float, float]


@dataclass(frozen=True, slots=True)
class Poses:
    """Where everything that moved since the last such event is: name, x [m], y [m], heading [rad]."""

    robots: tuple[Body, ...]
    objects: tuple[Body, ...]


@dataclass(frozen=True, slots=True)
class RunEnded:
    """The last event: the outcome."""

    outcome: str
    why: str


Event = (
    RunStarted
    | PlanRequested
    | PlanFollowed
    | PlanMended
    | PlanLinked
    | PlanFailed
    | PlanAnnounced
    | ActionStarted
    | ActionCalledOff
    | ActionEnded
    | AlsoHappened
    | FactChanged
    | Sensed
    | StepsLeftOut
    | RepairFailed
    | Waiting
    | Rerouted
    | GoalsReached
    | GaveUp
    | OfferMade
    | OfferAnswered
    | OfferClosed
    | Disturbed
    | Poses
    | RunEnded
)


class Recorder(Protocol):
    """Takes events as they happen."""

    def record(self, time: float, event: Event) -> int:
        """Keep the event; returns its id."""


def credit(cause: Cause | None) -> tuple[str | None, int | None]:
    """Whose doing a change was, and the id of that action's start, as events write them (``by``, ``cause``)."""
    return (cause.robot, cause.event) if cause is not None else (None, None)


def kind(event: Event) -> str:
    """The event's kind as the log names it.

    >>> kind(GoalsReached("r1"))
    'goals_reached'
    """
    return kind_of(type(event))


def kind_of(of_class: type[Event]) -> str:
    """The kind of all events of a class."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", of_class.__name__).lower()


def plain(event: Event) -> dict[str, object]:
    """The event's fields as JSON takes them; facts as ``(holding r1 o2)``."""
    values = {field.name: getattr(event, field.name) for field in fields(event)}
    if isinstance(event, FactChanged | Sensed | StepsLeftOut | ActionCalledOff | AlsoHappened):
        values["fact"] = fact_text(event.fact) if event.fact is not None else None
    return values
