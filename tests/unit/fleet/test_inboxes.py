"""Whose turn it is: nobody's who has no news, and those first whose action has ended."""

from clo_fleet.clo.messages import ActionFinished, Wake
from clo_fleet.fleet.inboxes import Inboxes
from clo_fleet.world.model import RobotId

A, B, C, D = (RobotId(name) for name in "abcd")


def turns(inboxes: Inboxes) -> list[str]:
    """The robots of one round."""
    return [robot for robot, _ in inboxes.round()]


def test_only_who_has_news_or_was_stirred_has_a_turn() -> None:
    """In the order of ids, with its events, once."""
    inboxes = Inboxes((A, B, C, D))
    inboxes.put(D, Wake(1.0))
    inboxes.put(B)
    inboxes.stir(A)
    assert list(inboxes.round()) == [(A, []), (D, [Wake(1.0)])]
    assert not inboxes
    assert turns(inboxes) == []


def test_whose_action_has_ended_comes_first() -> None:
    """What it then announces is known to the others when they hear of its deeds."""
    inboxes = Inboxes((A, B, C, D))
    for robot in (A, C):
        inboxes.put(robot, Wake(1.0))
    inboxes.put(D, ActionFinished(1.0, 1))
    assert turns(inboxes) == [D, A, C]


def test_who_is_stirred_meanwhile_has_its_turn_if_that_is_still_to_come() -> None:
    """Else in the next round; and so has one that has had its turn because its action ended."""
    inboxes = Inboxes((A, B, C, D))
    inboxes.put(B, Wake(1.0))
    inboxes.put(D, ActionFinished(1.0, 1))
    first = []
    for robot, _ in inboxes.round():
        first.append(robot)
        if robot == B:
            for other in (A, C, D):
                inboxes.put(other, Wake(2.0))
    assert first == [D, B, C]
    assert inboxes[A] == (Wake(2.0),)
    assert turns(inboxes) == [A, D]
    assert not inboxes
