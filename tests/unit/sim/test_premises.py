"""Rooms and zones: which of them a point belongs to."""

from clo_fleet.sim.premises import Premises
from clo_fleet.testing.buildings import corridor_with_rooms, rooms_in_a_row
from clo_fleet.world.model import PlaceId, RoomId

A, B = RoomId("a"), RoomId("b")
IN_A, IN_B = PlaceId("a"), PlaceId("b")


def test_a_robot_changes_its_room_at_the_line_of_the_door() -> None:
    """And is in the room that it came from until then."""
    premises = Premises(rooms_in_a_row("a", "b"))
    assert premises.place_at((5.9, 2.5), IN_A) == IN_A
    assert premises.place_at((6.1, 2.5), IN_A) == IN_B
    assert premises.place_at((6.1, 2.5), IN_B) == IN_B


def test_behind_a_door_onto_corridors_is_a_zone_until_a_room_is_entered() -> None:
    """By its nearest door: that is where one can come in."""
    premises = Premises(corridor_with_rooms(["a", "b"]))
    zone = premises.place_at((1.7, 3.9), IN_A)
    assert not premises.is_room(zone)
    assert premises.place_at((1.7, 0.0), zone) == zone
    assert premises.nearest_door(zone, (6.0, -3.0)).rooms == (B,)
    assert premises.place_at((6.3, -4.1), zone) == IN_B


def test_what_lies_in_a_doorway_or_under_a_wall_is_where_it_was() -> None:
    """Only another room's floor is that room."""
    premises = Premises(rooms_in_a_row("a", "b"))
    assert premises.room_around((6.0, 5.1), A) == A
    assert premises.room_around((6.0, 5.1), B) == B
    assert premises.room_around((8.0, 2.0), A) == B
