"""Faults that are drawn: how many, whom they befall, and that they are always the same."""

from dataclasses import replace

import pytest

from clo_fleet.testing.buildings import shipped_map
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import (
    FaultRate,
    ObjectMoved,
    RandomFaults,
    RobotBroken,
    RobotRepaired,
    SkillFails,
    kind_of,
)
from clo_fleet.world.model import World
from clo_fleet.world.outlines import clearance
from clo_fleet.world.places import room_at
from clo_fleet.world.random_faults import schedule

LASTING = (
    "corridor_closed",
    "door_closed",
    "object_taken",
    "planner_slowed",
    "radio_lost",
    "robot_broken",
    "robot_slowed",
    "sensor_blinded",
)
MOMENTARY = ("object_dropped", "object_moved", "object_prepared", "planner_killed", "skill_fails")


def world(*rates: FaultRate, until: float = 36_000.0, faults_seed: int | None = None, seed: int = 0) -> World:
    """Two robots and two objects in the office."""
    builder = WorldBuilder(shipped_map("office")).robot("r1", "store").robot("r2", "lab")
    plain = builder.thing("cup", "store").thing("mug", "lab").build()
    return replace(plain, until=until, seed=seed, faults=RandomFaults(rates, faults_seed))


@pytest.mark.parametrize("kind", [*LASTING, *MOMENTARY])
def test_about_as_many_are_drawn_as_the_rate_says(kind: str) -> None:
    """Ten hours at twenty an hour are about two hundred; what lasts is ended, and never begun twice at a time."""
    lasts = (1.0, 2.0) if kind in LASTING else None
    drawn = schedule(world(FaultRate(kind, 20.0, lasts, 0.5, "grasp" if kind == "skill_fails" else "")))
    begun = [fault for fault in drawn if kind_of(fault) == kind]
    each = 2 if kind in LASTING else 1
    assert 150 < len(drawn) / each < 250
    assert len(drawn) == len(begun) * each
    assert [fault.time for fault in drawn] == sorted(fault.time for fault in drawn)
    assert all(fault.time < 36_000.0 for fault in begun)


def test_what_lasts_does_not_befall_the_same_one_twice_at_a_time() -> None:
    """Between a breakdown and its repair there is no other breakdown of that robot."""
    broken: set[str] = set()
    for fault in schedule(world(FaultRate("robot_broken", 600.0, (10.0, 60.0)))):
        if isinstance(fault, RobotBroken):
            assert fault.robot not in broken
            broken.add(fault.robot)
        elif isinstance(fault, RobotRepaired):
            broken.remove(fault.robot)


def test_an_object_is_moved_to_where_it_can_lie() -> None:
    """Inside a room, clear of walls and obstacles."""
    setting = world(FaultRate("object_moved", 20.0))
    for fault in schedule(setting):
        assert isinstance(fault, ObjectMoved)
        room = next(room for room in setting.map.rooms if room.id == room_at(setting.map, fault.position))
        assert clearance(room, fault.position) >= 0.12


def test_the_same_seed_draws_the_same_faults() -> None:
    """The world's seed counts, or the faults' own; a longer run only has more of them."""
    rates = (FaultRate("robot_broken", 20.0, (1.0, 2.0)), FaultRate("object_moved", 20.0))
    assert schedule(world(*rates)) == schedule(world(*rates))
    assert schedule(world(*rates, seed=1)) != schedule(world(*rates))
    assert schedule(world(*rates, seed=1, faults_seed=5)) == schedule(world(*rates, seed=2, faults_seed=5))
    short = [fault for fault in schedule(world(*rates, until=3600.0)) if fault.time < 3600.0]
    assert short == [fault for fault in schedule(world(*rates)) if fault.time < 3600.0]


def test_faults_come_between_what_is_on_schedule() -> None:
    """One list, in the order of time."""
    fails = SkillFails(time=18_000.0, skill="grasp")
    drawn = schedule(replace(world(FaultRate("object_moved", 20.0)), disturbances=(fails,)))
    assert fails in drawn
    assert [fault.time for fault in drawn] == sorted(fault.time for fault in drawn)


def test_a_building_without_corridors_loses_none() -> None:
    """What there is not cannot be befallen."""
    nothing = replace(world(FaultRate("corridor_closed", 20.0, (1.0, 2.0))), objects=())
    bare = replace(nothing, map=replace(nothing.map, corridors=(), network=None))
    assert schedule(bare) == ()
