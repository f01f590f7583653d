"""Map files: what is read, what is written, and every fault at its place."""

import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clo_fleet.world.faults import FileFaultsError
from clo_fleet.world.map_file import NetworkOutsideError, map_schema, read_map, write_map
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
from clo_fleet.world.yaml_file import FileWriteError

MAP = """\
format: clo-fleet/map/1
name: three_rooms
rooms:
  l1: {outline_m: [[0, 0], [6, 0], [6, 5], [0, 5]], obstacles_m: [[[2, 2], [3, 2], [3, 3], [2, 3]]]}
  l2: {outline_m: [[14, 0], [14, 5], [20, 5], [20, 0]]}
  l3: {outline_m: [[20, 0], [26, 0], [26, 5], [20, 5]]}
doors:
  d1: {rooms: [l1], at_m: [6, 2.5], heading_rad: 0.0, width_m: 1.6}
  d2: {rooms: [l2], at_m: [14, 2.5], width_m: 1.6}
  d3: {rooms: [l2, l3], at_m: [20, 2.5], width_m: 1}
junctions:
  j1: {at_m: [10, 2.5]}
corridors:
  c1: {from: d1, to: j1, via_m: [[8, 2.5]], max_speed_m_s: 1, one_way: true}
  c2: {from: j1, to: d2}
spawn_points:
  p1: {room: l1, at_m: [1, 1], heading_rad: 0.5}
network: three_rooms.net.xml.gz
"""


def written(folder: Path, *edits: tuple[str, str]) -> Path:
    """The map above with some texts replaced, and its network beside it."""
    text = MAP
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    path = folder / "three_rooms.yaml"
    path.write_text(text, encoding="utf-8")
    (folder / "three_rooms.net.xml.gz").touch()
    return path


def faults(path: Path) -> list[str]:
    """The faults of the map file, without the file's name."""
    with pytest.raises(FileFaultsError) as error:
        read_map(path)
    assert all(fault.file == path for fault in error.value.faults)
    return [str(fault).removeprefix(f"{path}:") for fault in error.value.faults]


def test_a_map_is_read_into_values(tmp_path: Path) -> None:
    """Clockwise outlines are turned, headings derived, corridors run from node to node."""
    building = read_map(written(tmp_path))
    assert building.name == "three_rooms"
    assert list(building.rooms[1].outline) == [(14, 0), (20, 0), (20, 5), (14, 5)]
    assert [door.heading for door in building.doors] == pytest.approx([0, math.pi, 0])
    assert list(building.corridors[0].shape) == [(6, 2.5), (8, 2.5), (10, 2.5)]
    assert (building.corridors[0].max_speed, building.corridors[0].one_way) == (1.0, True)
    assert (building.corridors[1].max_speed, building.corridors[1].one_way) == (1.5, False)
    assert building.spawn_points == (SpawnPoint("p1", RoomId(PlaceId("l1")), Pose(1, 1, 0.5)),)
    assert building.network == tmp_path / "three_rooms.net.xml.gz"


