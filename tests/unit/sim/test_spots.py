"""Places on the floor, the nearest first, and what they cost."""

import math
from itertools import pairwise

import pytest

from clo_fleet.sim.spots import SPOT_STEP, spots
from clo_fleet.sim.walls import UnknownRoomError, in_front, in_room
from clo_fleet.world.model import BuildingMap, Door, DoorId, Point, Room, RoomId

LEFT, RIGHT = RoomId("left"), RoomId("right")
TURN = 0.3  # [rad] no wall runs along an axis


def turned(x: float, y: float) -> Point:
    """A point of the building, turned."""
    return (x * math.cos(TURN) - y * math.sin(TURN), x * math.sin(TURN) + y * math.cos(TURN))


def rectangle(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    """The corners of a turned rectangle."""
    return tuple(turned(*corner) for corner in ((x, y), (x + width, y), (x + width, y + height), (x, y + height)))


OUT = Door(id=DoorId("out"), rooms=(LEFT,), position=turned(0.0, 2.5), heading=TURN + math.pi, width=1.6)
BETWEEN = Door(id=DoorId("between"), rooms=(LEFT, RIGHT), position=turned(6.0, 2.5), heading=TURN, width=1.0)
ROOMS = (Room(LEFT, rectangle(0, 0, 6, 5), (rectangle(2, 2, 1, 1),)), Room(RIGHT, rectangle(6, 0, 3, 5)))
BUILDING = BuildingMap(name="two rooms", rooms=ROOMS, doors=(OUT, BETWEEN))


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.id))
def test_all_places_are_there_that_are_on_the_floor_and_not_in_front_of_doors(room: Room) -> None:
    """Each of the rings is judged as ``walls`` judges one place."""
    near, within, radius = turned(3.1, 2.4), 4.0, 0.12
    doors = [door for door in BUILDING.doors if room.id in door.rooms]
    expected = []
    for ring in range(round(within / SPOT_STEP) + 1):
        for k in range(max(1, 6 * ring)):
            angle = math.tau * k / max(1, 6 * ring)
            place = (near[0] + ring * SPOT_STEP * math.cos(angle), near[1] + ring * SPOT_STEP * math.sin(angle))
            if in_room(room, place) and not any(in_front(door, room.id, place, radius) for door in doors):
                expected.append(place)
    assert list(spots(BUILDING, room.id, near, radius, within)) == expected


def test_nearer_places_come_first() -> None:
    """Ring by ring, beginning with the point itself if that will do."""
    near = turned(4.5, 4.0)
    distances = [math.dist(near, spot) for spot in spots(BUILDING, LEFT, near, 0.12, 4.0)]
    assert distances[0] == 0.0
    assert all(before <= after + 1e-9 for before, after in pairwise(distances))


def test_a_room_that_is_not_there_has_no_floor() -> None:
    """It is named."""
    with pytest.raises(UnknownRoomError, match="'attic'"):
        next(spots(BUILDING, RoomId("attic"), (0.0, 0.0), 0.1, 1.0))
