"""What walls and obstacles hide, and what they do not."""

import pytest

from clo_fleet.sim.sightlines import Sightlines
from clo_fleet.sim.walls import free_space
from clo_fleet.world.model import BuildingMap, Door, DoorId, Point, Room, RoomId

PILLAR = ((4.0, 2.0), (5.0, 2.0), (5.0, 4.0), (4.0, 4.0))
PLAIN = Room(RoomId("plain"), ((0, 0), (10, 0), (10, 6), (0, 6)))
PILLARED = Room(RoomId("pillared"), PLAIN.outline, (PILLAR,))
ANGLE = Room(RoomId("angle"), ((0, 0), (8, 0), (8, 3), (3, 3), (3, 8), (0, 8)))


def lines(room: Room, *doors: Door) -> Sightlines:
    """The lines of sight of one room."""
    return Sightlines(room, free_space(BuildingMap(name="one", rooms=(room,), doors=doors), room.id))


@pytest.mark.parametrize(
    ("room", "eye", "point", "visible"),
    [
        (PLAIN, (1, 3), (9, 3), True),
        (PILLARED, (1, 3), (9, 3), False),
        (PILLARED, (1, 1), (9, 1), True),
        (PILLARED, (1, 4.0), (9, 4.0), True),
        (ANGLE, (7, 1), (1, 7), False),
        (ANGLE, (7, 1), (1, 1), True),
        (ANGLE, (1, 1), (1, 7), True),
    ],
    ids=["across", "behind the pillar", "beside it", "along its side", "round a corner", "one arm", "other arm"],
)
def test_walls_and_obstacles_block_sight(room: Room, eye: Point, point: Point, visible: bool) -> None:
    """What lies behind one is not seen, from either end of the line."""
    assert lines(room).seen(eye, [point], 20.0) == (visible,)
    assert lines(room).seen(point, [eye], 20.0) == (visible,)


def test_range_counts_as_well() -> None:
    """A point further away than the range is not seen; none are asked for, none are answered."""
    assert lines(PLAIN).seen((1, 1), [(4, 1), (9, 1)], 5.0) == (True, False)
    assert lines(PLAIN).seen((1, 1), [], 5.0) == ()


def test_a_doorway_is_seen_from_in_front_of_it_only() -> None:
    """It belongs to the room, but the walls beside the door hide most of it from the sides."""
    door = Door(id=DoorId("d"), rooms=(PLAIN.id,), position=(10, 3), heading=0.0, width=1.2)
    outside = (11.0, 3.0)
    assert lines(PLAIN, door).seen((5, 3), [outside], 20.0) == (True,)
    assert lines(PLAIN, door).seen((9.5, 0.5), [outside], 20.0) == (False,)


@pytest.mark.parametrize("room", [PLAIN, PILLARED, ANGLE], ids=["plain", "pillared", "angle"])
def test_spots_cover_the_floor_and_nothing_else(room: Room) -> None:
    """No point of the floor is further than 0.6 m from a spot, and no spot is within an obstacle or outside."""
    spots = lines(room).spots
    assert spots
    for x, y in spots:
        assert not (4.0 < x < 5.0 and 2.0 < y < 4.0 and room is PILLARED)
        assert not (x > 3.0 and y > 3.0 and room is ANGLE)
    for n in range(100):
        point = (0.2 + (n % 10) * 0.9, 0.2 + (n // 10) * 0.55)
        if room is PLAIN:
            assert min((point[0] - x) ** 2 + (point[1] - y) ** 2 for x, y in spots) < 0.36


def test_a_room_too_small_to_hide_anything_has_no_spots() -> None:
    """Nothing can lie there."""
    assert lines(Room(RoomId("slit"), ((0, 0), (3, 0), (3, 0.15), (0, 0.15)))).spots == ()
