"""Open-RMF buildings: what the importer makes of real ones, and of small ones drawn here."""

import math
from itertools import combinations, permutations
from pathlib import Path

import pytest
import shapely

from clo_fleet.bridges.drawings import slug
from clo_fleet.bridges.open_rmf import Imported, OpenRmfError, import_building, import_to_folder
from clo_fleet.sim.map_folder import MapExistsError
from clo_fleet.sim.network import build_network
from clo_fleet.sim.network_check import check_network
from clo_fleet.sim.routes import Routes
from clo_fleet.world.checks import map_findings
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import Door
from clo_fleet.world.outlines import area, clearance, length, wall_distance

REAL = Path(__file__).parents[4] / "shared/maps/open-rmf"
BUILDINGS = ("office", "battle_royale", "triple_H")

# A hall of 20 m x 6 m with a room of 20 m x 4 m above it, 20 pixels to the metre. The door between them is 1 m wide.
SKETCH = """\
name: sketch
levels:
  L1:
    vertices:
      - [0, 0, 0, ""]
      - [400, 0, 0, ""]
      - [400, 200, 0, ""]
      - [0, 200, 0, ""]
      - [0, 80, 0, ""]
      - [190, 80, 0, ""]
      - [210, 80, 0, ""]
      - [400, 80, 0, ""]
      - [20, 160, 0, Dock 1, {spawn_robot_name: [1, r1], is_charger: [4, true]}]
      - [200, 160, 0, middle]
      - [380, 160, 0, shelf, {pickup_dispenser: [1, cans]}]
      - [200, 40, 0, desk, {dropoff_ingestor: [1, bin]}]
    lanes:
      - [8, 9, {bidirectional: [4, true]}]
      - [9, 10, {bidirectional: [4, true], speed_limit: [3, 0.5]}]
      - [9, 11, {bidirectional: [4, true]}]
    walls: [[0, 1, {}], [1, 2, {}], [2, 3, {}], [3, 0, {}], [4, 5, {}], [6, 7, {}]]
    doors:
      - [5, 6, {name: [1, Desk Door]}]
    floors:
      - {vertices: [0, 1, 2, 3]}
    measurements:
      - [0, 1, {distance: [3, 20]}]
    models:
      - {model_name: Maker/Chair, x: 1, y: 1}
      - {model_name: Chair, x: 2, y: 1}
lifts: {}
"""


@pytest.fixture(scope="module")
def real() -> dict[str, Imported]:
    """The real buildings, imported once."""
    if not REAL.is_dir():
        pytest.skip("the Open-RMF buildings are not beside this checkout")
    return {name: import_building(REAL / f"{name}.building.yaml") for name in BUILDINGS}


@pytest.fixture(scope="module")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> Imported:
    """The sketch, imported once."""
    return import_building(drawn(tmp_path_factory.mktemp("sketch")))


def drawn(folder: Path, *changes: tuple[str, str]) -> Path:
    """The sketch as a file, with texts replaced."""
    text = SKETCH
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "sketch.building.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(path: Path, level: str | None = None) -> str:
    """What the importer says when it refuses a file."""
    with pytest.raises(OpenRmfError) as caught:
        import_building(path, level=level)
    return str(caught.value)


def ahead(door: Door, distance: float) -> tuple[float, float]:
    """The point that far straight out of a door."""
    x, y = door.position
    return (x + distance * math.cos(door.heading), y + distance * math.sin(door.heading))


