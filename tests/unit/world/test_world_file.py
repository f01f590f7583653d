"""World files: what is read, and every fault at its place."""

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clo_fleet.world.disturbances import ObjectMoved, RobotSlowed
from clo_fleet.world.faults import FileFaultsError
from clo_fleet.world.model import Perception, PerceptionMode, PlanningTime, Pose, Radio
from clo_fleet.world.world_file import read_world, world_schema

MAP = """\
format: clo-fleet/map/1
rooms:
  l1: {outline_m: [[0, 0], [6, 0], [6, 5], [0, 5]], obstacles_m: [[[3, 3], [4, 3], [4, 4], [3, 4]]]}
  l2: {outline_m: [[6, 0], [12, 0], [12, 5], [6, 5]]}
  l3: {outline_m: [[20, 0], [26, 0], [26, 5], [20, 5]]}
  l4: {outline_m: [[40, 0], [46, 0], [46, 5], [40, 5]]}
doors:
  d12: {rooms: [l1, l2], at_m: [6, 2.5], width_m: 1}
  d2: {rooms: [l2], at_m: [12, 2.5], width_m: 1}
  d3: {rooms: [l3], at_m: [20, 2.5], width_m: 1}
corridors:
  c1: {from: d2, to: d3, one_way: true}
spawn_points:
  p1: {room: l1, at_m: [1, 1], heading_rad: 0.5}
  p2: {room: l2, at_m: [7, 1]}
network: m.net.xml.gz
"""
WORLD = """\
format: clo-fleet/world/1
map: ../maps/m.yaml
seed: 7
until_s: 600
perception: {mode: full, range_m: 10}
radio: {facts: false, delay_s: 1, loss: 0.5}
planning: {fixed_s: 1, per_expansion_s: 0.001, wall_limit_s: 30, memory_limit_mb: 512, partly: true}
skills: {prepare_s: 8, spread: 0.1}
robots:
  r1: {at: p1, goals: ["(holding r1 o1)", "(at-object o2 l3)", "(PREPARED o1)"]}
  r2: {room: l2, at_m: [9, 2], heading_rad: 1, max_speed_m_s: 2, goals: ["(at-robot r2 l3)"]}
objects:
  o1: {room: l1, at_m: [2, 1], prepared: true, mass_kg: 2}
  o2: {at: p2}
disturbances:
  - {kind: object_moved, at_s: 12, object: o1, to_m: [1, 4]}
  - {kind: robot_slowed, at_s: 5, robot: r1, max_speed_m_s: 0.3}
expected: {outcome: goals_reached}
"""


def written(folder: Path, *edits: tuple[str, str], building: str = MAP) -> Path:
    """The world above with some texts replaced, and its map in the neighbouring folder."""
    text = WORLD
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    for name in ("maps", "worlds"):
        (folder / name).mkdir(exist_ok=True)
    (folder / "maps" / "m.yaml").write_text(building, encoding="utf-8")
    (folder / "maps" / "m.net.xml.gz").touch()
    path = folder / "worlds" / "w.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(path: Path) -> list[str]:
    """The faults of the world file and its map, with the files' bare names for files other than the world."""
    with pytest.raises(FileFaultsError) as error:
        read_world(path)
    texts = [str(fault) for fault in error.value.faults]
    return [text.removeprefix(f"{path}:").removeprefix(f"{path.parent}/../maps/") for text in texts]


def test_a_world_is_read_into_values(tmp_path: Path) -> None:
    """With its map, defaults where nothing is said, goals as facts and spawn points as poses."""
    world = read_world(written(tmp_path))
    assert (world.name, world.seed, world.until) == ("w", 7, 600.0)
    assert [room.id for room in world.map.rooms] == ["l1", "l2", "l3", "l4"]
    first, second = world.robots
    assert (first.room, first.pose) == ("l1", Pose(1, 1, 0.5))
    assert first.goals == (("holding", "r1", "o1"), ("at-object", "o2", "l3"), ("prepared", "o1"))
    assert (first.radius, first.max_speed, first.max_acceleration) == (0.3, 1.0, 1.0)
    assert (second.room, second.pose, second.max_speed) == ("l2", Pose(9, 2, 1), 2.0)
    assert [(thing.room, thing.position, thing.prepared) for thing in world.objects] == [
        ("l1", (2, 1), True),
        ("l2", (7, 1), False),
    ]
    assert [thing.mass for thing in world.objects] == [2.0, 1.0]
    assert world.perception == Perception(PerceptionMode.FULL, 10.0)
    assert world.radio == Radio(facts=False, range=None, delay=1.0, loss=0.5)
    times = PlanningTime(fixed=1.0, per_expansion=0.001, wall_limit=30.0, memory_limit=512 << 20, partly=True)
    assert world.planning == times
    assert (world.skills.prepare, world.skills.grasp, world.skills.spread) == (8.0, 2.0, 0.1)
    moved, slowed = world.disturbances
    assert isinstance(moved, ObjectMoved)
    assert (moved.time, moved.object, moved.position) == (12.0, "o1", (1, 4))
    assert isinstance(slowed, RobotSlowed)
    assert (slowed.time, slowed.robot, slowed.max_speed) == (5.0, "r1", 0.3)
    assert world.expected == (("outcome", "goals_reached"),)


