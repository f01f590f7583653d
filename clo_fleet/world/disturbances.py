"""Disturbances: what people, worn parts and bad luck do to a fleet, each at a moment of simulated time [s].

A disturbance that lasts is two values: one that begins it and one that ends it. So a schedule is a plain list, and what
is to happen in a run can be printed before it. Random faults are rates here; ``random_faults`` draws them.
"""

import re
from dataclasses import dataclass

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.world.ids import CorridorId, DoorId, ObjectId, Point, RobotId

__all__ = [
    "NO_FAULTS",
    "CorridorClosed",
    "CorridorOpened",
    "Disturbance",
    "DoorClosed",
    "DoorOpened",
    "FactTurned",
    "FaultRate",
    "ObjectDropped",
    "ObjectMoved",
    "ObjectPrepared",
    "ObjectReturned",
    "ObjectTaken",
    "PlannerKilled",
    "PlannerRecovered",
    "PlannerSlowed",
    "RadioLost",
    "RadioRestored",
    "RandomFaults",
    "RobotBroken",
    "RobotRecovered",
    "RobotRepaired",
    "RobotSlowed",
    "SensorBlinded",
    "SensorRestored",
    "SkillFails",
    "described",
    "kind_of",
    "subject_of",
    "summed_up",
]


@dataclass(frozen=True, slots=True)
class CorridorClosed:
    """Nobody may enter a corridor any more."""

    time: float
    corridor: CorridorId


@dataclass(frozen=True, slots=True)
class CorridorOpened:
    """A closed corridor is open again."""

    time: float
    corridor: CorridorId


@dataclass(frozen=True, slots=True)
class DoorClosed:
    """Somebody shuts a door: nobody passes it, in either direction."""

    time: float
    door: DoorId


@dataclass(frozen=True, slots=True)
class DoorOpened:
    """A closed door is open again."""

    time: float
    door: DoorId


@dataclass(frozen=True, slots=True)
class ObjectMoved:
    """Somebody shifts an object to another point of a room [m]."""

    time: float
    object: ObjectId
    position: Point


@dataclass(frozen=True, slots=True)
class ObjectTaken:
    """Somebody takes an object away, out of the building."""

    time: float
    object: ObjectId


@dataclass(frozen=True, slots=True)
class ObjectReturned:
    """Somebody brings an object back that was taken away: to ``position`` [m], or to where it lay."""

    time: float
    object: ObjectId
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class ObjectPrepared:
    """Somebody prepares an object where it lies."""

    time: float
    object: ObjectId


@dataclass(frozen=True, slots=True)
class FactTurned:
    """An effect turns true or false by itself: somebody answers unasked, or what was done is undone."""

    time: float
    fact: Fact
    value: bool = True


@dataclass(frozen=True, slots=True)
class ObjectDropped:
    """An object slips out of its carrier's hand."""

    time: float
    object: ObjectId


@dataclass(frozen=True, slots=True)
class RobotSlowed:
    """A robot's top speed becomes ``max_speed`` [m/s]."""

    time: float
    robot: RobotId
    max_speed: float


@dataclass(frozen=True, slots=True)
class RobotRecovered:
    """A robot's top speed is again what it was at the start."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class RobotBroken:
    """A robot stands still and does nothing with its hands; it still senses, talks and thinks."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class RobotRepaired:
    """A robot that was broken down goes on."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillFails:
    """From ``time`` on, some actions of a schema fail once they are under way.

    Attributes:
        skill: the schema's name, such as ``grasp``.
        robot: whose actions; ``None``: anybody's.
        nth: the first of them that is at risk, counted from ``time`` on, from 1.
        times: how many in a row are at risk from then on; ``None``: all.
        chance: the probability with which each of these fails.
        until: the end of it [s]; ``None``: none.
    """

    time: float
    skill: str
    robot: RobotId | None = None
    nth: int = 1
    times: int | None = 1
    chance: float = 1.0
    until: float | None = None


@dataclass(frozen=True, slots=True)
class SensorBlinded:
    """A robot sees nothing any more; it still knows where it is and what it has in hand."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class SensorRestored:
    """A blind robot sees again."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class RadioLost:
    """A robot neither tells others anything nor hears from them."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class RadioRestored:
    """A robot's radio works again."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class PlannerKilled:
    """The planner of a robot dies: over the question that it has open, else over the next one."""

    time: float
    robot: RobotId


@dataclass(frozen=True, slots=True)
class PlannerSlowed:
    """From its next question on, a robot's planner takes ``seconds`` more of simulated time for each answer [s]."""

    time: float
    robot: RobotId
    seconds: float


