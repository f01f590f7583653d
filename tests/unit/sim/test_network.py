"""Corridor networks: what netconvert makes of a map, and what the check finds."""

import gzip
from dataclasses import replace
from math import dist
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from clo_fleet.sim import network
from clo_fleet.sim.network import (
    NetconvertMissingError,
    NetworkBuildError,
    build_network,
    network_edges,
)
from clo_fleet.sim.network_check import check_network
from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, Junction, Point, RoomId

DOORS: dict[str, Point] = {"west": (-8.0, 0.0), "east": (8.0, 0.0), "south": (0.0, -8.0), "north": (0.0, 8.0)}


def door(name: str, position: Point) -> Door:
    """A door onto corridors; its heading does not matter to the network."""
    return Door(id=DoorId(name), rooms=(RoomId("l1"),), position=position, heading=0.0, width=1.6)


def corridor(name: str, start: str, end: str, *shape: Point, **more: bool | float) -> Corridor:
    """A corridor along a line."""
    return Corridor(id=CorridorId(name), start=start, end=end, shape=shape, **more)  # type: ignore[arg-type]


def plus(*names: str) -> BuildingMap:
    """Corridors of 8 m from the doors named to a junction in the middle."""
    return BuildingMap(
        name="plus",
        rooms=(),
        doors=tuple(door(n, DOORS[n]) for n in names),
        junctions=(Junction("j", (0.0, 0.0)),),
        corridors=tuple(corridor(f"c-{n}", n, "j", DOORS[n], (0.0, 0.0)) for n in names),
    )


PLUS = plus("west", "east", "south", "north")


@pytest.fixture(scope="module")
def plus_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The network of the plus."""
    path = tmp_path_factory.mktemp("plus") / "plus.net.xml.gz"
    build_network(PLUS, path)
    return path


def parsed(path: Path) -> ET.Element:
    """The network's XML."""
    return ET.fromstring(gzip.decompress(path.read_bytes()))


def edited(source: Path, folder: Path, old: str, new: str) -> Path:
    """A copy of a network with some text replaced, which must be there."""
    text = gzip.decompress(source.read_bytes()).decode()
    assert old in text
    path = folder / "edited.net.xml.gz"
    path.write_bytes(gzip.compress(text.replace(old, new).encode()))
    return path


def lane_shape(path: Path, edge: str) -> list[Point]:
    """The points of an edge's lane."""
    lane = parsed(path).find(f"edge[@id='{edge}']/lane")
    assert lane is not None
    return [(float(x), float(y)) for x, y in (p.split(",") for p in lane.attrib["shape"].split())]


def test_a_network_has_an_edge_for_each_direction_and_passes_its_check(plus_file: Path) -> None:
    """Edges are named after corridors, with a minus for the way back."""
    ids = {e.attrib["id"] for e in parsed(plus_file).iterfind("edge") if e.get("function") != "internal"}
    assert ids == {f"{sign}c-{name}" for name in DOORS for sign in ("", "-")}
    assert check_network(PLUS, plus_file) == ()


def test_lanes_run_to_the_right_of_the_centre_line_from_the_very_door(plus_file: Path) -> None:
    """Eastbound is south of the centre line, westbound north; the junction takes 1.3 m."""
    assert lane_shape(plus_file, "c-west") == [(-8.0, -0.35), (-1.3, -0.35)]
    assert lane_shape(plus_file, "-c-west") == [(-1.3, 0.35), (-8.0, 0.35)]


def test_where_corridors_cross_everybody_stops_and_nobody_turns_round(plus_file: Path) -> None:
    """The junction is an all-way stop with the twelve turns of a crossing; doors are plain ends."""
    root = parsed(plus_file)
    assert {j.attrib["id"]: j.attrib["type"] for j in root.iterfind("junction")} == {
        "j": "allway_stop",
        **dict.fromkeys(DOORS, "dead_end"),
    }
    turns = [(c.attrib["from"], c.attrib["to"]) for c in root.iterfind("connection") if c.get("via")]
    assert len(turns) == 12
    assert all(a != f"{b[1:]}" for a, b in turns)


def test_building_twice_gives_the_same_bytes_without_dates_or_paths(plus_file: Path, tmp_path: Path) -> None:
    """Networks can be kept under version control."""
    again = tmp_path / "again.net.xml.gz"
    build_network(PLUS, again)
    assert again.read_bytes() == plus_file.read_bytes()
    assert b"<!--" not in gzip.decompress(again.read_bytes())
    assert list(tmp_path.iterdir()) == [again]


