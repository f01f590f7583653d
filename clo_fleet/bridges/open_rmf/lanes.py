"""The lanes over the hub's floor as a network: nodes, and ways between them. A `Network` is a value."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import shapely

from clo_fleet.bridges.drawings import Skipped
from clo_fleet.bridges.open_rmf.cells import rounded
from clo_fleet.bridges.open_rmf.reading import Level, Span
from clo_fleet.world.model import Point

__all__ = ["SAME", "Network", "Way", "crossings", "dead_ends", "hub_network", "named", "split", "without_leaf"]

SAME = 0.25  # [m] vertices nearer to each other are one, and a vertex nearer to a lane is on it


@dataclass(frozen=True, slots=True)
class Way:
    """A corridor in the making, from one node to another."""

    start: str
    end: str
    via: tuple[Point, ...] = ()
    one_way: bool = False
    max_speed: float | None = None

    @property
    def ends(self) -> frozenset[str]:
        """Both nodes."""
        return frozenset((self.start, self.end))

    def other(self, node: str) -> str:
        """The end that is not ``node``."""
        return self.end if node == self.start else self.start

    def turned(self) -> "Way":
        """The same line, begun at the other end; only for ways that lead both ways."""
        return replace(self, start=self.end, end=self.start, via=self.via[::-1])


@dataclass(frozen=True, slots=True)
class Network:
    """Where the nodes are [m], the ways between them, and which nodes are doors."""

    nodes: Mapping[str, Point]
    ways: tuple[Way, ...]
    doors: frozenset[str] = frozenset()

    def line(self, way: Way) -> tuple[Point, ...]:
        """The way's centre line [m]."""
        return (self.nodes[way.start], *way.via, self.nodes[way.end])

    def at(self, node: str) -> tuple[Way, ...]:
        """The ways that begin or end at the node."""
        return tuple(way for way in self.ways if node in way.ends)

    def stubs(self) -> frozenset[str]:
        """The first nodes behind doors."""
        return frozenset(way.other(door) for way in self.ways for door in way.ends & self.doors)

    def without(self, ways: Iterable[Way]) -> "Network":
        """Less some ways."""
        gone = frozenset(ways)
        return self.changed(self.nodes, (way for way in self.ways if way not in gone)) if gone else self

    def changed(self, nodes: Mapping[str, Point], ways: Iterable[Way]) -> "Network":
        """With other nodes and ways, less circles, doubles, and nodes that nothing leads to."""
        kept = _single(ways)
        used = {node for way in kept for node in way.ends}
        return Network({name: point for name, point in nodes.items() if name in used}, kept, self.doors)


def hub_network(level: Level, hub: shapely.Polygon) -> tuple[Network, dict[int, str], tuple[Skipped, ...]]:
    """The lanes over the hub's floor: the network, its node of each vertex that it has, and what it leaves out."""
    skipped: list[Skipped] = []
    node_of, nodes = _merged(level, hub)
    ways: list[Way] = []
    for lane in level.lanes:
        name = f"{level.vertices[lane.start].id}-{level.vertices[lane.end].id}"
        shared = shapely.LineString(level.line(lane)).intersection(hub)
        pieces = [part for part in shapely.get_parts(shared) if part.geom_type == "LineString" and part.length > SAME]
        if not pieces:
            skipped.append(Skipped("lane", name, "not in the hub; in rooms robots find their own way"))
        elif len(pieces) > 1:
            skipped.append(Skipped("lane", name, "it runs through a wall, and is cut there"))
        for piece in pieces:
            start, end = (_end(level, lane, point, node_of, nodes) for point in (piece.coords[0], piece.coords[-1]))
            ways.append(Way(start, end, one_way=lane.one_way, max_speed=lane.max_speed))
    network = _planar(Network({}, ()).changed(nodes, ways))
    parts = sorted(_parts(network), key=lambda part: -sum(math.dist(*network.line(way)) for way in part))
    skipped += [
        Skipped("lane", f"{way.start}-{way.end}", "most other lanes cannot be reached from it")
        for part in parts[1:]
        for way in part
    ]
    kept = network.changed(network.nodes, parts[0] if parts else ())
    return kept, {index: node for index, node in node_of.items() if node in kept.nodes}, tuple(skipped)


def without_leaf(network: Network, node: str) -> Network:
    """Without the node if it is a dead end, and its way not the only one."""
    ways = network.at(node)
    if len(ways) != 1 or len(network.ways) == 1:
        return network
    return network.without(ways)


