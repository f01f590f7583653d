"""Random worlds, and their files."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clo_fleet.study.shipped import shipped
from clo_fleet.world.buildings import grid, line
from clo_fleet.world.free_spots import free_spots
from clo_fleet.world.map_file import read_map, write_map
from clo_fleet.world.model import PlaceId, Radio, RoomId
from clo_fleet.world.random_worlds import CrowdedError, random_world
from clo_fleet.world.world_file import read_world
from clo_fleet.world.world_writing import WorldNotWrittenError, write_world

OFFICE = shipped("maps") / "office.yaml"


@settings(deadline=None, max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(1, 12), st.integers(0, 20), st.integers(0, 1 << 40))
def test_a_random_world_is_sound_and_reads_back_from_its_file(
    tmp_path: Path, robots: int, objects: int, seed: int
) -> None:
    """On a map with obstacles and without spawn points, whatever the numbers."""
    world = random_world(read_map(OFFICE), robots=robots, objects=objects, seed=seed, name="drawn")
    assert (len(world.robots), len(world.objects)) == (robots, objects)
    assert all(robot.goals for robot in world.robots)
    write_world(world, tmp_path / "drawn.yaml", OFFICE)
    assert read_world(tmp_path / "drawn.yaml") == replace(world, map=read_world(tmp_path / "drawn.yaml").map)


def test_the_seed_decides() -> None:
    """The same one gives the same world, another one another."""
    building = grid(3, 3)
    first = random_world(building, robots=5, objects=9, seed=7)
    assert first == random_world(building, robots=5, objects=9, seed=7)
    assert first.robots != random_world(building, robots=5, objects=9, seed=8).robots


def test_interests_overlap_and_no_goal_undoes_another() -> None:
    """Many objects are wanted by two robots, and none is to end in two places."""
    world = random_world(grid(4, 4), robots=10, objects=60, seed=1)
    wishes = Counter(goal[2 if goal[0] == "holding" else 1] for robot in world.robots for goal in robot.goals)
    assert sum(wishes[item.id] == 2 for item in world.objects) > 20
    ends: dict[str, set[tuple[str, ...]]] = {}
    for goal in (goal for robot in world.robots for goal in robot.goals if goal[0] in ("at-object", "holding")):
        ends.setdefault(goal[2 if goal[0] == "holding" else 1], set()).add(goal)
    assert all(len(end) == 1 for end in ends.values())


def test_robots_and_objects_are_where_robots_get_to() -> None:
    """In a building that falls into parts all are in one part."""
    building = line(4)
    cut = replace(building, corridors=tuple(c for c in building.corridors if c.id != "node-0--node-1"))
    world = random_world(cut, robots=6, objects=6, seed=0)
    rooms = {robot.room for robot in world.robots} | {item.room for item in world.objects}
    assert rooms <= {"room-1", "room-2", "room-3"}


@pytest.mark.parametrize(("robots", "objects"), [(0, 1), (100, 0), (5, 100), (5, -1)])
def test_too_many_are_refused(robots: int, objects: int) -> None:
    """The error says how many there may be."""
    with pytest.raises(CrowdedError, match=r"(robots|objects): got -?\d+, expected \d+ to \d+ in this building"):
        random_world(line(2), robots=robots, objects=objects, seed=0)


def test_rooms_are_filled_but_stay_passable() -> None:
    """Twenty robots find a place in two rooms, and not every place in them is taken."""
    world = random_world(line(2), robots=20, objects=0, seed=0)
    assert max(Counter(robot.room for robot in world.robots).values()) <= 0.8 * len(
        free_spots(line(2))[RoomId(PlaceId("room-0"))]
    )


def test_a_world_that_a_file_would_not_hold_is_not_written(tmp_path: Path) -> None:
    """What differs from the defaults is named, and no file is made."""
    write_map(replace(line(2), corridors=(), junctions=()), tmp_path / "map.yaml")
    world = replace(random_world(line(2), robots=1, objects=1, seed=0), radio=Radio(loss=0.5))
    with pytest.raises(WorldNotWrittenError, match="its own radio"):
        write_world(world, tmp_path / "w.yaml", tmp_path / "map.yaml")
    assert not (tmp_path / "w.yaml").exists()


def test_unusual_measures_are_written(tmp_path: Path) -> None:
    """A robot's and an object's own size and speed read back."""
    world = random_world(read_map(OFFICE), robots=2, objects=2, seed=0, name="w")
    slow = replace(world.robots[0], max_speed=0.5, radius=0.25)
    world = replace(world, robots=(slow, world.robots[1]), objects=(replace(world.objects[0], prepared=True),))
    world = replace(world, robots=tuple(replace(robot, goals=()) for robot in world.robots))
    write_world(world, tmp_path / "w.yaml", OFFICE)
    found = read_world(tmp_path / "w.yaml")
    assert (found.robots, found.objects) == (world.robots, world.objects)


def test_places_are_free_apart_and_not_before_doors() -> None:
    """The rooms of the office have some, though the map names none."""
    spots = free_spots(read_map(OFFICE))
    assert all(len(found) >= 8 for found in spots.values())