@dataclass(frozen=True, slots=True)
class PlannerRecovered:
    """A robot's planner is as fast as at the start, from the next question on."""

    time: float
    robot: RobotId


Disturbance = (
    CorridorClosed
    | CorridorOpened
    | DoorClosed
    | DoorOpened
    | ObjectMoved
    | ObjectTaken
    | ObjectReturned
    | ObjectPrepared
    | ObjectDropped
    | FactTurned
    | RobotSlowed
    | RobotRecovered
    | RobotBroken
    | RobotRepaired
    | SkillFails
    | SensorBlinded
    | SensorRestored
    | RadioLost
    | RadioRestored
    | PlannerKilled
    | PlannerSlowed
    | PlannerRecovered
)


@dataclass(frozen=True, slots=True)
class FaultRate:
    """How often one kind of disturbance befalls a fleet.

    Attributes:
        kind: the disturbance, as ``robot_broken``.
        per_hour: how often on average, over the whole fleet.
        lasts: the shortest and the longest time that it lasts, if it does [s].
        amount: how slow (a share of the top speed), or by how much slower a planner answers [s]; else not used.
        skill: which skill fails.
    """

    kind: str
    per_hour: float
    lasts: tuple[float, float] | None = None
    amount: float = 0.0
    skill: str = ""


@dataclass(frozen=True, slots=True)
class RandomFaults:
    """Disturbances to be drawn; ``seed`` in place of the world's, so that several runs share their faults."""

    rates: tuple[FaultRate, ...] = ()
    seed: int | None = None


NO_FAULTS = RandomFaults()


def kind_of(disturbance: Disturbance) -> str:
    """The name of the kind, as files and logs write it.

    >>> kind_of(RobotBroken(3.0, RobotId("r1")))
    'robot_broken'
    """
    return re.sub(r"(?<!^)(?=[A-Z])", "_", type(disturbance).__name__).lower()


def subject_of(disturbance: Disturbance) -> str:
    """Who or what it befalls."""
    match disturbance:
        case CorridorClosed(_, corridor) | CorridorOpened(_, corridor):
            return corridor
        case DoorClosed(_, door) | DoorOpened(_, door):
            return door
        case (
            ObjectMoved(_, item)
            | ObjectTaken(_, item)
            | ObjectReturned(_, item)
            | ObjectPrepared(_, item)
            | ObjectDropped(_, item)
        ):
            return item
        case FactTurned(fact=fact):
            return fact_text(fact)
        case SkillFails(robot=robot):
            return robot or "anyone"
        case _:
            return disturbance.robot


def described(disturbance: Disturbance) -> str:
    """What exactly happens, beside kind and subject; empty if there is no more to say."""
    match disturbance:
        case ObjectMoved(position=(x, y)) | ObjectReturned(position=(x, y)):
            return f"to {x:.3g} {y:.3g}"
        case RobotSlowed(max_speed=speed):
            return f"{speed:.3g} m/s"
        case PlannerSlowed(seconds=seconds):
            return f"by {seconds:.3g} s"
        case FactTurned(value=value):
            return "true" if value else "false"
        case SkillFails():
            return _which(disturbance)
        case _:
            return ""


def summed_up(disturbance: Disturbance) -> str:
    """Kind, subject and what exactly, in a line.

    >>> summed_up(RobotSlowed(3.0, RobotId("r1"), 0.25))
    'robot_slowed r1 0.25 m/s'
    """
    return f"{kind_of(disturbance)} {subject_of(disturbance)} {described(disturbance)}".rstrip()


def _which(fails: SkillFails) -> str:
    """Which actions are at risk.

    >>> _which(SkillFails(time=0.0, skill="grasp", nth=2, times=3, chance=0.5))
    'grasp, 3 times from number 2 on, with probability 0.5'
    """
    text = fails.skill
    if fails.times is None:
        text += ", every time"
    elif fails.times > 1 or fails.nth == 1:
        text += ", once" if fails.times == 1 else f", {fails.times} times"
    if fails.nth > 1:
        text += f", number {fails.nth}" if fails.times == 1 else f" from number {fails.nth} on"
    if fails.chance < 1.0:
        text += f", with probability {fails.chance:g}"
    return text if fails.until is None else f"{text}, until {fails.until:g} s"