def test_only_format_map_and_robots_are_required(tmp_path: Path) -> None:
    """Everything else has its default from the model, and the name is the file's."""
    path = written(tmp_path)
    path.write_text("format: clo-fleet/world/1\nmap: ../maps/m.yaml\nrobots: {r1: {at: p1}}\n")
    world = read_world(path)
    assert (world.name, world.seed, world.until, world.objects) == ("w", 0, 900.0, ())
    assert (world.perception, world.radio, world.planning) == (Perception(), Radio(), PlanningTime())


@pytest.mark.parametrize(
    ("old", "new", "start", "words"),
    [
        ("format: clo-fleet/world/1", "# none", "2:1: format: got nothing", "required"),
        ("world/1", "world/9", "1:1: format: got 'clo-fleet/world/9'", "clo-fleet/world/1"),
        ("map: ../maps/m.yaml", "# none", "1:1: map: got nothing", "required"),
        ("m.yaml", "none.yaml", "2:1: map: got '../maps/none.yaml'", "a map file (.yaml) that exists"),
        ("../maps/m.yaml", "../maps", "2:1: map: got '../maps'", "a map file (.yaml) that exists"),
        ("../maps/m.yaml", "/etc/passwd", "2:1: map: got '/etc/passwd'", "relative to the world file"),
        ("../maps/m.yaml", "x" * 199, "2:1: map: got 'xxx", "a map file"),
        ("seed: 7", "seed: -1", "3:1: seed: got -1", "at least 0"),
        ("seed: 7", "seed: 1.5", "3:1: seed: got 1.5", "a whole number"),
        ("seed: 7", "seed: '7'", "3:1: seed: got '7'", "a whole number, without quotes"),
        ("seed: 7", "seed: true", "3:1: seed: got true", "a whole number"),
        ("seed: 7", "seed: " + "9" * 5000, "3:1: seed: got inf", "a whole number"),
        ("seed: 7", "seed: 9223372036854775808", "3:1: seed: got 9223372036854775808", "below"),
        ("until_s: 600", "until_s: 0", "4:1: until_s: got 0", "above 0"),
        ("until_s: 600", "until_min: 10", "4:1: until_min: got 10", "did you mean until_s? keys carry their unit"),
        ("mode: full", "mode: blind", "5:14: perception.mode: got 'blind'", "'sight' or 'full'"),
        ("range_m: 10", "range_m: .nan", "5:26: perception.range_m: got nan", "finite"),
        ("delay_s: 1", "delay_s: -1", "6:23: radio.delay_s: got -1", "at least 0"),
        ("loss: 0.5", "loss: 1.01", "6:35: radio.loss: got 1.01", "at most 1"),
        ("fixed_s: 1", "fixed_s: -1", "7:12: planning.fixed_s: got -1", "at least 0"),
        ("spread: 0.1", "spread: 1", "8:24: skills.spread: got 1", "below 1"),
        ("prepare_s: 8", "prepare_s: -8", "8:10: skills.prepare_s: got -8", "at least 0"),
        ("mass_kg: 2", "mass_kg: 0", "13:48: objects.o1.mass_kg: got 0", "above 0"),
        ("mass_kg: 2", "radius_m: -1", "13:48: objects.o1.radius_m: got -1", "above 0"),
        ("heading_rad: 1,", "heading: 1,", "11:32: robots.r2.heading: got 1", "heading_rad? keys carry their unit"),
        ("at: p1", "at: p9", "10:8: robots.r1.at: got 'p9'", "the name of a spawn point (p1, p2)"),
        ("at: p1", "at: p1, room: l1", "10:8: robots.r1.at: got 'p1'", "either at (a spawn point), or room"),
        ("at: p1, ", "", "10:3: robots.r1.room: got nothing", "a spawn point of the map"),
        ("room: l2, at", "room: l9, at", "11:8: robots.r2.room: got 'l9'", "the name of a room"),
        ("room: l2, at", "room: l3, at", "11:18: robots.r2.at_m: got [9, 2]", "inside room l3"),
        ("[9, 2]", "[6.2, 2]", "11:18: robots.r2.at_m: got [6.2, 2], 0.2 m from a wall", "at least 0.3 m"),
        ("[2, 1], p", "[3.5, 3.5], p", "13:18: objects.o1.at_m: got [3.5, 3.5]", "outside its obstacles"),
        ("[9, 2]", "[7.1, 1.1]", "14:8: objects.o2.at: got [7, 1], overlapping r2", "0.42 m from its centre"),
        (
            "room: l2, at_m: [9, 2], heading_rad: 1",
            "at: p1",
            "11:8: robots.r2.at: got [1, 1], overlap",
            "clear of r1",
        ),
        ("room: l1, at_m: [2, 1]", "at: p2", "14:8: objects.o2.at: got [7, 1], overlapping o1", "clear of o1"),
        ("  r2:", "  l2:", "11:3: robots.l2: got the name 'l2' again", "a room has it"),
        ("  r2:", "  d3:", "11:3: robots.d3: got the name 'd3' again", "a door has it"),
        ("  o2:", "  r1:", "14:3: objects.r1: got the name 'r1' again", "a robot has it"),
        ("  o2:", "  o1:", "14:3: objects.o1: got the key twice", "already stands on line 13"),
        ("(holding r1 o1)", "holding r1 o1", "10:24: robots.r1.goals[0]: got 'holding r1 o1'", "one fact"),
        ("(holding r1 o1)", "(and (holding r1 o1))", "10:24: robots.r1.goals[0]: got '(and", "one fact"),
        ("(holding r1 o1)", "(hold r1 o1)", "10:24: robots.r1.goals[0]: got '(hold r1 o1)'", "did you mean holding?"),
        ("(holding r1 o1)", "(holding o1)", "10:24: robots.r1.goals[0]: got '(holding o1)'", "(holding ROBOT OBJECT)"),
        (
            "(holding r1 o1)",
            "(holding o1 o2)",
            "10:24: robots.r1.goals[0]: got",
            "for 'o1' the name of a robot (r1, r2)",
        ),
        ("(holding r1 o1)", "(holding r1 o9)", "10:24: robots.r1.goals[0]: got", "for 'o9' the name of an object"),
        ("o2 l3", "o2 p1", "10:43: robots.r1.goals[1]: got '(at-object o2 p1)'", "for 'p1' the name of a room"),
        (
            '"(PREPARED o1)"',
            '"(at-object o2 l1)"',
            "10:64: robots.r1.goals[2]: got",
            "cannot also be as in (at-object o2 l3)",
        ),
        (
            '"(PREPARED o1)"',
            '"(holding r2 o1)"',
            "10:64: robots.r1.goals[2]: got",
            "cannot also be as in (holding r1 o1)",
        ),
        (
            "o2 l3",
            "o2 l4",
            "10:43: robots.r1.goals[1]: got '(at-object o2 l4)'",
            "no way leads from room l2 to room l4",
        ),
        ("r2 l3", "r2 l4", "11:74: robots.r2.goals[0]: got", "no way leads from room l2 to room l4"),
        (
            "room: l1, at_m: [2",
            "room: l4, at_m: [42",
            "10:24: robots.r1.goals[0]: got",
            "from room l1 to o1, in room l4",
        ),
        ("object_moved", "object_mved", "16:6: disturbances[0].kind: got 'object_mved'", "'object_moved'"),
        ("kind: object_moved, ", "", "16:5: disturbances[0].kind: got nothing", "required"),
        ("at_s: 12", "at_s: -1", "16:26: disturbances[0].at_s: got -1", "at least 0"),
        ("at_s: 12", "at_ms: 1", "16:26: disturbances[0].at_ms: got 1", "did you mean at_s? keys carry their unit"),
        ("object: o1", "object: r1", "16:36: disturbances[0].object: got 'r1'", "an object (o1, o2)"),
        ("to_m: [1, 4]", "to_m: [15, 2]", "16:48: disturbances[0].to_m: got [15, 2]", "inside a room"),
        ("to_m: [1, 4]", "to_m: [3.5, 3.5]", "16:48: disturbances[0].to_m: got [3.5, 3.5]", "outside its obstacles"),
        ("robot: r1", "robot: o1", "17:35: disturbances[1].robot: got 'o1'", "a robot (r1, r2)"),
        ("outcome: goals_reached", "outcome: 1", "18:12: expected.outcome: got 1", "text"),
        ("skills:", "skils:", "8:1: skils: got {prepare_s: 8, spread: 0.1}", "did you mean skills?"),
    ],
)
def test_each_fault_is_told_at_its_key(tmp_path: Path, old: str, new: str, start: str, words: str) -> None:
    """With line and column, the key path, the value and what was expected."""
    found = faults(written(tmp_path, (old, new)))
    mine = [fault for fault in found if fault.startswith(start)]
    assert len(mine) == 1, "\n".join(found)
    assert words in mine[0].partition("expected ")[2]


