"""Disturbances in world files: what entries mean, and what is wrong with them."""

from pathlib import Path

import pytest

from clo_fleet.study.shipped import shipped
from clo_fleet.world import disturbances as made
from clo_fleet.world.disturbances import FaultRate, described
from clo_fleet.world.faults import FileFaultsError
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world

WORLD = """\
format: clo-fleet/world/1
map: hello.yaml
robots:
  r1: {room: west, at_m: [2, 2.5], goals: [(holding r1 cup)]}
objects:
  cup: {room: east, at_m: [18, 2]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the map hello."""
    for name in ("hello.yaml", "hello.net.xml.gz"):
        (tmp_path / name).write_bytes((shipped("maps") / name).read_bytes())
    return tmp_path


def read(folder: Path, text: str) -> World:
    """The world with more lines."""
    path = folder / "world.yaml"
    path.write_text(WORLD + text, encoding="utf-8")
    return read_world(path)


def faults(folder: Path, text: str) -> list[str]:
    """What is wrong with the world, as places and sentences without the file."""
    with pytest.raises(FileFaultsError) as caught:
        read(folder, text)
    return [str(fault).partition("world.yaml:")[2] for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("entry", "begins", "ends"),
    [
        (
            "door_closed, door: west-door",
            "DoorClosed(time=1.0, door='west-door')",
            "DoorOpened(time=4.5, door='west-door')",
        ),
        (
            "corridor_closed, corridor: hall",
            "CorridorClosed(time=1.0, corridor='hall')",
            "CorridorOpened(time=4.5, corridor='hall')",
        ),
        ("robot_broken, robot: r1", "RobotBroken(time=1.0, robot='r1')", "RobotRepaired(time=4.5, robot='r1')"),
        (
            "robot_slowed, robot: r1, max_speed_m_s: 0.2",
            "RobotSlowed(time=1.0, robot='r1', max_speed=0.2)",
            "RobotRecovered(time=4.5, robot='r1')",
        ),
        ("sensor_blinded, robot: r1", "SensorBlinded(time=1.0, robot='r1')", "SensorRestored(time=4.5, robot='r1')"),
        ("radio_lost, robot: r1", "RadioLost(time=1.0, robot='r1')", "RadioRestored(time=4.5, robot='r1')"),
        (
            "planner_slowed, robot: r1, by_s: 7",
            "PlannerSlowed(time=1.0, robot='r1', seconds=7.0)",
            "PlannerRecovered(time=4.5, robot='r1')",
        ),
        (
            "object_taken, object: cup",
            "ObjectTaken(time=1.0, object='cup')",
            "ObjectReturned(time=4.5, object='cup', position=None)",
        ),
    ],
)
def test_what_lasts_begins_and_ends(folder: Path, entry: str, begins: str, ends: str) -> None:
    """``for_s`` makes two of one entry; without it there is no end."""
    lasting = read(folder, f"disturbances: [{{at_s: 1, for_s: 3.5, kind: {entry}}}]\n")
    assert [str(value) for value in lasting.disturbances] == [begins, ends]
    assert [str(value) for value in read(folder, f"disturbances: [{{at_s: 1, kind: {entry}}}]\n").disturbances] == [
        begins
    ]


def test_a_skill_fails_once_unless_a_chance_is_given(folder: Path) -> None:
    """A chance is for every action, if it is not said how many are at risk."""
    text = """\
disturbances:
  - {kind: skill_fails, at_s: 0, skill: grasp}
  - {kind: skill_fails, at_s: 1, for_s: 9, skill: move, robot: r1, chance: 0.25}
  - {kind: skill_fails, at_s: 2, skill: place, nth: 2, times: 3}
"""
    once, often, later = read(folder, text).disturbances
    assert once == made.SkillFails(time=0.0, skill="grasp")
    assert isinstance(often, made.SkillFails)
    assert (often.robot, often.times, often.chance, often.until) == ("r1", None, 0.25, 10.0)
    assert described(often) == "move, every time, with probability 0.25, until 10 s"
    assert described(later) == "place, 3 times from number 2 on"


