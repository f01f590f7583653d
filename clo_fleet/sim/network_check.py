"""Whether a SUMO network is the one of a building's corridors: it comes from a file, and files come from strangers."""

import gzip
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import dist, isfinite
from pathlib import Path
from xml.etree import ElementTree as ET

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.network import MOUTH, SHORTEST_LANE, Edge, line_length, network_edges, network_nodes, network_turns
from clo_fleet.world.model import BuildingMap, Point

__all__ = ["check_network"]

LARGEST_NETWORK = 1 << 28  # bytes unpacked; a file beyond it is not one of ours
NODE_TOLERANCE = 0.01  # [m]
SPEED_TOLERANCE = 0.01  # [m/s]
LENGTH_TOLERANCE = (0.01, 0.6)  # as a fraction of the length, and [m]
SHAPE_TOLERANCE = 1.0  # [m] from a lane to its centre line: half a lane, and what it swings out in a sharp bend


@dataclass(frozen=True, slots=True)
class _Lane:
    """One lane, as a network file has it."""

    start: str
    end: str
    length: float
    speed: float
    shape: tuple[Point, ...]
    opposite: str = ""


@dataclass(frozen=True, slots=True)
class _Network:
    """What a network file says: where its nodes are, its lanes by edge, and the turns from edge to edge."""

    nodes: dict[str, Point]
    lanes: dict[str, tuple[_Lane, ...]]
    turns: frozenset[tuple[str, str]]


class _UnreadableError(CloFleetError):
    """A network file cannot be read; says why."""


def check_network(building: BuildingMap, path: Path) -> tuple[str, ...]:
    """What in the network file does not fit the map, one sentence each; nothing if the network is the map's."""
    try:
        network = _read(path)
    except _UnreadableError as error:
        return (str(error),)
    edges = {e.id: e for e in network_edges(building)}
    nodes = network_nodes(building)
    used = {n for e in edges.values() for n in (e.start, e.end)}
    return tuple(
        [f"edge {e!r} is missing" for e in edges if e not in network.lanes]
        + [f"edge {e!r} is no corridor of the map" for e in sorted(set(network.lanes) - set(edges))]
        + [
            f"node {n!r} is not at {nodes[n]} m"
            for n in sorted(used & set(nodes) & set(network.nodes))
            if dist(nodes[n], network.nodes[n]) > NODE_TOLERANCE
        ]
        + [f for e in edges.values() for f in _lane_faults(e, network.lanes.get(e.id))]
        + [
            f"the turn from {a!r} to {b!r} is missing"
            for a, b in network_turns(building, tuple(edges.values()))
            if a in network.lanes and b in network.lanes and (a, b) not in network.turns
        ]
    )


def _read(path: Path) -> _Network:
    """The network in a file, packed or plain.

    Raises:
        _UnreadableError: if there is none.
    """
    try:
        with path.open("rb") as file:
            packed = file.read(2) == b"\x1f\x8b"
        with gzip.open(path) if packed else path.open("rb") as file:
            text = file.read(LARGEST_NETWORK + 1).decode()
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise _UnreadableError(f"{path.name} cannot be read: {error}") from error
    if len(text) > LARGEST_NETWORK or "<!DOCTYPE" in text:  # a bomb, or entities; neither is a network
        raise _UnreadableError(f"{path.name} is no SUMO network")
    try:
        root = ET.fromstring(text)
        if root.tag != "net" or "version" not in root.attrib:
            raise _UnreadableError(f"{path.name} is no SUMO network")
        edges = [e for e in root.iterfind("edge") if e.get("function") != "internal"]
        return _Network(
            nodes={
                j.attrib["id"]: (float(j.attrib["x"]), float(j.attrib["y"]))
                for j in root.iterfind("junction")
                if j.get("type") != "internal"
            },
            lanes={e.attrib["id"]: tuple(_lane(e, lane) for lane in e.iterfind("lane")) for e in edges},
            turns=frozenset((c.attrib["from"], c.attrib["to"]) for c in root.iterfind("connection")),
        )
    except (ET.ParseError, KeyError, ValueError) as error:
        raise _UnreadableError(f"{path.name} is no SUMO network: {error}") from error


def _lane(edge: ET.Element, lane: ET.Element) -> _Lane:
    points = [point.split(",") for point in lane.attrib["shape"].split()]
    numbers = [float(lane.attrib["length"]), float(lane.attrib["speed"]), *(float(n) for p in points for n in p)]
    if len(points) < 2 or {len(p) for p in points} - {2, 3} or not all(map(isfinite, numbers)):
        raise ValueError(f"lane {lane.get('id')!r} has no proper shape, length or speed")
    shape = tuple((float(p[0]), float(p[1])) for p in points)
    return _Lane(edge.attrib["from"], edge.attrib["to"], numbers[0], numbers[1], shape, edge.get("bidi", ""))


def _lane_faults(edge: Edge, lanes: tuple[_Lane, ...] | None) -> Iterator[str]:
    """How the network's lanes of an edge differ from the map's."""
    if lanes is None:
        return
    if len(lanes) != 1:
        yield f"edge {edge.id!r} has {len(lanes)} lanes instead of 1"
        return
    (lane,) = lanes
    if (lane.start, lane.end) != (edge.start, edge.end):
        yield f"edge {edge.id!r} leads from {lane.start!r} to {lane.end!r} instead of {edge.start!r} to {edge.end!r}"
    if abs(lane.speed - edge.corridor.max_speed) > SPEED_TOLERANCE:
        yield f"edge {edge.id!r} allows {lane.speed:g} m/s instead of {edge.corridor.max_speed:g} m/s"
    fraction, slack = LENGTH_TOLERANCE
    shortest = (1 - fraction) * line_length(lane.shape) - slack
    mouths = MOUTH if edge.corridor.single_lane else 0.0  # half of one at each end, beyond the corridor
    longest = max((1 + fraction) * edge.length, SHORTEST_LANE) + slack + mouths
    if not shortest <= lane.length <= longest:
        yield f"edge {edge.id!r} is {lane.length:g} m long instead of {edge.length:.2f} m less its junctions"
    opposite = edge.id.removeprefix("-") if edge.id.startswith("-") else f"-{edge.id}"
    if lane.opposite != (opposite if edge.corridor.single_lane else ""):
        yield f"edge {edge.id!r} shares its lane with {lane.opposite or 'none'!r}, contrary to the map"
    off = max(_distance(p, edge.shape) for p in lane.shape)
    if off > SHAPE_TOLERANCE:
        yield f"edge {edge.id!r} runs {off:.2f} m beside its corridor"


def _distance(point: Point, line: tuple[Point, ...]) -> float:
    """From a point to the nearest point of a line [m]."""
    return min(_segment_distance(point, a, b) for a, b in pairwise(line))


def _segment_distance(point: Point, a: Point, b: Point) -> float:
    (px, py), (ax, ay), (bx, by) = point, a, b
    square = dist(a, b) ** 2
    along = min(max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / square, 0.0), 1.0) if square else 0.0
    return dist(point, (ax + along * (bx - ax), ay + along * (by - ay)))
