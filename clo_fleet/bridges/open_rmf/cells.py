"""Cells, rooms and real doors: where the floor is, cut up by walls and doors.

Floors in a building file only say what the ground looks like. A *cell* is a connected piece of all floors together less
the walls and the doors. The cell with most of the lanes is the *hub*, the others are rooms if a door leads to them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import shapely

from clo_fleet.bridges.drawings import Names, Skipped, slug
from clo_fleet.bridges.open_rmf.reading import Level, Span, Vertex
from clo_fleet.world.model import Door, DoorId, PlaceId, Point, Room, RoomId
from clo_fleet.world.outlines import outward_headings, wall_distance

__all__ = ["Cells", "RoomsAndDoors", "cells_of", "mouth", "rooms_and_doors", "rounded", "wall_door"]

WALL = 0.1  # [m] thickness of walls and doors
SMALLEST_CELL = 1.0  # [m2]; less is a sliver between a floor's edge and a wall, or too small for a room
STRAIGHT = 0.05  # [m] walls are made straight within half their thickness, so that joints of walls do not show
INTO_WALL = 0.005  # [m] rooms reach this far into their walls: a door between two is then surely on the walls of both
DOOR_WIDTHS = (1.6, 1.5, 1.4, 1.3)  # [m] robots pass both ways at 1.6; a lane's edge is 0.65 off the middle: 1.3
NARROWEST = 0.8  # [m] between two rooms, where there are no lanes
JAMB = 0.05  # [m] of wall on either side of a door
FARTHEST_SHIFT = 0.5  # [m] that a door may move along its wall to fit
BESIDE = 0.3  # [m] from the middle of a door to the two places that it joins


@dataclass(frozen=True, slots=True)
class Cells:
    """The hub's floor, the floors of the other cells, and how many cells there are."""

    hub: shapely.Polygon
    others: tuple[shapely.Polygon, ...]

    @property
    def count(self) -> int:
        """The hub is one of them."""
        return 1 + len(self.others)


@dataclass(frozen=True, slots=True)
class RoomsAndDoors:
    """Rooms made of cells; ``onto_hub`` are the doors that lead to corridors, ``between`` those between two rooms."""

    rooms: tuple[Room, ...]
    onto_hub: tuple[Door, ...]
    between: tuple[Door, ...]
    skipped: tuple[Skipped, ...]


def cells_of(level: Level) -> Cells | None:
    """The cells, from left to right; ``None`` if no lane runs over any floor."""
    points = [vertex.point for vertex in level.vertices]
    floors = [shapely.make_valid(shapely.Polygon([points[index] for index in floor])) for floor in level.floors]
    lines = [shapely.LineString(level.line(wall)) for wall in level.walls if wall.start != wall.end]
    joined = shapely.line_merge(shapely.union_all(lines)) if lines else shapely.LineString()
    walls = joined.buffer(WALL / 2, cap_style="square", join_style="mitre", mitre_limit=2)
    doors = [shapely.LineString(level.line(door)).buffer(WALL / 2, cap_style="square") for door in level.doors]
    floor = shapely.union_all(floors).difference(walls).difference(shapely.union_all(doors))
    cells = [part for part in shapely.get_parts(floor) if part.geom_type == "Polygon" and part.area >= SMALLEST_CELL]
    lanes = shapely.MultiLineString([level.line(lane) for lane in level.lanes])
    lengths = [cell.intersection(lanes).length for cell in cells]
    if not any(lengths):
        return None
    hub = cells[lengths.index(max(lengths))]
    others = sorted((cell for cell in cells if cell is not hub), key=lambda cell: tuple(cell.bounds))
    return Cells(hub, tuple(others))


