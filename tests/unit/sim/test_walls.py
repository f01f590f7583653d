"""What the geometry of walls and doorways promises."""

import math

import pytest

from clo_fleet.sim.walls import (
    DoorRoomError,
    UnknownRoomError,
    beyond,
    doorway_walls,
    free_space,
    inner_point,
    room_walls,
    walls,
)
from clo_fleet.world.model import BuildingMap, Door, DoorId, Room, RoomId

LEFT, RIGHT = RoomId("left"), RoomId("right")
PILLAR = ((2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (2.0, 3.0))
OUT = Door(id=DoorId("out"), rooms=(LEFT,), position=(0.0, 2.5), heading=math.pi, width=1.6)
BETWEEN = Door(id=DoorId("between"), rooms=(LEFT, RIGHT), position=(6.0, 2.5), heading=0.0, width=1.0)
BUILDING = BuildingMap(
    name="two rooms",
    rooms=(
        Room(LEFT, ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)), (PILLAR,)),
        Room(RIGHT, ((6.0, 0.0), (9.0, 0.0), (9.0, 5.0), (6.0, 5.0))),
    ),
    doors=(OUT, BETWEEN),
)


def length(segments: tuple[tuple[tuple[float, float], tuple[float, float]], ...]) -> float:
    """How long all segments are together."""
    return sum(math.dist(*segment) for segment in segments)


def area(ring: tuple[tuple[float, float], ...]) -> float:
    """The area of a ring, by the shoelace formula."""
    pairs = zip(ring, ring[1:] + ring[:1], strict=True)
    return abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairs)) / 2


def test_doors_open_the_outlines_of_their_rooms_by_their_width() -> None:
    """A room's walls are its outline less the widths of its doors."""
    assert length(room_walls(BUILDING, LEFT)) == pytest.approx(22 - 1.6 - 1.0)
    assert length(room_walls(BUILDING, RIGHT)) == pytest.approx(16 - 1.0)


def test_a_door_opens_both_of_two_outlines_that_lie_apart() -> None:
    """Outlines a wall's thickness away from their door are opened too."""
    apart = BuildingMap(
        name="apart",
        rooms=(Room(LEFT, ((0, 0), (5.9, 0), (5.9, 5), (0, 5))), Room(RIGHT, ((6.1, 0), (9, 0), (9, 5), (6.1, 5)))),
        doors=(BETWEEN,),
    )
    assert length(room_walls(apart, LEFT)) == pytest.approx(21.8 - 1.0)
    assert length(room_walls(apart, RIGHT)) == pytest.approx(15.8 - 1.0)
    assert len(free_space(apart, LEFT)) == 1


def test_only_doorways_onto_corridors_have_side_walls() -> None:
    """They run from the wall 1.2 m outwards, a door's width apart; between rooms there are none."""
    assert doorway_walls(BETWEEN) == ()
    (a, b), (c, d) = doorway_walls(OUT)
    assert math.dist(a, b) == pytest.approx(1.2)
    assert math.dist(a, c) == pytest.approx(1.6)
    assert sorted([b[0], d[0]]) == pytest.approx([-1.2, -1.2])


def test_walls_hold_everything_solid() -> None:
    """Outlines, side walls of doorways and the sides of obstacles."""
    assert length(walls(BUILDING)) == pytest.approx(19.4 + 15.0 + 2.4 + 4.0)


def test_free_space_reaches_through_doors_and_leaves_obstacles_out() -> None:
    """The floor is the room with its doorways; an obstacle is a hole."""
    (floor,) = free_space(BUILDING, LEFT)
    assert area(floor.outline) == pytest.approx(30 + 1.2 * 1.6 + 1.2 * 1.0)
    assert [area(hole) for hole in floor.holes] == pytest.approx([1.0])


def test_free_space_does_not_leave_a_narrow_neighbour_through_its_far_wall() -> None:
    """What reaches into the other room ends at that room's walls."""
    narrow = BuildingMap(
        name="narrow",
        rooms=(BUILDING.rooms[0], Room(RIGHT, ((6.0, 0.0), (6.5, 0.0), (6.5, 5.0), (6.0, 5.0)))),
        doors=(BETWEEN,),
    )
    (floor,) = free_space(narrow, LEFT)
    assert max(x for x, _ in floor.outline) == pytest.approx(6.5)


def test_points_at_a_door_are_told_apart_by_room() -> None:
    """Inside for one room is beyond for the other."""
    inside = inner_point(BETWEEN, LEFT, 0.5)
    assert inside == pytest.approx((5.5, 2.5))
    assert inner_point(BETWEEN, RIGHT, 0.5) == pytest.approx((6.5, 2.5))
    assert not beyond(BETWEEN, LEFT, inside)
    assert beyond(BETWEEN, RIGHT, inside)
    assert inner_point(OUT, LEFT, -0.4) == pytest.approx((-0.4, 2.5))


def test_unknown_rooms_are_refused() -> None:
    """A room that is not there, or not at the door, raises an error that names it."""
    with pytest.raises(UnknownRoomError) as unknown:
        room_walls(BUILDING, RoomId("attic"))
    assert unknown.value.room == "attic"
    with pytest.raises(DoorRoomError) as wrong:
        inner_point(OUT, RIGHT, 0.5)
    assert (wrong.value.door, wrong.value.room) == ("out", "right")
