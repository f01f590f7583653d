"""Which lines come near a point: asked for a few points, again and again."""

from collections.abc import Mapping, Sequence

import shapely

from clo_fleet.world.model import Point

__all__ = ["Nearby"]


class Nearby:
    """Named lines in the plane. ``lines``: the points of each [m]."""

    def __init__(self, lines: Mapping[str, Sequence[Point]]) -> None:
        self._names = sorted(lines)
        self._lines = shapely.STRtree([shapely.LineString(lines[name]) for name in self._names])
        self._found: dict[tuple[Point, float], tuple[str, ...]] = {}

    def names(self, point: Point, within: float) -> tuple[str, ...]:
        """The lines that come this near to a point [m], sorted."""
        if (point, within) not in self._found:
            near = self._lines.query(shapely.Point(point), predicate="dwithin", distance=within)
            self._found[point, within] = tuple(self._names[number] for number in sorted(near.tolist()))
        return self._found[point, within]
