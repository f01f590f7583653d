"""Corridors: the network of lanes led up to doors and past obstacles, and made of pieces that a robot fits into.

What to change is found by trying. `Ground.harm` says in square metres how far robots would drive into walls, rooms and
doorways (a corridor is two lanes, 1.3 m from rim to rim), and the network with the least harm is taken. Few drawings
leave so much space everywhere, so some harm has to be borne.
"""

import math
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from itertools import pairwise

import shapely
from shapely.ops import substring

from clo_fleet.bridges.drawings import Skipped
from clo_fleet.bridges.open_rmf.cells import mouth, rounded
from clo_fleet.bridges.open_rmf.lanes import SAME, Network, Way, crossings, dead_ends, named, split
from clo_fleet.world.model import Door, Point
from clo_fleet.world.outlines import length

__all__ = ["DOORWAY", "HALF_BAND", "SHORTEST_STUB", "SHORTEST_WAY", "Ground", "attached", "tidied"]

HALF_BAND = 0.65  # [m] from a corridor's middle to the rim of a robot in its lane: 0.35 + 0.3
DOORWAY = 1.2  # [m] of a door's corridor that are the doorway, where robots have bodies
SHORTEST_STUB = 1.4  # [m] from a door straight to its junction
STUBS = (SHORTEST_STUB, 1.8, 2.2, 2.6)  # [m] that are tried
THICKER = 0.2  # [m] on each side of walls, which are so thin that going through one would seem a small harm
LANE = 1.2  # [m] of lane that each way should have between its junctions: a robot and its gap
CUT = 1.2  # [m] of way that junctions may take, so that its first direction is that of this piece
LANE_WIDTH = 0.7  # [m]
JUNCTION = 0.2  # [m] of way that a junction takes in any case
SHARPEST = 0.2  # [rad] between ways; below, they lie over each other
SHORTEST_WAY = 1.2  # [m]
AT_JUNCTION = 0.6  # [m] nodes nearer to a door's junction become one with it
AT_NODE = 0.8  # [m] a spur that would meet a way this near to its end meets it at the end
SIGHT = 0.3  # [m] free on both sides of a line along which a spur may run
WALL_PRICE = 3.0  # walls count more than doorways and rooms, which are there only now and then
CROSSING = 5.0  # [m2] of harm that two corridors count for that cross without a junction
CRAMPED_PRICE = 2.0  # [m2] of harm that each metre of lane counts for that is missing
LENGTH_PRICE = 0.25  # [m2] of harm that each metre of corridor counts for
SPACIOUS = 3.0  # [m] longer ways are never done away with


@dataclass(frozen=True, slots=True)
class _Strip:
    """A piece of corridor on its own: its middle, what robots on it cover, and how far they drive into walls [m2]."""

    middle: shapely.LineString
    band: shapely.Polygon
    walled: float


@dataclass(frozen=True, slots=True)
class Ground:
    """Where corridors may run: the hub's floor less the rooms made in it and the mouths of doors.

    Attributes:
        hub: the hub's floor.
        rooms: the rooms made in it.
        doors: all doors onto corridors.
        wanted: nodes of the network from where doors will be reached later, although they may be dead ends now.
    """

    hub: shapely.Polygon
    rooms: tuple[shapely.Polygon, ...] = ()
    doors: Mapping[str, Door] = field(default_factory=dict)
    wanted: frozenset[str] = frozenset()
    _strips: dict[tuple[Point, ...], _Strip] = field(default_factory=dict)  # what is known by line; for speed alone

    def with_door(self, door: Door, room: shapely.Polygon | None = None) -> "Ground":
        """With one more door, perhaps that of a room made in the hub."""
        rooms = self.rooms if room is None else (*self.rooms, room)
        return Ground(self.hub, rooms, {**self.doors, door.id: door}, self.wanted, self._strips)

    def blocks(self) -> list[shapely.Polygon]:
        """The rooms made in the hub, and the mouths of all doors."""
        return [*self.rooms, *(mouth(door, 0.0, DOORWAY) for door in self.doors.values())]

    def harm(self, network: Network) -> float:
        """How bad the network is [m2]; what will not be used does no harm."""
        if len(network.doors) > 1:
            network = network.without(dead_ends(network, self.wanted))
        strips = [self._strip(_beyond_doorways(network, way)) for way in network.ways]
        crossed = crossings(network, [self._strip(network.line(way)).middle for way in network.ways])
        blocks = self.blocks()
        bands = [strip.band for strip in strips]
        band_of, block_of = (
            shapely.STRtree(blocks).query(bands, predicate="intersects") if blocks and bands else ((), ())
        )
        blocked = sum(bands[i].intersection(blocks[j]).area for i, j in zip(band_of, block_of, strict=True))
        driven = sum(strip.middle.length for strip in strips)
        harm = sum(strip.walled for strip in strips) + blocked + LENGTH_PRICE * driven + CROSSING * len(crossed)
        return float(harm + CRAMPED_PRICE * _cramped(straightened(network)))

    def clear(self, a: Point, b: Point) -> bool:
        """Whether a spur may run straight from one point to the other."""
        strip = shapely.LineString([a, b]).buffer(SIGHT, cap_style="flat")
        return bool(self.hub.covers(strip)) and not any(room.intersects(strip) for room in self.rooms)

    def _strip(self, line: tuple[Point, ...]) -> _Strip:
        if line not in self._strips:
            middle = shapely.LineString(line)
            band = middle.buffer(HALF_BAND, cap_style="flat", join_style="mitre")
            narrower = middle.buffer(HALF_BAND - THICKER, cap_style="flat", join_style="mitre")
            walled = narrower.difference(self.hub.buffer(-THICKER, join_style="mitre")).area
            through = 0.0 if self.hub.covers(middle) else CROSSING
            self._strips[line] = _Strip(middle, band, WALL_PRICE * walled + through)
        return self._strips[line]


