"""Whether a world makes sense: names, and places to stand.

As for maps, findings are at keys of a world file, and what could not be read in full is ``unsound``. Without a
sound map (``building`` is ``None``) everything is judged that needs none.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from clo_fleet.clo.task import Fact
from clo_fleet.world.faults import Finding, KeyPath, point_text
from clo_fleet.world.model import BuildingMap, ObjectSpec, Point, RobotSpec, Room
from clo_fleet.world.outlines import clearance
from clo_fleet.world.references import Unsound, map_names, name_findings, names_of, unknown

__all__ = ["Cast", "cast_findings"]

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
    """Everything that is wrong with who and what is on the map, but for their goals."""
    taken: dict[str, str] = {}
    if building is not None:
        taken = names_of(map_names(building))
    findings = list(name_findings({"robots": list(cast.goals), "objects": cast.object_ids}, taken))
    if not cast.goals and ("robots",) not in cast.unsound:
        findings.append(Finding(("robots",), "at least one robot"))
    if building is not None:
        findings += _position_findings(cast, building)
    return tuple(findings)


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