@pytest.mark.parametrize(
    ("old", "new", "start", "words"),
    [
        ("format: clo-fleet/map/1", "# format", "2:1: format: got nothing", "required"),
        ("clo-fleet/map/1", "clo-fleet/map/2", "1:1: format: got 'clo-fleet/map/2'", "clo-fleet/map/1"),
        ("clo-fleet/map/1", "clo-fleet/world/1", "1:1: format: got 'clo-fleet/world/1'", "clo-fleet/map/1"),
        ("junctions:", "juntions:", "11:1: juntions: got", "did you mean junctions?"),
        ("max_speed_m_s: 1,", "max_speed_km_h: 5,", "14:45: corridors.c1.max_speed_km_h: got 5", "carry their unit"),
        (
            "max_speed_m_s: 1,",
            "max_speed: 5,",
            "14:45: corridors.c1.max_speed: got 5",
            "mean max_speed_m_s? keys carry",
        ),
        ("width_m: 1.6}\n  d2", "width_m: '1.6'}\n  d2", "8:55: doors.d1.width_m: got '1.6'", "without quotes"),
        ("width_m: 1.6}\n  d2", "width_m: true}\n  d2", "8:55: doors.d1.width_m: got true", "a number"),
        ("width_m: 1.6}\n  d2", "width_m: .nan}\n  d2", "8:55: doors.d1.width_m: got nan", "finite"),
        ("width_m: 1.6}\n  d2", "width_m: .inf}\n  d2", "8:55: doors.d1.width_m: got inf", "finite"),
        ("width_m: 1.6}\n  d2", "width_m: 1e999}\n  d2", "8:55: doors.d1.width_m: got inf", "finite"),
        ("width_m: 1.6}\n  d2", "width_m: 0.6}\n  d2", "8:55: doors.d1.width_m: got 0.6", "at least 0.7 m"),
        ("width_m: 1}", "width_m: 9}", "10:42: doors.d3.width_m: got 9", "fits into the wall"),
        (", width_m: 1}", "}", "10:3: doors.d3.width_m: got nothing", "required"),
        ("one_way: true", "one_way: yes", "14:63: corridors.c1.one_way: got 'yes'", "true or false"),
        (
            "one_way: true",
            "one_way: true, single_lane: true",
            "14:78: corridors.c1.single_lane: got true",
            "one direction",
        ),
        ("one_way: true", "single_lane: 1", "14:63: corridors.c1.single_lane: got 1", "true or false"),
        ("max_speed_m_s: 1,", "max_speed_m_s: 0,", "14:45: corridors.c1.max_speed_m_s: got 0", "above 0"),
        ("[10, 2.5]}", "[10, 2.5, 0]}", "12:8: junctions.j1.at_m: got [10, 2.5, 0]", "a point [x, y]"),
        ("[10, 2.5]}", "[10, 1e7]}", "12:8: junctions.j1.at_m[1]: got 10000000.0", "at most"),
        ("  l3:", "  L3:", "6:3: rooms.L3: got 'L3'", "lower-case letters"),
        ("  l3:", "  l2:", "6:3: rooms.l2: got the key twice", "already stands on line 5"),
        ("  j1: {at_m: [10", "  l1: {at_m: [10", "12:3: junctions.l1: got the name 'l1' again", "a room has it"),
        ("  l3:", "  zone-1:", "6:3: rooms.zone-1: got 'zone-1'", "corridor zones"),
        ("rooms: [l1]", "rooms: [l9]", "8:16: doors.d1.rooms[0]: got 'l9'", "the name of a room (l1, l2, l3)"),
        ("rooms: [l2, l3]", "rooms: [l2, l2]", "10:8: doors.d3.rooms: got ['l2', 'l2']", "two different"),
        ("rooms: [l2, l3]", "rooms: [l2]", "10:8: doors.d3.rooms: got ['l2']", "a corridor that ends at this door"),
        ("to: d2", "to: d3", "10:8: doors.d3.rooms: got ['l2', 'l3']", "one room, as corridor c2 ends"),
        ("to: d2", "to: d7", "15:18: corridors.c2.to: got 'd7'", "a door or a junction (d1, d2, d3, j1)"),
        ("from: j1", "from: d2", "15:18: corridors.c2.to: got 'd2'", "another place"),
        ("room: l1", "room: l4", "17:8: spawn_points.p1.room: got 'l4'", "the name of a room"),
        ("at_m: [1, 1]", "at_m: [2.5, 2.5]", "17:18: spawn_points.p1.at_m: got [2.5, 2.5]", "outside its obstacles"),
        ("at_m: [1, 1]", "at_m: [9, 1]", "17:18: spawn_points.p1.at_m: got [9, 1]", "inside room l1"),
        (
            "[[20, 0], [26, 0], [26, 5], [20, 5]]",
            "[[20, 0], [26, 0]]",
            "6:8: rooms.l3.outline_m: got",
            "at least 3 entries",
        ),
        ("[26, 5], [20, 5]]", "[20, 5], [26, 5]]", "6:8: rooms.l3.outline_m: got", "not cross or touch itself"),
        ("[26, 5], [20, 5]]", "[26, 5], [20, 5], [20, 0]]", "6:8: rooms.l3.outline_m: got", "points that differ"),
        ("[[20, 0], [26", "[[19, 0], [26", "6:8: rooms.l3.outline_m: got 2.5 m2 in common with room l2", "touching"),
        ("[3, 2], [3, 3]", "[7, 2], [3, 3]", "4:67: rooms.l1.obstacles_m[0]: got [[2, 2], [7", "inside room l1"),
        ("at_m: [6, 2.5], h", "at_m: [6.1, 2.5], h", "8:21: doors.d1.at_m: got [6.1, 2.5], 0.10 m from", "on the wall"),
        ("heading_rad: 0.0", "heading_rad: 90", "8:37: doors.d1.heading_rad: got 90", "out of room l1"),
        ("[8, 2.5]", "[10, 2.5]", "14:26: corridors.c1.via_m: got [[10, 2.5]]", "points that differ"),
        ("at_m: [10, 2.5]", "at_m: [13, 2.5]", "15:3: corridors.c2: got 1 m from j1 to d2", "at least 1.2 m"),
        ("[8, 2.5]", "[3, 1]", "14:3: corridors.c1: got 6", "outside of rooms"),
        ("network: three_rooms.net.xml.gz", "", "1:1: network: got nothing", "clo-fleet build-network"),
        ("network: three", "network: four", "18:1: network: got 'four_rooms", "clo-fleet build-network"),
        ("network: ", "network: ../", "18:1: network: got '../three", "in the map's own folder"),
        ("network: ", "network: /tmp/", "18:1: network: got '/tmp/three", "in the map's own folder"),
        ("network: ", "network: C:\\", "18:1: network: got 'C:", "in the map's own folder"),
        ("network: three", 'network: "\\0three', "18:1: network: got '\\x00three", "control characters"),
        ("rooms:\n  l1", "rooms: 3\nx:\n  l1", "3:1: rooms: got 3", "names with values"),
    ],
)
def test_each_fault_is_told_at_its_key(tmp_path: Path, old: str, new: str, start: str, words: str) -> None:
    """With line and column, the key path, the value and what was expected."""
    if new.startswith('network: "'):
        new, old = new + '_rooms.net.xml.gz"', old + "_rooms.net.xml.gz"
    found = faults(written(tmp_path, (old, new)))
    mine = [fault for fault in found if fault.startswith(start)]
    assert len(mine) == 1, "\n".join(found)
    assert words in mine[0].partition("expected ")[2]


