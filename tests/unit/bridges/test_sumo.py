"""SUMO networks: what the importer makes of them, and what it refuses."""

import gzip
from pathlib import Path

import pytest

from clo_fleet.bridges.drawings import Skipped, folded
from clo_fleet.bridges.sumo import SumoError, import_network
from clo_fleet.bridges.sumo.reading import MAX_NUMBER
from clo_fleet.cli import main
from clo_fleet.sim.map_folder import write_building
from clo_fleet.study.shipped import shipped
from clo_fleet.world.checks import map_findings
from clo_fleet.world.map_file import read_map
from clo_fleet.world.places import reachable_rooms

NODES = """\
<nodes>
    <node id="West" x="0" y="0"/>
    <node id="Mid" x="40" y="0" type="traffic_light"/>
    <node id="East" x="80" y="0"/>
    <node id="North" x="40" y="30"/>
    <node id="near" x="40.5" y="0.2"/>
    <node id="trap" x="60" y="-30"/>
</nodes>
"""
EDGES = """\
<edges>
    <edge id="a" from="West" to="Mid" numLanes="3" speed="13.9"/>
    <edge id="-a" from="Mid" to="West"/>
    <edge id="b" from="near" to="East" shape="40.5,0.2 60,5 80,0" speed="1"/>
    <edge id="-b" from="East" to="near" speed="1"/>
    <edge id="tiny" from="Mid" to="near"/>
    <edge id="-tiny" from="near" to="Mid"/>
    <edge id="up" from="Mid" to="North" bidi="true"/>
    <edge id="down" from="North" to="Mid" bidi="true"/>
    <edge id="astray" from="near" to="trap"/>
    <edge id="train" from="West" to="East"><lane index="0" allow="rail tram"/></edge>
    <edge id="shut" from="East" to="West" disallow="all"/>
    <roundabout nodes="Mid near" edges="tiny"/>
</edges>
"""


def written(folder: Path, nodes: str = NODES, edges: str = EDGES) -> Path:
    """The files; the nodes' one."""
    (folder / "town.nod.xml").write_text(nodes, encoding="utf-8")
    (folder / "town.edg.xml").write_text(edges, encoding="utf-8")
    return folder / "town.nod.xml"


def faults(path: Path, *rooms: str) -> str:
    """What is wrong with a network."""
    with pytest.raises(SumoError) as caught:
        import_network(path, rooms=rooms)
    return str(caught.value)


def test_edges_become_corridors_and_dead_ends_rooms(tmp_path: Path) -> None:
    """Edges there and back are one corridor, on one centre line a single lane; bends and limits stay."""
    building = import_network(written(tmp_path)).building
    assert {room.id for room in building.rooms} == {"room-west", "room-east", "room-north"}
    corridors = {str(corridor.id): corridor for corridor in building.corridors if "room" not in corridor.id}
    assert set(corridors) == {"west--mid", "mid--east", "mid--north"}
    assert corridors["mid--east"].shape[1:-1] == ((60.0, 5.0),)
    assert [corridors[name].max_speed for name in sorted(corridors)] == [1, 1.5, 1.5]
    assert [corridors[name].single_lane for name in sorted(corridors)] == [False, True, False]
    assert not any(corridor.one_way for corridor in building.corridors)


def test_a_map_is_sound_and_robots_get_everywhere_and_back(tmp_path: Path) -> None:
    """As after ``make-map``: files that are read back, and a way from every room to every other."""
    building, path = write_building(import_network(written(tmp_path)).building, tmp_path / "maps")
    assert read_map(path) == building
    assert map_findings(building) == ()
    rooms = {room.id for room in building.rooms}
    assert reachable_rooms(building, rooms) == dict.fromkeys(rooms, rooms)


def test_what_is_left_out_is_told(tmp_path: Path) -> None:
    """Lanes, trains, ways of no return, short edges, traffic lights."""
    told = [str(item) for item in import_network(written(tmp_path)).skipped]
    for what in (
        "lane 'beside another' (2 times)",
        "edge 'train': no lane of it",
        "edge 'shut': no lane of it",
        "edge 'tiny': under 1.2 m",
        "road 'Mid to trap': robots do not get there and back",
        "element '<roundabout>': not imported",
        "element '<traffic light>': not imported",
        "speed limit 'of corridors' (2 times): 1.5 m/s at most",
    ):
        assert any(line.startswith(what) for line in told), what


def test_named_nodes_get_rooms(tmp_path: Path) -> None:
    """In the widest gap between corridors; a node that became one with another stands for that one."""
    building = import_network(written(tmp_path), rooms=["near"]).building
    assert "room-mid" in {room.id for room in building.rooms}
    assert map_findings(building) == ()


def test_a_node_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """The nearest name is suggested."""
    assert "got 'Nort', expected the id of a node; did you mean North?" in faults(written(tmp_path), "Nort")


