"""The SUMO network of a building's corridors: built once by netconvert, shipped beside the map, checked before use.

===================================  =============================================
map                                  SUMO network
===================================  =============================================
junction or door ``j``               junction ``j``
corridor ``c`` from start to end     edge ``c``, one lane
corridor ``c`` from end to start     edge ``-c``, one lane; none if it is one-way
===================================  =============================================

Traffic keeps to the right: a lane's centre runs 0.35 m right of the corridor's centre line. Between two lanes lies a
junction, so a lane is shorter than its corridor by what the junctions at its ends take (1 m where two-way corridors
cross): the way that SUMO counts is the way that a robot covers in the building. Counting the whole corridor as lane
instead would crowd queues together until robots overlap. Only lanes under ``SHORTEST_LANE`` are counted longer than
they are: they would hold no robot, and traffic over chains of them freezes.

Building needs netconvert (``pip install 'clo-fleet[maps]'``); checking and running do not.
"""

import gzip
import os
import shutil
import subprocess
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise
from math import dist, isfinite
from pathlib import Path
from xml.etree import ElementTree as ET

from clo_fleet.errors import CloFleetError
from clo_fleet.world.model import BuildingMap, Corridor, Point

__all__ = [
    "Edge",
    "NetconvertMissingError",
    "NetworkBuildError",
    "build_network",
    "check_network",
    "network_edges",
]

LANE_WIDTH = 0.7  # [m] per direction; a robot is 0.6 m wide
JUNCTION_RADIUS = 0.6  # [m]; netconvert's 4 m eats short corridors; below 0.6 m opposing left-turners overlap
SHORTEST_LANE = 1.2  # [m]; a robot and its gap need 1.1. Measured: a grid with lanes of 0.2 m froze, with 1.2 it flowed
TIME_LIMIT = 120.0  # real seconds for netconvert, which needs one for 400 junctions
LARGEST_NETWORK = 1 << 28  # bytes unpacked; a file beyond it is not one of ours
NODE_TOLERANCE = 0.01  # [m]
SPEED_TOLERANCE = 0.01  # [m/s]
LENGTH_TOLERANCE = (0.01, 0.6)  # as a fraction of the length, and [m]
SHAPE_TOLERANCE = 1.0  # [m] from a lane to its centre line: half a lane, and what it swings out in a sharp bend
NETCONVERT_OPTIONS = (
    *("--default.junctions.radius", str(JUNCTION_RADIUS)),
    "--no-turnarounds",  # beside those that we ask for
    "--offset.disable-normalization",  # stay in the building's coordinates
    *("--precision", "3"),
    *("--xml-validation", "never"),
    "--no-warnings",
)


class NetconvertMissingError(CloFleetError):
    """SUMO's network builder is not installed."""

    def __init__(self) -> None:
        super().__init__("building a corridor network needs SUMO's netconvert: pip install 'clo-fleet[maps]'")


class NetworkBuildError(CloFleetError):
    """No network can be built from a map.

    Attributes:
        map_name: the map's name.
        reason: why, in netconvert's words where they are its.
    """

    def __init__(self, map_name: str, reason: str) -> None:
        super().__init__(map_name, reason)
        self.map_name, self.reason = map_name, reason

    def __str__(self) -> str:
        return f"no corridor network for map {self.map_name!r}: {self.reason}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """One direction of a corridor.

    Attributes:
        id: the SUMO edge's id; its only lane is ``<id>_0``.
        start, end: ids of the doors or junctions that it leads from and to.
        shape: the corridor's centre line in this direction [m].
    """

    id: str
    start: str
    end: str
    shape: tuple[Point, ...]
    corridor: Corridor

    @property
    def length(self) -> float:
        """The centre line's length, door or junction to door or junction [m]."""
        return _length(self.shape)


@dataclass(frozen=True, slots=True)
class _Lane:
    """One lane, as a network file has it."""

    start: str
    end: str
    length: float
    speed: float
    shape: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class _Network:
    """What a network file says: where its nodes are, its lanes by edge, and the turns from edge to edge."""

    nodes: dict[str, Point]
    lanes: dict[str, tuple[_Lane, ...]]
    turns: frozenset[tuple[str, str]]


