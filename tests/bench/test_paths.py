"""How long paths among idle robots take, beside the time for an empty room and for a graph of everything."""

import itertools
import math
import random
import sys
import time

import networkx as nx
import numpy as np
import pytest
import shapely

from clo_fleet.sim.paths import MARGIN, RoomPaths
from clo_fleet.sim.shortest import rims
from clo_fleet.sim.walls import Area
from clo_fleet.world.model import Point

RADIUS, BERTH = 0.3, 0.16
OUTLINE = ((0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0))
BEGIN, END = (1.0, 6.0), (11.0, 6.2)

pytestmark = pytest.mark.bench


def idle(n: int, seed: int) -> list[tuple[Point, float]]:
    """Idle robots in the middle of the hall, none in another."""
    chance, found = random.Random(seed), list[tuple[Point, float]]()
    while len(found) < n:
        at = (chance.uniform(4, 8), chance.uniform(1, 11))
        if all(math.dist(at, other) > 0.7 for other, _ in found):
            found.append((at, RADIUS + BERTH))
    return found


def everything(things: list[tuple[Point, float]]) -> None:
    """A graph of all points, all lines between them and all discs, and the shortest way in it."""
    around = [(at, size + RADIUS + MARGIN) for at, size in things]
    polygons = rims(np.asarray([at for at, _ in around]), np.asarray([reach for _, reach in around]))
    points = np.asarray([BEGIN, END, *polygons.reshape(-1, 2).tolist()])
    pairs = np.asarray(list(itertools.combinations(range(len(points)), 2)))
    lines = shapely.linestrings(points[pairs])
    clear = np.ones(len(pairs), dtype=bool)
    for at, reach in around:
        clear &= shapely.distance(lines, shapely.Point(at)) >= reach - 1e-6
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from((0, 1))
    for one, other in pairs[clear].tolist():
        graph.add_edge(one, other, weight=math.dist(points[one], points[other]))
    if nx.has_path(graph, 0, 1):
        nx.dijkstra_path(graph, 0, 1)


def test_paths_among_idle_robots(capsys: pytest.CaptureFixture[str]) -> None:
    """Prints, for 5, 15 and 25 idle robots, what a search costs."""
    paths = RoomPaths((Area(OUTLINE),))
    paths.path(BEGIN, END, RADIUS)
    begin = time.process_time()
    for _ in range(100):
        paths.path(BEGIN, END, RADIUS)
    lines = []
    empty = (time.process_time() - begin) / 100
    for n in (5, 15, 25):
        scenes = [idle(n, seed) for seed in range(8)]
        begin = time.process_time()
        for things in scenes:
            paths.path(BEGIN, END, RADIUS, things)
        search = (time.process_time() - begin) / len(scenes)
        begin = time.process_time()
        for things in scenes:
            everything(things)
        graph = (time.process_time() - begin) / len(scenes)
        lines.append(
            f"path among {n} idle robots: {1000 * search:.2f} ms, {search / empty:.0f} times an empty room; "
            f"a graph of everything takes {graph / search:.0f} times as long"
        )
    with capsys.disabled():
        sys.stdout.write("\n".join(["", *lines, ""]))
