"""Objects that leave their places otherwise than in a hand."""

import json

from clo_fleet.sim.site import Site
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.world.model import ObjectId, ObjectSpec, PlaceId, Pose, RobotId, RobotSpec, RoomId

A, B = RoomId("a"), RoomId("b")
R1, CUP = RobotId("r1"), ObjectId("cup")
ROBOT = RobotSpec(id=R1, room=A, pose=Pose(2, 2), goals=())
OBJECT = ObjectSpec(id=CUP, room=A, position=(2.5, 2))


def scene() -> Site:
    """A robot with an object before it."""
    return Site(rooms_in_a_row("a", "b"), [ROBOT], [OBJECT], seed=0, tick=0.2)


def test_what_was_taken_away_lies_nowhere_and_comes_back_to_where_it_lay() -> None:
    """Not to where it was at first."""
    site = scene()
    site.rooms.move_item(CUP, (8, 2))
    site.items.take_away(CUP)
    site.step()
    assert site.items.place(CUP) is None
    assert site.items.lying == {}
    assert site.items.bring_back(CUP, None) == (8, 2)
    assert site.items.place(CUP) == PlaceId(B)


def test_what_slips_out_of_a_hand_lies_beside_its_carrier() -> None:
    """On the same floor."""
    site = scene()
    site.rooms.grasp(R1, CUP)
    site.step()
    assert site.items.lying_in(A) == ()
    spot = site.items.drop(CUP, R1, A)
    assert spot is not None
    assert site.rooms.carrier(CUP) is None
    assert site.items.place(CUP) == PlaceId(A)


def test_where_things_lay_is_known_after_a_round_trip() -> None:
    """An object under a wall belongs to the room in which it lay before."""
    site, again = scene(), scene()
    site.rooms.move_item(CUP, (8, 2))
    assert site.items.place(CUP) == PlaceId(B)
    again.items.restore(json.loads(json.dumps(site.items.state())))
    assert again.items.state() == site.items.state()
    again.rooms.move_item(CUP, (6, 5.1))
    assert again.items.place(CUP) == PlaceId(B)