def rooms_and_doors(level: Level, cells: Cells, names: Names) -> RoomsAndDoors:
    """The cells that doors lead to from the hub, perhaps through others, and these doors."""
    skipped: list[Skipped] = []
    joins = [(door, _sides(level, cells, door)) for door in level.doors]
    reached = _reached([sides for _, sides in joins], cells.count)
    rooms: dict[int, Room] = {}
    for number, cell in enumerate(cells.others, start=1):
        wish = _room_name(level, cell, [door for door, sides in joins if number in sides]) or f"room_{number}"
        if number in reached:
            rooms[number] = _room(cell, names.new(wish))
        else:
            skipped.append(Skipped("room", wish, f"{cell.area:.1f} m2 that no door leads to"))
    onto_hub, between = [], []
    for index, (span, sides) in enumerate(joins, start=1):
        wish = slug(span.name) or f"door_{index}"
        inside = [rooms[number] for number in sides if number in rooms]
        if None in sides or sides[0] == sides[1]:
            skipped.append(Skipped("door", span.name or wish, "it does not lead from one piece of floor to another"))
        elif not inside:
            skipped.append(Skipped("door", span.name or wish, "no robot comes there"))
        elif 0 not in sides:
            between += _kept(_door_between(level, span, inside, names.new(wish)), span, wish, skipped)
        else:
            found = _kept(_door_onto_hub(level, span, inside[0], names.new(wish)), span, wish, skipped)
            onto_hub += found
            skipped += [note for door in found for note in _widened(level, span, door)]
    return RoomsAndDoors(tuple(rooms.values()), tuple(onto_hub), tuple(between), tuple(skipped))


def wall_door(room: Room, name: str, near: Point, along: float | None = None) -> Door | None:
    """A door in the room's wall as near to a point as it fits, as wide as it should be.

    Args:
        room: the room.
        name: the door's id.
        near: where it should be [m].
        along: the direction of the wall [rad], either way round, where not any wall will do.
    """
    walls = sorted(_walls(room.outline, along), key=lambda wall: shapely.LineString(wall).distance(shapely.Point(near)))
    for width in DOOR_WIDTHS:
        for (ax, ay), (bx, by) in walls[:1]:
            length = math.dist((ax, ay), (bx, by))
            ux, uy = (bx - ax) / length, (by - ay) / length
            wish = (near[0] - ax) * ux + (near[1] - ay) * uy
            margin = width / 2 + JAMB
            place = min(max(wish, margin), length - margin)
            if length >= 2 * margin and abs(place - wish) <= FARTHEST_SHIFT:
                position = rounded((ax + place * ux, ay + place * uy))
                heading = outward_headings(room.outline, position)[0]
                return Door(id=DoorId(name), rooms=(room.id,), position=position, heading=heading, width=width)
    return None


def mouth(door: Door, begin: float, end: float, margin: float = 0.0) -> shapely.Polygon:
    """The rectangle from ``begin`` to ``end`` beyond a door's wall, on each side wider than the door by ``margin``."""
    (x, y), half = door.position, door.width / 2 + margin
    dx, dy = math.cos(door.heading), math.sin(door.heading)
    corners = ((begin, -half), (end, -half), (end, half), (begin, half))
    return shapely.Polygon([(x + out * dx - side * dy, y + out * dy + side * dx) for out, side in corners])


def rounded(point: Point) -> Point:
    """The point to the millimetre."""
    return (round(float(point[0]), 3) + 0.0, round(float(point[1]), 3) + 0.0)


def _sides(level: Level, cells: Cells, door: Span) -> tuple[int | None, int | None]:
    """The cells on the two sides of a door by number, the hub being 0; ``None`` is out of doors."""
    (ax, ay), (bx, by) = level.line(door)
    length = math.dist((ax, ay), (bx, by)) or 1.0
    nx, ny = -(by - ay) / length * BESIDE, (bx - ax) / length * BESIDE
    middle = ((ax + bx) / 2, (ay + by) / 2)
    found: list[int | None] = []
    for sign in (1, -1):
        beside = shapely.Point(middle[0] + sign * nx, middle[1] + sign * ny)
        floors = enumerate((cells.hub, *cells.others))
        found.append(next((number for number, floor in floors if floor.covers(beside)), None))
    return (found[0], found[1])


