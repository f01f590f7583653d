"""Map files: a building as people write it in YAML.

```yaml
format: clo-fleet/map/1
name: three_rooms
rooms:
  l1: {outline_m: [[0, 0], [6, 0], [6, 5], [0, 5]], obstacles_m: [[[2, 2], [3, 2], [3, 3], [2, 3]]]}
doors:
  d1: {rooms: [l1], at_m: [6, 2.5], heading_rad: 0.0, width_m: 1.6}
junctions:
  j1: {at_m: [10, 2.5]}
corridors:
  c1: {from: d1, to: j1, via_m: [[8, 2.5]], max_speed_m_s: 1.5, one_way: false, single_lane: false}
spawn_points:
  p1: {room: l1, at_m: [1, 1], heading_rad: 0.0}
network: three_rooms.net.xml.gz
```

A map is trusted with nothing: it can name one file, its network, in its own folder or below.
"""

from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Literal

from pydantic import Field

from clo_fleet.errors import CloFleetError
from clo_fleet.world.checks import map_findings
from clo_fleet.world.faults import FileFaultsError, Finding
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    PlaceId,
    Point,
    Pose,
    Room,
    RoomId,
    SpawnPoint,
)
from clo_fleet.world.outlines import counter_clockwise, outward_headings
from clo_fleet.world.sections import (
    Coordinate,
    Id,
    Outline,
    Parsed,
    PointM,
    Positive,
    Section,
    Text,
    json_schema,
    parse,
)
from clo_fleet.world.yaml_file import read_yaml, write_yaml

__all__ = ["MAP_FORMAT", "NetworkOutsideError", "map_schema", "read_map", "write_map"]

MAP_FORMAT = "clo-fleet/map/1"


class NetworkOutsideError(CloFleetError):
    """A map cannot be written because its network is not in the map's folder, where alone a map may look for it.

    Attributes:
        network: the network file.
        folder: the map's folder.
    """

    def __init__(self, network: Path, folder: Path) -> None:
        super().__init__(network, folder)
        self.network = network
        self.folder = folder

    def __str__(self) -> str:
        return f"the network {self.network} must be in the folder of its map, {self.folder}"


class RoomSection(Section):
    """A room."""

    outline_m: Outline = Field(description="Corners of the room in order; the last joins the first.")
    obstacles_m: tuple[Outline, ...] = Field((), description="Outlines of what stands in the room.")


class DoorSection(Section):
    """A door: of one room onto corridors, or between two rooms."""

    rooms: tuple[Id, ...] = Field(min_length=1, max_length=2)
    at_m: PointM = Field(description="The middle of the opening, on the wall.")
    heading_rad: Coordinate | None = Field(None, description="Out of the first room; by default square to its wall.")
    width_m: Positive


class JunctionSection(Section):
    """A point where corridors meet or end."""

    at_m: PointM


class CorridorSection(Section):
    """A corridor between two doors or junctions."""

    start: Id = Field(alias="from")
    to: Id
    via_m: tuple[PointM, ...] = Field((), max_length=10_000, description="Bends between the two ends.")
    max_speed_m_s: Positive = 1.5
    one_way: bool = Field(False, description="Only from the first end to the other.")
    single_lane: bool = Field(False, description="One lane for both directions, by turns, along the middle.")


class SpawnSection(Section):
    """A named place where a robot may start or an object may lie."""

    room: Id
    at_m: PointM
    heading_rad: Coordinate = 0.0


class MapSection(Section):
    """A map file."""

    format: Literal["clo-fleet/map/1"]
    name: Text | None = Field(None, description="By default the file's name.")
    rooms: dict[Id, RoomSection]
    doors: dict[Id, DoorSection] = Field({})
    junctions: dict[Id, JunctionSection] = Field({})
    corridors: dict[Id, CorridorSection] = Field({})
    spawn_points: dict[Id, SpawnSection] = Field({})
    network: Text | None = Field(None, description="The SUMO network of the corridors, in the map's folder.")


def read_map(path: Path, *, network_required: bool = True) -> BuildingMap:
    """The building that the file describes, checked: outlines are simple and counter-clockwise, references exist.

    Args:
        path: the map file.
        network_required: whether a map with corridors must have its network file; not to build that very file.

    Raises:
        FileFaultsError: with everything that is wrong with the file.
    """
    parsed = parse(read_yaml(path), MapSection, {"format": MAP_FORMAT, "rooms": {}})
    building = _building(parsed.sections, path)
    findings = [*map_findings(building, parsed.unsound), *_network_findings(parsed, path, network_required)]
    faults = parsed.located(findings)
    if faults:
        raise FileFaultsError(faults)
    return building


def write_map(building: BuildingMap, path: Path) -> None:
    """Write the building to a map file that reads back as the same building. A reader never sees half of it.

    Raises:
        NetworkOutsideError: if the building's network is not in the file's folder.
        FileWriteError: if the file cannot be written.
    """
    content: dict[str, object] = {"format": MAP_FORMAT, "name": building.name}
    content["rooms"] = {room.id: _room_entry(room) for room in building.rooms}
    sections = {
        "doors": {door.id: _door_entry(door) for door in building.doors},
        "junctions": {junction.id: {"at_m": _plain(junction.position)} for junction in building.junctions},
        "corridors": {corridor.id: _corridor_entry(corridor) for corridor in building.corridors},
        "spawn_points": {spawn.id: _spawn_entry(spawn) for spawn in building.spawn_points},
    }
    content.update((name, entries) for name, entries in sections.items() if entries)
    if building.network is not None:
        folder = path.parent.resolve()
        network = building.network.resolve()
        if not network.is_relative_to(folder):
            raise NetworkOutsideError(building.network, path.parent)
        content["network"] = network.relative_to(folder).as_posix()
    write_yaml(path, content)


