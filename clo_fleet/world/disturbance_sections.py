"""The keys of world files that say what befalls the fleet: ``disturbances``, each at its time, and ``faults``, drawn.

What lasts may be given with ``for_s``, or be ended by an entry of its own (``door_closed``, later ``door_opened``).
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, JsonValue
from pydantic_core import PydanticCustomError

from clo_fleet.clo.task import parse_fact
from clo_fleet.world import disturbances as made
from clo_fleet.world.disturbances import Disturbance, FaultRate, RandomFaults
from clo_fleet.world.ids import CorridorId, DoorId, ObjectId, Point, RobotId
from clo_fleet.world.sections import FactText, Fraction, Id, NonNegative, PointM, Positive, Section

__all__ = ["DisturbanceSection", "FaultsSection", "disturbances_in", "random_faults_in"]


def _span(span: tuple[float, ...]) -> tuple[float, ...]:
    if len(span) != 2 or span[0] > span[1]:
        raise PydanticCustomError("span", "the shortest and the longest time, as [10, 60]")
    return span


TWO: dict[str, JsonValue] = {"minItems": 2, "maxItems": 2}
Span = Annotated[tuple[Positive, ...], AfterValidator(_span), Field(json_schema_extra=TWO)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
PerHour = Annotated[float, Field(gt=0, le=3600)]


class _Timed(Section):
    at_s: NonNegative


class _Lasting(_Timed):
    for_s: Positive | None = Field(
        default=None, description="How long it lasts; by default until another entry ends it."
    )


class ObjectMovedSection(_Timed):
    """Somebody shifts an object."""

    kind: Literal["object_moved"]
    object: Id
    to_m: PointM


class ObjectTakenSection(_Lasting):
    """Somebody takes an object out of the building, and perhaps brings it back to where it lay."""

    kind: Literal["object_taken"]
    object: Id


class ObjectReturnedSection(_Timed):
    """Somebody brings an object back; by default to where it lay."""

    kind: Literal["object_returned"]
    object: Id
    to_m: PointM | None = None


class ObjectPreparedSection(_Timed):
    """Somebody prepares an object where it lies."""

    kind: Literal["object_prepared"]
    object: Id


class FactTurnedSection(_Timed):
    """An effect turns true or false by itself."""

    kind: Literal["fact_turned"]
    fact: FactText
    value: bool = True


class ObjectDroppedSection(_Timed):
    """An object slips out of its carrier's hand."""

    kind: Literal["object_dropped"]
    object: Id


class RobotSlowedSection(_Lasting):
    """A robot's top speed changes."""

    kind: Literal["robot_slowed"]
    robot: Id
    max_speed_m_s: NonNegative


class RobotFaultSection(_Lasting):
    """A robot breaks down, its sensors go blind, or its radio is lost."""

    kind: Literal["robot_broken", "sensor_blinded", "radio_lost"]
    robot: Id


class RobotMendedSection(_Timed):
    """A robot is as before: its speed, all of it, its sensors, its radio, or its planner's speed."""

    kind: Literal["robot_recovered", "robot_repaired", "sensor_restored", "radio_restored", "planner_recovered"]
    robot: Id


class SkillFailsSection(_Lasting):
    """Actions of a schema fail once they are under way."""

    kind: Literal["skill_fails"]
    skill: Id
    robot: Id | None = Field(default=None, description="Whose actions; by default anybody's.")
    nth: Count = Field(default=1, description="The first of them that is at risk, counted from at_s on.")
    times: Count | None = Field(
        default=None, description="How many are at risk; by default one, or all if a chance is given."
    )
    chance: Fraction | None = Field(
        default=None, description="With which probability each of these fails; by default 1."
    )


class PlannerKilledSection(_Timed):
    """A robot's planner dies over the question that it has open, else over the next one."""

    kind: Literal["planner_killed"]
    robot: Id


