"""The buildings that come with the package, beside those drawn by hand."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import pytest

from clo_fleet.study.shipped import shipped
from clo_fleet.world.checks import map_findings
from clo_fleet.world.floor_plans import campus, hospital, warehouse
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import BuildingMap
from clo_fleet.world.places import Ways, round_trips, zones

PLANS = [hospital, warehouse, campus]


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.__name__)
def test_the_shipped_map_is_the_plan(plan: Callable[[], BuildingMap]) -> None:
    """Whoever changes one changes the other, with ``clo-fleet make-map``."""
    read = read_map(shipped("maps") / f"{plan.__name__}.yaml")
    assert replace(read, network=None) == plan()


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.__name__)
def test_a_plan_is_sound_and_robots_get_everywhere_and_back(plan: Callable[[], BuildingMap]) -> None:
    """No finding, and some corridors with a single lane beside such with two."""
    building = plan()
    assert map_findings(building) == ()
    assert len(round_trips(building)) == 1
    assert {corridor.single_lane for corridor in building.corridors} == {True, False}


def test_the_warehouse_has_a_hundred_bays_in_one_zone() -> None:
    """And four large rooms."""
    building = warehouse()
    assert sum(room.id.startswith("bay-") for room in building.rooms) == 100
    assert len(zones(building)) == 1
    assert len(building.rooms) == 104


def test_a_way_across_the_campus_leads_through_two_lobbies() -> None:
    """Each building has corridors of its own, and so has the plaza between them."""
    building = campus()
    assert len(zones(building)) == 4
    pairs = {pair for pair, _ in Ways(building).all()}
    assert ("west-1", "lobby-west") in pairs
    assert ("lobby-west", "lobby-east") in pairs
    assert ("west-1", "east-1") not in pairs


def test_in_the_hospital_ways_lead_through_the_supply_room_and_ward_6() -> None:
    """The one has a door on each of the single-lane corridors, the other leads to the isolation room."""
    doors = Counter(room for door in hospital().doors for room in door.rooms)
    assert {room for room, number in doors.items() if number > 1} == {"supply", "ward-6"}
