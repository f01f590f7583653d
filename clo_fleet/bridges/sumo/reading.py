"""What SUMO's network files say: nodes and the edges between them.

The files are a stranger's. They are parsed by expat event by event; a document type, which alone can declare entities,
is refused before anything in it is read, and sizes are bounded. Every fault has its line.
"""

import gzip
import math
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from clo_fleet.bridges.drawings import Skipped
from clo_fleet.world.faults import Fault, FileFaultsError, key_text, value_text
from clo_fleet.world.model import Point

__all__ = ["RoadEdge", "Roads", "SumoError", "is_sumo_file", "read_roads"]

NETWORK, NODES, EDGES = (".net.xml.gz", ".net.xml"), ".nod.xml", ".edg.xml"
BESIDE = {".con.xml": "connections", ".tll.xml": "traffic lights", ".typ.xml": "edge types"}
MAX_BYTES = 1 << 26  # unpacked
MAX_NUMBER = 10_000  # nodes, and edges
MAX_POINTS = 10_000  # of an edge's shape
MAX_FAULTS = 20  # then reading stops
LARGEST = 1e9  # [m], [m/s]
DEFAULT_SPEED = 13.89  # [m/s], SUMO's
RAILS = ("rail", "rail_electric", "rail_fast", "rail_urban", "subway", "tram", "cable_car")
ELSEWHERE = frozenset((*RAILS, "aircraft", "drone", "ship", "container"))  # what does not move on floors
QUIET = frozenset({"location", "net", "nodes", "edges", "param", "request", "junction", "node", "edge", "lane"})


class SumoError(FileFaultsError):
    """A network cannot be imported; each fault names file, line, value and what was expected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadEdge:
    """One direction of a road.

    Attributes:
        id: as in the file.
        start, end: ids of its nodes.
        via: bends between them [m].
        speed: limit [m/s].
        bidi: whether the opposite edge is on the same centre line.
    """

    id: str
    start: str
    end: str
    via: tuple[Point, ...]
    speed: float
    bidi: bool


@dataclass(frozen=True, slots=True)
class Roads:
    """Where nodes are [m], the edges for robots, and what the file has besides."""

    nodes: Mapping[str, Point]
    edges: tuple[RoadEdge, ...]
    skipped: tuple[Skipped, ...]


def is_sumo_file(path: Path) -> bool:
    """Whether a file is SUMO's, by its name."""
    return path.name.endswith((*NETWORK, NODES, EDGES))


def read_roads(path: Path) -> Roads:
    """The roads in a ``.net.xml`` file (packed or not), or in a ``.nod.xml`` file and its ``.edg.xml`` file beside it.

    Raises:
        SumoError: with everything that is wrong with the files.
    """
    reader = _Reader()
    if path.name.endswith(NETWORK):
        reader.read(path, "net")
    else:
        stem = path.name.removesuffix(NODES).removesuffix(EDGES)
        reader.read(path.with_name(stem + NODES), "nodes")
        reader.read(path.with_name(stem + EDGES), "edges")
        for suffix, what in BESIDE.items():
            if path.with_name(stem + suffix).exists():
                reader.skipped.append(Skipped("file", stem + suffix, f"{what} are not imported"))
    return reader.roads()


@dataclass(slots=True)
class _Edge:
    """An edge while it is read."""

    line: int
    path: Path
    attributes: dict[str, str]
    lanes: list[dict[str, str]] = field(default_factory=list)


