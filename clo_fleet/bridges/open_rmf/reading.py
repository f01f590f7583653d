"""What an Open-RMF building file says about one level: plain values in metres, y up.

A vertex is ``[x, y, z, name, {params}]``; a lane, wall, door or measurement ``[i, j, {params}]`` between vertices i and
j; a param ``[type, value]``. Coordinates are pixels of the floor plan with y down. The scale is the mean, over the
measurements, of their distance by their length in pixels.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from clo_fleet.bridges.drawings import Skipped, slug
from clo_fleet.world.faults import Fault, FileFaultsError, Finding, KeyPath
from clo_fleet.world.model import Point
from clo_fleet.world.yaml_file import Value, YamlFile, read_yaml

__all__ = ["Level", "OpenRmfError", "Span", "Vertex", "read_level"]

T = TypeVar("T")

PIXELS = "reference_image"
LARGEST = 1e6  # pixels; beyond it no drawing reaches, and sums lose their digits
USES = ("pickup_dispenser", "dropoff_ingestor", "spawn_robot_name")  # a place that robots cannot do without
STOPS = ("is_parking_spot", "is_holding_point")  # a place where they may stand


class OpenRmfError(FileFaultsError):
    """A building file cannot be imported; each fault names file, line, key, value and what was expected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vertex:
    """A point of the drawing.

    Attributes:
        index: its place in the file's list.
        name: as written; empty for most.
        point: [m], y up.
        needed: objects are handed out or taken in here, or a robot begins here.
        stop: robots may stand here; true for whatever is needed.
    """

    index: int
    name: str
    point: Point
    needed: bool
    stop: bool

    @property
    def id(self) -> str:
        """A name of ours: the vertex's own, or made from its index."""
        return slug(self.name) or f"v{self.index}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A lane, a wall or a door between two vertices, given by their indices."""

    start: int
    end: int
    name: str = ""
    one_way: bool = False
    max_speed: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """One level of a building. ``models`` holds the name of each piece of furniture; sizes are not in the file."""

    name: str
    scale: float
    vertices: tuple[Vertex, ...]
    floors: tuple[tuple[int, ...], ...]
    walls: tuple[Span, ...]
    doors: tuple[Span, ...]
    lanes: tuple[Span, ...]
    models: tuple[str, ...]
    skipped: tuple[Skipped, ...]

    def line(self, span: Span) -> tuple[Point, Point]:
        """The two ends of a lane, wall or door [m]."""
        return (self.vertices[span.start].point, self.vertices[span.end].point)


def read_level(path: Path, level: str | None) -> Level:
    """The level of that name; ``None``: the only one that the building has.

    Raises:
        OpenRmfError: if the file is no building of that kind, with everything that is wrong with it.
    """
    try:
        file = read_yaml(path)
    except FileFaultsError as error:
        raise OpenRmfError(error.faults) from error
    reader = _Reader(file, list(file.faults))
    found = reader.level(level)
    if reader.faults or found is None:
        raise OpenRmfError(sorted(reader.faults))
    return found


@dataclass(slots=True)
class _Reader:
    """Takes values out of the file, and notes what is wrong instead of stopping at it."""

    file: YamlFile
    faults: list[Fault] = field(default_factory=list)

    def level(self, wanted: str | None) -> Level | None:
        levels = self._mapping(("levels",))
        system = self.file.value(("coordinate_system",))
        if system not in (None, PIXELS):
            self._fault(("coordinate_system",), f"{PIXELS}, the only one that is understood")
        if not levels:
            self._fault(("levels",), "at least one level")
            return None
        if wanted is None and len(levels) > 1:
            self._fault(("levels",), f"a choice with --level, one of: {', '.join(levels)}", f"{len(levels)} levels")
            return None
        name = next(iter(levels)) if wanted is None else wanted
        if name not in levels:
            self._fault(("levels",), f"a level {name!r}; the file has: {', '.join(levels)}", "no such level")
            return None
        skipped = [Skipped("level", other, "a map has one level") for other in levels if other != name]
        skipped += [Skipped("lift", lift, "lifts are not followed") for lift in self._mapping(("lifts",))]
        return self._level(name, tuple(skipped))

    def _level(self, name: str, skipped: tuple[Skipped, ...]) -> Level | None:
        key: KeyPath = ("levels", name)
        self._mapping(key)
        pixels = self._list((*key, "vertices"), self._vertex)
        if not self._tuple((*key, "vertices")):
            self._fault((*key, "vertices"), "at least one vertex")
        size = len(pixels)
        spans = {
            kind: self._list((*key, kind), lambda at, value: self._span(at, value, size))
            for kind in ("walls", "doors", "lanes", "measurements")
        }
        floors = self._list((*key, "floors"), lambda at, value: self._floor(at, value, size))
        for kind in ("floors", "lanes", "measurements"):
            if not self._tuple((*key, kind)):
                self._fault((*key, kind), "at least one")
        models = self._list((*key, "models"), self._model)
        if self.faults:
            return None
        scale = self._scale((*key, "measurements"), [vertex.point for vertex in pixels])
        if scale is None:
            return None
        return Level(
            name=name,
            scale=scale,
            vertices=tuple(_scaled(vertex, scale) for vertex in pixels),
            floors=tuple(floors),
            walls=tuple(spans["walls"]),
            doors=tuple(spans["doors"]),
            lanes=tuple(spans["lanes"]),
            models=tuple(models),
            skipped=skipped,
        )

    def _vertex(self, key: KeyPath, value: Value) -> Vertex | None:
        if not isinstance(value, tuple) or len(value) < 4 or not all(map(_coordinate, value[:2])):
            self._fault(key, "a vertex [x, y, z, name, {params}] with x and y in pixels")
            return None
        params = _params(value[4:5])
        needed = any(params.get(use) not in (None, "", False) for use in USES)
        stop = needed or any(params.get(stop) is True for stop in STOPS)
        name = "" if value[3] is None else str(value[3])
        point = (_number(value[0]), _number(value[1]))
        return Vertex(index=int(key[-1]), name=name, point=point, needed=needed, stop=stop)

    def _span(self, key: KeyPath, value: Value, size: int) -> Span | None:
        if not isinstance(value, tuple) or len(value) < 2 or not all(_index(item, size) for item in value[:2]):
            self._fault(key, f"[i, j, {{params}}] between two of the {size} vertices")
            return None
        params = _params(value[2:3])
        speed = params.get("speed_limit")
        return Span(
            start=int(_number(value[0])),
            end=int(_number(value[1])),
            name=str(params.get("name") or ""),
            one_way=params.get("bidirectional") is False,
            max_speed=_number(speed) if _coordinate(speed) and _number(speed) > 0 else None,  # 0: no limit
        )

    def _floor(self, key: KeyPath, value: Value, size: int) -> tuple[int, ...] | None:
        corners = value.get("vertices") if isinstance(value, dict) else None
        if not isinstance(corners, tuple) or len(corners) < 3 or not all(_index(item, size) for item in corners):
            self._fault((*key, "vertices"), f"at least three of the {size} vertices")
            return None
        return tuple(int(_number(item)) for item in corners)

    def _model(self, key: KeyPath, value: Value) -> str | None:
        if not isinstance(value, dict):
            self._fault(key, "a model {model_name, x, y, ...}")
            return None
        return str(value.get("model_name") or value.get("name") or "model").rpartition("/")[2]

    def _scale(self, key: KeyPath, pixels: list[Point]) -> float | None:
        """Metres per pixel."""
        scales = []
        for index, value in enumerate(self._tuple(key)):
            assert isinstance(value, tuple)  # spans were read from it
            length = math.dist(pixels[int(_number(value[0]))], pixels[int(_number(value[1]))])
            distance = _params(value[2:3]).get("distance")
            if length > 0 and _coordinate(distance) and _number(distance) > 0:
                scales.append(_number(distance) / length)
            else:
                self._fault((*key, index), "a distance [m] above 0 between two different points")
        return None if self.faults else sum(scales) / len(scales)

    def _list(self, key: KeyPath, read: Callable[[KeyPath, Value], T | None]) -> list[T]:
        found = (read((*key, index), value) for index, value in enumerate(self._tuple(key)))
        return [item for item in found if item is not None]

    def _tuple(self, key: KeyPath) -> tuple[Value, ...]:
        value = self.file.value(key)
        if value is not None and not isinstance(value, tuple) and value != {}:
            self._fault(key, "a list")
        return value if isinstance(value, tuple) else ()

    def _mapping(self, key: KeyPath) -> dict[str, Value]:
        value = self.file.value(key)
        if value is not None and not isinstance(value, dict):
            self._fault(key, "keys with values")
        return value if isinstance(value, dict) else {}

    def _fault(self, key: KeyPath, expected: str, value: str | None = None) -> None:
        self.faults.append(self.file.fault(Finding(key, expected, value)))


def _scaled(vertex: Vertex, scale: float) -> Vertex:
    """The vertex in metres, y up."""
    x, y = vertex.point
    point = (x * scale, -y * scale)
    return Vertex(index=vertex.index, name=vertex.name, point=point, needed=vertex.needed, stop=vertex.stop)


def _params(values: tuple[Value, ...]) -> dict[str, Value]:
    """The params without their types."""
    pairs: Iterator[tuple[str, Value]] = (pair for value in values if isinstance(value, dict) for pair in value.items())
    return {name: pair[1] for name, pair in pairs if isinstance(pair, tuple) and len(pair) == 2}


def _coordinate(value: Value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _index(value: Value, size: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < size


def _number(value: Value) -> float:
    assert isinstance(value, int | float)  # by _coordinate or _index
    return float(value)
