"""Worlds for tests are put together in a few lines, find places by themselves, and are checked like files."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.clo.task import FactSyntaxError
from clo_fleet.testing import NoSpotError, UnsoundWorldError, WorldBuilder, rooms_in_a_row, shipped_map
from clo_fleet.testing.fixtures import FleetWorld
from clo_fleet.world.checks import map_findings
from clo_fleet.world.disturbances import ObjectMoved
from clo_fleet.world.map_file import read_map, write_map
from clo_fleet.world.model import ObjectId, Radio
from clo_fleet.world.outlines import clearance


def crowded() -> WorldBuilder:
    """Six robots and six objects in one room, one of them at a place of its own."""
    world = WorldBuilder(rooms_in_a_row("a", "b")).robot("r0", "a", at=(1.0, 1.0))
    for number in range(1, 6):
        world.robot(f"r{number}", "a").thing(f"o{number}", "a")
    return world.thing("o6", "b", prepared=True)


def test_places_are_found_for_all_that_have_none() -> None:
    """They are on the floor, clear of walls and of one another, the same every time; given places are kept."""
    world = crowded().build()
    rooms = {room.id: room for room in world.map.rooms}
    discs = [(robot.room, robot.pose.point, robot.radius) for robot in world.robots]
    discs += [(thing.room, thing.position, thing.radius) for thing in world.objects]
    for number, (room, point, radius) in enumerate(discs):
        assert clearance(rooms[room], point) > radius
        assert all(math.dist(point, other) > radius + size for _, other, size in discs[:number])
    assert world.robots[0].pose.point == (1.0, 1.0)
    assert crowded().build() == world


def test_a_full_room_is_told() -> None:
    """Who finds no place is named, with the room."""
    world = WorldBuilder(rooms_in_a_row("a"))
    for number in range(60):
        world.robot(f"r{number}", "a")
    with pytest.raises(NoSpotError, match=r"no free place for r\d+ in room a: say where it is"):
        world.build()


def test_faults_are_told_as_for_files_all_at_once() -> None:
    """A name that there is not and a goal that is no goal: each with what was expected instead."""
    world = WorldBuilder(rooms_in_a_row("hall", "kitchen")).robot("r1", "kitchn", wants="(holdin r1 cup)")
    with pytest.raises(UnsoundWorldError) as told:
        world.build()
    room, goal = str(told.value).splitlines()
    assert room == "robots.r1.room: got 'kitchn', expected the name of a room; did you mean kitchen?"
    assert goal.startswith("robots.r1.goals[0]: got '(holdin r1 cup)', expected one of (at-robot ROBOT ROOM), ")
    assert goal.endswith("did you mean holding?")
    with pytest.raises(FactSyntaxError):
        world.robot("r2", "hall", wants="holding r2 cup")


def test_a_goal_to_which_no_way_leads_is_told() -> None:
    """Two rooms without a door between them."""
    building = replace(rooms_in_a_row("a", "b"), doors=())
    with pytest.raises(UnsoundWorldError, match="no way leads from room a to room b"):
        WorldBuilder(building).robot("r1", "a", wants="(at-robot r1 b)").build()


def test_settings_are_taken_from_another_world() -> None:
    """Seed, limits and radio come along, robots and disturbances stay."""
    base = replace(crowded().build(), seed=7, until=60.0, radio=Radio(facts=False))
    moved = ObjectMoved(1.0, ObjectId("cup"), (7.0, 1.0))
    world = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a").thing("cup", "a").happens(moved).like(base).build()
    assert (world.seed, world.until, world.radio.facts) == (7, 60.0, False)
    assert [robot.id for robot in world.robots] == ["r1"]
    assert world.disturbances == (moved,)


def test_rooms_in_a_row_are_a_sound_map(tmp_path: Path) -> None:
    """The map passes the checks of map files, and reads back as it was."""
    building = rooms_in_a_row("a", "b", "c")
    assert map_findings(building) == ()
    write_map(building, tmp_path / "row.yaml")
    assert read_map(tmp_path / "row.yaml") == building


def test_a_world_may_lie_on_any_building(tmp_path: Path) -> None:
    """On a shipped map by its name, on a file, on a building, or on a corridor of its own."""
    worlds = FleetWorld(tmp_path)
    hello = shipped_map("hello")
    write_map(rooms_in_a_row("a"), tmp_path / "one.yaml")
    assert worlds(on_map="hello").robot("r1", "west").build().map == hello
    assert worlds(on_map=hello).robot("r1", "west").build().map == hello
    assert [room.id for room in worlds(on_map=tmp_path / "one.yaml").robot("r1", "a").build().map.rooms] == ["a"]
    world = worlds("a", "b", "c", corridor=True).robot("r1", "a", wants="(at-robot r1 c)").build()
    assert world.map.network is not None
    assert world.map.network.is_file()
    assert map_findings(world.map) == ()