def attached(
    network: Network, ground: Ground, door: Door, max_speed: float | None = None
) -> tuple[Network, float] | None:
    """The network led up to one more door, and its harm [m2]; ``None`` if no way leads there.

    The door gets a straight stub to a junction. Nodes and ways in front of the door move to that junction.

    Args:
        network: the network as it is.
        ground: the ground, which has the door already.
        door: the door.
        max_speed: on the way to the door [m/s].
    """
    tried = []
    for stub in STUBS:
        x, y = door.position
        junction = rounded((x + stub * math.cos(door.heading), y + stub * math.sin(door.heading)))
        candidate = _joined(network, ground, door, junction, max_speed)
        if candidate is not None:
            tried.append((ground.harm(candidate), stub, candidate))
    if not tried:
        return None
    harm, _, best = min(tried, key=lambda item: item[:2])
    return best, harm


def tidied(network: Network, ground: Ground) -> tuple[Network, tuple[Skipped, ...]]:
    """Without dead ends, without junctions where ways only bend, and without ways that are too short."""
    dead = dead_ends(network)
    skipped = tuple(Skipped("lane", f"{way.start}-{way.end}", "a dead end without a door") for way in dead)
    network = straightened(network.without(dead))
    while (better := _lengthened(network, ground)) is not None:
        network = straightened(better)
    return _smooth(network, ground), skipped


def straightened(network: Network, kept: Set[str] | None = None) -> Network:
    """Without nodes at which two ways just join, apart from those to be kept: by default the stubs of doors."""
    kept = network.stubs() if kept is None else kept
    meeting: dict[str, list[Way]] = {}
    for way in network.ways:
        for node in way.ends:
            meeting.setdefault(node, []).append(way)
    for node in network.nodes:
        if node in kept or node in network.doors or len(meeting.get(node, ())) != 2:
            continue
        pair = meeting[node]
        joined = _end_to_end(pair[0], pair[1], node, network.nodes[node])
        if joined is not None:
            network = Network(network.nodes, (*(w for w in network.ways if w not in pair), joined), network.doors)
            for end in joined.ends:
                meeting[end] = [way for way in meeting[end] if way not in pair] + [joined]
    return network.changed(network.nodes, network.ways)


def _beyond_doorways(network: Network, way: Way) -> tuple[Point, ...]:
    """The way's line without the doorways at its ends."""
    line = network.line(way)
    if not way.ends & network.doors:
        return line
    begin = DOORWAY if way.start in network.doors else 0.0
    end = length(line) - (DOORWAY if way.end in network.doors else 0.0)
    return tuple(substring(shapely.LineString(line), begin, max(end, begin + 0.01)).coords)


def _joined(network: Network, ground: Ground, door: Door, junction: Point, max_speed: float | None) -> Network | None:
    """The network with a stub to the door, and what is in front of the door moved to the stub's junction."""
    doorway, stubs = mouth(door, -0.1, DOORWAY, 0.2), network.stubs()
    in_front = {node for node, point in network.nodes.items() if doorway.covers(shapely.Point(point))}
    if in_front & (stubs | network.doors):
        return None
    near = {node for node, point in network.nodes.items() if math.dist(point, junction) < AT_JUNCTION}
    moving = in_front | (near - stubs - network.doors)
    name = next((node for node in network.nodes if node in moving and named(node)), f"{door.id}_front")
    moved = _moved(network, moving, name, junction)
    for way in moved.ways:
        line = shapely.LineString(moved.line(way))
        if name not in way.ends and (line.intersects(doorway) or line.distance(shapely.Point(junction)) < SAME):
            if way.ends & moved.doors:
                return None
            moved = split(moved, way, name, junction)
    reached = moved if name in moved.nodes else _with_spur(moved, ground, Way(name, "", max_speed=max_speed), junction)
    if reached is None:
        return None
    nodes = {**reached.nodes, door.id: door.position}
    return Network(nodes, (*reached.ways, Way(door.id, name, max_speed=max_speed)), reached.doors | {door.id})


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


