"""Where walls and doorways are: the geometry that physics and paths share.

A door onto corridors continues its room through the wall: its *doorway* is a rectangle as wide as the
door, from a little inside the wall to ``DOORWAY_OUTSIDE`` beyond it, closed by two side walls and open
at its outer end. There a robot changes between body and vehicle. Behind a narrow door the doorway is wider than
the door, as wide as the lanes of the corridor. A door between two rooms is a gap.
"""

import math
from dataclasses import dataclass

import shapely

from clo_fleet.errors import CloFleetError
from clo_fleet.world.model import BuildingMap, Door, Point, Room, RoomId

__all__ = [
    "DOORWAY_INSIDE",
    "DOORWAY_OUTSIDE",
    "Area",
    "DoorRoomError",
    "Segment",
    "UnknownRoomError",
    "beyond",
    "doorway_walls",
    "free_space",
    "in_front",
    "in_room",
    "inner_point",
    "outward",
    "room_walls",
    "walls",
]

DOORWAY_INSIDE = 0.3  # [m] how far a doorway reaches into its room
DOORWAY_OUTSIDE = 1.2  # [m] how far it reaches out: a robot's diameter, and room to turn into a lane
LANES = 1.5  # [m] a doorway is no narrower: two lanes with centres 0.7 m apart, a robot's radius, 0.1 m to the sides
JAMB = 0.1  # [m] beyond the wall a doorway gets wider than its door, lest the floor runs through the wall
DOOR_DEPTH = 0.3  # [m] a door opens the walls this near to it; outlines may lie a wall's thickness apart

Segment = tuple[Point, Point]


class UnknownRoomError(CloFleetError):
    """The building has no such room.

    Attributes:
        room: the id as given.
    """

    def __init__(self, room: str) -> None:
        super().__init__(f"there is no room {room!r} in this building")
        self.room = room


class DoorRoomError(CloFleetError):
    """A door was asked about a room that it does not open into.

    Attributes:
        door: the door's id.
        room: the room's id.
    """

    def __init__(self, door: str, room: str) -> None:
        super().__init__(f"door {door!r} does not open into room {room!r}")
        self.door = door
        self.room = room


@dataclass(frozen=True, slots=True)
class Area:
    """A polygon with holes [m]; the first point is not repeated at the end."""

    outline: tuple[Point, ...]
    holes: tuple[tuple[Point, ...], ...] = ()


def walls(building: BuildingMap) -> tuple[Segment, ...]:
    """Everything solid in the building: the walls of rooms and doorways, and the sides of obstacles [m]."""
    solid = [segment for room in building.rooms for segment in room_walls(building, room.id)]
    solid += [side for door in building.doors for side in doorway_walls(door)]
    solid += [side for room in building.rooms for obstacle in room.obstacles for side in _sides(obstacle)]
    return tuple(solid)


def room_walls(building: BuildingMap, room: RoomId) -> tuple[Segment, ...]:
    """The room's outline without the openings of its doors [m]."""
    doors = [door for door in building.doors if room in door.rooms]
    return tuple(piece for side in _sides(_room(building, room).outline) for piece in _closed(side, doors))


def doorway_walls(door: Door) -> tuple[Segment, ...]:
    """The two side walls of a doorway onto corridors, from the wall outwards; none between two rooms [m]."""
    if len(door.rooms) != 1:
        return ()
    half = max(door.width, LANES) / 2
    return tuple((_at(door, 0.0, side), _at(door, DOORWAY_OUTSIDE, side)) for side in (-half, half))


def free_space(building: BuildingMap, room: RoomId) -> tuple[Area, ...]:
    """The floor on which paths in ``room`` may run, its doorways included [m].

    A door between two rooms lets the floor reach on into the other room, so that a path to a point just
    beyond the door exists on either side. Obstacles are holes; more than one area means that they cut
    the room in two.
    """
    here = _room(building, room)
    floor = shapely.Polygon(here.outline)
    blocked = [shapely.Polygon(obstacle) for obstacle in here.obstacles]
    for door in (door for door in building.doors if room in door.rooms):
        passage = _passage(door, room, -DOORWAY_INSIDE, DOORWAY_OUTSIDE)
        if len(door.rooms) == 1 and door.width < LANES:
            passage = shapely.union(passage, _passage(door, room, JAMB, DOORWAY_OUTSIDE, LANES))
        for other in (_room(building, other) for other in door.rooms if other != room):
            gap = _passage(door, room, -DOORWAY_INSIDE, DOOR_DEPTH)
            passage = shapely.intersection(passage, shapely.union(shapely.Polygon(other.outline), gap))
            blocked += [shapely.Polygon(obstacle) for obstacle in other.obstacles]
        floor = shapely.union(floor, passage)
    free = shapely.difference(floor, shapely.union_all(blocked))
    polygons = [part for part in shapely.get_parts(free) if part.geom_type == "Polygon" and not part.is_empty]
    return tuple(Area(_ring(part.exterior), tuple(_ring(hole) for hole in part.interiors)) for part in polygons)


