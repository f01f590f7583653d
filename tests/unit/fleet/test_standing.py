"""What the log is told of robots that stand."""

import json

from clo_fleet.fleet.standing import Standing
from clo_fleet.fleet.waits import Waits
from clo_fleet.robot.skill import Under, standing
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.sim.site import Site
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.world.events import Waiting
from clo_fleet.world.model import RobotId

R1, R2 = RobotId("r1"), RobotId("r2")
DOOR = standing(Wait(WaitCause.DOOR, "d", (R2,)))


def test_it_is_told_why_a_robot_stands_when_that_is_new() -> None:
    """Not again while it stands for the same; but again when it has moved in between, also after a round trip."""
    waits = Waits()
    site = Site(rooms_in_a_row("a"), [], [], seed=0, tick=0.2)
    follows = Standing(site, waits)
    told = [Waiting(R1, DOOR.standing_for, "door", "d", (R2,))]
    assert follows.note(0.2, {R2: Under(), R1: DOOR}) == told
    assert follows.note(0.4, {R1: DOOR}) == []
    again = Standing(site, waits)
    again.restore(json.loads(json.dumps(follows.state())))
    assert again.texts == {"r1": DOOR.standing_for}
    assert again.note(0.6, {R1: DOOR}) == []
    assert again.note(0.8, {R1: Under()}) == []
    assert again.note(1.0, {R1: DOOR}) == told
    assert waits.seconds == {R1: {"door": 0.8}}