def _with_spur(network: Network, ground: Ground, spur: Way, point: Point) -> Network | None:
    """With a straight way, whose end is still open, to the nearest node or way that can be seen from its start."""
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
            targets.append((math.dist(foot, point), f"{spur.start}_foot", way, foot))
    for _, node, target, place in sorted(targets, key=lambda item: item[:2]):
        if ground.clear(point, place):
            led = network if target is None else split(network, target, node, place)
            return led.changed({**led.nodes, spur.start: point}, (*led.ways, replace(spur, end=node)))
    return None


def _end_to_end(first: Way, second: Way, node: str, point: Point) -> Way | None:
    """Two ways that meet at a node as one, if they are alike and do not make a circle."""
    if first.one_way and first.start == node:
        first, second = second, first
    if not first.one_way:
        first = first if first.end == node else first.turned()
        second = second if second.start == node or second.one_way else second.turned()
    alike = (first.one_way, first.max_speed) == (second.one_way, second.max_speed)
    if not alike or first.end != node or second.start != node or first.start == second.end:
        return None
    return replace(first, end=second.end, via=(*first.via, point, *second.via))


def _cramped(network: Network) -> float:
    """How many metres of lane are missing: ways that part at an angle a take 0.7 m / tan(a / 2) of each other."""
    left = {way: length(network.line(way)) for way in network.ways}
    meeting: dict[str, list[tuple[float, Way]]] = {}
    for way in network.ways:
        line = network.line(way)
        for node, run in ((way.start, line), (way.end, line[::-1])):
            (x, y), (to_x, to_y) = run[0], _along(run, CUT)
            meeting.setdefault(node, []).append((math.atan2(to_y - y, to_x - x), way))
    for arms in meeting.values():
        arms.sort(key=lambda arm: arm[0])
        gaps = [(after[0] - arm[0]) % math.tau for arm, after in zip(arms, arms[1:] + arms[:1], strict=True)]
        for (_, way), gap_after, gap_before in zip(arms, gaps, gaps[-1:] + gaps[:-1], strict=True):
            gap = max(min(gap_after, gap_before), SHARPEST)
            left[way] -= JUNCTION + LANE_WIDTH / math.tan(gap / 2) if len(arms) > 1 and gap < math.pi else JUNCTION
    return sum(max(0.0, LANE - lane) for lane in left.values())


def _along(line: tuple[Point, ...], reach: float) -> Point:
    """The point of a line that far from its beginning, or its end."""
    for a, b in pairwise(line):
        piece = math.dist(a, b)
        if piece >= reach:
            return (a[0] + (b[0] - a[0]) * reach / piece, a[1] + (b[1] - a[1]) * reach / piece)
        reach -= piece
    return line[-1]


def _smooth(network: Network, ground: Ground) -> Network:
    """Without bends close to junctions, where ways cut each other's corners off anyway, as far as walls allow."""
    for way in network.ways:
        ends = [network.nodes[way.start], network.nodes[way.end]]
        of_doors = {0} if way.start in network.doors else set()
        of_doors |= {len(way.via) - 1} if way.end in network.doors else set()
        kept = (
            bend
            for number, bend in enumerate(way.via)
            if number in of_doors or all(math.dist(bend, end) > CUT for end in ends)
        )
        smooth = replace(way, via=tuple(kept))
        if ground.hub.covers(shapely.LineString(network.line(smooth))):
            network = network.changed(network.nodes, (smooth if old == way else old for old in network.ways))
    return network


def _lengthened(network: Network, ground: Ground) -> Network | None:
    """With fewer ways, one that is too short being spared; ``None`` if there is none that can be."""
    before = ground.harm(network)
    for way in sorted(network.ways, key=lambda way: (length(network.line(way)), way.start, way.end)):
        extent = length(network.line(way))
        if way.ends & network.doors or extent >= SPACIOUS:
            continue
        stubs = network.stubs()
        bent = [straightened(network, stubs - {node}) for node in sorted(way.ends & stubs)]
        merged = [_moved(network, way.ends - {node}, node, network.nodes[node]) for node in sorted(way.ends)]
        for tried in (bent, merged):
            best = min((other for other in tried if len(other.ways) < len(network.ways)), key=ground.harm, default=None)
            if best is not None and (tried is bent or extent < SHORTEST_WAY or ground.harm(best) < before):
                return best
    return None