def outward(door: Door, room: RoomId) -> Point:
    """The unit vector through the door, out of ``room``.

    Raises:
        DoorRoomError: if the door does not open into ``room``.
    """
    if room not in door.rooms:
        raise DoorRoomError(door.id, room)
    sign = 1.0 if room == door.rooms[0] else -1.0
    return (sign * math.cos(door.heading), sign * math.sin(door.heading))


def inner_point(door: Door, room: RoomId, offset: float) -> Point:
    """The point ``offset`` [m] straight inside ``room`` from the middle of the door; negative is outside."""
    x, y = outward(door, room)
    return (door.position[0] - offset * x, door.position[1] - offset * y)


def beyond(door: Door, room: RoomId, point: Point) -> bool:
    """Whether ``point`` has crossed the door's line, seen from ``room``."""
    return _from_door(door, room, point)[0] > 0.0


def in_front(door: Door, room: RoomId, point: Point, clearance: float) -> bool:
    """Whether something that needs ``clearance`` [m] round ``point`` would stand in the way of the door."""
    out, side = _from_door(door, room, point)
    return abs(out) < DOORWAY_OUTSIDE + clearance and abs(side) < door.width / 2 + clearance


def in_room(room: Room, point: Point) -> bool:
    """Whether the point lies on the room's floor: inside its outline and in none of its obstacles."""
    return _inside(room.outline, point) and not any(_inside(obstacle, point) for obstacle in room.obstacles)


def _room(building: BuildingMap, room: RoomId) -> Room:
    for candidate in building.rooms:
        if candidate.id == room:
            return candidate
    raise UnknownRoomError(room)


def _sides(polygon: tuple[Point, ...]) -> tuple[Segment, ...]:
    return tuple(zip(polygon, polygon[1:] + polygon[:1], strict=True))


def _closed(side: Segment, doors: list[Door]) -> list[Segment]:
    """What stays of one side of an outline after the doors have cut their openings."""
    (ax, ay), (bx, by) = side
    length = math.hypot(bx - ax, by - ay)
    ux, uy = (bx - ax) / length, (by - ay) / length
    openings = []
    for door in doors:
        dx, dy = door.position[0] - ax, door.position[1] - ay
        square = abs(ux * math.cos(door.heading) + uy * math.sin(door.heading)) < 0.1
        if square and abs(ux * dy - uy * dx) <= DOOR_DEPTH:
            middle = ux * dx + uy * dy
            openings.append((middle - door.width / 2, middle + door.width / 2))
    pieces, begin = [], 0.0
    for left, right in [*sorted(openings), (length, length)]:
        if min(left, length) - begin > 1e-9:
            pieces.append((begin, min(left, length)))
        begin = max(begin, right)
    return [((ax + s * ux, ay + s * uy), (ax + t * ux, ay + t * uy)) for s, t in pieces]


def _at(door: Door, out: float, side: float) -> Point:
    """The point ``out`` beyond the door's line along its heading and ``side`` to the left of its middle."""
    x, y = math.cos(door.heading), math.sin(door.heading)
    return (door.position[0] + out * x - side * y, door.position[1] + out * y + side * x)


def _from_door(door: Door, room: RoomId, point: Point) -> tuple[float, float]:
    """How far ``point`` is out of ``room`` through the door, and how far to the side [m]."""
    x, y = outward(door, room)
    dx, dy = point[0] - door.position[0], point[1] - door.position[1]
    return (dx * x + dy * y, x * dy - y * dx)


def _passage(door: Door, room: RoomId, inner: float, outer: float, width: float | None = None) -> shapely.Polygon:
    """The rectangle as wide as the door, or as given, from ``inner`` to ``outer`` along the way out of ``room``."""
    sign = 1.0 if room == door.rooms[0] else -1.0
    half = (door.width if width is None else width) / 2
    corners = ((inner, -half), (outer, -half), (outer, half), (inner, half))
    return shapely.Polygon([_at(door, sign * out, side) for out, side in corners])


def _ring(ring: shapely.LinearRing) -> tuple[Point, ...]:
    return tuple((float(x), float(y)) for x, y in shapely.get_coordinates(ring)[:-1])


def _inside(polygon: tuple[Point, ...], point: Point) -> bool:
    """Even-odd rule: a ray from the point to the right crosses the polygon an odd number of times."""
    x, y = point
    inside = False
    for (ax, ay), (bx, by) in _sides(polygon):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside
