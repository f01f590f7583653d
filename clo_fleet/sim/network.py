"""The SUMO network of a building's corridors: built once by netconvert and shipped beside the map.

===================================  =============================================
map                                  SUMO network
===================================  =============================================
junction or door ``j``               junction ``j``
corridor ``c`` from start to end     edge ``c``, one lane
corridor ``c`` from end to start     edge ``-c``, one lane; none if it is one-way
single lane for both directions      edges ``c`` and ``-c`` with ``bidi`` set
===================================  =============================================

Traffic keeps to the right: a lane's centre runs 0.35 m right of the corridor's centre line. A single lane for both
directions runs along that line; who may use it is not SUMO's to say.

Between two lanes lies a junction, so a lane is shorter than its corridor by what the junctions at its ends take (1 m
where two-way corridors cross): the way that SUMO counts is the way that a robot covers in the building. Counting the
whole corridor as lane instead would crowd queues together until robots overlap. Only lanes under ``SHORTEST_LANE`` are
counted longer than they are: they would hold no robot, and traffic over chains of them freezes.

Building needs netconvert (``pip install 'clo-fleet[maps]'``); checking (``network_check``) and running do not.
"""

import gzip
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise
from math import dist
from pathlib import Path
from xml.etree import ElementTree as ET

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.crossings import keep_apart
from clo_fleet.world.model import BuildingMap, Corridor, Point

__all__ = [
    "MOUTH",
    "SHORTEST_LANE",
    "Edge",
    "NetconvertMissingError",
    "NetworkBuildError",
    "build_network",
    "line_length",
    "network_edges",
    "network_nodes",
    "network_turns",
]

LANE_WIDTH = 0.7  # [m] per direction; a robot is 0.6 m wide
JUNCTION_RADIUS = 0.6  # [m]; netconvert's 4 m eats short corridors; below 0.6 m opposing left-turners overlap
MOUTH = 2.0  # [m] of a two-lane corridor over which its lanes join to the single one that goes on from it
SHORTEST_LANE = 1.2  # [m]; a robot and its gap need 1.1. Measured: a grid with lanes of 0.2 m froze, with 1.2 it flowed
TIME_LIMIT = 120.0  # real seconds for netconvert, which needs one for 400 junctions
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
        return line_length(self.shape)


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
    nodes = network_nodes(building)
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


def _netconvert() -> str:
    """The path of the binary that the package eclipse-sumo brings."""
    spec = find_spec("sumo")  # not imported: its import changes the environment
    found = spec and spec.origin and shutil.which("netconvert", path=Path(spec.origin).parent / "bin")
    if not found:
        raise NetconvertMissingError
    return found


def network_nodes(building: BuildingMap) -> dict[str, Point]:
    """Where the doors and junctions are [m]."""
    return {str(d.id): d.position for d in building.doors} | {j.id: j.position for j in building.junctions}


def network_turns(building: BuildingMap, edges: tuple[Edge, ...]) -> Iterator[tuple[str, str]]:
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
    """Edges in netconvert's plain XML: the shape is the left border of the lane, or the middle of a single one."""
    joining = _joining(edges)
    for e in edges:
        yield ET.Element(
            "edge",
            {"from": e.start, "to": e.end},
            id=e.id,
            shape=" ".join(f"{float(x)!r},{float(y)!r}" for x, y in _drawn(e, joining)),
            speed=repr(e.corridor.max_speed),
            width=repr(LANE_WIDTH),
            numLanes="1",
            spreadType="center" if e.corridor.single_lane else "right",
            **({"bidi": "true"} if e.corridor.single_lane else {}),
        )


def _joining(edges: tuple[Edge, ...]) -> set[str]:
    """The nodes at which a corridor goes on with one lane where it had two; netconvert leaves no room to join there."""
    kinds: dict[str, dict[str, bool]] = {}
    for edge in edges:
        for node in (edge.start, edge.end):
            kinds.setdefault(node, {})[edge.corridor.id] = edge.corridor.single_lane
    return {node for node, single in kinds.items() if sorted(single.values()) == [False, True]}


def _drawn(edge: Edge, joining: set[str]) -> tuple[Point, ...]:
    """The edge's shape, of two lanes cut back where they join."""
    if edge.corridor.single_lane or not joining & {edge.start, edge.end}:
        return edge.shape
    cut = min(MOUTH, edge.length / 3)
    shape = _cut(edge.shape, cut) if edge.start in joining else edge.shape
    return _cut(shape[::-1], cut)[::-1] if edge.end in joining else shape


def _cut(line: tuple[Point, ...], distance: float) -> tuple[Point, ...]:
    """The line without its first part [m], which is shorter than the line."""
    a, b = line[0], line[1]
    if dist(a, b) <= distance:
        return _cut(line[1:], distance - dist(a, b))
    share = distance / dist(a, b)
    return ((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])), *line[1:])


def _connection_elements(building: BuildingMap, edges: tuple[Edge, ...]) -> Iterator[ET.Element]:
    """Every turn in netconvert's plain XML, so that it guesses none."""
    for a, b in network_turns(building, edges):
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
    keep_apart(root)
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


def line_length(line: tuple[Point, ...]) -> float:
    """How long a line of points is [m]."""
    return sum(dist(a, b) for a, b in pairwise(line))