def test_a_small_room_is_refused(tmp_path: Path) -> None:
    """Below 1 m2 nothing can move."""
    path = tmp_path / "small.yaml"
    path.write_text("format: clo-fleet/map/1\nrooms:\n  l1: {outline_m: [[0, 0], [1, 0], [1, 0.5]]}\n")
    assert faults(path) == ["3:8: rooms.l1.outline_m: got 0.25 m2, expected at least 1 m2"]


def test_a_map_needs_a_room(tmp_path: Path) -> None:
    """An empty section is no building."""
    path = tmp_path / "empty.yaml"
    path.write_text("format: clo-fleet/map/1\nrooms: {}\n")
    assert faults(path) == ["2:1: rooms: got {}, expected at least one room"]


def test_all_faults_of_a_file_are_told_at_once_in_the_order_of_lines(tmp_path: Path) -> None:
    """Faults of the text, of its types and of the geometry; nothing is told that only follows from another fault."""
    path = written(
        tmp_path,
        ("width_m: 1}", "width_m: one}"),
        ("at_m: [1, 1]", "at_m: [9, 9]"),
        ("[[20, 0], [26", "[[19, 0], [26"),
        ("junctions:", "junctions: !x"),
        ("max_speed_m_s: 1,", "max_sped_m_s: 1,"),
    )
    keys = ["rooms.l3.outline_m", "doors.d3.width_m", "junctions", "corridors.c1.max_sped_m_s", "spawn_points.p1.at_m"]
    assert [fault.split(": ")[1] for fault in faults(path)] == keys


def test_references_to_what_is_faulty_itself_are_not_faulted(tmp_path: Path) -> None:
    """The door of a room that cannot be read has no fault of its own."""
    found = faults(written(tmp_path, ("[26, 0], [26, 5]", "[26, x], [26, 5]")))
    assert [fault.split(": ")[1] for fault in found] == ["rooms.l3.outline_m[1][1]"]


def test_a_network_behind_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    """A link does not lead out of the map's folder either."""
    folder = tmp_path / "maps"
    folder.mkdir()
    path = written(folder)
    (tmp_path / "elsewhere").touch()
    (folder / "three_rooms.net.xml.gz").unlink()
    (folder / "three_rooms.net.xml.gz").symlink_to(tmp_path / "elsewhere")
    assert "in the map's own folder" in faults(path)[0]


def test_a_map_can_be_read_to_build_its_network(tmp_path: Path) -> None:
    """Then the network need not exist, nor be named."""
    path = written(tmp_path, ("network: three_rooms.net.xml.gz", ""))
    assert read_map(path, network_required=False).network is None
    path = written(tmp_path, ("network: three", "network: four"))
    assert read_map(path, network_required=False).network == tmp_path / "four_rooms.net.xml.gz"