def test_faults_to_be_drawn_are_rates(folder: Path) -> None:
    """Sorted by kind, with their own seed."""
    text = """\
faults:
  seed: 4
  robot_slowed: {per_hour: 2, for_s: [10, 60], to_share: 0.5}
  object_moved: {per_hour: 6}
  planner_slowed: {per_hour: 1, for_s: [1, 1], by_s: 3}
  skill_fails: {per_hour: 10, skill: grasp}
"""
    random = read(folder, text).faults
    assert random.seed == 4
    assert random.rates == (
        FaultRate("object_moved", 6.0),
        FaultRate("planner_slowed", 1.0, (1.0, 1.0), 3.0),
        FaultRate("robot_slowed", 2.0, (10.0, 60.0), 0.5),
        FaultRate("skill_fails", 10.0, None, 0.0, "grasp"),
    )


@pytest.mark.parametrize(
    ("entry", "key", "expected"),
    [
        ("{kind: robot_broken, at_s: 1, robot: r2}", "robot", "the name of a robot"),
        ("{kind: door_closed, at_s: 1, door: west}", "door", "the name of a door; did you mean west-door?"),
        ("{kind: corridor_closed, at_s: 1, corridor: hal}", "corridor", "the name of a corridor; did you mean hall?"),
        ("{kind: object_taken, at_s: 1, object: mug}", "object", "the name of an object (cup)"),
        (
            "{kind: skill_fails, at_s: 1, skill: grab}",
            "skill",
            "one of give, grasp, move, place, prepare; did you mean",
        ),
        ("{kind: skill_fails, at_s: 1, skill: grasp, chance: 1.5}", "chance", "a number of at most 1"),
        ("{kind: robot_broken, at_s: -1, robot: r1}", "at_s", "a number of at least 0"),
        ("{kind: robot_broken, at_s: 1, for_s: 0, robot: r1}", "for_s", "a number above 0"),
        ("{kind: object_moved, at_s: 1, object: cup, to_m: [10, 2]}", "to_m", "a point inside a room"),
        ("{kind: object_returned, at_s: 1, object: cup, to_m: [2, 2]}", "at_s", "a time at which cup is taken away"),
        ("{kind: robot_exploded, at_s: 1, robot: r1}", "kind", "one of"),
    ],
)
def test_a_bad_entry_is_told_with_its_place(folder: Path, entry: str, key: str, expected: str) -> None:
    """Line and column of the key, and what was expected."""
    found = faults(folder, f"disturbances:\n  - {entry}\n")
    assert len(found) == 1
    assert found[0].startswith(f"8:{5 + entry.index(key + ':')}: "), found
    assert expected in found[0]


def test_what_is_closed_cannot_be_closed_again(folder: Path) -> None:
    """Nor can a door be opened that is open: the file does not say what its author thinks."""
    text = """\
disturbances:
  - {kind: door_closed, at_s: 5, for_s: 10, door: west-door}
  - {kind: door_closed, at_s: 8, door: west-door}
  - {kind: door_opened, at_s: 30, door: west-door}
"""
    first, second = faults(folder, text)
    assert first.startswith("9:25")
    assert "a time at which west-door is not closed already" in first
    assert second.startswith("10:25")
    assert "a time at which west-door is closed" in second


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        ("{robot_broken: {per_hour: 2}}", "a value: this key is required"),
        ("{robot_broken: {per_hour: 2, for_s: [60, 10]}}", "the shortest and the longest time, as [10, 60]"),
        ("{robot_broke: {per_hour: 2}}", "did you mean robot_broken?"),
        ("{object_moved: {per_hour: 0}}", "a number above 0"),
        ("{skill_fails: {per_hour: 1, skill: gras}}", "did you mean grasp?"),
    ],
)
def test_a_bad_rate_is_told(folder: Path, entry: str, expected: str) -> None:
    """As any other fault of the file."""
    (fault,) = faults(folder, f"faults: {entry}\n")
    assert expected in fault


def test_a_run_has_a_bounded_number_of_faults(folder: Path) -> None:
    """A file cannot make a schedule that fills the memory."""
    (fault,) = faults(folder, "until_s: 1000000000\nfaults: {object_moved: {per_hour: 3600}}\n")
    assert "at most 10000 faults of a kind within until_s" in fault
