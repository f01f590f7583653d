"""Whether a world makes sense: names, places to stand, goals.

As for maps, findings are at keys of a world file, and what could not be read in full is ``unsound``. Without a
sound map (``building`` is ``None``) everything is judged that needs none.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.world.faults import Finding, KeyPath, did_you_mean, point_text
from clo_fleet.world.model import BuildingMap, ObjectSpec, Point, RobotSpec, Room, RoomId
from clo_fleet.world.outlines import clearance
from clo_fleet.world.places import reachable_rooms
from clo_fleet.world.references import Unsound, map_names, name_findings, names_of, unknown

__all__ = ["Cast", "cast_findings", "reach_findings"]

GOALS: Mapping[str, tuple[str, ...]] = {
    "at-robot": ("robots", "rooms"),
    "at-object": ("objects", "rooms"),
    "prepared": ("objects",),
    "holding": ("robots", "objects"),
}
CLEARANCE_SLACK = 1e-9  # m: a disc that touches a wall is clear of it, whatever the rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Cast:
    """Who and what is on the map, as far as it could be read.

    Attributes:
        robots, objects: those that have a position.
        goals: of every robot, also of those without a position.
        object_ids: of every object.
        unsound: what could not be read in full.
    """

    robots: tuple[RobotSpec, ...]
    objects: tuple[ObjectSpec, ...]
    goals: Mapping[str, tuple[Fact, ...]]
    object_ids: tuple[str, ...]
    unsound: Unsound


def cast_findings(cast: Cast, building: BuildingMap | None) -> tuple[Finding, ...]:
    """Everything that is wrong with who and what is on the map, but for what cannot be reached."""
    taken: dict[str, str] = {}
    if building is not None:
        taken = names_of(map_names(building))
    findings = list(name_findings({"robots": list(cast.goals), "objects": cast.object_ids}, taken))
    if not cast.goals and ("robots",) not in cast.unsound:
        findings.append(Finding(("robots",), "at least one robot"))
    if building is not None:
        findings += _position_findings(cast, building)
    findings += _goal_findings(cast, building)
    return tuple(findings)


def reach_findings(cast: Cast, building: BuildingMap) -> Iterator[Finding]:
    """Goals that no way leads to, in a world that is sound otherwise."""
    home: dict[str, RoomId] = {robot.id: robot.room for robot in cast.robots}
    lies: dict[str, RoomId] = {thing.id: thing.room for thing in cast.objects}
    reach = reachable_rooms(building, (*home.values(), *lies.values()))
    for robot in cast.robots:
        for index, fact in enumerate(robot.goals):
            key: KeyPath = ("robots", robot.id, "goals", index)
            match fact:
                case ("at-robot", name, room):
                    legs = [(home[name], f"room {room}", room)]
                case ("at-object", name, room):
                    legs = [(robot.room, f"{name}, in room {lies[name]}", lies[name])]
                    legs.append((lies[name], f"room {room}", room))
                case _:
                    name = fact[-1]
                    legs = [(robot.room, f"{name}, in room {lies[name]}", lies[name])]
            for start, target, room in legs:
                if room not in reach[start]:
                    value = f"{fact_text(fact)!r}"
                    yield Finding(key, f"a goal that can be reached: no way leads from room {start} to {target}", value)
                    break


def _position_findings(cast: Cast, building: BuildingMap) -> Iterator[Finding]:
    """Robots and objects that stand in walls, in obstacles or in one another."""
    rooms = {room.id: room for room in building.rooms}
    placed: dict[str, list[tuple[str, Point, float]]] = defaultdict(list)
    robots = [("robots", robot.id, robot.room, robot.pose.point, robot.radius) for robot in cast.robots]
    objects = [("objects", thing.id, thing.room, thing.position, thing.radius) for thing in cast.objects]
    for section, name, room, point, radius in (*robots, *objects):
        key: KeyPath = (section, name)
        yield from unknown((*key, "room"), room, rooms, ("rooms",), cast.unsound)
        if room not in rooms or key in cast.unsound:
            continue
        yield from _clear_findings((*key, "at_m"), rooms[room], point, radius)
        for other, centre, size in placed[room]:
            gap = math.dist(point, centre) - radius - size
            if gap < -CLEARANCE_SLACK:
                value = f"{point_text(point)}, overlapping {other} by {-gap:.2g} m"
                yield Finding((*key, "at_m"), f"a place clear of {other}, {radius + size:.3g} m from its centre", value)
                break  # the rest is told when this is mended
        placed[room].append((name, point, radius))


def _clear_findings(key: KeyPath, room: Room, point: Point, radius: float) -> Iterator[Finding]:
    free = clearance(room, point)
    if free < 0:
        yield Finding(key, f"a point inside room {room.id} and outside its obstacles", point_text(point))
    elif free < radius - CLEARANCE_SLACK:
        value = f"{point_text(point)}, {free:.3g} m from a wall or obstacle"
        yield Finding(key, f"a point at least {radius:g} m (the radius) from the walls of room {room.id}", value)


def _goal_findings(cast: Cast, building: BuildingMap | None) -> Iterator[Finding]:
    known: dict[str, frozenset[str]] = {"robots": frozenset(cast.goals), "objects": frozenset(cast.object_ids)}
    if building is not None:
        known["rooms"] = frozenset(room.id for room in building.rooms)
    for robot, goals in cast.goals.items():
        placed: dict[str, Fact] = {}
        for index, fact in enumerate(goals):
            key: KeyPath = ("robots", robot, "goals", index)
            faulty = list(_fact_findings(key, fact, known, cast.unsound))
            yield from faulty
            if faulty or fact[0] == "prepared":
                continue
            mover = fact[1] if fact[0].startswith("at-") else fact[2]  # what the goal puts in one place
            first = placed.setdefault(mover, fact)
            if first != fact:
                expected = f"goals that can hold together; {mover} cannot also be as in {fact_text(first)}"
                yield Finding(key, expected, repr(fact_text(fact)))


def _fact_findings(
    key: KeyPath, fact: Fact, known: Mapping[str, frozenset[str]], unsound: Unsound
) -> Iterator[Finding]:
    predicate, *names = fact
    value = repr(fact_text(fact))
    if predicate not in GOALS:
        forms = ", ".join(_form(name) for name in GOALS)
        yield Finding(key, f"one of {forms}{did_you_mean(predicate, GOALS)}", value)
    elif len(names) != len(GOALS[predicate]):
        yield Finding(key, _form(predicate), value)
    else:
        for name, section in zip(names, GOALS[predicate], strict=True):
            if section in known:
                for finding in unknown(key, name, known[section], (section,), unsound):
                    yield Finding(key, f"for {name!r} {finding.expected}", value)


def _form(predicate: str) -> str:
    return fact_text((predicate, *(section.removesuffix("s").upper() for section in GOALS[predicate])))