@dataclass(slots=True)
class _Reader:
    """Takes nodes and edges out of files, and notes what is wrong and what is left out."""

    nodes: dict[str, Point] = field(default_factory=dict)
    edges: dict[str, _Edge] = field(default_factory=dict)
    skipped: list[Skipped] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)
    lanes: int = 0  # beside the first
    _path: Path = Path()
    _depth: int = 0
    _root: str = ""
    _edge: _Edge | None = None
    _line: int = 1

    def read(self, path: Path, root: str) -> None:
        """Read one file, whose outermost element must be ``root``."""
        self._path, self._root, self._depth, self._line = path, root, 0, 1
        content = self._content(path)
        parser = expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            self._line = parser.CurrentLineNumber
            self._start(tag, attributes)

        parser.StartElementHandler, parser.EndElementHandler = start, self._end
        parser.StartDoctypeDeclHandler = self._document_type
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            self._line = error.lineno
            self.stop("(the file)", expat.ErrorString(error.code), "XML")

    def roads(self) -> Roads:
        """What was read."""
        found = []
        for name, edge in self.edges.items():
            self._path, self._line = edge.path, edge.line
            if (road := self._road(name, edge)) is not None:
                found.append(road)
        if self.faults:
            raise SumoError(self.faults)
        if self.lanes:
            reason = "a corridor has one lane for each direction"
            self.skipped.append(Skipped("lane", "beside another", reason, self.lanes))
        self.skipped += [
            Skipped("element", f"<{tag}>", "not imported", count) for tag, count in sorted(self.others.items())
        ]
        return Roads(self.nodes, tuple(found), tuple(self.skipped))

    def fault(self, key: str, value: str, expected: str) -> None:
        """Note something wrong at the present line."""
        self.faults.append(Fault(file=self._path, line=self._line, column=1, key=key, value=value, expected=expected))
        if len(self.faults) >= MAX_FAULTS:
            raise SumoError(self.faults)

    def stop(self, key: str, value: str, expected: str) -> NoReturn:
        """Note something wrong and give up."""
        self.fault(key, value, expected)
        raise SumoError(self.faults)

    def _content(self, path: Path) -> bytes:
        expected = f"an XML file of SUMO of at most {MAX_BYTES >> 20} MB"
        try:
            with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
                content = file.read(MAX_BYTES + 1)
        except (OSError, EOFError, zlib.error) as error:
            self.stop("(the file)", getattr(error, "strerror", None) or str(error), expected)
        if len(content) > MAX_BYTES:
            self.stop("(the file)", "a larger file", expected)
        return content

    def _document_type(self, name: str, *_: object) -> None:
        self.stop("(the file)", f"a document type {value_text(name)}", "none: files cannot declare entities here")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth == 1 and tag != self._root:
            self.stop("(the file)", f"<{tag}>", f"<{self._root}> outermost")
        match self._depth, tag:
            case 2, "node" | "junction":
                self._node(attributes)
            case 2, "edge":
                self._begin_edge(attributes)
            case 3, "lane" if self._edge is not None:
                self._edge.lanes.append(attributes)
            case 2, _ if tag not in QUIET:
                self.others[tag] += 1

    def _end(self, tag: str) -> None:
        self._depth -= 1
        if self._depth == 1:
            self._edge = None

    def _node(self, attributes: dict[str, str]) -> None:
        if attributes.get("type") == "internal":
            return
        name = attributes.get("id", "")
        x, y = self._number(name, attributes, "x"), self._number(name, attributes, "y")
        if len(self.nodes) >= MAX_NUMBER:
            self.stop("(the file)", "more nodes", f"at most {MAX_NUMBER:,}")
        self.nodes[name] = (x, y)
        if attributes.get("type", "").startswith("traffic_light"):
            self.others["traffic light"] += 1

    def _begin_edge(self, attributes: dict[str, str]) -> None:
        function = attributes.get("function", "normal")
        if function == "internal":
            return
        name = attributes.get("id", "")
        if function not in ("normal", "connector"):
            self.skipped.append(Skipped("edge", name, f"it is a {function}"))
            return
        if len(self.edges) >= MAX_NUMBER:
            self.stop("(the file)", "more edges", f"at most {MAX_NUMBER:,}")
        self._edge = _Edge(self._line, self._path, attributes)
        self.edges[name] = self._edge

    def _road(self, name: str, edge: _Edge) -> RoadEdge | None:
        attributes = edge.attributes
        for end in ("from", "to"):
            if attributes.get(end) not in self.nodes:
                self.fault(_key(name, end), value_text(attributes.get(end)), "the id of a node")
        lanes = edge.lanes or [attributes]
        usable = [lane for lane in lanes if _usable(attributes | lane)]
        if not usable:
            self.skipped.append(Skipped("edge", name, "no lane of it is for what moves on floors"))
            return None
        number = max(len(usable), int(self._number(name, attributes, "numLanes", 1.0)) if not edge.lanes else 1)
        if number > 1:
            self.lanes += number - 1
        speed = self._number(name, usable[0] if "speed" in usable[0] else attributes, "speed", DEFAULT_SPEED)
        if speed <= 0:
            self.fault(_key(name, "speed"), f"{speed:g}", "a speed above 0")
        if attributes.get("from") not in self.nodes or attributes.get("to") not in self.nodes:
            return None
        via = self._shape(name, attributes["shape"]) if "shape" in attributes else ()
        if "shape" not in attributes and "shape" in usable[0]:
            via = self._shape(name, usable[0]["shape"])[1:-1]
        return RoadEdge(
            id=name,
            start=attributes["from"],
            end=attributes["to"],
            via=via,
            speed=speed,
            bidi=attributes.get("bidi", "false") not in ("", "false", "0"),
        )

    def _shape(self, name: str, text: str) -> tuple[Point, ...]:
        points = []
        for part in text.split()[: MAX_POINTS + 1]:
            numbers = [_float(number) for number in part.split(",")]
            if len(numbers) not in (2, 3) or None in numbers:
                self.fault(_key(name, "shape"), value_text(part), "points x,y or x,y,z")
                return ()
            points.append((numbers[0] or 0.0, numbers[1] or 0.0))
        if len(points) > MAX_POINTS:
            self.fault(_key(name, "shape"), "more points", f"at most {MAX_POINTS:,}")
        return tuple(points)

    def _number(self, name: str, attributes: dict[str, str], key: str, default: float | None = None) -> float:
        if key not in attributes and default is not None:
            return default
        number = _float(attributes.get(key, ""))
        if number is None:
            self.fault(_key(name, key), value_text(attributes.get(key)), f"a number within {LARGEST:g}")
        return number or 0.0


def _usable(attributes: dict[str, str]) -> bool:
    """Whether something may be on a lane that moves on floors."""
    allowed = attributes.get("allow", "").split()
    if "all" in attributes.get("disallow", "").split():
        return False
    return not allowed or not ELSEWHERE.issuperset(allowed)


def _float(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and abs(number) <= LARGEST else None


def _key(name: str, attribute: str) -> str:
    return key_text((name, attribute))