def test_a_one_way_corridor_has_only_its_forward_edge(tmp_path: Path) -> None:
    """And its lane still lies right of the centre line."""
    building = replace(PLUS, corridors=(replace(PLUS.corridors[0], one_way=True), *PLUS.corridors[1:]))
    build_network(building, path := tmp_path / "net.xml.gz")
    assert "-c-west" not in {e.id for e in network_edges(building)}
    assert parsed(path).find("edge[@id='-c-west']") is None
    assert {y for _, y in lane_shape(path, "c-west")} == {-0.35}
    assert check_network(building, path) == ()
    assert check_network(PLUS, path)[0] == "edge '-c-west' is missing"


def single_lanes() -> BuildingMap:
    """The plus, whose western and northern arms have a single lane."""
    arms = (replace(arm, single_lane=arm.id in ("c-west", "c-north")) for arm in PLUS.corridors)
    return replace(PLUS, corridors=tuple(arms))


def test_a_single_lane_runs_along_the_centre_line_in_both_directions(tmp_path: Path) -> None:
    """To the last digit the same line, and SUMO knows that the two edges share it."""
    building = single_lanes()
    build_network(building, path := tmp_path / "net.xml.gz")
    assert {y for _, y in lane_shape(path, "c-west")} == {0.0}
    assert lane_shape(path, "c-west") == lane_shape(path, "-c-west")[::-1]
    pairs = {e.attrib["id"]: e.get("bidi") for e in parsed(path).iterfind("edge[@priority]")}
    assert {a: b for a, b in pairs.items() if b} == {
        "c-west": "-c-west",
        "-c-west": "c-west",
        "c-north": "-c-north",
        "-c-north": "c-north",
    }
    assert check_network(building, path) == ()


def test_the_check_tells_single_lanes_from_others(plus_file: Path, tmp_path: Path) -> None:
    """A network built before a corridor got its single lane is refused, and the other way round."""
    build_network(single_lanes(), path := tmp_path / "net.xml.gz")
    assert any("'c-west' shares its lane with '-c-west'" in fault for fault in check_network(PLUS, path))
    assert any("'-c-north' shares its lane with 'none'" in fault for fault in check_network(single_lanes(), plus_file))


def test_two_lanes_join_smoothly_to_the_single_one_that_goes_on(tmp_path: Path) -> None:
    """From lane to lane it is as far as a robot can follow with its wheels, not a step to the side."""
    arms = plus("west", "east")
    building = replace(arms, corridors=(replace(arms.corridors[0], single_lane=True), arms.corridors[1]))
    build_network(building, path := tmp_path / "net.xml.gz")
    (x, y), (after_x, after_y) = lane_shape(path, "c-west")[-1], lane_shape(path, "-c-east")[0]
    assert (y, after_y) == (0.0, -0.35)
    assert after_x - x >= 0.9
    assert check_network(building, path) == ()


def test_bends_and_sharp_corners_pass_the_check(tmp_path: Path) -> None:
    """A lane follows its corridor's shape; where two corridors meet there is no stop."""
    building = replace(
        plus("west", "north"),
        corridors=(
            corridor("a", "west", "j", (-8.0, 0.0), (-4.0, 3.0), (-4.0, -3.0), (0.0, 0.0), max_speed=0.8),
            corridor("b", "j", "north", (0.0, 0.0), (3.0, 3.0), (0.0, 8.0)),
        ),
    )
    build_network(building, path := tmp_path / "net.xml.gz")
    assert check_network(building, path) == ()
    junction = parsed(path).find("junction[@id='j']")
    assert junction is not None
    assert junction.attrib["type"] == "priority"


def test_one_may_turn_round_only_where_a_corridor_just_ends(tmp_path: Path) -> None:
    """At a blind junction, not at a door."""
    building = replace(
        plus("west", "east"),
        junctions=(Junction("j", (0.0, 0.0)), Junction("blind", (0.0, 5.0))),
        corridors=(*plus("west", "east").corridors, corridor("spur", "j", "blind", (0.0, 0.0), (0.0, 5.0))),
    )
    build_network(building, path := tmp_path / "net.xml.gz")
    turns = {(c.attrib["from"], c.attrib["to"]) for c in parsed(path).iterfind("connection")}
    assert ("spur", "-spur") in turns
    assert not {("-c-west", "c-west"), ("c-west", "-c-west")} & turns
    assert check_network(building, path) == ()


def test_no_lane_is_counted_too_short_for_a_robot(tmp_path: Path) -> None:
    """Between two crossings 2.2 m apart only 0.2 m of lane are left."""
    west, east = (-1.1, 0.0), (1.1, 0.0)
    ends: dict[str, tuple[Point, str, Point]] = {
        "a": ((-8.0, 0.0), "j1", west),
        "b": ((-1.1, 8.0), "j1", west),
        "c": ((8.0, 0.0), "j2", east),
        "d": ((1.1, 8.0), "j2", east),
    }
    building = BuildingMap(
        name="close",
        rooms=(),
        doors=tuple(door(n, p) for n, (p, _, _) in ends.items()),
        junctions=(Junction("j1", west), Junction("j2", east)),
        corridors=(
            corridor("mid", "j1", "j2", west, east),
            *(corridor(f"c-{n}", n, j, p, q) for n, (p, j, q) in ends.items()),
        ),
    )
    build_network(building, path := tmp_path / "net.xml.gz")
    lane = parsed(path).find("edge[@id='mid']/lane")
    assert lane is not None
    assert float(lane.attrib["length"]) == network.SHORTEST_LANE
    a, b = lane_shape(path, "mid")
    assert dist(a, b) < network.SHORTEST_LANE
    assert check_network(building, path) == ()


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('id="c-west"', 'id="c-waste"', "edge 'c-waste' is no corridor of the map"),
        ('length="6.700" width="0.700" shape="-8', 'length="9.300" width="0.700" shape="-8', "'c-west' is 9.3 m long"),
        ('length="6.700" width="0.700" shape="-8', 'length="-7" width="0.700" shape="-8', "'c-west' is -7 m long"),
        ('id="west" type="dead_end" x="-8.000"', 'id="west" type="dead_end" x="-8.100"', "node 'west' is not at"),
        ('shape="-8.000,-0.350 ', 'shape="-8.000,-2.000 ', "edge 'c-west' runs 2.00 m beside its corridor"),
        ('id="c-west_0" index="0" speed="1.500"', 'id="c-west_0" index="0" speed="9"', "allows 9 m/s instead of 1.5"),
        ('id="c-west" from="west"', 'id="c-west" from="east"', "edge 'c-west' leads from 'east' to 'j'"),
        ('from="c-west" to="-c-east"', 'from="c-west" to="c-west"', "the turn from 'c-west' to '-c-east' is missing"),
        ("<net ", "<nodes><net ", "is no SUMO network"),
        ("<?xml", "<!DOCTYPE net><?xml", "is no SUMO network"),
        (' shape="-8.000,-0.350 ', ' shape="nan,-0.350 ', "has no proper shape"),
    ],
)
def test_the_check_names_what_differs(plus_file: Path, tmp_path: Path, old: str, new: str, fault: str) -> None:
    """Each difference is told in one sentence."""
    assert any(fault in found for found in check_network(PLUS, edited(plus_file, tmp_path, old, new)))


@pytest.mark.parametrize("cut", [0, 1, 2, 5, 200])
def test_a_file_that_cannot_be_read_is_one_fault(plus_file: Path, tmp_path: Path, cut: int) -> None:
    """Absent, empty and torn files are told, not raised."""
    path = tmp_path / "torn.net.xml.gz"
    assert "cannot be read" in check_network(PLUS, path)[0]
    path.write_bytes(plus_file.read_bytes()[:cut])
    (fault,) = check_network(PLUS, path)
    assert "torn.net.xml.gz" in fault


def test_a_map_without_corridors_or_with_a_loose_end_has_no_network(tmp_path: Path) -> None:
    """And the file that was there stays."""
    path = tmp_path / "kept.net.xml.gz"
    path.write_bytes(b"old")
    with pytest.raises(NetworkBuildError, match="'plus': it has no corridors"):
        build_network(replace(PLUS, corridors=()), path)
    with pytest.raises(NetworkBuildError, match="'c-east' leads to unknown 'j'"):
        build_network(replace(PLUS, junctions=()), path)
    assert path.read_bytes() == b"old"


def test_without_netconvert_the_error_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Building is an extra."""
    monkeypatch.setattr(network, "find_spec", lambda _: None)
    with pytest.raises(NetconvertMissingError, match=r"pip install 'clo-fleet\[maps\]'"):
        build_network(PLUS, tmp_path / "net.xml.gz")
