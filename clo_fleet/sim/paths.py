"""Shortest paths for a disc in a room: a visibility graph over the floor, shrunk by the disc.

The shortest way for a point among polygons bends only at corners that stick into the free floor. The
floor is shrunk by the robot's radius first, so that the robot is a point. Which of its corners see one
another is found once for each radius. Things that come and go are discs to go round: the shortest path
is searched without them, then only the discs that it meets are added, and again until it meets none;
the result is the shortest path round all of them.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import networkx as nx
import numpy as np
import numpy.typing as npt
import shapely

from clo_fleet.sim.walls import Area
from clo_fleet.world.model import Point

__all__ = ["MARGIN", "Disc", "RoomPaths"]

MARGIN = 0.05  # [m] beyond the radius: half of a wall's thickness, the chords at rounded corners, and play
TOLERANCE = 1e-6  # [m] a path may lie on the edge of the free floor
ARC = 4  # chords that round off a quarter turn at a corner of the shrunk floor
DISC_CORNERS = 12  # corners of the polygon round a disc: at most 3.5 % longer than the circle

Disc = tuple[Point, float]
Points = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Graph:
    """The part that never changes: the shrunk floor, its inner corners, and which of them see each other."""

    floor: shapely.Geometry
    roomy: shapely.Geometry  # the floor a hair larger, prepared: what a path must stay in
    corners: Points
    links: npt.NDArray[np.intp]


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
        way = _shortest(graph, begin, end, discs)
        if way is None:
            return None
        if math.dist(begin, start) <= TOLERANCE:
            way = way[1:]
        return _cut([start, *way], goal, within)

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
    return _Graph(floor, roomy, corners, pairs[_covered(roomy, corners, pairs)])


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


def _covered(roomy: shapely.Geometry, points: Points, pairs: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Which of the lines between pairs of points stay on the floor."""
    if not len(pairs):
        return np.zeros(0, dtype=np.bool_)
    lines = shapely.linestrings(points[pairs])
    return np.asarray(shapely.covers(roomy, lines), dtype=np.bool_)


def _clear(points: Points, pairs: npt.NDArray[np.intp], discs: Sequence[Disc]) -> npt.NDArray[np.bool_]:
    """Which of the lines between pairs of points miss every disc."""
    begin, along = points[pairs[:, 0]], points[pairs[:, 1]] - points[pairs[:, 0]]
    squared = np.maximum((along * along).sum(axis=1), 1e-18)
    clear = np.ones(len(pairs), dtype=np.bool_)
    for centre, reach in discs:
        toward = np.asarray(centre) - begin
        share = np.clip((toward * along).sum(axis=1) / squared, 0.0, 1.0)
        gap = toward - share[:, None] * along
        clear &= (gap * gap).sum(axis=1) >= (reach - TOLERANCE) ** 2
    return clear


def _shortest(graph: _Graph, begin: Point, end: Point, discs: Sequence[Disc]) -> list[Point] | None:
    """The shortest way round all discs, found by adding only those that are met."""
    met: list[Disc] = []
    while True:
        way = _shortest_round(graph, begin, end, met)
        if way is None:
            return None
        points, steps = np.asarray(way), np.column_stack((np.arange(len(way) - 1), np.arange(1, len(way))))
        new = [disc for disc in discs if disc not in met and not _clear(points, steps, [disc]).all()]
        if not new:
            return way
        met += new


def _shortest_round(graph: _Graph, begin: Point, end: Point, discs: Sequence[Disc]) -> list[Point] | None:
    """The shortest way round exactly these discs: the fixed graph, the two ends, and corners round the discs."""
    fixed = len(graph.corners)
    points = np.concatenate([graph.corners, [begin, end], *(_polygon(disc) for disc in discs)])
    rows, columns = np.triu_indices(len(points), 1)
    fresh = np.column_stack((rows, columns))[columns >= fixed]
    fresh = fresh[_clear(points, fresh, discs)]
    fresh = fresh[_covered(graph.roomy, points, fresh)]
    links = np.concatenate([graph.links[_clear(points, graph.links, discs)], fresh])
    lengths = np.sqrt(((points[links[:, 0]] - points[links[:, 1]]) ** 2).sum(axis=1))
    network: nx.Graph[int] = nx.Graph()
    network.add_nodes_from((fixed, fixed + 1))
    network.add_weighted_edges_from(zip(*links.T.tolist(), lengths.tolist(), strict=True))
    try:
        way = nx.dijkstra_path(network, fixed, fixed + 1)
    except nx.NetworkXNoPath:
        return None
    return [(float(x), float(y)) for x, y in points[way]]


def _polygon(disc: Disc) -> Points:
    """Corners of a polygon that touches the disc from outside."""
    (x, y), reach = disc
    outer = (reach + TOLERANCE) / math.cos(math.pi / DISC_CORNERS)
    turns = [2 * math.pi * k / DISC_CORNERS for k in range(DISC_CORNERS)]
    return np.asarray([(x + outer * math.cos(a), y + outer * math.sin(a)) for a in turns])


def _nearest_free(graph: _Graph, point: Point, discs: Sequence[Disc]) -> Point | None:
    """``point`` itself if it is free, else the nearest point that is."""
    here = shapely.Point(point)
    near = [disc for disc in discs if math.dist(point, disc[0]) < disc[1] - TOLERANCE]
    if not near and shapely.covers(graph.roomy, here):
        return point
    blocked = [shapely.Polygon(_polygon(disc)) for disc in discs]
    free = shapely.difference(graph.floor, shapely.union_all(blocked))
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