class _UnreadableError(CloFleetError):
    """A network file cannot be read; says why."""


def network_edges(building: BuildingMap) -> tuple[Edge, ...]:
    """The edges of the building's network, by corridor id, the way from start to end before the way back."""
    found = []
    for c in sorted(building.corridors, key=lambda c: c.id):
        found.append(Edge(id=c.id, start=c.start, end=c.end, shape=c.shape, corridor=c))
        if not c.one_way:
            found.append(Edge(id=f"-{c.id}", start=c.end, end=c.start, shape=c.shape[::-1], corridor=c))
    return tuple(found)


def build_network(building: BuildingMap, path: Path) -> None:
    """Write the SUMO network of the building's corridors to ``path`` (``.net.xml.gz``), or leave ``path`` as it was.

    The same map gives the same bytes on the same version of netconvert.

    Raises:
        NetconvertMissingError: if netconvert is not installed.
        NetworkBuildError: if the map has no corridors, one leads to an unknown node, or netconvert fails.
    """
    netconvert = _netconvert()
    nodes = _nodes(building)
    edges = network_edges(building)
    if not edges:
        raise NetworkBuildError(building.name, "it has no corridors")
    for edge in edges:
        for node in (edge.start, edge.end):
            if node not in nodes:
                raise NetworkBuildError(building.name, f"corridor {edge.corridor.id!r} leads to unknown {node!r}")
    with tempfile.TemporaryDirectory() as folder:
        sources = {"nod": _node_elements(nodes, edges), "edg": _edge_elements(edges)}
        sources["con"] = _connection_elements(building, edges)
        for kind, elements in sources.items():
            root = ET.Element("all")
            root.extend(elements)
            ET.ElementTree(root).write(Path(folder, f"map.{kind}.xml"), encoding="utf-8")
        _run(netconvert, Path(folder), building.name)
        text = _finished(Path(folder, "map.net.xml"))
    _write(path, gzip.compress(text, mtime=0))


def check_network(building: BuildingMap, path: Path) -> tuple[str, ...]:
    """What in the network file does not fit the map, one sentence each; nothing if the network is the map's."""
    try:
        network = _read(path)
    except _UnreadableError as error:
        return (str(error),)
    edges = {e.id: e for e in network_edges(building)}
    nodes = _nodes(building)
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
            for a, b in _turns(building, tuple(edges.values()))
            if a in network.lanes and b in network.lanes and (a, b) not in network.turns
        ]
    )


def _netconvert() -> str:
    """The path of the binary that the package eclipse-sumo brings."""
    spec = find_spec("sumo")  # not imported: its import changes the environment
    found = spec and spec.origin and shutil.which("netconvert", path=Path(spec.origin).parent / "bin")
    if not found:
        raise NetconvertMissingError
    return found


def _nodes(building: BuildingMap) -> dict[str, Point]:
    """Where the doors and junctions are [m]."""
    return {str(d.id): d.position for d in building.doors} | {j.id: j.position for j in building.junctions}


def _turns(building: BuildingMap, edges: tuple[Edge, ...]) -> Iterator[tuple[str, str]]:
    """The edges that one may change between, without turning round, except where a corridor just ends."""
    doors = {str(d.id) for d in building.doors}
    meeting = _meeting(edges)
    leaving: dict[str, list[Edge]] = {}
    for edge in edges:
        leaving.setdefault(edge.start, []).append(edge)
    for edge in edges:
        dead_end = len(meeting[edge.end]) == 1 and edge.end not in doors
        onward = leaving.get(edge.end, [])
        yield from ((edge.id, e.id) for e in onward if dead_end or e.corridor.id != edge.corridor.id)


def _meeting(edges: Iterable[Edge]) -> dict[str, set[str]]:
    """The ids of the corridors that begin or end at each node."""
    found: dict[str, set[str]] = {}
    for edge in edges:
        for node in (edge.start, edge.end):
            found.setdefault(node, set()).add(edge.corridor.id)
    return found


