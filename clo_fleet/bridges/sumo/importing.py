"""From roads to a map: what robots can go and come back on, and rooms where it ends."""

import math
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import networkx as nx
import shapely

from clo_fleet.bridges.drawings import Names, Skipped, folded, slug
from clo_fleet.bridges.sumo.reading import RoadEdge, Roads, SumoError, read_roads
from clo_fleet.world.buildings import MAX_ROOMS, SMALLEST_ROOM
from clo_fleet.world.checks import MIN_CORRIDOR_LENGTH, map_findings
from clo_fleet.world.faults import Fault, did_you_mean, key_text, value_text
from clo_fleet.world.layout import MAX_SPEED, SPUR, Layout
from clo_fleet.world.model import BuildingMap, Point
from clo_fleet.world.outlines import length

__all__ = ["ImportedNetwork", "import_network"]

ROOM = 5.0  # [m]
SPURS = (SPUR, 5.0, 7.0)  # [m] that are tried
TURNS = (0.0, 0.5, -0.5, 1.0, -1.0)  # [rad] off straight on that are tried at dead ends
HALF_BAND = 0.65  # [m] beside a corridor's centre line: half of two lanes, less what a robot is narrower
GAP = 0.3  # [m] round rooms
CROSSING = 1.5  # [m] of a spur at its node, where corridors are anyway
FAR = 1e5  # [m] from the origin: coordinates beyond it are moved
SAME = 0.5  # [m] a bend this near to its end is the end
NAME = 24  # characters of a node's name; corridors are named after two


@dataclass(frozen=True, slots=True)
class ImportedNetwork:
    """A network as a map, without a SUMO network of its own yet.

    Attributes:
        building: the map.
        skipped: what of the files is missing from it, or different.
    """

    building: BuildingMap
    skipped: tuple[Skipped, ...]


@dataclass(frozen=True, slots=True)
class _Road:
    """A corridor to be."""

    start: str
    end: str
    via: tuple[Point, ...]
    speed: float
    one_way: bool = False
    single_lane: bool = False


def import_network(path: Path, *, rooms: Collection[str] = (), room_size: float = ROOM) -> ImportedNetwork:
    """The map of a SUMO network, in its coordinates (moved to the origin if they are far from it) [m].

    Args:
        path: a ``.net.xml``, ``.net.xml.gz``, ``.nod.xml`` or ``.edg.xml`` file.
        rooms: ids of nodes that get a room besides the dead ends.
        room_size: width and depth of rooms [m]; smaller ones are made where they do not fit.

    Raises:
        SumoError: if the files are faulty, or no map can be made of them.
    """
    roads = read_roads(path)

    def refuse(key: str, value: str, expected: str) -> SumoError:
        return SumoError([Fault(file=path, line=1, column=1, key=key, value=value, expected=expected)])

    for name in rooms:
        if name not in roads.nodes:
            raise refuse("room", value_text(name), f"the id of a node{did_you_mean(name, roads.nodes)}")
    if not SMALLEST_ROOM <= room_size <= 100.0:
        raise refuse("room size", f"{room_size:g} m", f"{SMALLEST_ROOM:g} m to 100 m")
    draft = _Draft(roads)
    draft.lay_out(path.name.partition(".")[0])
    draft.add_rooms(frozenset(rooms), room_size)
    building = draft.layout.building()
    if len(building.rooms) < 2:
        raise refuse("(the file)", f"{len(building.rooms)} rooms", "at least two dead ends, or nodes named as rooms")
    if findings := map_findings(building):
        raise SumoError(
            Fault(file=path, line=1, column=1, key=key_text(f.key), value=f.value or "the network", expected=f.expected)
            for f in findings
        )
    return ImportedNetwork(building, folded((*roads.skipped, *draft.skipped)))