@pytest.mark.parametrize("name", ["office", "hello", "three_rooms"])
def test_our_own_networks_can_be_imported(name: str) -> None:
    """Doors are dead ends there, so there are as many rooms again as there are doors onto corridors."""
    original = read_map(shipped("maps") / f"{name}.yaml")
    assert original.network is not None
    if name == "three_rooms":  # two networks that nothing joins: the larger part is kept
        assert len(import_network(original.network).building.rooms) == 2
        return
    imported = import_network(original.network)
    assert len(imported.building.rooms) == sum(len(door.rooms) == 1 for door in original.doors)


def test_coordinates_far_away_come_near(tmp_path: Path) -> None:
    """Those of surveys, millions of metres from their origin."""
    nodes = '<nodes><node id="a" x="600000" y="5500000"/><node id="b" x="600040" y="5500000"/></nodes>'
    edges = '<edges><edge id="e" from="a" to="b"/><edge id="f" from="b" to="a"/></edges>'
    imported = import_network(written(tmp_path, nodes, edges))
    assert [junction.position for junction in imported.building.junctions] == [(0, 0), (40, 0)]
    assert str(imported.skipped[0]) == "offset '600000,5.5e+06': taken off all coordinates"


BOMB = '<?xml version="1.0"?><!DOCTYPE nodes [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><nodes>&b;</nodes>'


@pytest.mark.parametrize(
    ("nodes", "edges", "expected"),
    [
        (BOMB, EDGES, "town.nod.xml:1:1: (the file): got a document type 'nodes', expected none"),
        (NODES[:-9], EDGES, "town.nod.xml:8:1: (the file): got no element found, expected XML"),
        ("<net/>", EDGES, "got <net>, expected <nodes> outermost"),
        (NODES.replace('x="80"', 'x="far"'), EDGES, "town.nod.xml:4:1: East.x: got 'far', expected a number"),
        (NODES.replace('x="80"', 'x="nan"'), EDGES, "East.x: got 'nan'"),
        (NODES.replace('x="80"', 'x="1e300"'), EDGES, "East.x: got '1e300'"),
        (
            NODES,
            EDGES.replace('to="Mid"', 'to="Nod"', 1),
            "town.edg.xml:2:1: a.to: got 'Nod', expected the id of",
        ),
        (NODES, EDGES.replace('speed="13.9"', 'speed="-1"'), "a.speed: got -1, expected a speed above 0"),
        (NODES, EDGES.replace("60,5 80", "60;5 80"), "b.shape: got '60;5', expected points x,y or x,y,z"),
        (NODES, "<edges/>", "got 0 rooms, expected at least two dead ends, or nodes named as rooms"),
        ("<nodes>" + '<node id="n" x="0" y="0"/>' * 3 + "</nodes>", EDGES, "expected the id of a node"),
    ],
)
def test_faulty_files_are_refused_with_their_place(tmp_path: Path, nodes: str, edges: str, expected: str) -> None:
    """File, line, what was found and what was expected."""
    assert expected in faults(written(tmp_path, nodes, edges))


def test_files_that_are_not_there_or_too_large_are_refused(tmp_path: Path) -> None:
    """Missing files, more nodes than there may be, and what is not packed though it says so."""
    assert "No such file" in faults(tmp_path / "town.net.xml")
    many = "".join(f'<node id="n{number}" x="0" y="0"/>' for number in range(MAX_NUMBER + 1))
    assert "expected at most 10,000" in faults(written(tmp_path, f"<nodes>{many}</nodes>"))
    (tmp_path / "town.net.xml.gz").write_bytes(b"<net/>")
    assert "expected an XML file" in faults(tmp_path / "town.net.xml.gz")
    (tmp_path / "town.net.xml.gz").write_bytes(gzip.compress(b"<net version='1'/>")[:-6])
    assert "expected an XML file" in faults(tmp_path / "town.net.xml.gz")


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    """Up to twenty of them."""
    told = faults(written(tmp_path, NODES, EDGES.replace('to="', 'to="x')))
    assert told.count("expected the id of a node") == 11


def test_many_left_out_for_one_reason_are_one_line() -> None:
    """Few of them are told one by one."""
    few = [Skipped("edge", name, "why") for name in "abc"]
    assert folded(few) == tuple(few)
    many = [Skipped("edge", name, "why") for name in "abcdefgh"]
    assert [str(item) for item in folded(many)] == ["edge 'a, b, c, d, ...' (8 times): why"]


def test_the_command_knows_the_kind_by_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``import-map`` writes a map that ``validate`` finds sound."""
    path = written(tmp_path)
    assert main(["import-map", str(path), "-o", str(tmp_path / "maps"), "--room", "Mid"]) == 0
    assert "4 rooms" in capsys.readouterr().out
    assert main(["validate", str(tmp_path / "maps" / "town.yaml")]) == 0
    assert main(["import-map", str(path), "-o", str(tmp_path / "maps")]) == 2
    assert "nothing was overwritten" in capsys.readouterr().err