def test_a_network_outside_of_the_folder_is_not_written(tmp_path: Path) -> None:
    """The map would be refused when read."""
    building = read_map(written(tmp_path))
    (tmp_path / "sub").mkdir()
    with pytest.raises(NetworkOutsideError):
        write_map(building, tmp_path / "sub" / "copy.yaml")
    assert list((tmp_path / "sub").iterdir()) == []


def test_a_map_cannot_be_written_to_a_missing_folder(tmp_path: Path) -> None:
    """The error is ours and names the file."""
    building = BuildingMap(name="none", rooms=(), doors=())
    with pytest.raises(FileWriteError, match=r"missing/a\.yaml"):
        write_map(building, tmp_path / "missing" / "a.yaml")


def test_the_schema_describes_every_key_for_editors() -> None:
    """It is plain JSON with the keys of the file, closed to others."""
    schema = map_schema()
    assert schema["additionalProperties"] is False
    properties = schema["properties"]
    assert isinstance(properties, dict)
    assert set(properties) >= {"format", "rooms", "doors", "corridors", "network"}


finite = st.floats(0.1, 3, allow_nan=False)
names = st.text("abcdefghijklmnopqrstuvwxyzäß0123456789 .:-#'\"~{[&*!%@", min_size=1, max_size=12)


@st.composite
def buildings(draw: st.DrawFn) -> BuildingMap:
    """A row of rooms: neighbours share a door or have a corridor between them."""
    rooms: list[Room] = []
    doors: list[Door] = []
    corridors: list[Corridor] = []
    junctions: list[Junction] = []
    spawns: list[SpawnPoint] = []
    prefix = draw(st.sampled_from(["l", "true", "null", "no-", "y_"]))
    x = draw(st.floats(-1e4, 1e4))
    end: tuple[Point, RoomId] | None = None
    for i in range(draw(st.integers(1, 4))):
        name = RoomId(PlaceId(prefix + str(i) * bool(i)))
        gap = draw(st.sampled_from([0.0, 4.0])) if end is not None else 0.0
        left, right, top = x + gap, x + gap + 3 + draw(finite), 4 + draw(finite)
        block: tuple[Point, ...] = ((left + 1, 1), (left + 1.5, 1), (left + 1.5, 1.5))
        rooms.append(Room(name, ((left, 0), (right, 0), (right, top), (left, top)), (block,) * draw(st.integers(0, 1))))
        spawns.append(SpawnPoint(f"p{i}", name, Pose(left + 2, draw(finite), draw(st.floats(-4, 4)))))
        if end is not None and gap:
            a, b = DoorId(f"a{i}"), DoorId(f"b{i}")
            doors.append(Door(id=a, rooms=(end[1],), position=end[0], heading=0.0, width=1.0))
            doors.append(Door(id=b, rooms=(name,), position=(left, 2), heading=math.pi, width=0.7))
            bend = (x + draw(st.floats(0.5, 3)), 2 + draw(finite))
            junctions.append(Junction(f"j{i}", bend))
            shapes = (end[0], bend), (bend, (left - 0.25, 2.0), (left, 2.0))
            one_way = draw(st.booleans())
            single = draw(st.booleans())
            first, second = CorridorId(f"c{i}"), CorridorId(f"k{i}")
            speed = draw(st.floats(0.1, 3))
            corridors.append(
                Corridor(id=first, start=a, end=f"j{i}", shape=shapes[0], max_speed=speed, single_lane=single)
            )
            corridors.append(Corridor(id=second, start=f"j{i}", end=b, shape=shapes[1], one_way=one_way))
        elif end is not None:
            doors.append(Door(id=DoorId(f"s{i}"), rooms=(end[1], name), position=end[0], heading=0.0, width=1.0))
        x, end = right, ((right, 2.0), name)
    return BuildingMap(
        name=draw(names.filter(str.strip)),
        rooms=tuple(rooms),
        doors=tuple(doors),
        junctions=tuple(junctions),
        corridors=tuple(c for c in corridors),
        spawn_points=tuple(spawns),
    )


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(buildings())
def test_what_is_written_reads_back_the_same(tmp_path: Path, building: BuildingMap) -> None:
    """Every number to its last digit, every name whatever YAML may think that it means; short corridors are refused."""
    path = tmp_path / "row.yaml"
    write_map(building, path)
    try:
        assert read_map(path, network_required=False) == building
    except FileFaultsError as error:
        assert all("at least 1.2 m" in fault.expected for fault in error.faults)  # noqa: PT017
    assert [entry.name for entry in tmp_path.iterdir()] == ["row.yaml"]