@dataclass(slots=True)
class _Draft:
    """A map in the making."""

    source: Roads
    skipped: list[Skipped] = field(default_factory=list)
    layout: Layout = field(default_factory=lambda: Layout(""))
    points: dict[str, Point] = field(default_factory=dict)  # of nodes
    called: dict[str, str] = field(default_factory=dict)  # nodes' names in the map
    stands_for: dict[str, str] = field(default_factory=dict)  # of each node the node that it became one with
    roads: list[_Road] = field(default_factory=list)

    def lay_out(self, name: str) -> None:
        """Draw junctions and corridors."""
        self.layout = Layout(name)
        edges = self._merged(self._near_origin())
        self.roads = self._round_trips(list(_paired(edges)))
        names = Names()
        for node in dict.fromkeys(node for road in self.roads for node in (road.start, road.end)):
            self.called[node] = names.new(slug(node)[:NAME] or "node")
            self.layout.node(self.called[node], self.points[node])
        for road in self.roads:
            self.layout.hall(
                self.called[road.start],
                self.called[road.end],
                via=road.via,
                max_speed=min(road.speed, MAX_SPEED),
                one_way=road.one_way,
                single_lane=road.single_lane,
            )
        fast = sum(road.speed > MAX_SPEED for road in self.roads)
        if fast:
            self.skipped.append(Skipped("speed limit", "of corridors", f"{MAX_SPEED:g} m/s at most", fast))

    def add_rooms(self, named: frozenset[str], size: float) -> None:
        """Hang a room at each dead end and at each named node."""
        around: dict[str, list[float]] = defaultdict(list)  # the directions of the corridors at each node [rad]
        lines = []
        for road in self.roads:
            line = (self.points[road.start], *road.via, self.points[road.end])
            around[road.start].append(math.atan2(line[1][1] - line[0][1], line[1][0] - line[0][0]))
            around[road.end].append(math.atan2(line[-2][1] - line[-1][1], line[-2][0] - line[-1][0]))
            lines.append(shapely.LineString(line).buffer(HALF_BAND, cap_style="flat"))
        corridors = shapely.STRtree(lines)
        taken: list[shapely.Polygon] = []
        wanted = {self.stands_for.get(node, node) for node in named}
        for lost in sorted(wanted - around.keys()):
            self.skipped.append(Skipped("room", lost, "robots do not get there and back"))
        for node, directions in around.items():
            if len(directions) > 1 and node not in wanted:
                continue
            if len(taken) >= MAX_ROOMS:
                self.skipped.append(Skipped("room", node, f"a map has {MAX_ROOMS} rooms at most"))
                continue
            for heading, spur, side in _choices(directions, size):
                probe = _probe(self.points[node], heading, spur, side)
                if (
                    not len(corridors.query(probe, predicate="intersects"))
                    and not shapely.intersects(probe, taken).any()
                ):
                    taken.append(probe)
                    room = f"room-{self.called[node]}"
                    self.layout.hang(room, self.called[node], heading, (side, side), spur=spur)
                    break
            else:
                self.skipped.append(Skipped("room", node, "there is no space for it"))

    def _near_origin(self) -> list[RoadEdge]:
        """The edges, and ``points``, moved to the origin if they are far from it."""
        self.points = dict(self.source.nodes)
        values = [abs(value) for point in self.points.values() for value in point]
        if max(values, default=0.0) <= FAR:
            return list(self.source.edges)
        dx, dy = (float(math.floor(min(point[axis] for point in self.points.values()))) for axis in (0, 1))
        self.skipped.append(Skipped("offset", f"{dx:g},{dy:g}", "taken off all coordinates"))
        self.points = {name: (x - dx, y - dy) for name, (x, y) in self.points.items()}
        return [
            RoadEdge(
                id=edge.id,
                start=edge.start,
                end=edge.end,
                via=tuple((x - dx, y - dy) for x, y in edge.via),
                speed=edge.speed,
                bidi=edge.bidi,
            )
            for edge in self.source.edges
        ]

    def _merged(self, edges: list[RoadEdge]) -> list[RoadEdge]:
        """The edges without those too short for a robot: their two nodes become one."""
        same: nx.Graph[str] = nx.Graph()
        short = {edge.id for edge in edges if self._length(edge) < MIN_CORRIDOR_LENGTH}
        same.add_edges_from((edge.start, edge.end) for edge in edges if edge.id in short)
        for part in nx.connected_components(same):
            first = min(part, key=list(self.points).index)
            self.stands_for |= dict.fromkeys(part, first)
        found = []
        for edge in edges:
            start, end = (self.stands_for.get(node, node) for node in (edge.start, edge.end))
            if edge.id in short:
                self.skipped.append(Skipped("edge", edge.id, f"under {MIN_CORRIDOR_LENGTH} m; its nodes are one now"))
                continue
            if start == end:
                self.skipped.append(Skipped("edge", edge.id, "it ends where it begins"))
                continue
            ends = [self.points[node] for node in (edge.start, edge.end, start, end)]
            via = [bend for bend in edge.via if all(math.dist(bend, at) > SAME for at in ends)]
            via = [bend for bend, before in zip(via, (ends[0], *via), strict=False) if bend != before]
            found.append(RoadEdge(id=edge.id, start=start, end=end, via=tuple(via), speed=edge.speed, bidi=edge.bidi))
        return found

    def _round_trips(self, roads: list[_Road]) -> list[_Road]:
        """The roads of the largest part of the network in which one gets from every node to every other."""
        graph: nx.DiGraph[str] = nx.DiGraph()
        for road in roads:
            graph.add_edge(road.start, road.end)
            if not road.one_way:
                graph.add_edge(road.end, road.start)
        parts = list(nx.strongly_connected_components(graph))
        largest = max(parts, key=lambda part: (len(part), min(part)), default=set())
        kept = [road for road in roads if {road.start, road.end} <= largest]
        for road in roads:
            if road not in kept:
                name = f"{road.start} to {road.end}"
                self.skipped.append(Skipped("road", name, "robots do not get there and back"))
        return kept

    def _length(self, edge: RoadEdge) -> float:
        return length((self.points[edge.start], *edge.via, self.points[edge.end]))