def map_schema() -> dict[str, object]:
    """The JSON schema of map files, for editors."""
    return json_schema(MapSection, "A clo-fleet map")


def _building(sections: MapSection, path: Path) -> BuildingMap:
    rooms = {name: _room(name, section) for name, section in sections.rooms.items()}
    doors = {name: _door(name, section, rooms) for name, section in sections.doors.items()}
    junctions = {name: Junction(name, _point(section.at_m)) for name, section in sections.junctions.items()}
    nodes = {junction.id: junction.position for junction in junctions.values()}
    nodes |= {door.id: door.position for door in doors.values()}
    return BuildingMap(
        name=sections.name or path.stem,
        rooms=tuple(rooms.values()),
        doors=tuple(doors.values()),
        junctions=tuple(junctions.values()),
        corridors=tuple(_corridor(name, section, nodes) for name, section in sections.corridors.items()),
        spawn_points=tuple(
            SpawnPoint(name, _room_id(section.room), Pose(*_point(section.at_m), float(section.heading_rad)))
            for name, section in sections.spawn_points.items()
        ),
        network=None if sections.network is None else path.parent / sections.network,
    )


def _room(name: str, section: RoomSection) -> Room:
    obstacles = tuple(counter_clockwise(_line(obstacle)) for obstacle in section.obstacles_m)
    return Room(_room_id(name), counter_clockwise(_line(section.outline_m)), obstacles)


def _door(name: str, section: DoorSection, rooms: dict[str, Room]) -> Door:
    position, heading = _point(section.at_m), section.heading_rad
    if heading is None:
        room = rooms.get(section.rooms[0])
        heading = next(iter(outward_headings(room.outline, position) if room else ()), 0.0)
    return Door(
        id=DoorId(name),
        rooms=tuple(map(_room_id, section.rooms)),
        position=position,
        heading=float(heading),
        width=float(section.width_m),
    )


def _corridor(name: str, section: CorridorSection, nodes: dict[str, Point]) -> Corridor:
    """The corridor; an end that does not exist is missing from its line, and the checks say so."""
    ends = [[nodes[end]] if end in nodes else [] for end in (section.start, section.to)]
    return Corridor(
        id=CorridorId(name),
        start=section.start,
        end=section.to,
        shape=(*ends[0], *_line(section.via_m), *ends[1]),
        max_speed=float(section.max_speed_m_s),
        one_way=section.one_way,
        single_lane=section.single_lane,
    )


def _network_findings(parsed: Parsed[MapSection], path: Path, required: bool) -> Iterator[Finding]:
    name, key = parsed.sections.network, ("network",)
    build = f"; build it with: clo-fleet build-network {path}"
    if key in parsed.unsound:
        return
    if name is None:
        if required and parsed.sections.corridors:
            yield Finding(key, f"the file of the corridors' network{build}")
        return
    folder = path.parent
    absolute = PurePosixPath(name).is_absolute() or bool(PureWindowsPath(name).anchor) or "\\" in name
    try:
        inside = (folder / name).resolve().is_relative_to(folder.resolve())
        exists = (folder / name).is_file()
    except (OSError, RuntimeError):  # a name too long, or links that go round in a circle
        inside, exists = True, False
    if absolute or ".." in PurePosixPath(name).parts or not inside:
        yield Finding(key, "a file in the map's own folder, named relative to it")
    elif not exists and required:
        yield Finding(key, f"a file that exists{build}")


def _room_entry(room: Room) -> dict[str, object]:
    entry: dict[str, object] = {"outline_m": _plain(room.outline)}
    if room.obstacles:
        entry["obstacles_m"] = _plain(room.obstacles)
    return entry


def _door_entry(door: Door) -> dict[str, object]:
    entry: dict[str, object] = {"rooms": list(door.rooms), "at_m": _plain(door.position)}
    return entry | {"heading_rad": _plain(door.heading), "width_m": _plain(door.width)}


def _corridor_entry(corridor: Corridor) -> dict[str, object]:
    entry: dict[str, object] = {"from": corridor.start, "to": corridor.end}
    if corridor.shape[1:-1]:
        entry["via_m"] = _plain(corridor.shape[1:-1])
    entry["max_speed_m_s"] = _plain(corridor.max_speed)
    return entry | {key: True for key in ("one_way", "single_lane") if getattr(corridor, key)}


def _spawn_entry(spawn: SpawnPoint) -> dict[str, object]:
    entry: dict[str, object] = {"room": spawn.room, "at_m": _plain(spawn.pose.point)}
    return entry | {"heading_rad": _plain(spawn.pose.heading)}


def _plain(value: float | tuple[object, ...]) -> object:
    """The value as people write it: lists, and whole numbers without a point."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]  # type: ignore[arg-type]  # tuples of tuples of numbers
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else float(value)


def _room_id(name: str) -> RoomId:
    return RoomId(PlaceId(name))


def _point(point: tuple[float, ...]) -> Point:
    return (float(point[0]), float(point[1]))


def _line(points: tuple[tuple[float, ...], ...]) -> tuple[Point, ...]:
    return tuple(map(_point, points))