def dead_ends(network: Network, wanted: Set[str] = frozenset()) -> tuple[Way, ...]:
    """The ways that lead to no door and no wanted node."""
    live = dict.fromkeys(network.ways)
    while True:
        count = Counter(node for way in live for node in way.ends)
        dead = [way for way in live if any(count[n] == 1 and n not in network.doors | wanted for n in way.ends)]
        if not dead:
            return tuple(way for way in network.ways if way not in live)
        for way in dead:
            del live[way]


def named(node: str) -> bool:
    """Whether the drawing has a name for the node."""
    return re.fullmatch(r"(v|cut|crossing_)[0-9_]*", node) is None


def split(network: Network, way: Way, node: str, point: Point) -> Network:
    """With a straight way led over a node, new or old."""
    pieces = (replace(way, end=node), replace(way, start=node))
    ways = [piece for old in network.ways for piece in (pieces if old == way else (old,))]
    return network.changed({**network.nodes, node: point}, ways)


def crossings(network: Network, lines: Sequence[shapely.LineString]) -> list[tuple[Way, Way]]:
    """The pairs of ways that cross without a common node; ``lines`` are those of the ways, one each."""
    pairs = shapely.STRtree(lines).query(lines, predicate="intersects").T if lines else ()
    found = sorted((int(a), int(b)) for a, b in pairs if a < b)
    ways = network.ways
    return [(ways[a], ways[b]) for a, b in found if not ways[a].ends & ways[b].ends]


def _merged(level: Level, hub: shapely.Polygon) -> tuple[dict[int, str], dict[str, Point]]:
    """The node of every vertex of a lane in the hub, and where the nodes are; near ones become one."""
    node_of: dict[int, str] = {}
    nodes: dict[str, Point] = {}
    for index in sorted({index for lane in level.lanes for index in (lane.start, lane.end)}):
        vertex = level.vertices[index]
        if not hub.covers(shapely.Point(vertex.point)):
            continue
        near = (name for name, point in nodes.items() if math.dist(point, vertex.point) < SAME)
        same = next((name for name in near if hub.covers(shapely.LineString([nodes[name], vertex.point]))), None)
        node_of[index] = same or _new(vertex.id, nodes)
        nodes.setdefault(node_of[index], rounded(vertex.point))
    return node_of, nodes


def _new(wish: str, nodes: Mapping[str, Point]) -> str:
    number, name = 1, wish
    while name in nodes:
        number += 1
        name = f"{wish}_{number}"
    return name


def _end(level: Level, lane: Span, point: Point, node_of: Mapping[int, str], nodes: dict[str, Point]) -> str:
    """The node at the end of a piece of lane: a vertex's, or a new one where a wall or a door cuts the lane."""
    for index in (lane.start, lane.end):
        if index in node_of and math.dist(level.vertices[index].point, point) < 1e-6:
            return node_of[index]
    name = _new("cut", nodes)
    nodes[name] = rounded(point)
    return name


def _single(ways: Iterable[Way]) -> tuple[Way, ...]:
    """The ways without circles and doubles; two that lead in opposite directions become one that leads both ways."""
    kept: dict[tuple[str, str, tuple[Point, ...]], Way] = {}
    for way in ways:
        key, back = (way.start, way.end, way.via), (way.end, way.start, way.via[::-1])
        if way.start == way.end:
            continue
        if back in kept:
            kept[back] = replace(kept[back], one_way=False)
        elif key not in kept or not way.one_way:
            kept[key] = way
    return tuple(kept.values())


def _planar(network: Network) -> Network:
    """With a node wherever lanes cross or a node lies on a lane: whoever drew them saw a junction there."""
    for node, point in network.nodes.items():
        for way in network.ways:
            near = shapely.LineString(network.line(way)).distance(shapely.Point(point)) < SAME
            if near and node not in way.ends:
                network = split(network, way, node, point)
    number = 0
    while found := crossings(network, [shapely.LineString(network.line(way)) for way in network.ways]):
        number += 1
        a, b = found[0]
        one, other = (shapely.LineString(network.line(way)) for way in found[0])
        point = rounded(one.intersection(other).centroid.coords[0])
        name = _new(f"crossing_{number}", network.nodes)
        network = split(split(network, a, name, point), b, name, point)
    return network


def _parts(network: Network) -> list[list[Way]]:
    """The ways of each connected part of the network."""
    parts: list[list[Way]] = []
    left = dict.fromkeys(network.ways)
    while left:
        part = [next(iter(left))]
        reached = set(part[0].ends)
        del left[part[0]]
        while more := [way for way in left if way.ends & reached]:
            for way in more:
                del left[way]
                reached |= way.ends
            part += more
        parts.append(part)
    return parts
