"""Who waits for whom: circles, and how long for what."""

import json

from clo_fleet.fleet.judge import CIRCLE_AFTER, Judge
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.fleet.waits import Waits
from clo_fleet.robot.wait import Wait, WaitCause, hindered
from clo_fleet.sim.right_of_way import Hindrance, Obstacle
from clo_fleet.world.model import RobotId

R1, R2, R3 = map(RobotId, ("r1", "r2", "r3"))
AFTER_2 = Wait(WaitCause.DOOR, "d1", (R2,))
AFTER_3 = Wait(WaitCause.VEHICLE, "", (R3,))
AFTER_1 = Wait(WaitCause.SINGLE_LANE, "c1", (R1,))
ROUND = {R1: AFTER_2, R2: AFTER_3, R3: AFTER_1}


def test_waits_are_told_when_they_are_new_and_counted_by_cause() -> None:
    """Not again in every tick."""
    waits = Waits()
    assert waits.note(0.2, 0.2, {R1: AFTER_2}) == (R1,)
    assert waits.note(0.4, 0.2, {R2: AFTER_3, R1: AFTER_2}) == (R2,)
    assert waits.note(0.6, 0.2, {R1: AFTER_1}) == (R1,)
    assert waits.now == {R1: AFTER_1}
    assert waits.seconds == {R1: {"door": 0.4, "single lane": 0.2}, R2: {"vehicle ahead": 0.2}}


def test_robots_that_wait_for_one_another_are_a_circle() -> None:
    """From its smallest robot on, and since it closed."""
    waits = Waits()
    waits.note(0.2, 0.2, {R1: AFTER_2, R2: AFTER_3})
    assert not waits.circle
    waits.note(0.4, 0.2, ROUND)
    waits.note(0.6, 0.2, ROUND)
    assert waits.circle == (R1, R2, R3)
    assert waits.circle_since == 0.4
    assert waits.circle_text() == (
        "r1 waits for r2 (door d1), r2 waits for r3 (vehicle ahead), r3 waits for r1 (single lane c1)"
    )


def test_whoever_gives_up_by_itself_closes_no_circle() -> None:
    """A giver fails when its partner does not come, and so does a drive without a way through its room."""
    waits = Waits()
    waits.note(0.2, 0.2, {R1: Wait(WaitCause.PARTNER, "r2", (R2,)), R2: Wait(WaitCause.DOOR, "d1", (R1,))})
    assert waits.circle == ()


def test_a_run_ends_in_gridlock_when_a_circle_stays() -> None:
    """Long before nobody has moved for minutes; the circle is named."""
    waits, judge = Waits(), Judge(frozenset())
    waits.note(1.0, 0.2, ROUND)
    assert judge.verdict(1.0 + CIRCLE_AFTER, 900.0, frozenset(), {}, {}, waits) is None
    verdict = judge.verdict(1.2 + CIRCLE_AFTER, 900.0, frozenset(), {}, {}, waits)
    assert verdict == (Outcome.GRIDLOCK, waits.circle_text())


def test_a_saved_state_is_the_state() -> None:
    """Through JSON."""
    waits = Waits()
    waits.note(0.2, 0.2, ROUND)
    again = Waits.from_state(json.loads(json.dumps(waits.state())))
    assert again == waits
    assert again.note(0.4, 0.2, ROUND) == ()


def test_who_has_no_right_of_way_waits_for_those_who_all_must_go_on() -> None:
    """Not for the many of whom any one could clear its way."""
    assert hindered(Hindrance(Obstacle.SINGLE_LANE, "c1", (R1,))) == AFTER_1
    assert hindered(Hindrance(Obstacle.ROOM, "l1", (R1, R2))) == Wait(WaitCause.ROOM, "l1")
    assert hindered(Hindrance(Obstacle.TURN, "l1", (R2,))).text == "its turn on the way to room l1, after robot r2"
    assert {hindered(Hindrance(obstacle, "x")).cause for obstacle in Obstacle} >= {WaitCause.LANES, WaitCause.CLOSED}
    assert all(Wait(cause, "x").text and Wait(cause, "x").what for cause in WaitCause)
