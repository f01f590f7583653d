"""Shortest paths for a disc in a room: a visibility graph over the floor, shrunk by the disc.

The floor is shrunk by the robot's radius first, so that the robot is a point. Which of its corners see one another is
found once for each radius. Things that come and go are discs to go round; ``shortest.py`` finds the way.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from clo_fleet.sim.shortest import TOLERANCE, Corners, Disc, Points, covered, rims, shortest_way
from clo_fleet.sim.walls import Area
from clo_fleet.world.model import Point

__all__ = ["MARGIN", "Disc", "RoomPaths"]

MARGIN = 0.05  # [m] beyond the radius: half of a wall's thickness, the chords at rounded corners, and play
ARC = 4  # chords that round off a quarter turn at a corner of the shrunk floor


@dataclass(frozen=True, slots=True)
class _Graph:
    """The part that never changes: the shrunk floor, and its inner corners."""

    floor: shapely.Geometry
    corners: Corners
    left: dict[tuple[Disc, ...], shapely.Geometry] = field(default_factory=dict)  # by the last discs: what they leave

    def free(self, discs: Sequence[Disc]) -> shapely.Geometry:
        """The floor that some discs leave; asked for several times in a row with the same discs."""
        key = tuple(discs)
        if key not in self.left:
            centres = np.asarray([disc[0] for disc in discs]).reshape(-1, 2)
            blocked = shapely.polygons(rims(centres, np.asarray([disc[1] for disc in discs])))
            self.left.clear()
            self.left[key] = shapely.difference(self.floor, shapely.union_all(blocked))
        return self.left[key]


@dataclass(slots=True)
class RoomPaths:
    """Paths in one room, whose floor is ``areas`` (see ``walls.free_space``)."""

    areas: tuple[Area, ...]
    _graphs: dict[float, _Graph] = field(default_factory=dict, repr=False)

    def path(
        self, start: Point, goal: Point, radius: float, obstacles: Sequence[Disc] = (), *, within: float = 0.0
    ) -> tuple[Point, ...] | None:
        """The points to drive through in turn, the start left out; ``None`` if there is no way.

        Args:
            start: where the disc is [m]; if it stands too close to something, the nearest free point
                is the first of the path.
            goal: where it is to go [m].
            radius: of the disc [m].
            obstacles: discs to keep away from, as (centre, radius) [m].
            within: the path ends as soon as it is this near to the goal [m], which then need not be free. Leave
                the thing itself that is to be reached out of ``obstacles``.
        """
        graph = self._graph(radius)
        discs = [(centre, size + radius + MARGIN) for centre, size in obstacles]
        begin, end = _nearest_free(graph, start, discs), _nearest_free(graph, goal, discs)
        if begin is None or end is None or math.dist(end, goal) > within + TOLERANCE:
            return None
        way = shortest_way(graph.corners, begin, end, discs)
        if way is None:
            return None
        if math.dist(begin, start) <= TOLERANCE:
            way = way[1:]
        return _cut([start, *way], goal, within)

    def along_walls(self, point: Point, velocity: Point, radius: float, ahead: float) -> Point:
        """The velocity, turned so that a disc that keeps it for ``ahead`` [s] slides along walls and not into them."""
        aim = (point[0] + ahead * velocity[0], point[1] + ahead * velocity[1])
        graph = self._graph(radius)
        if shapely.intersects_xy(graph.corners.roomy, *aim):
            return velocity
        free = _nearest_free(graph, aim, ())
        return velocity if free is None else ((free[0] - point[0]) / ahead, (free[1] - point[1]) / ahead)

    def nearest_free(self, point: Point, radius: float, obstacles: Sequence[Disc] = ()) -> Point | None:
        """The point nearest to ``point`` where a disc may stand; ``None`` if there is none."""
        discs = [(centre, size + radius + MARGIN) for centre, size in obstacles]
        return _nearest_free(self._graph(radius), point, discs)

    def _graph(self, radius: float) -> _Graph:
        if radius not in self._graphs:
            self._graphs[radius] = _visibility(self.areas, radius + MARGIN)
        return self._graphs[radius]


def _visibility(areas: Iterable[Area], reach: float) -> _Graph:
    """The graph for a disc that keeps its centre ``reach`` away from everything solid; O(n²) cover tests."""
    floor = shapely.union_all([shapely.Polygon(area.outline, area.holes) for area in areas])
    floor = shapely.buffer(floor, -reach, quad_segs=ARC)
    roomy = shapely.buffer(floor, TOLERANCE, join_style="mitre")
    shapely.prepare(roomy)
    corners = _inner_corners(floor)
    pairs = np.transpose(np.triu_indices(len(corners), 1))
    sees = np.zeros((len(corners), len(corners)), dtype=np.bool_)
    sees[pairs[:, 0], pairs[:, 1]] = covered(roomy, corners, pairs)
    return _Graph(floor, Corners(roomy, corners, sees | sees.T))


def _inner_corners(floor: shapely.Geometry) -> Points:
    """The corners that stick into the floor: those of holes, and those of outlines where it turns inwards."""
    found = [np.empty((0, 2))]
    for part in shapely.get_parts(floor):
        polygon = shapely.orient_polygons(part)
        for ring in (polygon.exterior, *polygon.interiors):
            corners = shapely.get_coordinates(ring)[:-1]
            before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            found.append(corners[turn < -1e-12])
    return np.concatenate(found)


def _nearest_free(graph: _Graph, point: Point, discs: Sequence[Disc]) -> Point | None:
    """``point`` itself if it is free, else the nearest point that is."""
    here = shapely.Point(point)
    near = [disc for disc in discs if math.dist(point, disc[0]) < disc[1] - TOLERANCE]
    if not near and shapely.covers(graph.corners.roomy, here):
        return point
    free = graph.free(discs)
    if free.is_empty:
        return None
    x, y = shapely.get_coordinates(shapely.shortest_line(free, here))[0]
    return (float(x), float(y))


def _cut(route: list[Point], goal: Point, within: float) -> tuple[Point, ...]:
    """The points after the first, up to where the route first comes this near to the goal."""
    kept: list[Point] = []
    for begin, end in itertools.pairwise(route):
        near = _entry(begin, end, goal, within) if within > 0.0 else None
        kept.append(end if near is None else near)
        if near is not None:
            break
    return tuple(kept)


def _entry(begin: Point, end: Point, goal: Point, within: float) -> Point | None:
    """The first point of a line that lies within a distance of the goal."""
    if math.dist(begin, goal) <= within:
        return begin
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    fx, fy = begin[0] - goal[0], begin[1] - goal[1]
    a, b, c = dx * dx + dy * dy, fx * dx + fy * dy, fx * fx + fy * fy - within * within
    if a == 0.0 or b * b < a * c:
        return None
    share = (-b - math.sqrt(b * b - a * c)) / a
    return (begin[0] + share * dx, begin[1] + share * dy) if 0.0 <= share <= 1.0 else None