def _node_elements(nodes: dict[str, Point], edges: tuple[Edge, ...]) -> Iterator[ET.Element]:
    """Nodes in netconvert's plain XML. Where no more than two corridors meet no ways cross, so nobody has to stop."""
    for node, corridors in sorted(_meeting(edges).items()):
        x, y = nodes[node]
        kind = "allway_stop" if len(corridors) > 2 else "priority"
        yield ET.Element("node", id=node, x=repr(float(x)), y=repr(float(y)), type=kind)


def _edge_elements(edges: tuple[Edge, ...]) -> Iterator[ET.Element]:
    """Edges in netconvert's plain XML: the shape is the left border of the lane."""
    for e in edges:
        yield ET.Element(
            "edge",
            {"from": e.start, "to": e.end},
            id=e.id,
            shape=" ".join(f"{float(x)!r},{float(y)!r}" for x, y in e.shape),
            speed=repr(e.corridor.max_speed),
            width=repr(LANE_WIDTH),
            numLanes="1",
            spreadType="right",
        )


def _connection_elements(building: BuildingMap, edges: tuple[Edge, ...]) -> Iterator[ET.Element]:
    """Every turn in netconvert's plain XML, so that it guesses none."""
    for a, b in _turns(building, edges):
        yield ET.Element("connection", {"from": a, "to": b}, fromLane="0", toLane="0")


def _run(netconvert: str, folder: Path, map_name: str) -> None:
    """Have netconvert turn the folder's sources into ``map.net.xml``."""
    command = [netconvert, "-n", "map.nod.xml", "-e", "map.edg.xml", "-x", "map.con.xml", "-o", "map.net.xml"]
    environment = os.environ | {"SUMO_HOME": str(Path(netconvert).parent.parent)}
    try:
        done = subprocess.run(
            [*command, *NETCONVERT_OPTIONS],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIME_LIMIT,
        )
    except subprocess.TimeoutExpired as error:
        raise NetworkBuildError(map_name, f"netconvert took longer than {TIME_LIMIT:.0f} s") from error
    except OSError as error:
        raise NetworkBuildError(map_name, f"netconvert does not run: {error}") from error
    if done.returncode or not (folder / "map.net.xml").exists():
        raise NetworkBuildError(map_name, " ".join(done.stderr.split())[:300] or f"netconvert ended {done.returncode}")


def _finished(path: Path) -> bytes:
    """Netconvert's output with lanes of a useful length, and without its comments, which hold date and paths."""
    root = ET.parse(path).getroot()
    for lane in root.iterfind("edge[@priority]/lane"):  # internal lanes, on junctions, have no priority
        lane.set("length", f"{max(float(lane.get('length', '0')), SHORTEST_LANE):.3f}")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode").encode()


def _write(path: Path, content: bytes) -> None:
    """Replace the file in one step."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


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
    return _Lane(edge.attrib["from"], edge.attrib["to"], numbers[0], numbers[1], shape)


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
    shortest = (1 - fraction) * _length(lane.shape) - slack
    longest = max((1 + fraction) * edge.length, SHORTEST_LANE) + slack
    if not shortest <= lane.length <= longest:
        yield f"edge {edge.id!r} is {lane.length:g} m long instead of {edge.length:.2f} m less its junctions"
    off = max(_distance(p, edge.shape) for p in lane.shape)
    if off > SHAPE_TOLERANCE:
        yield f"edge {edge.id!r} runs {off:.2f} m beside its corridor"


def _length(line: tuple[Point, ...]) -> float:
    return sum(dist(a, b) for a, b in pairwise(line))


def _distance(point: Point, line: tuple[Point, ...]) -> float:
    """From a point to the nearest point of a line [m]."""
    return min(_segment_distance(point, a, b) for a, b in pairwise(line))


def _segment_distance(point: Point, a: Point, b: Point) -> float:
    (px, py), (ax, ay), (bx, by) = point, a, b
    square = dist(a, b) ** 2
    along = min(max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / square, 0.0), 1.0) if square else 0.0
    return dist(point, (ax + along * (bx - ax), ay + along * (by - ay)))