def test_ways_respect_one_way_corridors(tmp_path: Path) -> None:
    """From l3 no way leads back to l2."""
    path = written(tmp_path, ("room: l2, at_m: [9, 2]", "room: l3, at_m: [21, 2]"), ("r2 l3", "r2 l2"))
    assert faults(path)[0].endswith("a goal that can be reached: no way leads from room l3 to room l2")


def test_a_world_needs_a_robot(tmp_path: Path) -> None:
    """An empty section, and a missing one."""
    path = written(tmp_path)
    path.write_text("format: clo-fleet/world/1\nmap: ../maps/m.yaml\nrobots: {}\n")
    assert faults(path) == ["3:1: robots: got {}, expected at least one robot"]
    path.write_text("format: clo-fleet/world/1\nmap: ../maps/m.yaml\n")
    assert faults(path) == ["1:1: robots: got nothing, expected a value: this key is required"]


def test_the_faults_of_a_map_follow_those_of_the_world(tmp_path: Path) -> None:
    """With the map's file name; what can be judged without the map is judged."""
    path = written(
        tmp_path,
        ("(holding r1 o1)", "(holding r1 o9)"),
        ("object: o1", "object: o7"),
        ("at: p1", "at: p9"),
        building=MAP.replace("[26, 5]", "[27]").replace("one_way: true", "one_way: 1"),
    )
    assert [fault.split(": ")[:2] for fault in faults(path)] == [
        ["10:24", "robots.r1.goals[0]"],
        ["16:36", "disturbances[0].object"],
        ["m.yaml:5:38", "rooms.l3.outline_m[2]"],
        ["m.yaml:12:26", "corridors.c1.one_way"],
    ]


