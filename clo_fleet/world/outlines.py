"""Polygons and lines in plain Python: the few measures of outlines that the setting and the simulation ask for.

An outline is a closed polygon of at least three points [m]; its last point joins its first. Everything is linear
in the number of points.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from clo_fleet.world.model import Point, Room

__all__ = [
    "area",
    "centroid",
    "clearance",
    "counter_clockwise",
    "covers",
    "in_room",
    "length",
    "outward_headings",
    "wall_distance",
]

SAME_DISTANCE = 1e-6  # m: walls this near to equally near are both the nearest


def area(outline: Sequence[Point]) -> float:
    """The area [m2], positive for a counter-clockwise outline.

    >>> area([(0, 0), (2, 0), (2, 3), (0, 3)])
    6.0
    """
    return sum(ax * by - bx * ay for (ax, ay), (bx, by) in _edges(outline)) / 2


def counter_clockwise(outline: Sequence[Point]) -> tuple[Point, ...]:
    """The outline turned counter-clockwise; its first point stays the first."""
    return tuple(outline) if area(outline) >= 0 else (outline[0], *reversed(outline[1:]))


def centroid(outline: Sequence[Point]) -> Point:
    """The centre of the area [m]; it lies outside of some outlines that are not convex.

    >>> centroid([(0, 0), (2, 0), (2, 4), (0, 4)])
    (1.0, 2.0)
    """
    x0, y0 = outline[0]  # relative to a corner, where the products stay small
    sx = sy = twice = 0.0
    for (ax, ay), (bx, by) in _edges([(x - x0, y - y0) for x, y in outline]):
        cross = ax * by - bx * ay
        sx, sy, twice = sx + (ax + bx) * cross, sy + (ay + by) * cross, twice + cross
    return (x0 + sx / (3 * twice), y0 + sy / (3 * twice)) if twice else (x0, y0)


def covers(outline: Sequence[Point], point: Point) -> bool:
    """Whether the point lies in the outline or on it, by the even-odd rule.

    >>> covers([(0, 0), (2, 0), (2, 4), (0, 4)], (2, 1))
    True
    """
    x, y = point
    inside = False
    for (ax, ay), (bx, by) in _edges(outline):
        side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        if side == 0 and min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by):
            return True
        if (ay > y) != (by > y) and (side > 0) == (by > ay):
            inside = not inside
    return inside


def wall_distance(outline: Sequence[Point], point: Point) -> float:
    """The distance from the point to the nearest edge of the outline [m]."""
    return min(_distance(point, a, b) for a, b in _edges(outline))


def in_room(room: Room, point: Point) -> bool:
    """Whether the point lies in the room and not within an obstacle."""
    return clearance(room, point) >= 0


def clearance(room: Room, point: Point) -> float:
    """The distance from the point to the nearest wall or obstacle of the room [m]; negative if it is not free."""
    distance = wall_distance(room.outline, point)
    nearest = distance if covers(room.outline, point) else -distance
    for obstacle in room.obstacles:
        distance = wall_distance(obstacle, point)
        nearest = min(nearest, -distance if covers(obstacle, point) else distance)
    return nearest


def outward_headings(outline: Sequence[Point], point: Point) -> tuple[float, ...]:
    """The directions out of a counter-clockwise outline at the wall nearest to the point [rad]: two at a corner.

    >>> outward_headings([(0, 0), (6, 0), (6, 5), (0, 5)], (6, 2.5))
    (0.0,)
    """
    walls = [(_distance(point, a, b), a, b) for a, b in _edges(outline) if a != b]
    nearest = min((distance for distance, _, _ in walls), default=0.0)
    return tuple(
        math.atan2(a[0] - b[0], b[1] - a[1]) + 0.0 for distance, a, b in walls if distance <= nearest + SAME_DISTANCE
    )


def length(line: Sequence[Point]) -> float:
    """The length of an open line [m]."""
    return sum(math.dist(a, b) for a, b in pairwise(line))


def _edges(outline: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    yield from pairwise((*outline, outline[0]))


def _distance(point: Point, a: Point, b: Point) -> float:
    """The distance from a point to a segment [m]."""
    (px, py), (ax, ay), (bx, by) = point, a, b
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    along = max(0.0, min(1.0, ((px - ax) * dx + (py - ay) * dy) / square)) if square else 0.0
    return math.dist(point, (ax + along * dx, ay + along * dy))