class PlannerSlowedSection(_Lasting):
    """A robot's planner takes longer, by so much simulated time."""

    kind: Literal["planner_slowed"]
    robot: Id
    by_s: NonNegative


class DoorSection(_Timed):
    """A closed door is open again."""

    kind: Literal["door_opened"]
    door: Id


class DoorClosedSection(_Lasting):
    """Somebody shuts a door."""

    kind: Literal["door_closed"]
    door: Id


class CorridorSection(_Timed):
    """A closed corridor is open again."""

    kind: Literal["corridor_opened"]
    corridor: Id


class CorridorClosedSection(_Lasting):
    """Nobody may enter a corridor."""

    kind: Literal["corridor_closed"]
    corridor: Id


DisturbanceSection = Annotated[
    ObjectMovedSection
    | ObjectTakenSection
    | ObjectReturnedSection
    | ObjectPreparedSection
    | ObjectDroppedSection
    | FactTurnedSection
    | RobotSlowedSection
    | RobotFaultSection
    | RobotMendedSection
    | SkillFailsSection
    | PlannerKilledSection
    | PlannerSlowedSection
    | DoorSection
    | DoorClosedSection
    | CorridorSection
    | CorridorClosedSection,
    Field(discriminator="kind"),
]


class RateSection(Section):
    """How often it happens, over the whole fleet."""

    per_hour: PerHour


class LastingRateSection(RateSection):
    """How often it happens, and how long it lasts."""

    for_s: Span


class SlowedRateSection(LastingRateSection):
    """``to_share``: of its top speed a robot keeps so much."""

    to_share: Fraction = 0.3


class PlannerSlowedRateSection(LastingRateSection):
    """``by_s``: so much later each answer comes."""

    by_s: Positive = 5.0


class SkillRateSection(RateSection):
    """``skill``: which one fails, once each time."""

    skill: Id


class FaultsSection(Section):
    """Disturbances that are drawn before the run, the same for every strategy."""

    seed: int | None = Field(default=None, ge=0, lt=1 << 63, description="By default the world's seed.")
    object_moved: RateSection | None = None
    object_taken: LastingRateSection | None = None
    object_prepared: RateSection | None = None
    object_dropped: RateSection | None = None
    robot_slowed: SlowedRateSection | None = None
    robot_broken: LastingRateSection | None = None
    sensor_blinded: LastingRateSection | None = None
    radio_lost: LastingRateSection | None = None
    skill_fails: SkillRateSection | None = None
    planner_killed: RateSection | None = None
    planner_slowed: PlannerSlowedRateSection | None = None
    door_closed: LastingRateSection | None = None
    corridor_closed: LastingRateSection | None = None


_OF_ROBOTS: Mapping[str, Callable[[float, RobotId], Disturbance]] = MappingProxyType(
    {
        "robot_broken": made.RobotBroken,
        "robot_repaired": made.RobotRepaired,
        "robot_recovered": made.RobotRecovered,
        "sensor_blinded": made.SensorBlinded,
        "sensor_restored": made.SensorRestored,
        "radio_lost": made.RadioLost,
        "radio_restored": made.RadioRestored,
        "planner_recovered": made.PlannerRecovered,
    }
)
_ENDED_BY = MappingProxyType(
    {"robot_broken": "robot_repaired", "sensor_blinded": "sensor_restored", "radio_lost": "radio_restored"}
)


def disturbances_in(section: DisturbanceSection) -> tuple[Disturbance, ...]:
    """The disturbance that an entry describes, and the one that ends it, if the entry says when."""
    at = float(section.at_s)
    lasts = section.for_s if isinstance(section, _Lasting) else None
    end = None if lasts is None else round(at + lasts, 6)
    begin, over = _pair(section, at, 0.0 if end is None else end)
    return (begin,) if end is None or over is None else (begin, over)


def random_faults_in(section: FaultsSection) -> RandomFaults:
    """The rates of the faults, sorted by kind."""
    rates = []
    for kind in sorted(FaultsSection.model_fields):
        rate = getattr(section, kind) if kind != "seed" else None
        if rate is not None:
            rates.append(_rate(kind, rate))
    return RandomFaults(tuple(rates), section.seed)


