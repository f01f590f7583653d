"""What holds in every tick of every run, with many robots and goals that overlap."""

import math
from pathlib import Path

import pytest

from clo_fleet.clo.task import Fact
from clo_fleet.testing import RunFleet, assert_goals_reached, assert_sound, rooms_on_a_corridor
from clo_fleet.world.model import (
    ObjectId,
    ObjectSpec,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    RoomId,
    SkillSettings,
    World,
)


def robot(name: str, room: str, at: Point, *goals: Fact) -> RobotSpec:
    """A robot."""
    return RobotSpec(id=RobotId(name), room=RoomId(room), pose=Pose(*at), goals=goals)


def thing(name: str, room: str, at: Point) -> ObjectSpec:
    """An object."""
    return ObjectSpec(id=ObjectId(name), room=RoomId(room), position=at)


def crowd(folder: Path) -> World:
    """Twelve robots in three rooms and a closet, who want the same objects moved and prepared, and pass each other."""
    building = rooms_on_a_corridor(["l0", "l1", "l2"], folder, closet="closet")
    at = {"l0": (1.0, 5.2), "l1": (1.0, -9.0), "l2": (11.0, 5.2)}
    goals: dict[str, tuple[Fact, ...]] = {
        "r00": (("holding", "r00", "o0"), ("at-robot", "r00", "l1")),
        "r01": (("holding", "r01", "o1"), ("prepared", "o2")),
        "r02": (("at-object", "o3", "closet"),),
        "r03": (("at-object", "o2", "l0"), ("at-robot", "r03", "l2")),
        "r04": (("at-robot", "r04", "closet"),),
        "r05": (("prepared", "o0"), ("at-robot", "r05", "l0")),
        "r06": (("at-object", "o2", "l0"), ("at-robot", "r06", "l2")),
        "r07": (("at-robot", "r07", "l0"),),
        "r08": (("prepared", "o4"), ("at-robot", "r08", "l0")),
        "r09": (("at-robot", "r09", "closet"),),
        "r10": (("at-object", "o3", "closet"), ("at-robot", "r10", "l1")),
        "r11": (("prepared", "o5"), ("holding", "r11", "o4")),
    }
    rooms = ["l0", "l1", "l2"]
    robots = []
    for number, name in enumerate(sorted(goals)):
        room = rooms[number % 3]
        x, y = at[room]
        robots.append(robot(name, room, (x + 1.5 * (number // 3), y), *goals[name]))
    objects = (
        thing("o0", "l0", (2, 8)),
        thing("o1", "l0", (5, 9)),
        thing("o2", "l1", (3, -6)),
        thing("o3", "l2", (12, 8.5)),
        thing("o4", "l2", (16, 9)),
        thing("o5", "closet", (-2, 9)),
    )
    return World(name="crowd", map=building, robots=tuple(robots), objects=objects, until=600.0)


def errands(count: int, folder: Path) -> World:
    """Any number of robots, three to five a room, of which each has one thing to do."""
    building = rooms_on_a_corridor([f"l{n}" for n in range(max(2, 2 * math.ceil(count / 8)))], folder)
    rooms = building.rooms
    robots: list[RobotSpec] = []
    objects: list[ObjectSpec] = []
    for number in range(count):
        home, other = rooms[number % len(rooms)], rooms[(number * 5 + 3) % len(rooms)]
        (x, y), place = home.outline[0], number // len(rooms)
        name = f"r{number:02}"
        goal: Fact = ("at-robot", name, other.id)
        if number % 5 == 0 and len(objects) < 3:
            objects.append(thing(f"o{number:02}", home.id, (x + 1.0, y + 3.0)))
            goal = ("prepared", f"o{number:02}")
        robots.append(robot(name, home.id, (x + 0.8 + 1.5 * place, y + (0.8 if y > 0 else 5.2)), goal))
    return World(
        name=f"errands-{count}",
        map=building,
        robots=tuple(robots),
        objects=tuple(objects),
        until=180.0,
        skills=SkillSettings(prepare=2.0, grasp=1.0),
    )


def test_in_a_crowd_all_is_as_it_must_be_in_every_tick(tmp_path: Path, run_fleet: RunFleet) -> None:
    """Twelve robots with goals that overlap reach them, and nothing impossible happens on the way."""
    world = crowd(tmp_path)
    run = run_fleet(world)
    assert_sound(run)
    assert_goals_reached(run)


@pytest.mark.parametrize("count", [1, 2, 10, 25, pytest.param(50, marks=pytest.mark.study)])
def test_any_number_of_robots_does_the_same_again(count: int, tmp_path: Path, run_fleet: RunFleet) -> None:
    """However many there are, all get where they want, nothing impossible happens, and a second run is the same."""
    world = errands(count, tmp_path)
    run = run_fleet(world)
    assert_sound(run)
    assert_goals_reached(run)
    again = run_fleet(world)
    again.finish()
    assert again.log == run.log
