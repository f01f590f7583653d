"""Corridors: the network of lanes led up to doors and past obstacles, and made of pieces that a robot fits into.

What to change is found by trying. `Ground.harm` says in square metres how far robots would drive into walls, rooms and
doorways (a corridor is two lanes, 1.3 m from rim to rim), and the network with the least harm is taken. Few drawings
leave so much space everywhere, so some harm has to be borne.
"""

import math
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field, replace

import shapely
from shapely.ops import substring

from clo_fleet.bridges.open_rmf.cells import mouth, rounded
from clo_fleet.bridges.open_rmf.lanes import SAME, Network, Way, crossings, split
from clo_fleet.bridges.open_rmf.reading import Skipped
from clo_fleet.world.model import Door, Point
from clo_fleet.world.outlines import length

__all__ = ["DOORWAY", "HALF_BAND", "Ground", "attached", "tidied"]

HALF_BAND = 0.65  # [m] from a corridor's middle to the rim of a robot in its lane: 0.35 + 0.3
DOORWAY = 1.2  # [m] of a door's corridor that are the doorway, where robots have bodies
STUBS = (1.4, 1.8, 2.2)  # [m] from a door straight to its junction
SPACIOUS = 2.2  # [m] of way: its junctions take up to 1 m of it, and a robot with its gap needs 1.1 m
SHORTEST = 1.2  # [m] of any way
AT_JUNCTION = 0.6  # [m] nodes nearer to a door's junction become one with it
AT_NODE = 0.8  # [m] a spur that would meet a way this near to its end meets it at the end
SIGHT = 0.3  # [m] free on both sides of a line along which a spur may run
CROSSING = 5.0  # [m2] of harm that two corridors count for that cross without a junction
STUB_PRICE = 0.3  # [m2] of harm that each metre counts for that a stub is shorter than spacious
LENGTH_PRICE = 0.02  # [m2] of harm that each metre of corridor counts for
LITTLE = 0.15  # [m2] of harm that a spacious way is worth


@dataclass(frozen=True, slots=True)
class Ground:
    """Where corridors may run: the hub's floor less the rooms made in it and the mouths of doors."""

    hub: shapely.Polygon
    rooms: tuple[shapely.Polygon, ...] = ()
    doors: Mapping[str, Door] = field(default_factory=dict)
    _in_walls: dict[tuple[Point, ...], float] = field(default_factory=dict)  # by line [m2]; for speed alone

    def with_door(self, door: Door, room: shapely.Polygon | None = None) -> "Ground":
        """With one more door, perhaps that of a room made in the hub."""
        rooms = self.rooms if room is None else (*self.rooms, room)
        return Ground(self.hub, rooms, {**self.doors, door.id: door}, self._in_walls)

    def blocks(self) -> list[shapely.Polygon]:
        """The rooms made in the hub, and the mouths of all doors."""
        return [*self.rooms, *(mouth(door, 0.0, DOORWAY) for door in self.doors.values())]

    def harm(self, network: Network) -> float:
        """How bad the network is [m2]."""
        lines = [_beyond_doorways(network, way) for way in network.ways]
        bands = [shapely.LineString(line).buffer(HALF_BAND, cap_style="flat", join_style="mitre") for line in lines]
        for line, band in zip(lines, bands, strict=True):
            if line not in self._in_walls:
                self._in_walls[line] = band.difference(self.hub).area
        blocks = self.blocks()
        band_of, block_of = shapely.STRtree(blocks).query(bands, predicate="intersects") if blocks else ((), ())
        blocked = sum(bands[i].intersection(blocks[j]).area for i, j in zip(band_of, block_of, strict=True))
        driven = sum(map(length, lines))
        in_walls = sum(self._in_walls[line] for line in lines)
        return float(in_walls + blocked + LENGTH_PRICE * driven + CROSSING * len(crossings(network)))

    def clear(self, a: Point, b: Point) -> bool:
        """Whether a spur may run straight from one point to the other."""
        strip = shapely.LineString([a, b]).buffer(SIGHT, cap_style="flat")
        return bool(self.hub.covers(strip)) and not any(room.intersects(strip) for room in self.rooms)


def attached(network: Network, ground: Ground, door: Door) -> tuple[Network, float] | None:
    """The network led up to one more door, and its harm [m2]; ``None`` if no way leads there.

    The door gets a straight stub to a junction. Nodes and ways in front of the door move to that junction.

    Args:
        network: the network as it is.
        ground: the ground, which has the door already.
        door: the door.
    """
    tried = []
    for stub in STUBS:
        x, y = door.position
        junction = rounded((x + stub * math.cos(door.heading), y + stub * math.sin(door.heading)))
        candidate = _joined(network, ground, door, junction)
        if candidate is not None:
            tried.append((ground.harm(candidate) + STUB_PRICE * (SPACIOUS - stub), stub, candidate))
    if not tried:
        return None
    harm, _, best = min(tried, key=lambda item: item[:2])
    return best, harm


def tidied(network: Network, ground: Ground) -> tuple[Network, tuple[Skipped, ...]]:
    """Without dead ends, without junctions where ways only bend, and without ways that are too short."""
    skipped = []
    while dead := [way for way in network.ways if any(_dead_end(network, node) for node in way.ends)]:
        skipped += [Skipped("lane", f"{way.start}-{way.end}", "a dead end without a door") for way in dead]
        network = network.changed(network.nodes, (way for way in network.ways if way not in dead))
    network = _straightened(network, network.stubs())
    while (better := _lengthened(network, ground)) is not None:
        network = _straightened(better, better.stubs())
    return network, tuple(skipped)