def _rate(kind: str, rate: RateSection) -> FaultRate:
    lasts = rate.for_s if isinstance(rate, LastingRateSection) else None
    amount = rate.to_share if isinstance(rate, SlowedRateSection) else 0.0
    amount = rate.by_s if isinstance(rate, PlannerSlowedRateSection) else amount
    skill = rate.skill if isinstance(rate, SkillRateSection) else ""
    return FaultRate(kind, float(rate.per_hour), None if lasts is None else _pair_of(lasts), float(amount), skill)


def _pair(section: DisturbanceSection, at: float, end: float) -> tuple[Disturbance, Disturbance | None]:
    """What begins, and what ends it."""
    match section:
        case ObjectMovedSection() | ObjectTakenSection() | ObjectReturnedSection():
            return _of_object(section, at, end)
        case ObjectPreparedSection():
            return made.ObjectPrepared(at, ObjectId(section.object)), None
        case ObjectDroppedSection():
            return made.ObjectDropped(at, ObjectId(section.object)), None
        case FactTurnedSection():
            return made.FactTurned(at, parse_fact(section.fact), section.value), None
        case SkillFailsSection():
            return _skill_fails(section, at, end), None
        case DoorClosedSection(door=door):
            return made.DoorClosed(at, DoorId(door)), made.DoorOpened(end, DoorId(door))
        case DoorSection(door=door):
            return made.DoorOpened(at, DoorId(door)), None
        case CorridorClosedSection(corridor=corridor):
            return made.CorridorClosed(at, CorridorId(corridor)), made.CorridorOpened(end, CorridorId(corridor))
        case CorridorSection(corridor=corridor):
            return made.CorridorOpened(at, CorridorId(corridor)), None
        case _:
            return _of_robot(section, at, end)


def _of_object(
    section: ObjectMovedSection | ObjectTakenSection | ObjectReturnedSection, at: float, end: float
) -> tuple[Disturbance, Disturbance | None]:
    item = ObjectId(section.object)
    match section:
        case ObjectMovedSection():
            return made.ObjectMoved(at, item, _pair_of(section.to_m)), None
        case ObjectTakenSection():
            return made.ObjectTaken(at, item), made.ObjectReturned(end, item)
        case _:
            back = None if section.to_m is None else _pair_of(section.to_m)
            return made.ObjectReturned(at, item, back), None


def _of_robot(
    section: RobotSlowedSection | RobotFaultSection | RobotMendedSection | PlannerKilledSection | PlannerSlowedSection,
    at: float,
    end: float,
) -> tuple[Disturbance, Disturbance | None]:
    robot = RobotId(section.robot)
    match section:
        case RobotSlowedSection():
            return made.RobotSlowed(at, robot, float(section.max_speed_m_s)), made.RobotRecovered(end, robot)
        case PlannerKilledSection():
            return made.PlannerKilled(at, robot), None
        case PlannerSlowedSection():
            return made.PlannerSlowed(at, robot, float(section.by_s)), made.PlannerRecovered(end, robot)
        case RobotFaultSection():
            return _OF_ROBOTS[section.kind](at, robot), _OF_ROBOTS[_ENDED_BY[section.kind]](end, robot)
        case _:
            return _OF_ROBOTS[section.kind](at, robot), None


def _skill_fails(section: SkillFailsSection, at: float, end: float) -> Disturbance:
    return made.SkillFails(
        time=at,
        skill=section.skill,
        robot=None if section.robot is None else RobotId(section.robot),
        nth=section.nth,
        times=1 if section.times is None and section.chance is None else section.times,
        chance=1.0 if section.chance is None else float(section.chance),
        until=None if section.for_s is None else end,
    )


def _pair_of(values: tuple[float, ...]) -> Point:
    return (float(values[0]), float(values[1]))
