"""Goals: that they are facts of the domain about what there is, can hold together, and can be reached."""

from collections.abc import Iterator, Mapping

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.fact_checks import Known, fact_findings
from clo_fleet.world.faults import Finding, KeyPath
from clo_fleet.world.model import BuildingMap, ObjectSpec, PlaceId, RobotSpec, RoomId, World
from clo_fleet.world.places import reachable_rooms
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["goal_findings", "known_in", "reach_findings"]

WANTED = (SensorKind.PLACE, SensorKind.POSITION, SensorKind.HOLDING, SensorKind.EFFECTS)

Leg = tuple[RoomId, str, RoomId]
"""From a room to something, in words and as the room where it is."""


def known_in(world: World) -> Known:
    """What facts may be about in a world that was put together in code."""
    names = {
        "robots": tuple(spec.id for spec in world.robots),
        "objects": tuple(spec.id for spec in world.objects),
        "rooms": tuple(room.id for room in world.map.rooms),
    }
    return Known(world.domain or fleet_binding(), names, frozenset())


def goal_findings(goals: Mapping[str, tuple[Fact, ...]], known: Known, words: Vocabulary) -> Iterator[Finding]:
    """Goals that make no sense, by robot; ``words``: of the domain, for whatever there is."""
    for robot, facts in goals.items():
        placed: dict[str, Fact] = {}
        for index, fact in enumerate(facts):
            key: KeyPath = ("robots", robot, "goals", index)
            faulty = list(fact_findings(key, fact, known, WANTED))
            yield from faulty
            mover = "" if faulty else words.item(fact) or (*words.read(fact, SensorKind.PLACE), "")[0]
            first = placed.setdefault(mover, fact) if mover else fact
            if first != fact:
                expected = f"goals that can hold together; {mover} cannot also be as in {fact_text(first)}"
                yield Finding(key, expected, repr(fact_text(fact)))


def reach_findings(
    robots: tuple[RobotSpec, ...], objects: tuple[ObjectSpec, ...], building: BuildingMap, words: Vocabulary
) -> Iterator[Finding]:
    """Goals that no way leads to, in a world that is sound otherwise."""
    home: dict[str, RoomId] = {robot.id: robot.room for robot in robots}
    lies: dict[str, RoomId] = {thing.id: thing.room for thing in objects}
    reach = reachable_rooms(building, (*home.values(), *lies.values()))
    for robot in robots:
        for index, fact in enumerate(robot.goals):
            for start, target, room in _legs(fact, robot.room, home, lies, words):
                if room not in reach[start]:
                    value = f"{fact_text(fact)!r}"
                    expected = f"a goal that can be reached: no way leads from room {start} to {target}"
                    yield Finding(("robots", robot.id, "goals", index), expected, value)
                    break


def _legs(
    fact: Fact, start: RoomId, home: Mapping[str, RoomId], lies: Mapping[str, RoomId], words: Vocabulary
) -> list[Leg]:
    """The ways that have to exist for the robot that starts there to bring the fact about."""
    if ends := words.read(fact, SensorKind.PLACE):
        return [(home[ends[0]], f"room {ends[1]}", RoomId(PlaceId(ends[1])))]
    item = words.item(fact) or words.seen_at(fact)
    if item not in lies:
        return []
    legs: list[Leg] = [(start, f"{item}, in room {lies[item]}", lies[item])]
    if ends := words.read(fact, SensorKind.POSITION):
        legs.append((lies[item], f"room {ends[1]}", RoomId(PlaceId(ends[1]))))
    return legs