def _paired(edges: list[RoadEdge]) -> Iterator[_Road]:
    """One road for each pair of edges there and back, and for each edge without another back."""
    back: dict[tuple[str, str], list[RoadEdge]] = defaultdict(list)
    for edge in edges:
        back[edge.start, edge.end].append(edge)
    used: set[str] = set()
    for edge in edges:
        if edge.id in used:
            continue
        opposite = [other for other in back[edge.end, edge.start] if other.id not in used]
        partner = min(opposite, key=lambda other: other.id.lstrip("-") != edge.id.lstrip("-"), default=None)
        used |= {edge.id} | ({partner.id} if partner else set())
        single = partner is not None and edge.bidi and partner.bidi
        yield _Road(edge.start, edge.end, edge.via, edge.speed, one_way=partner is None, single_lane=single)


def _choices(directions: list[float], size: float) -> Iterator[tuple[float, float, float]]:
    """Headings, lengths of spurs and sizes of rooms to try at a node, the best first."""
    if len(directions) == 1:
        headings = [directions[0] + math.pi + turn for turn in TURNS]
    else:
        turns = sorted(direction % math.tau for direction in directions)
        gaps = [(after - turn, turn) for turn, after in zip(turns, (*turns[1:], turns[0] + math.tau), strict=True)]
        headings = [turn + gap / 2 for gap, turn in sorted(gaps, reverse=True) if gap > 1.5]
    for side in dict.fromkeys((size, max(SMALLEST_ROOM, 0.8 * size), SMALLEST_ROOM)):
        for spur in SPURS:
            for heading in headings:
                yield heading, spur, side


def _probe(node: Point, heading: float, spur: float, side: float) -> shapely.Polygon:
    """The floor that a room and its spur need."""
    cos, sin = math.cos(heading), math.sin(heading)

    def at(out: float, aside: float) -> Point:
        return (node[0] + out * cos - aside * sin, node[1] + out * sin + aside * cos)

    half = side / 2
    room = shapely.Polygon([at(spur, -half), at(spur + side, -half), at(spur + side, half), at(spur, half)])
    way = shapely.LineString([at(CROSSING, 0.0), at(spur, 0.0)]).buffer(HALF_BAND, cap_style="flat")
    return shapely.union(room.buffer(GAP, join_style="mitre"), way)