def _beyond_doorways(network: Network, way: Way) -> tuple[Point, ...]:
    """The way's line without the doorways at its ends."""
    line = network.line(way)
    begin = DOORWAY if way.start in network.doors else 0.0
    end = length(line) - (DOORWAY if way.end in network.doors else 0.0)
    return tuple(substring(shapely.LineString(line), begin, max(end, begin + 0.01)).coords) if way.ends & network.doors else line


def _joined(network: Network, ground: Ground, door: Door, junction: Point) -> Network | None:
    """The network with a stub to the door, and what is in front of the door moved to the stub's junction."""
    name, doorway = f"{door.id}_front", mouth(door, -0.1, DOORWAY, 0.2)
    stubs = network.stubs()
    in_front = {node for node, point in network.nodes.items() if doorway.covers(shapely.Point(point))}
    if in_front & (stubs | network.doors):
        return None
    near = {node for node, point in network.nodes.items() if math.dist(point, junction) < AT_JUNCTION}
    moved = _moved(network, in_front | (near - stubs - network.doors), name, junction)
    for way in moved.ways:
        line = shapely.LineString(moved.line(way))
        if name not in way.ends and (line.intersects(doorway) or line.distance(shapely.Point(junction)) < SAME):
            if way.ends & moved.doors:
                return None
            moved = split(moved, replace(way, via=()), name, junction)
    reached = moved if name in moved.nodes else _with_spur(moved, ground, name, junction)
    if reached is None:
        return None
    nodes = {**reached.nodes, door.id: door.position}
    return Network(nodes, (*reached.ways, Way(door.id, name)), reached.doors | {door.id})


def _moved(network: Network, nodes: Set[str], to: str, point: Point) -> Network:
    """With several nodes become one. The ways of doors keep the old points as bends: they begin straight."""

    def ways() -> Iterator[Way]:
        for way in network.ways:
            start, end, via = way.start, way.end, way.via
            if start in nodes:
                start, via = to, ((network.nodes[way.start],) if way.end in network.doors else ()) + via
            if end in nodes:
                end, via = to, via + ((network.nodes[way.end],) if way.start in network.doors else ())
            yield replace(way, start=start, end=end, via=via)

    return network.changed({**network.nodes, to: point}, ways())


def _with_spur(network: Network, ground: Ground, name: str, point: Point) -> Network | None:
    """With a straight way from a new node to the nearest node or way that can be seen from it."""
    targets: list[tuple[float, str, Way | None, Point]] = [
        (math.dist(place, point), node, None, place)
        for node, place in network.nodes.items()
        if node not in network.doors
    ]
    for way in network.ways:
        line = shapely.LineString(network.line(way))
        along = line.project(shapely.Point(point))
        if not way.ends & network.doors and not way.via and AT_NODE < along < line.length - AT_NODE:
            foot = rounded(line.interpolate(along).coords[0])
            targets.append((math.dist(foot, point), f"{name}_foot", way, foot))
    for _, node, target, place in sorted(targets, key=lambda item: item[:2]):
        if ground.clear(point, place):
            led = network if target is None else split(network, target, node, place)
            return led.changed({**led.nodes, name: point}, (*led.ways, Way(name, node)))
    return None


def _dead_end(network: Network, node: str) -> bool:
    return node not in network.doors and len(network.at(node)) == 1


def _straightened(network: Network, kept: Set[str]) -> Network:
    """Without nodes at which two ways just join, apart from those to be kept."""
    for node in network.nodes:
        ways = network.at(node)
        if node in kept | network.doors or len(ways) != 2:
            continue
        first = ways[0] if ways[0].end == node or ways[0].one_way else ways[0].turned()
        second = ways[1] if ways[1].start == node or ways[1].one_way else ways[1].turned()
        if first.start == node:  # a one-way street that begins here
            first, second = second if second.end == node else second.turned(), first
        alike = (first.one_way, first.max_speed) == (second.one_way, second.max_speed)
        if alike and first.end == node == second.start and first.start != second.end:
            joined = replace(first, end=second.end, via=(*first.via, network.nodes[node], *second.via))
            network = network.changed(network.nodes, (*(way for way in network.ways if way not in ways), joined))
    return network


def _lengthened(network: Network, ground: Ground) -> Network | None:
    """With one way less that is too short, if there is one that can be spared."""
    before = ground.harm(network)
    short = [(length(network.line(way)), way.start, way.end, way) for way in network.ways]
    for extent, _, _, way in sorted(entry[:3] + (entry[3],) for entry in short if entry[0] < SPACIOUS):
        if way.ends & network.doors:
            continue
        for node in sorted(way.ends & network.stubs()):
            if len(network.at(node)) == 2:
                return _straightened(network, network.stubs() - {node})
        tried = [_moved(network, way.ends - {node}, node, network.nodes[node]) for node in sorted(way.ends)]
        best = min(tried, key=ground.harm)
        if extent < SHORTEST or ground.harm(best) < before + LITTLE:
            return best
    return None