def test_all_faults_of_a_world_are_told_at_once(tmp_path: Path) -> None:
    """Faults of one robot do not hide others of the same robot, and indices stay those of the file."""
    path = written(
        tmp_path,
        ('"(holding r1 o1)"', '3, "holding", "(holding r1 o9)"'),
        ("heading_rad: 1", "heading_deg: 1"),
        ("r2 l3", "r2 l9"),
        ("kind: object_moved", "kind: x"),
        ("robot: r1", "robot: r9"),
        ("mass_kg: 2", "mass_kg: 2, mass_kg: 3"),
    )
    assert [fault.split(": ")[1] for fault in faults(path)] == [
        "robots.r1.goals[0]",
        "robots.r1.goals[1]",
        "robots.r1.goals[2]",
        "robots.r2.heading_deg",
        "robots.r2.goals[0]",
        "objects.o1.mass_kg",
        "disturbances[0].kind",
        "disturbances[1].robot",
    ]


def test_a_robot_and_an_object_of_one_name_are_not_mixed_up(tmp_path: Path) -> None:
    """The name is faulted once, and each keeps its own place."""
    assert len(faults(written(tmp_path, ("  o2: {at: p2}", "  r2: {at: p2}"), ("o2 l3", "o1 l3")))) == 2


JUNK = ["", "3", "-1e300", ".nan", "no", "true", "[]", "{}", "[1, 2]", "[[1, 2], [3]]", "{kind: x}", "~", "l1", "r1"]
JUNK += ["object_moved", '"(holding r1 o1)"', "[key]", "{at: p1, room: l1}", "[{kind: object_moved, object_moved: {}}]"]


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 400), st.sampled_from(JUNK)), min_size=1, max_size=4), st.booleans())
def test_any_mistake_in_any_place_is_a_fault_or_harmless(
    tmp_path: Path, mistakes: list[tuple[int, str]], in_map: bool
) -> None:
    """No foreign exception comes out, and every fault has a place in one of the two files."""
    words = re.split(r"([\w./()-]+)", MAP if in_map else WORLD)
    for place, junk in mistakes:
        words[(2 * place + 1) % (len(words) - 1)] = junk
    path = written(tmp_path, building="".join(words)) if in_map else written(tmp_path)
    if not in_map:
        path.write_text("".join(words), encoding="utf-8")
    try:
        read_world(path)
    except FileFaultsError as error:
        places = [(fault.file.name, fault.line >= 1, fault.column >= 1) for fault in error.faults]
        assert set(places) <= {("w.yaml", True, True), ("m.yaml", True, True)}


def test_the_schema_describes_every_key_for_editors() -> None:
    """It is closed to other keys, and tells the kinds of disturbances apart."""
    schema = world_schema()
    assert schema["additionalProperties"] is False
    assert schema["required"] == ["format", "map", "robots"]
    definitions = schema["$defs"]
    assert isinstance(definitions, dict)
    assert {"ObjectMovedSection", "RobotSlowedSection", "RobotSection"} <= set(definitions)