def _reached(joins: Sequence[tuple[int | None, int | None]], count: int) -> set[int]:
    """The cells that can be reached from the hub, itself included."""
    reached = {0}
    for _ in range(count):
        for a, b in joins:
            if a is not None and b is not None and (a in reached or b in reached):
                reached |= {a, b}
    return reached


def _room_name(level: Level, cell: shapely.Polygon, doors: list[Span]) -> str:
    """The id that vertices inside suggest, those with a use first, or else a door."""
    inside = [vertex for vertex in level.vertices if slug(vertex.name) and cell.covers(shapely.Point(vertex.point))]
    for vertex in sorted(inside, key=_importance):
        return slug(vertex.name)
    return next((slug(door.name).removesuffix("_door") for door in doors if door.name), "")


def _importance(vertex: Vertex) -> tuple[bool, bool, int]:
    return (not vertex.needed, not vertex.stop, vertex.index)


def _room(cell: shapely.Polygon, name: str) -> Room:
    floor = cell.simplify(STRAIGHT).buffer(INTO_WALL, join_style="mitre")
    obstacles = tuple(_ring(hole) for hole in floor.interiors)
    return Room(RoomId(PlaceId(name)), _ring(floor.exterior), obstacles)


def _ring(ring: shapely.LinearRing) -> tuple[Point, ...]:
    """The corners, counter-clockwise, to the millimetre."""
    points = [rounded((x, y)) for x, y in ring.normalize().coords[:-1]]
    corners = [point for point, before in zip(points, points[-1:] + points[:-1], strict=True) if point != before]
    return tuple(corners if shapely.LinearRing(corners).is_ccw else reversed(corners))


def _walls(outline: tuple[Point, ...], along: float | None) -> Iterator[tuple[Point, Point]]:
    """The edges of the outline that run in a direction, give or take 20 degrees."""
    for a, b in zip(outline, outline[1:] + outline[:1], strict=True):
        angle = math.atan2(b[1] - a[1], b[0] - a[0])
        if along is None or abs(math.remainder(angle - along, math.pi)) < math.radians(20):
            yield a, b


def _middle(line: tuple[Point, Point]) -> tuple[Point, float, float]:
    """The middle of a line [m], its direction [rad] and its length [m]."""
    (ax, ay), (bx, by) = line
    return ((ax + bx) / 2, (ay + by) / 2), math.atan2(by - ay, bx - ax), math.dist((ax, ay), (bx, by))


def _door_onto_hub(level: Level, span: Span, room: Room, name: str) -> Door | None:
    middle, along, _ = _middle(level.line(span))
    return wall_door(room, name, middle, along)


def _door_between(level: Level, span: Span, rooms: list[Room], name: str) -> Door | None:
    """A door between two rooms, in the middle of the wall between them; ``None`` if their walls are not parallel."""
    middle, _, length = _middle(level.line(span))
    heading = outward_headings(rooms[0].outline, middle)[0]
    position, width = rounded(middle), round(length, 3)
    dx, dy = -math.sin(heading) * width / 2, math.cos(heading) * width / 2
    ends = ((middle[0] + sign * dx, middle[1] + sign * dy) for sign in (-1, 0, 1))
    off = max(wall_distance(room.outline, end) for end in ends for room in rooms)
    if width < NARROWEST or off > WALL / 2:
        return None
    return Door(id=DoorId(name), rooms=(rooms[0].id, rooms[1].id), position=position, heading=heading, width=width)


def _kept(door: Door | None, span: Span, wish: str, skipped: list[Skipped]) -> list[Door]:
    if door is None:
        skipped.append(Skipped("door", span.name or wish, "its wall is too short or too crooked for a robot's doorway"))
    return [] if door is None else [door]


def _widened(level: Level, span: Span, door: Door) -> Iterator[Skipped]:
    _, _, length = _middle(level.line(span))
    if door.width > length + 0.01:
        reason = f"widened from {length:.2f} m to {door.width:.2f} m, as robots come and go in lanes side by side"
        yield Skipped("door", span.name or door.id, reason)
