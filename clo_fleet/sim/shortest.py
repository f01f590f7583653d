"""The shortest way for a point on a floor, round corners and discs: A* on a visibility graph that is seen as it goes.

The shortest way bends only at corners that stick into the floor and at the rims of discs, which stand in as polygons
round them. Which points see one another is asked only for the points that the search comes to; a search among a
crowd comes to few of them. Lines that do not touch a polygon's corner tautly, but run into the polygon there, are no
part of a shortest way and are left out. A search that takes long asks first whether there can be a way at all.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from clo_fleet.world.model import Point

__all__ = ["TOLERANCE", "Corners", "Disc", "Points", "covered", "rims", "shortest_way"]

TOLERANCE = 1e-6  # [m] a path may lie on the edge of the free floor, or touch a disc
DISC_CORNERS = 12  # corners of the polygon round a disc: at most 3.5 % longer than the circle
PATIENCE = 8  # points that a search comes to before it asks whether there can be a way: most find one before

Disc = tuple[Point, float]
Points = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Corners:
    """The part that never changes.

    Attributes:
        roomy: the floor, a hair larger, prepared: what a way must stay in.
        points: the corners that stick into the floor, ``(n, 2)`` [m].
        sees: which of them see each other, ``(n, n)``.
    """

    roomy: shapely.Geometry
    points: Points
    sees: Flags


def shortest_way(corners: Corners, begin: Point, end: Point, discs: Sequence[Disc]) -> list[Point] | None:
    """The points of the shortest way, both ends included; ``None`` if there is none."""
    if _straight(corners.roomy, begin, end, discs):
        return [begin, end]
    centres, reaches = np.asarray([disc[0] for disc in discs]).reshape(-1, 2), np.asarray([disc[1] for disc in discs])
    search = _Search.over(corners, begin, end, centres, reaches)
    for round_ in range(len(search.points)):
        here = int(np.argmin(search.estimate))
        if search.estimate[here] == math.inf or (round_ == PATIENCE and not _joined(corners.roomy, begin, end, discs)):
            return None
        if here == 1:
            return search.way()
        search.settle(here)
    return None


@dataclass(slots=True)
class _Search:
    """A search under way. Point 0 is its begin, point 1 its end, then come the corners, then rims of discs."""

    corners: Corners
    points: Points
    centres: Points
    reaches: Points
    disc: npt.NDArray[np.intp]  # of each point on a rim, else -1
    before: Points  # from it to its neighbours on its rim
    after: Points
    to_go: Points
    cost: Points
    estimate: Points  # of the way through each point; infinite: not come to yet, or settled
    parent: npt.NDArray[np.intp]

    @classmethod
    def over(cls, corners: Corners, begin: Point, end: Point, centres: Points, reaches: Points) -> "_Search":
        fixed = np.concatenate([np.asarray([begin, end], dtype=np.float64), corners.points])
        around = rims(centres, reaches)
        points, before, after = (
            np.concatenate([fixed, around[:, order].reshape(-1, 2)]) for order in (_THIS, _BEFORE, _AFTER)
        )
        disc = np.concatenate([np.full(len(fixed), -1), np.repeat(np.arange(len(around)), DISC_CORNERS)])
        free = _outside(points, centres, reaches) & shapely.intersects_xy(corners.roomy, points)
        free[: len(fixed)] = True
        points, before, after, disc = points[free], (before - points)[free], (after - points)[free], disc[free]
        to_go = _lengths(points - points[1])
        cost, estimate = np.full(len(points), math.inf), np.full(len(points), math.inf)
        cost[0], estimate[0] = 0.0, to_go[0]
        parent = np.full(len(points), -1, dtype=np.intp)
        return cls(corners, points, centres, reaches, disc, before, after, to_go, cost, estimate, parent)

    def settle(self, here: int) -> None:
        """Go on from the point to all that it sees and that are reached sooner so."""
        self.estimate[here] = math.inf
        cost = self.cost[here] + _lengths(self.points - self.points[here])
        at = np.nonzero(cost < self.cost - 1e-12)[0]
        at = at[self._taut(here, at)]
        at = at[_clear(self.points[here], self.points[at], self.centres, self.reaches)]
        at = at[self._seen(here, at)]
        self.cost[at], self.parent[at] = cost[at], here
        self.estimate[at] = cost[at] + self.to_go[at]

    def way(self) -> list[Point]:
        """The way found."""
        found, here = [], 1
        while here >= 0:
            found.append((float(self.points[here, 0]), float(self.points[here, 1])))
            here = int(self.parent[here])
        return found[::-1]

    def _taut(self, here: int, at: npt.NDArray[np.intp]) -> Flags:
        """Whether lines from ``here`` touch the rims where they end; from within a rim's polygon any will do."""
        along = self.points[at] - self.points[here]
        sides = [along[:, 0] * rim[:, 1] - along[:, 1] * rim[:, 0] for rim in (self.before[at], self.after[at])]
        within = np.zeros(len(at), dtype=np.bool_)
        if len(self.centres):
            outer = self.reaches / math.cos(math.pi / DISC_CORNERS) + 2 * TOLERANCE
            within = (_lengths(self.centres - self.points[here]) <= outer)[self.disc[at]]
        return np.asarray((self.disc[at] < 0) | (sides[0] * sides[1] >= -1e-12) | within, dtype=np.bool_)

    def _seen(self, here: int, at: npt.NDArray[np.intp]) -> Flags:
        known = len(self.corners.points)
        seen = np.zeros(len(at), dtype=np.bool_)
        old = (at >= 2) & (at < 2 + known) if 2 <= here < 2 + known else seen.copy()
        if old.any():
            seen[old] = self.corners.sees[here - 2, at[old] - 2]
        pairs = np.column_stack((np.full(int((~old).sum()), here), at[~old]))
        seen[~old] = covered(self.corners.roomy, self.points, pairs)
        return seen


