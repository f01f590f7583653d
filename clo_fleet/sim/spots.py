"""Places on the floor where something could be put down: on rings round a point, the nearest ring first.

Crowded rooms are searched to the end, which is thousands of places: they are judged many at a time, in numpy, and all
the arithmetic is that of ``walls.in_room`` and ``walls.in_front``, to the last bit.
"""

import math
from collections.abc import Iterator
from functools import cache

import numpy as np
import numpy.typing as npt

from clo_fleet.sim.walls import DOORWAY_OUTSIDE, UnknownRoomError, outward
from clo_fleet.world.model import BuildingMap, Door, Point, Room, RoomId

__all__ = ["spots"]

SPOT_STEP = 0.1  # [m] between the places that are tried, and between rings of them
FIRST = 2  # rings that are judged together, then twice as many: the place is mostly among the first

Points = npt.NDArray[np.float64]
Verdicts = npt.NDArray[np.bool_]


def spots(building: BuildingMap, room: RoomId, near: Point, radius: float, within: float) -> Iterator[Point]:
    """Places for an item on the room's floor and not in front of its doors, on growing rings round ``near``.

    Whether something stands or lies there already, or a wall is too close, is for the caller to see.

    Raises:
        UnknownRoomError: if there is no such room.
    """
    floor = next((candidate for candidate in building.rooms if candidate.id == room), None)
    if floor is None:
        raise UnknownRoomError(room)
    doors = [door for door in building.doors if room in door.rooms]
    rings = int(within / SPOT_STEP + 1e-9) + 1
    first, end = 0, FIRST
    while first < rings:
        places = np.asarray(near) + _rings(first, min(rings, end))
        fits = _on_floor(floor, places)
        for door in doors:
            fits &= ~_in_front(door, room, places, radius)
        yield from ((x, y) for x, y in places[fits].tolist())
        first, end = end, 2 * end


@cache
def _rings(first: int, end: int) -> Points:
    """The places of some rings, seen from their middle, ``(n, 2)`` [m]."""
    turns = [(ring * SPOT_STEP, math.tau * k / max(1, 6 * ring)) for ring in range(first, end) for k in _places(ring)]
    return np.asarray([(reach * math.cos(angle), reach * math.sin(angle)) for reach, angle in turns])


def _places(ring: int) -> range:
    return range(max(1, 6 * ring))


def _on_floor(room: Room, points: Points) -> Verdicts:
    floor = _inside(room.outline, points)
    for obstacle in room.obstacles:
        floor &= ~_inside(obstacle, points)
    return floor


def _inside(polygon: tuple[Point, ...], points: Points) -> Verdicts:
    """Even-odd rule: a ray from the point to the right crosses the polygon an odd number of times."""
    x, y = points.T
    inside = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def _in_front(door: Door, room: RoomId, points: Points, clearance: float) -> Verdicts:
    x, y = outward(door, room)
    dx, dy = (points - np.asarray(door.position)).T
    ahead: Verdicts = np.abs(dx * x + dy * y) < DOORWAY_OUTSIDE + clearance
    beside: Verdicts = np.abs(x * dy - y * dx) < door.width / 2 + clearance
    return ahead & beside
