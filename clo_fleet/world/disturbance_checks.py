"""Whether the disturbances of a world make sense: whom they befall, where they put things, and in which order."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from clo_fleet.world import disturbances as made
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.disturbances import Disturbance, RandomFaults, kind_of, subject_of
from clo_fleet.world.fact_checks import Known, fact_findings
from clo_fleet.world.faults import Finding, KeyPath, did_you_mean
from clo_fleet.world.model import BuildingMap, Point
from clo_fleet.world.outlines import clearance
from clo_fleet.world.places import room_at
from clo_fleet.world.references import Unsound, unknown

__all__ = ["Befallen", "disturbance_findings"]

MOST = 10_000  # faults drawn for one run

# what begins something, and what ends it: begun twice, or ended before, the file does not say what its author thinks
SPANS: tuple[tuple[type, type, str], ...] = (
    (made.CorridorClosed, made.CorridorOpened, "closed"),
    (made.DoorClosed, made.DoorOpened, "closed"),
    (made.ObjectTaken, made.ObjectReturned, "taken away"),
    (made.RobotBroken, made.RobotRepaired, "broken down"),
    (made.RobotSlowed, made.RobotRecovered, "slowed"),
    (made.SensorBlinded, made.SensorRestored, "blind"),
    (made.RadioLost, made.RadioRestored, "without radio"),
    (made.PlannerSlowed, made.PlannerRecovered, "with a slow planner"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Befallen:
    """Whom disturbances may befall.

    Attributes:
        robots, objects: all there are.
        known: the domain's actions, and what facts may be about; ``None``: the domain could not be read.
        building: ``None`` if it could not be read: nothing is said about doors and corridors then.
        unsound: what could not be read in full.
        until: how long the run may last [s].
    """

    robots: Collection[str]
    objects: Collection[str]
    known: Known | None
    building: BuildingMap | None
    unsound: Unsound
    until: float

    @property
    def skills(self) -> tuple[str, ...] | None:
        """The actions' schemas."""
        return None if self.known is None else tuple(name for name, _ in self.known.binding.skills)


def disturbance_findings(
    scheduled: Sequence[tuple[int, Disturbance]], random: RandomFaults, who: Befallen
) -> Iterator[Finding]:
    """Everything that is wrong with the disturbances.

    Args:
        scheduled: each with the index of its entry in the file.
        random: the rates of those that are to be drawn.
        who: whom they may befall.
    """
    for index, disturbance in scheduled:
        yield from _reference_findings(("disturbances", index), disturbance, who)
    for begins, ends, word in SPANS:
        yield from _span_findings([(i, d) for i, d in scheduled if isinstance(d, begins | ends)], ends, word)
    for rate in random.rates:
        key: KeyPath = ("faults", rate.kind)
        if rate.per_hour * who.until / 3600.0 > MOST:
            value = f"about {rate.per_hour * who.until / 3600.0:.0f}"
            yield Finding((*key, "per_hour"), f"at most {MOST} faults of a kind within until_s", value)
        if rate.skill:
            yield from _skill_findings((*key, "skill"), rate.skill, who.skills)


def _reference_findings(key: KeyPath, disturbance: Disturbance, who: Befallen) -> Iterator[Finding]:
    match disturbance:
        case made.ObjectMoved() | made.ObjectReturned():
            yield from unknown((*key, "object"), disturbance.object, who.objects, ("objects",), who.unsound)
            yield from _place_findings((*key, "to_m"), disturbance.position, who.building)
        case made.ObjectTaken() | made.ObjectPrepared() | made.ObjectDropped():
            yield from unknown((*key, "object"), disturbance.object, who.objects, ("objects",), who.unsound)
        case made.FactTurned(fact=fact):
            if who.known is not None:
                yield from fact_findings((*key, "fact"), fact, who.known, (SensorKind.EFFECTS,))
        case made.DoorClosed() | made.DoorOpened():
            if who.building is not None:
                doors = [door.id for door in who.building.doors]
                yield from unknown((*key, "door"), disturbance.door, doors, ("doors",), ())
        case made.CorridorClosed() | made.CorridorOpened():
            if who.building is not None:
                corridors = [corridor.id for corridor in who.building.corridors]
                yield from unknown((*key, "corridor"), disturbance.corridor, corridors, ("corridors",), ())
        case made.SkillFails(skill=skill, robot=robot):
            yield from _skill_findings((*key, "skill"), skill, who.skills)
            if robot is not None:
                yield from unknown((*key, "robot"), robot, who.robots, ("robots",), who.unsound)
        case _:
            yield from unknown((*key, "robot"), disturbance.robot, who.robots, ("robots",), who.unsound)


def _place_findings(key: KeyPath, position: Point | None, building: BuildingMap | None) -> Iterator[Finding]:
    if building is None or position is None:
        return
    name = room_at(building, position)
    room = next((room for room in building.rooms if room.id == name), None)
    if room is None or clearance(room, position) < 0:
        yield Finding(key, "a point inside a room and outside its obstacles")


def _skill_findings(key: KeyPath, skill: str, skills: Collection[str] | None) -> Iterator[Finding]:
    if skills is not None and skill not in skills:
        yield Finding(key, f"one of {', '.join(sorted(skills))}{did_you_mean(skill, skills)}", repr(skill))


def _span_findings(entries: Sequence[tuple[int, Disturbance]], ends: type, word: str) -> Iterator[Finding]:
    """What begins while it lasts already, and what ends without having begun."""
    since: dict[str, float] = {}
    for index, disturbance in sorted(entries, key=lambda entry: (entry[1].time, entry[0])):
        subject, key = subject_of(disturbance), ("disturbances", index, "at_s")
        if isinstance(disturbance, ends):
            if since.pop(subject, None) is None:
                yield Finding(key, f"a time at which {subject} is {word}", f"{disturbance.time:g}")
        elif subject in since and not isinstance(
            disturbance, made.RobotSlowed | made.PlannerSlowed
        ):  # slower still is no contradiction
            value = f"{disturbance.time:g}, in a {kind_of(disturbance)} that began at {since[subject]:g} s"
            yield Finding(key, f"a time at which {subject} is not {word} already", value)
        else:
            since[subject] = disturbance.time
