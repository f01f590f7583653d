"""What can be seen from where in a room: walls and obstacles block sight, robots and objects do not.

A room without corners that stick into it hides nothing, and most rooms are such; in the others a line of sight is
tested against the prepared floor. To say that something is *not* in a room one has to have seen all of it:
``spots`` are points all over the floor, close enough that nothing lies between them unseen.
"""

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
import shapely

from clo_fleet.sim.walls import Area
from clo_fleet.world.model import Point, Room

__all__ = ["Sightlines"]

SLACK = 0.02  # [m] a line along a wall is clear: less than half of a wall's thickness
SPOT = 0.5  # [m] between two spots: a robot that sees both sides of a small object has seen the object
RIM = 0.1  # [m] spots keep this far from walls, where an object's centre cannot be


class Sightlines:
    """Lines of sight in one room, whose floor with its doorways is ``areas`` (see ``walls.free_space``)."""

    def __init__(self, room: Room, areas: Iterable[Area]) -> None:
        outline = shapely.Polygon(room.outline)
        self._inside = outline.difference(shapely.union_all([shapely.Polygon(block) for block in room.obstacles]))
        self._plain = not room.obstacles and outline.convex_hull.area - outline.area < SLACK * SLACK
        floor = shapely.union_all([shapely.Polygon(area.outline, area.holes) for area in areas])
        self._floor = shapely.buffer(floor, SLACK, join_style="mitre")
        shapely.prepare(self._inside)
        shapely.prepare(self._floor)

    def seen(self, eye: Point, points: Sequence[Point], reach: float) -> tuple[bool, ...]:
        """Which of the points are seen from ``eye`` within ``reach`` [m]."""
        near = [math.dist(eye, point) <= reach for point in points]
        if not any(near) or (self._plain and bool(shapely.contains_xy(self._inside, [eye, *points]).all())):
            return tuple(near)
        lines = shapely.linestrings(np.asarray([(eye, point) for point in points], dtype=np.float64))
        clear = shapely.covers(self._floor, lines)
        return tuple(bool(both) for both in clear & np.asarray(near))

    def plain_within(self, reach: float) -> bool:
        """Whether everything inside is seen from everywhere inside, with such a range of sight [m]."""
        left, low, right, high = self._inside.bounds
        return self._plain and math.hypot(right - left, high - low) <= reach

    def inside(self, point: Point) -> bool:
        """Whether the point is on the floor within the walls, not in a doorway."""
        return bool(shapely.contains_xy(self._inside, *point))

    @cached_property
    def spots(self) -> tuple[Point, ...]:
        """Points all over the floor, row by row: who has seen them all has seen the room."""
        floor = shapely.buffer(self._inside, -RIM)
        if floor.is_empty:
            return ()
        left, low, right, high = floor.bounds
        xs, ys = (np.linspace(a, b, math.ceil((b - a) / SPOT) + 1) for a, b in ((left, right), (low, high)))
        grid = [(float(x), float(y)) for y in ys for x in xs]
        covered = shapely.intersects_xy(shapely.buffer(floor, 1e-6), np.asarray(grid))
        return tuple(point for point, free in zip(grid, covered, strict=True) if free)
