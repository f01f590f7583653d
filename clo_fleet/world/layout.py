"""A building drawn by a program: corridors from node to node, rectangular rooms, doors with their spurs.

A `Layout` takes a building piece by piece and gives it as a `BuildingMap`. Rooms hang beside the corridors at *spurs*:
short pieces of corridor with a lane for each direction, so that who waits at a door blocks nobody who passes by. A spur
comes straight out of its door, as the doorway needs it.

Along the walls of each room are *spots*, spawn points where robots can stand and objects can lie a metre apart, out of
the way of the doors; the middle of the room stays free.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from clo_fleet.world.free_spots import in_the_way
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    PlaceId,
    Point,
    Pose,
    Room,
    RoomId,
    SpawnPoint,
)
from clo_fleet.world.outlines import counter_clockwise, outward_headings

__all__ = ["DOOR_WIDTH", "MAX_SPEED", "SPUR", "Layout"]

DOOR_WIDTH = 1.8  # [m]; at 1.6 robots pass both ways at once
SPUR = 3.5  # [m] from the node to the door: a doorway of 1.2, a junction of 1, and a lane that holds a robot
MAX_SPEED = 1.5  # [m/s] of robots in corridors
SPOT_GAP = 1.0  # [m] between spots: two robots of radius 0.3 and another's hand between them
SPOT_INSET = 0.5  # [m] from the walls
MAX_SPOTS = 16  # a room


@dataclass(slots=True)
class Layout:
    """A building in the making. Coordinates are rounded to millimetres, so that equal drawings give equal files.

    Attributes:
        name: the building's.
    """

    name: str
    _rooms: dict[str, Room] = field(default_factory=dict)
    _doors: dict[str, Door] = field(default_factory=dict)
    _nodes: dict[str, Point] = field(default_factory=dict)
    _corridors: dict[str, Corridor] = field(default_factory=dict)

    def node(self, name: str, at: Point) -> None:
        """A point where corridors meet or end [m]."""
        self._nodes[name] = _rounded(at)

    def hall(
        self,
        start: str,
        end: str,
        *,
        via: Iterable[Point] = (),
        max_speed: float = MAX_SPEED,
        one_way: bool = False,
        single_lane: bool = False,
    ) -> None:
        """A corridor between two nodes that are there already; there may be several."""
        shape = (self._nodes[start], *map(_rounded, via), self._nodes[end])
        name = CorridorId(f"{start}--{end}")
        if name in self._corridors:
            name = CorridorId(f"{name}-{sum(other.startswith(name) for other in self._corridors) + 1}")
        self._corridors[name] = Corridor(
            id=name,
            start=start,
            end=end,
            shape=shape,
            max_speed=max_speed,
            one_way=one_way,
            single_lane=single_lane,
        )

    def room(self, name: str, corner: Point, size: tuple[float, float]) -> None:
        """A room along the axes, from its lower left corner, of a width and depth [m]; doors come next."""
        (x, y), (width, depth) = corner, size
        self._add_room(name, ((x, y), (x + width, y), (x + width, y + depth), (x, y + depth)))

    def door(self, room: str, at: Point, node: str, *, via: Iterable[Point] = (), width: float = DOOR_WIDTH) -> None:
        """A door of a room, with the spur that leads from it to a node."""
        start = self._add_door((room,), at, width)
        shape = (_rounded(at), *map(_rounded, via), self._nodes[node])
        name = CorridorId(f"{start}--{node}")
        self._corridors[name] = Corridor(id=name, start=start, end=node, shape=shape)

    def door_between(self, room: str, other: str, at: Point, *, width: float = DOOR_WIDTH) -> None:
        """A door in the common wall of two rooms."""
        self._add_door((room, other), at, width)

    def hang(self, name: str, node: str, heading: float, size: tuple[float, float], *, spur: float = SPUR) -> None:
        """A room of a width and depth [m] with its door in the middle of one wall, a straight spur away from a node.

        Args:
            name: the room's.
            node: where the spur begins.
            heading: from the node to the room [rad].
            size: along the door's wall, and away from it [m].
            spur: its length [m].
        """
        width, depth = size
        x, y = self._nodes[node]
        along = (math.cos(heading), math.sin(heading))

        def at(out: float, side: float) -> Point:
            return (x + out * along[0] - side * along[1], y + out * along[1] + side * along[0])

        half = width / 2
        corners = (at(spur, -half), at(spur + depth, -half), at(spur + depth, half), at(spur, half))
        self._add_room(name, corners)
        self.door(name, at(spur, 0.0), node)

    def building(self) -> BuildingMap:
        """The building, without a network yet."""
        return BuildingMap(
            name=self.name,
            rooms=tuple(self._rooms.values()),
            doors=tuple(self._doors.values()),
            junctions=tuple(Junction(name, at) for name, at in self._nodes.items()),
            corridors=tuple(self._corridors.values()),
            spawn_points=self._spawn_points(),
        )

    def _add_room(self, name: str, corners: Sequence[Point]) -> None:
        outline = counter_clockwise(tuple(map(_rounded, corners)))
        self._rooms[name] = Room(RoomId(PlaceId(name)), outline)

    def _add_door(self, rooms: Sequence[str], at: Point, width: float) -> str:
        number = sum(set(rooms) <= set(door.rooms) for door in self._doors.values()) + 1
        name = f"{'--'.join(rooms)}-door" + (f"-{number}" if number > 1 else "")
        position = _rounded(at)
        self._doors[name] = Door(
            id=DoorId(name),
            rooms=tuple(RoomId(PlaceId(room)) for room in rooms),
            position=position,
            heading=round(outward_headings(self._rooms[rooms[0]].outline, position)[0], 6),
            width=width,
        )
        return name

    def _spawn_points(self) -> tuple[SpawnPoint, ...]:
        doors_of: dict[str, list[Door]] = {name: [] for name in self._rooms}
        for door in self._doors.values():
            for room in door.rooms:
                doors_of[room].append(door)
        return tuple(
            SpawnPoint(f"{name}-{number}", room.id, pose)
            for name, room in self._rooms.items()
            for number, pose in enumerate(_spots(room, doors_of[name]), start=1)
        )


def _spots(room: Room, doors: list[Door]) -> list[Pose]:
    """Places along the walls of a rectangular room, looking away from them; as many as there may be, evenly chosen."""
    middle = (sum(x for x, _ in room.outline) / 4, sum(y for _, y in room.outline) / 4)
    inner = [_inwards(corner, room.outline) for corner in room.outline]
    found = []
    for a, b in pairwise((*inner, inner[0])):
        steps = max(1, int(math.dist(a, b) / SPOT_GAP + 1e-9))
        for step in range(steps):
            x, y = a[0] + (b[0] - a[0]) * step / steps, a[1] + (b[1] - a[1]) * step / steps
            if not any(in_the_way(door, (x, y)) for door in doors):
                heading = math.atan2(middle[1] - y, middle[0] - x)
                found.append(Pose(*_rounded((x, y)), round(heading, 3)))
    if len(found) > MAX_SPOTS:
        found = [found[number * len(found) // MAX_SPOTS] for number in range(MAX_SPOTS)]
    return found


def _inwards(corner: Point, outline: tuple[Point, ...]) -> Point:
    """The corner of a rectangle moved inwards from both its walls."""
    index = outline.index(corner)
    before, after = outline[index - 1], outline[(index + 1) % len(outline)]
    x, y = corner
    for other in (before, after):
        reach = SPOT_INSET / math.dist(corner, other)
        x, y = x + reach * (other[0] - corner[0]), y + reach * (other[1] - corner[1])
    return (x, y)


def _rounded(point: Point) -> Point:
    return (round(point[0], 3) + 0.0, round(point[1], 3) + 0.0)