def check_geometry(imported: Imported) -> None:
    """Whatever every imported map keeps to."""
    building = imported.building
    assert map_findings(building) == ()
    rooms = {room.id: room for room in building.rooms}
    polygons = {name: shapely.Polygon(room.outline) for name, room in rooms.items()}
    assert all(polygon.is_valid for polygon in polygons.values())
    assert all(area(room.outline) > 1.0 for room in building.rooms), "counter-clockwise"
    for a, b in combinations(polygons.values(), 2):
        assert a.intersection(b).area < 1e-6
    nodes = {junction.id: junction.position for junction in building.junctions}
    nodes |= {door.id: door.position for door in building.doors}
    lines = {corridor.id: shapely.LineString(corridor.shape) for corridor in building.corridors}
    for door in building.doors:
        assert wall_distance(rooms[door.rooms[0]].outline, door.position) <= 0.05
        assert not polygons[door.rooms[0]].buffer(0.01).covers(shapely.Point(ahead(door, 0.05)))
        assert door.width >= 0.9
        for corridor in building.corridors:
            if door.id in (corridor.start, corridor.end):
                run = corridor.shape if corridor.start == door.id else corridor.shape[::-1]
                begin = shapely.LineString([door.position, ahead(door, 1.2)])
                assert lines[corridor.id].hausdorff_distance(shapely.LineString(run)) == 0
                assert lines[corridor.id].buffer(0.005).covers(begin), f"{corridor.id} bends in the doorway"
    for corridor in building.corridors:
        assert corridor.shape[0] == nodes[corridor.start]
        assert corridor.shape[-1] == nodes[corridor.end]
        assert length(corridor.shape) >= 1.2
        for polygon in polygons.values():
            assert lines[corridor.id].intersection(polygon.buffer(-0.01)).is_empty
    for one, two in combinations(building.corridors, 2):
        if not {one.start, one.end} & {two.start, two.end}:
            assert not lines[one.id].intersects(lines[two.id]), f"{one.id} crosses {two.id}"
    for spawn in building.spawn_points:
        assert clearance(rooms[spawn.room], spawn.pose.point) >= 0.35
    routes = Routes(building)
    outside = [door.id for door in building.doors if len(door.rooms) == 1]
    assert len(outside) > 1
    assert all(routes.fastest(a, b) is not None for a, b in permutations(outside, 2))


@pytest.mark.parametrize("name", BUILDINGS)
def test_a_real_building_becomes_a_sound_map(real: dict[str, Imported], name: str) -> None:
    """Rooms, doors, corridors and spawn points fit together, and every door is reached from every other."""
    check_geometry(real[name])


@pytest.mark.parametrize("name", BUILDINGS)
def test_sumo_takes_a_real_building(real: dict[str, Imported], name: str, tmp_path: Path) -> None:
    """Netconvert makes a network of it that is the map's, with all the turns between doors."""
    pytest.importorskip("sumo", reason="netconvert comes with the extra `maps`")
    network = tmp_path / f"{name}.net.xml.gz"
    build_network(real[name].building, network)
    assert check_network(real[name].building, network) == ()


def test_a_written_map_reads_back(tmp_path: Path) -> None:
    """The map and its network lie side by side in the folder, which is made."""
    pytest.importorskip("sumo", reason="netconvert comes with the extra `maps`")
    imported, path = import_to_folder(drawn(tmp_path), tmp_path / "maps" / "mine")
    assert path == tmp_path / "maps" / "mine" / "sketch.yaml"
    assert read_map(path) == imported.building


def test_the_office_has_its_cells_scale_and_places(real: dict[str, Imported]) -> None:
    """Three cells; rooms behind the two doors; bays for dispensers and chargers that are in the hub."""
    office = real["office"]
    assert office.cells == 3
    assert office.scale_m_per_px == pytest.approx(0.00847, rel=0.01)
    places = {"coe", "hardware_2", "pantry", "tinyrobot1_charger", "tinyrobot2_charger"}
    assert places <= {room.id for room in office.building.rooms}
    assert places <= {spawn.id for spawn in office.building.spawn_points}
    doors = [(door.id, *door.rooms) for door in office.building.doors]
    assert doors[:2] == [("coe_door", "coe"), ("hardware_door", "hardware_2")]


def test_the_office_report_names_what_is_left_out(real: dict[str, Imported]) -> None:
    """The door to the street, lanes inside rooms, and furniture, which has no size, are listed."""
    skipped = {(entry.kind, entry.name): entry for entry in real["office"].skipped}
    assert ("door", "main_door") in skipped
    assert ("lane", "v64-coe") in skipped
    assert skipped["model", "OfficeChairBlack"].count == 9
    assert "9 times" in str(skipped["model", "OfficeChairBlack"])


