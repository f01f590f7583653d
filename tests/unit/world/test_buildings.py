"""Buildings in a line: grids, rings and lines."""

import math
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clo_fleet.world.buildings import MAX_ROOMS, BuildingSizeError, Measures, grid, line, ring
from clo_fleet.world.checks import map_findings
from clo_fleet.world.model import BuildingMap
from clo_fleet.world.outlines import area, clearance
from clo_fleet.world.places import reachable_rooms, zones

BUILDINGS = [grid(4, 3), grid(1, 2), grid(2, 1), ring(3), ring(16), line(2), line(7)]


@pytest.mark.parametrize("building", BUILDINGS, ids=lambda building: building.name)
def test_a_building_is_sound_and_one_zone_from_which_every_room_is_reached(building: BuildingMap) -> None:
    """The checks of map files find nothing, and a robot gets from any room to any other."""
    assert map_findings(building) == ()
    assert len(zones(building)) == 1
    rooms = {room.id for room in building.rooms}
    assert reachable_rooms(building, rooms) == dict.fromkeys(rooms, rooms)


@pytest.mark.parametrize("building", BUILDINGS, ids=lambda building: building.name)
def test_ten_robots_have_space_in_every_room(building: BuildingMap) -> None:
    """There are as many spawn points, a robot's radius and more from the walls, and from each other."""
    for room in building.rooms:
        spots = [spawn.pose.point for spawn in building.spawn_points if spawn.room == room.id]
        assert len(spots) >= 10
        assert all(clearance(room, spot) >= 0.45 for spot in spots)
        assert all(math.dist(a, b) >= 0.95 for a, b in combinations(spots, 2))


@pytest.mark.parametrize("building", BUILDINGS, ids=lambda building: building.name)
def test_spawn_points_leave_doors_free(building: BuildingMap) -> None:
    """Nobody who stands on one is within a robot's width of the way through a door."""
    for door in building.doors:
        spots = [spawn.pose.point for spawn in building.spawn_points if spawn.room in door.rooms]
        assert all(math.dist(spot, door.position) > 1.2 for spot in spots)


def test_sizes_are_as_asked_for() -> None:
    """Columns, rows, spacing and room size are those of the building."""
    building = grid(3, 2, Measures(spacing=20, room=8), name="hall")
    assert building.name == "hall"
    assert len(building.rooms) == 6
    nodes = {junction.id: junction.position for junction in building.junctions}
    assert nodes["node-2-1"] == pytest.approx((40, 20))
    assert area(building.rooms[0].outline) == pytest.approx(64)


def test_corridors_have_one_lane_and_spurs_two_unless_told_otherwise() -> None:
    """Who waits at a door stands in a lane of its own."""
    for corridor in grid(2, 2).corridors:
        assert corridor.single_lane == corridor.start.startswith("node-")
    assert not any(corridor.single_lane for corridor in grid(2, 2, Measures(two_lane=True)).corridors)


@pytest.mark.parametrize("rooms", [1, MAX_ROOMS + 1, -3])
def test_too_few_or_too_many_rooms_are_refused(rooms: int) -> None:
    """The error says what may be."""
    for build in (ring, line):
        with pytest.raises(BuildingSizeError, match=f"rooms: got {rooms}, expected [23] to {MAX_ROOMS}"):
            build(rooms)
    with pytest.raises(BuildingSizeError, match="expected"):
        grid(1, rooms)


@pytest.mark.parametrize(
    ("measures", "message"),
    [
        (Measures(spacing=5), r"spacing \[m\]: got 5, expected 10 to 200"),
        (Measures(spacing=math.nan), "spacing"),
        (Measures(room=1), r"room size \[m\]: got 1, expected 3 to "),
        (Measures(room=11), r"room size \[m\]: got 11, expected 3 to "),
    ],
)
def test_measures_that_do_not_fit_are_refused(measures: Measures, message: str) -> None:
    """Whatever the form of the building."""
    for build in (ring, line, lambda rooms, measures: grid(rooms, rooms, measures)):
        with pytest.raises(BuildingSizeError, match=message):
            build(4, measures)


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from([ring, line, lambda rooms, measures: grid(rooms, 2, measures)]),
    st.integers(3, 12),
    st.floats(10, 40),
    st.floats(3, 30),
)
def test_whatever_is_not_refused_is_sound(build, rooms: int, spacing: float, room: float) -> None:  # type: ignore[no-untyped-def]  # of three functions
    """Any size either gives a sound building or an error."""
    try:
        building = build(rooms, Measures(spacing=spacing, room=room))
    except BuildingSizeError:
        return
    assert map_findings(building) == ()
