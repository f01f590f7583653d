"""What the truth promises: facts follow from where things are, and can be looked at within a tick."""

import json

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.task import Action, Condition
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import SHOVED, Truth
from clo_fleet.world.model import (
    BuildingMap,
    Door,
    DoorId,
    ObjectId,
    ObjectSpec,
    PlaceId,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    World,
)
from clo_fleet.world.vocabulary import vocabulary

A, B = RoomId("a"), RoomId("b")
R1, CUP = RobotId("r1"), ObjectId("cup")
BUILDING = BuildingMap(
    name="two rooms",
    rooms=(Room(A, ((0, 0), (6, 0), (6, 5), (0, 5))), Room(B, ((6, 0), (12, 0), (12, 5), (6, 5)))),
    doors=(Door(id=DoorId("d"), rooms=(A, B), position=(6, 2.5), heading=0.0, width=1.2),),
)
ROBOT = RobotSpec(id=R1, room=A, pose=Pose(2, 2), goals=())
OBJECT = ObjectSpec(id=CUP, room=A, position=(2.5, 2), prepared=True)
WORLD = World(name="two rooms", map=BUILDING, robots=(ROBOT,), objects=(OBJECT,))
GRASP = Cause(R1, "grasp(r1, cup, a)", 7)


def scene() -> tuple[Site, Truth]:
    """One robot, and one prepared object within its reach."""
    site = Site(BUILDING, [ROBOT], [OBJECT], seed=0, tick=0.2)
    return site, Truth(site, vocabulary(WORLD))


def test_what_changed_within_a_tick_is_seen_by_a_look_and_told_once_the_tick_is_over() -> None:
    """``facts`` is a snapshot of the last tick; ``look`` shows the moment, and whose doing it is."""
    site, truth = scene()
    site.rooms.grasp(R1, CUP)
    truth.handle(CUP, GRASP)
    assert ("at-object", "cup", "a") in truth.facts
    assert truth.look(("at-object", "cup", "a")) == Flip(("at-object", "cup", "a"), False, GRASP)
    assert truth.look(("holding", "r1", "cup")) == Flip(("holding", "r1", "cup"), True, GRASP)
    site.step()
    flips = truth.step({R1: GRASP})
    assert flips == (Flip(("at-object", "cup", "a"), False, GRASP), Flip(("holding", "r1", "cup"), True, GRASP))
    assert truth.look(("holding", "r1", "cup")) == Flip(("holding", "r1", "cup"), True, GRASP)


def test_an_object_is_where_it_lies_at_this_moment() -> None:
    """Moved into the next room, it is there before the tick is over."""
    site, truth = scene()
    site.rooms.move_item(CUP, (10, 2))
    assert site.items.place(CUP) == PlaceId(B)
    assert truth.look(("at-object", "cup", "b")).value
    site.step()
    assert site.items.lying_in(B) == (CUP,)
    assert site.items.lying_in(A) == ()


def test_a_prepared_object_stays_so_in_hand_but_not_when_it_is_shoved() -> None:
    """Carried over any distance it stays prepared; slid across the floor it does not, and nobody did that."""
    site, truth = scene()
    site.rooms.move_item(CUP, (2.5 + 0.9 * SHOVED, 2))
    assert truth.step({}) == ()
    site.rooms.grasp(R1, CUP)
    truth.step({})
    site.rooms.release(R1, CUP, (4, 4))
    truth.step({})
    assert ("prepared", "cup") in truth.facts
    site.rooms.move_item(CUP, (4, 4 - 1.1 * SHOVED))
    assert truth.step({}) == (Flip(("prepared", "cup"), False),)


def test_effects_come_about_within_a_tick_and_are_saved_with_where_they_were_done() -> None:
    """Told with their cause once the tick is over; restored from JSON, they are lost by the same shove."""
    site, truth = scene()
    truth.come_about({("prepared", "cup"): False, ("at-robot", "r1", "b"): True}, GRASP)
    assert truth.effects == frozenset()
    assert truth.step({}) == (Flip(("prepared", "cup"), False, GRASP),)
    truth.come_about({("prepared", "cup"): True}, None)
    truth.step({})
    again = Truth(site, vocabulary(WORLD))
    again.restore(json.loads(json.dumps(truth.state())))
    assert (again.facts, again.state()) == (truth.facts, truth.state())
    site.rooms.move_item(CUP, (2.5 + 1.1 * SHOVED, 2))
    assert again.step({}) == truth.step({}) == (Flip(("prepared", "cup"), False),)


def test_where_a_shoved_object_was_prepared_is_where_it_lies_at_the_end_of_that_tick() -> None:
    """A tick is one moment: how far it was shoved within the tick does not count."""
    site, truth = scene()
    truth.come_about({("prepared", "cup"): True}, None)
    site.rooms.move_item(CUP, (2.5 + 0.9 * SHOVED, 2))
    truth.step({})
    site.rooms.move_item(CUP, (2.5 + 1.8 * SHOVED, 2))
    assert truth.step({}) == ()


def test_an_action_lacks_what_is_not_so_at_this_moment() -> None:
    """Where objects lie, who holds them and what was done to them; where robots are is their skills' business."""
    _, truth = scene()
    needs = (Condition(("at-robot", "r1", "b")), Condition(("at-object", "cup", "a")), Condition(("prepared", "cup")))
    action = Action(schema="grasp", args=("r1", "cup", "a"), needs=needs, adds=frozenset(), deletes=frozenset())
    assert truth.lacking(action) is None
    truth.come_about({("prepared", "cup"): False}, None)
    assert truth.lacking(action) == needs[2]
