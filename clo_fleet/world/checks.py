"""Whether a building makes sense: its references and its geometry. Shapely works here and nowhere else.

Every check gives findings at the key of a map file that they concern, so that they serve buildings from any source.
What a reader could not read in full is ``unsound``: references to it are not faulted, its geometry is not judged.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import shapely

from clo_fleet.world.faults import Finding, KeyPath, point_text
from clo_fleet.world.model import BuildingMap, Corridor, Door, Point, Room
from clo_fleet.world.outlines import area, clearance, length, outward_headings, wall_distance
from clo_fleet.world.references import Unsound, map_names, name_findings, unknown

__all__ = ["MIN_CORRIDOR_LENGTH", "MIN_DOOR_WIDTH", "map_findings"]

ON_WALL = 0.05  # m: a door this near to a wall is on it, a corridor this little inside a room is outside
MIN_AREA = 1.0  # m2
MAX_OVERLAP = 1e-4  # m2 that two rooms may share: the rounded coordinates of their common wall
MIN_DOOR_WIDTH = 0.7  # m: a robot of radius 0.3 with 0.1 to spare
MIN_CORRIDOR_LENGTH = 1.2  # m: a robot's 0.8 as a vehicle, its gap of 0.3, and what a junction takes
HEADING_TOLERANCE = 0.02  # rad: headings written with two digits pass


def map_findings(building: BuildingMap, unsound: Unsound = frozenset()) -> tuple[Finding, ...]:
    """Everything that is wrong with the building, each finding independent of the others."""
    findings = list(name_findings(map_names(building), {}))
    if not building.rooms and not unsound:
        findings.append(Finding(("rooms",), "at least one room"))
    outlines: dict[str, Room] = {}
    for room in building.rooms:
        if ("rooms", room.id) not in unsound:
            faulty = list(_room_findings(room))
            findings += faulty
            if not any("outline_m" in finding.key for finding in faulty):
                outlines[room.id] = room
    site = _Site(building, unsound, outlines)
    findings += _overlap_findings(site)
    for door in building.doors:
        findings += _door_findings(site, door)
    for corridor in building.corridors:
        findings += _corridor_findings(site, corridor)
    findings += _crossing_findings(site)
    findings += _spawn_findings(site)
    return tuple(findings)


@dataclass(frozen=True, slots=True)
class _Site:
    """The building under check, with the rooms whose outlines can be relied on."""

    building: BuildingMap
    unsound: Unsound
    outlines: Mapping[str, Room]

    @property
    def rooms(self) -> frozenset[str]:
        return frozenset(room.id for room in self.building.rooms)

    @property
    def nodes(self) -> frozenset[str]:
        doors, junctions = self.building.doors, self.building.junctions
        return frozenset((*(door.id for door in doors), *(junction.id for junction in junctions)))


def _room_findings(room: Room) -> Iterator[Finding]:
    key: KeyPath = ("rooms", room.id)
    problem = _outline_problem(room.outline)
    if problem:
        yield Finding((*key, "outline_m"), problem)
    elif abs(area(room.outline)) < MIN_AREA:
        yield Finding((*key, "outline_m"), f"at least {MIN_AREA:g} m2", f"{abs(area(room.outline)):.3g} m2")
    for index, obstacle in enumerate(room.obstacles):
        own = _outline_problem(obstacle)
        if own:
            yield Finding((*key, "obstacles_m", index), own)
        elif not problem and not shapely.Polygon(room.outline).covers(shapely.Polygon(obstacle)):
            yield Finding((*key, "obstacles_m", index), f"an obstacle inside room {room.id}")


def _outline_problem(outline: tuple[Point, ...]) -> str:
    """What was expected of the outline; empty if it is a simple polygon."""
    if len(outline) < 3:
        return "at least 3 points"
    if any(a == b for a, b in pairwise((*outline, outline[0]))):
        return "neighbouring points that differ (the last point joins the first by itself)"
    if not shapely.Polygon(outline).is_valid:
        return "an outline that does not cross or touch itself"
    return ""


def _overlap_findings(site: _Site) -> Iterator[Finding]:
    names = list(site.outlines)
    polygons = [shapely.Polygon(room.outline) for room in site.outlines.values()]
    for later, earlier in _meeting(polygons, polygons):
        shared = polygons[earlier].intersection(polygons[later]).area if earlier < later else 0.0
        if shared > MAX_OVERLAP:
            expected = f"a room that does not overlap room {names[earlier]} (touching is fine)"
            value = f"{shared:.3g} m2 in common with room {names[earlier]}"
            yield Finding(("rooms", names[later], "outline_m"), expected, value)


def _door_findings(site: _Site, door: Door) -> Iterator[Finding]:
    key: KeyPath = ("doors", door.id)
    for index, name in enumerate(door.rooms):
        yield from unknown((*key, "rooms", index), name, site.rooms, ("rooms",), site.unsound)
    if key in site.unsound:
        return
    if len(door.rooms) != len(set(door.rooms)) or len(door.rooms) not in (1, 2):
        yield Finding((*key, "rooms"), "one room, or two different ones")
        return
    if door.width < MIN_DOOR_WIDTH:
        yield Finding((*key, "width_m"), f"at least {MIN_DOOR_WIDTH} m, so that a robot can pass")
    yield from _wall_findings(door, [site.outlines[name] for name in door.rooms if name in site.outlines])
    corridors = [corridor.id for corridor in site.building.corridors if door.id in (corridor.start, corridor.end)]
    all_read = not any(path[0] == "corridors" for path in site.unsound)
    if len(door.rooms) == 1 and not corridors and all_read:
        yield Finding((*key, "rooms"), "a second room, or a corridor that ends at this door")
    if len(door.rooms) == 2 and corridors:
        yield Finding((*key, "rooms"), f"one room, as corridor {corridors[0]} ends at this door")


def _wall_findings(door: Door, rooms: list[Room]) -> Iterator[Finding]:
    """Findings about where the door is; only a door on its wall has a right heading, and then a right width."""
    key: KeyPath = ("doors", door.id)
    off = [room for room in rooms if wall_distance(room.outline, door.position) > ON_WALL]
    for room in off:
        value = f"{point_text(door.position)}, {wall_distance(room.outline, door.position):.2f} m from that wall"
        yield Finding((*key, "at_m"), f"a point on the wall of room {room.id}, within {ON_WALL} m", value)
    if off or not rooms:
        return
    if rooms[0].id == door.rooms[0]:
        right = outward_headings(rooms[0].outline, door.position)
        if all(abs(math.remainder(door.heading - heading, math.tau)) > HEADING_TOLERANCE for heading in right):
            expected = f"{right[0]:.4g} rad, square to the wall and out of room {rooms[0].id} (or leave it out)"
            yield Finding((*key, "heading_rad"), expected)
            return
    (x, y), half = door.position, door.width / 2
    dx, dy = -math.sin(door.heading) * half, math.cos(door.heading) * half
    ends = ((x + dx, y + dy), (x - dx, y - dy))
    if any(wall_distance(room.outline, end) > ON_WALL for room in rooms for end in ends):
        yield Finding((*key, "width_m"), "an opening that fits into the wall")


def _corridor_findings(site: _Site, corridor: Corridor) -> Iterator[Finding]:
    key: KeyPath = ("corridors", corridor.id)
    for end, name in (("from", corridor.start), ("to", corridor.end)):
        yield from unknown((*key, end), name, site.nodes, ("doors", "junctions"), site.unsound)
    if corridor.one_way and corridor.single_lane:
        yield Finding((*key, "single_lane"), "false, as a one-way corridor is used in one direction only")
    if corridor.start == corridor.end:
        yield Finding((*key, "to"), "another place than the corridor's start")
    elif not {corridor.start, corridor.end} <= site.nodes or key in site.unsound:
        return
    elif any(a == b for a, b in pairwise(corridor.shape)):
        yield Finding((*key, "via_m"), "points that differ from their neighbours and from both ends")
    elif length(corridor.shape) < MIN_CORRIDOR_LENGTH:
        value = f"{length(corridor.shape):.3g} m from {corridor.start} to {corridor.end}"
        yield Finding(key, f"a corridor of at least {MIN_CORRIDOR_LENGTH} m", value)


def _crossing_findings(site: _Site) -> Iterator[Finding]:
    """Corridors that run through rooms; their ends may reach as far into a room as a door may be off its wall."""
    nodes = site.nodes
    corridors = [
        corridor
        for corridor in site.building.corridors
        if {corridor.start, corridor.end} <= nodes and ("corridors", corridor.id) not in site.unsound
    ]
    lines = [shapely.LineString(corridor.shape) for corridor in corridors]
    names = list(site.outlines)
    insides = [shapely.Polygon(room.outline).buffer(-ON_WALL, join_style="mitre") for room in site.outlines.values()]
    for index, room in _meeting(lines, insides):
        inside = lines[index].intersection(insides[room]).length
        if inside > 0:
            value = f"{inside:.3g} m inside room {names[room]}"
            yield Finding(("corridors", corridors[index].id), "a corridor that stays outside of rooms", value)


def _spawn_findings(site: _Site) -> Iterator[Finding]:
    for spawn in site.building.spawn_points:
        key: KeyPath = ("spawn_points", spawn.id)
        yield from unknown((*key, "room"), spawn.room, site.rooms, ("rooms",), site.unsound)
        room = site.outlines.get(spawn.room)
        if room is not None and key not in site.unsound and clearance(room, spawn.pose.point) < 0:
            yield Finding((*key, "at_m"), f"a point inside room {room.id} and outside its obstacles")


def _meeting(these: list[shapely.Geometry], those: list[shapely.Geometry]) -> list[tuple[int, int]]:
    """Index pairs of the geometries that meet, in order; n log n for n of them."""
    if not these or not those:
        return []
    found = shapely.STRtree(those).query(these, predicate="intersects")
    return sorted((int(a), int(b)) for a, b in found.T)