def covered(roomy: shapely.Geometry, points: Points, pairs: npt.NDArray[np.intp]) -> Flags:
    """Which of the lines between pairs of points stay on the floor."""
    if not len(pairs):
        return np.zeros(0, dtype=np.bool_)
    lines = shapely.linestrings(points[pairs])
    return np.asarray(shapely.covers(roomy, lines), dtype=np.bool_)


def rims(centres: Points, reaches: Points) -> Points:
    """Corners of polygons that touch some discs from outside, ``(n, DISC_CORNERS, 2)``."""
    outer = (reaches + TOLERANCE) / math.cos(math.pi / DISC_CORNERS)
    corners: Points = centres[:, None, :] + outer[:, None, None] * _CIRCLE
    return corners


def _straight(roomy: shapely.Geometry, begin: Point, end: Point, discs: Sequence[Disc]) -> bool:
    """Whether the line between two points is free, which is much cheaper to see than to search for a way."""
    (ax, ay), (bx, by) = begin, end
    dx, dy = bx - ax, by - ay
    squared = max(dx * dx + dy * dy, 1e-18)
    for (x, y), reach in discs:
        share = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / squared))
        if math.hypot(ax + share * dx - x, ay + share * dy - y) < reach - TOLERANCE:
            return False
    return bool(shapely.covers(roomy, shapely.linestrings((begin, end))))


def _clear(begin: Points, ends: Points, centres: Points, reaches: Points) -> Flags:
    """Which of the lines from one point miss every disc."""
    if not len(ends) or not len(centres):
        return np.ones(len(ends), dtype=np.bool_)
    along, toward = ends - begin, centres - begin
    squared = np.maximum((along * along).sum(axis=1), 1e-18)[:, None]
    dot = along @ toward.T
    share = np.clip(dot / squared, 0.0, 1.0)
    off = (toward * toward).sum(axis=1) - 2.0 * share * dot + share * share * squared
    return np.asarray((off >= np.maximum(reaches - TOLERANCE, 0.0) ** 2).all(axis=1), dtype=np.bool_)


def _outside(points: Points, centres: Points, reaches: Points) -> Flags:
    """Which of the points lie in no disc."""
    if not len(centres):
        return np.ones(len(points), dtype=np.bool_)
    off = points[:, None, :] - centres
    return np.asarray(((off * off).sum(axis=2) >= (reaches - TOLERANCE) ** 2).all(axis=1), dtype=np.bool_)


def _lengths(vectors: Points) -> Points:
    lengths: Points = np.sqrt((vectors * vectors).sum(axis=1))
    return lengths


def _joined(roomy: shapely.Geometry, begin: Point, end: Point, discs: Sequence[Disc]) -> bool:
    """Whether both points lie on one piece of the floor that the discs leave; what it denies is so."""
    centres = shapely.points([disc[0] for disc in discs]) if discs else []
    solid = shapely.union_all(shapely.buffer(centres, [disc[1] - TOLERANCE for disc in discs], quad_segs=6))
    parts = shapely.get_parts(shapely.difference(roomy, solid))
    ends = [shapely.distance(parts, shapely.Point(point)) <= TOLERANCE for point in (begin, end)]
    return bool((ends[0] & ends[1]).any())


_TURNS = math.tau * np.arange(DISC_CORNERS) / DISC_CORNERS
_CIRCLE = np.asarray([(math.cos(turn), math.sin(turn)) for turn in _TURNS.tolist()])
_THIS = np.arange(DISC_CORNERS)
_BEFORE, _AFTER = np.roll(_THIS, 1), np.roll(_THIS, -1)