@pytest.mark.parametrize("name", ["battle_royale", "triple_H"])
def test_an_arena_without_doors_gets_a_bay_at_each_place(real: dict[str, Imported], name: str) -> None:
    """Where a level is one cell, each start and goal at the end of a lane becomes a room."""
    assert real[name].cells == 1
    assert len(real[name].building.rooms) == 8
    assert len(real[name].building.spawn_points) == 8


def test_the_sketch_has_a_room_and_two_bays(sketch: Imported) -> None:
    """A cell with a door is a room named after the place in it; places in the hub get bays."""
    check_geometry(sketch)
    assert [room.id for room in sketch.building.rooms] == ["desk", "dock_1", "shelf"]
    assert [door.id for door in sketch.building.doors] == ["desk_door", "dock_1_door", "shelf_door"]
    assert sketch.scale_m_per_px == pytest.approx(0.05)
    assert sketch.cells == 2


def test_y_points_up(sketch: Imported) -> None:
    """The drawing's y points down, the map's up: the room that is drawn on top has the larger y."""
    desk, dock = sketch.building.rooms[:2]
    assert min(y for _, y in desk.outline) > max(y for _, y in dock.outline)


def test_bays_lie_on_the_hub_floor(sketch: Imported) -> None:
    """A bay is at most 3 m x 3 m, between the walls, and contains its place."""
    hall = shapely.box(0.05, -9.95, 19.95, -4.05)
    for room, place in zip(sketch.building.rooms[1:], ((1.0, -8.0), (19.0, -8.0)), strict=True):
        polygon = shapely.Polygon(room.outline)
        assert hall.buffer(0.002).covers(polygon)
        assert polygon.covers(shapely.Point(place))
        assert polygon.area < 9.01


def test_a_lane_keeps_its_speed_limit(sketch: Imported) -> None:
    """The limit holds in the corridor that the lane became; others have the default."""
    assert {corridor.max_speed for corridor in sketch.building.corridors} == {0.5, 1.5}


def test_a_narrow_door_is_widened_and_said_to_be(sketch: Imported) -> None:
    """Robots leave in lanes side by side, which 1 m is too narrow for."""
    assert sketch.building.doors[0].width == 1.6
    assert any(entry.kind == "door" and "1.00 m to 1.60 m" in entry.reason for entry in sketch.skipped)


def test_models_are_counted_by_name(sketch: Imported) -> None:
    """Who made a model does not matter."""
    assert [(entry.name, entry.count) for entry in sketch.skipped if entry.kind == "model"] == [("Chair", 2)]


def test_importing_twice_gives_the_same(sketch: Imported, tmp_path: Path) -> None:
    """Nothing depends on chance or on the order of sets."""
    assert import_building(drawn(tmp_path)) == sketch


def test_a_door_between_two_rooms_joins_them(tmp_path: Path) -> None:
    """A cell behind a room is reached through it."""
    corners = ('[60, 0, 0, ""]', '[60, 30, 0, ""]', '[60, 52, 0, ""]', '[60, 80, 0, ""]', "[20, 40, 0, store]")
    path = drawn(
        tmp_path,
        ("    lanes:\n", "".join(f"      - {corner}\n" for corner in corners) + "    lanes:\n"),
        ("[6, 7, {}]]", "[6, 7, {}], [12, 13, {}], [14, 15, {}]]"),
        ("    floors:", "      - [13, 14, {name: [1, inner]}]\n    floors:"),
    )
    imported = import_building(path)
    check_geometry(imported)
    assert imported.cells == 3
    inner = next(door for door in imported.building.doors if door.id == "inner")
    assert sorted(inner.rooms) == ["desk", "store"]


def test_a_cell_without_a_door_is_reported(tmp_path: Path) -> None:
    """It is not guessed how robots would come in."""
    path = drawn(tmp_path, ("    doors:\n      - [5, 6, {name: [1, Desk Door]}]\n", ""), ("[6, 7", "[5, 6, {}], [6, 7"))
    imported = import_building(path)
    assert "desk" not in [room.id for room in imported.building.rooms]
    assert [entry.name for entry in imported.skipped if entry.kind == "room"] == ["desk"]


