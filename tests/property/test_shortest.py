"""The search for shortest ways, held against a graph of all points and all lines between them."""

import itertools
import math

import networkx as nx
import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from clo_fleet.sim.paths import MARGIN, RoomPaths
from clo_fleet.sim.shortest import rims
from clo_fleet.sim.walls import Area
from clo_fleet.world.model import Point

RADIUS = 0.3
SIDE = 8.0
OUTLINE = ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE))
BLOCKS = (((2.0, 2.0), (2.0, 3.5), (3.0, 3.5), (3.0, 2.0)), ((5.0, 4.0), (5.0, 7.0), (5.5, 7.0), (5.5, 4.0)))
PATHS = RoomPaths((Area(OUTLINE, BLOCKS),))
FLOOR = shapely.buffer(shapely.Polygon(OUTLINE, BLOCKS), -RADIUS - MARGIN, quad_segs=4)
ROOMY = shapely.buffer(FLOOR, 1e-6, join_style="mitre")
shapely.prepare(ROOMY)

places = st.tuples(*[st.integers(1, 31).map(lambda n: n / 4 + 0.01)] * 2)
discs = st.lists(st.tuples(places, st.sampled_from([0.12, 0.3, 0.46])), max_size=9)


def free(point: Point, things: list[tuple[Point, float]]) -> bool:
    """Whether a robot can stand there."""
    clear = all(math.dist(point, at) > size + RADIUS + MARGIN + 1e-3 for at, size in things)
    return clear and bool(shapely.covers(ROOMY, shapely.Point(point)))


def slow(begin: Point, end: Point, things: list[tuple[Point, float]]) -> float | None:
    """The length of the shortest way over all corners of the floor and of all polygons round discs."""
    around = [(at, size + RADIUS + MARGIN) for at, size in things]
    corners = [tuple(corner) for corner in shapely.get_coordinates(FLOOR).tolist()]
    polygons = rims(np.asarray([at for at, _ in around]).reshape(-1, 2), np.asarray([reach for _, reach in around]))
    points = [begin, end, *corners, *map(tuple, polygons.reshape(-1, 2).tolist())]
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from((0, 1))
    pairs = np.asarray(list(itertools.combinations(range(len(points)), 2)))
    lines = shapely.linestrings(np.asarray(points)[pairs])
    clear = shapely.covers(ROOMY, lines)
    for at, reach in around:
        clear &= shapely.distance(lines, shapely.Point(at)) >= reach - 1e-6
    for one, other in pairs[clear].tolist():
        graph.add_edge(one, other, weight=math.dist(points[one], points[other]))
    try:
        return float(nx.dijkstra_path_length(graph, 0, 1))
    except nx.NetworkXNoPath:
        return None


@settings(max_examples=60, deadline=None)
@given(begin=places, end=places, things=discs)
def test_the_way_found_is_as_short_as_any(begin: Point, end: Point, things: list[tuple[Point, float]]) -> None:
    """Whatever stands in the room, the search finds a way just when there is one, and none is shorter."""
    if not free(begin, things) or not free(end, things):
        return
    found, shortest = PATHS.path(begin, end, RADIUS, things), slow(begin, end, things)
    if shortest is None:
        assert found is None
        return
    assert found is not None
    length = sum(math.dist(*pair) for pair in itertools.pairwise((begin, *found)))
    assert abs(length - shortest) < 2e-3 * max(1.0, shortest)