def test_lanes_that_are_one_way_to_a_place_are_refused(tmp_path: Path) -> None:
    """A robot that left could not come back."""
    vertex = ("    lanes:\n", '      - [75, 160, 0, ""]\n    lanes:\n')
    lanes = ("[8, 9, {bidirectional: [4, true]}]", "[8, 12, {}]\n      - [12, 9, {bidirectional: [4, false]}]")
    assert "one-way" in refusal(drawn(tmp_path, vertex, lanes))


def test_a_level_has_to_be_chosen_among_several(tmp_path: Path) -> None:
    """A map has one level; the others and the lifts are reported."""
    second = SKETCH[SKETCH.index("  L1:") : SKETCH.index("lifts:")].replace("L1:", "L2:")
    path = drawn(tmp_path, ("lifts: {}", f"{second}lifts:\n  Lift1: {{}}"))
    assert "expected a choice with --level, one of: L1, L2" in refusal(path)
    assert "no such level" in refusal(path, "L3")
    found = {(entry.kind, entry.name) for entry in import_building(path, level="L2").skipped}
    assert {("level", "L1"), ("lift", "Lift1")} <= found


@pytest.mark.parametrize(
    ("old", "new", "place", "expected"),
    [
        ("[8, 9, {", "[8, 99, {", ":18:9: levels.L1.lanes[0]", "12 vertices"),
        ("[0, 0, 0,", "[zero, 0, 0,", ":5:", "a vertex"),
        ("distance: [3, 20]", "distance: [3, 0]", "measurements[0]", "above 0"),
        ("vertices: [0, 1, 2, 3]", "vertices: [0, 1]", "floors[0]", "three"),
        ("name: sketch", "coordinate_system: wgs84", "coordinate_system", "reference_image"),
        ("name: sketch", "name: [", "", "sketch.building.yaml"),
    ],
)
def test_a_fault_names_its_place(tmp_path: Path, old: str, new: str, place: str, expected: str) -> None:
    """File, line or key, value and what was expected."""
    said = refusal(drawn(tmp_path, (old, new)))
    assert "sketch.building.yaml:" in said
    assert place in said
    assert expected in said


def test_all_faults_come_at_once(tmp_path: Path) -> None:
    """Nobody has to start the import again for each."""
    said = refusal(drawn(tmp_path, ("[8, 9, {", "[8, 99, {"), ("vertices: [0, 1, 2, 3]", "vertices: [0, 1]")))
    assert len(said.splitlines()) == 2


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    """With its name."""
    assert "nowhere.yaml" in refusal(tmp_path / "nowhere.yaml")


def test_a_building_without_places_is_refused(tmp_path: Path) -> None:
    """Lanes alone give robots nothing to do."""
    changes = (
        ("spawn_robot_name: [1, r1], ", ""),
        ("pickup_dispenser: [1, cans]", ""),
        ("dropoff_ingestor: [1, bin]", ""),
    )
    no_door = ("      - [5, 6, {name: [1, Desk Door]}]\n", "      []\n")
    assert "0 of them, expected two rooms or places" in refusal(drawn(tmp_path, *changes, no_door))


def test_a_map_is_not_overwritten_unasked(tmp_path: Path) -> None:
    """``force`` asks for it."""
    (tmp_path / "sketch.yaml").write_text("mine", encoding="utf-8")
    with pytest.raises(MapExistsError):
        import_to_folder(drawn(tmp_path), tmp_path)
    assert (tmp_path / "sketch.yaml").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    ("name", "expected"),
    [("tinyRobot1_charger", "tinyrobot1_charger"), ("2nd floor", "p2nd_floor"), ("é", ""), ("zone-1", "zone_1")],
)
def test_names_become_ids(name: str, expected: str) -> None:
    """Ids are lower-case PDDL names, none of them a zone's."""
    assert slug(name) == expected
