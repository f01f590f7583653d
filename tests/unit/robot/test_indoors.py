"""Robots that work in a room stay in it, and keep clear of who waits at its door."""

import pytest

from clo_fleet.robot.avoidance import Avoidance
from clo_fleet.robot.indoors import at_doors, indoors
from clo_fleet.testing import FleetWorld, RunFleet
from clo_fleet.world.disturbances import RobotSlowed
from clo_fleet.world.model import RobotId, RoomId

R1, R2 = RobotId("r1"), RobotId("r2")


def test_near_a_door_nobody_is_carried_out_by_it(fleet_world: FleetWorld, run_fleet: RunFleet) -> None:
    """What leads out goes, what leads along the wall or back in stays; far from doors nothing changes."""
    run = run_fleet(fleet_world("a", "b").robot("r1", "a", at=(5.3, 2.5)).robot("r2", "a", at=(2.0, 4.0)))
    run.step()
    site = run.mission.site
    assert indoors(site, R1, (1.0, 0.2)) == pytest.approx((0.0, 0.2))
    assert indoors(site, R1, (-1.0, 0.2)) == (-1.0, 0.2)
    assert indoors(site, R1, (0.3, 0.0)) == (0.3, 0.0)  # it stops in time
    assert indoors(site, R2, (1.0, 0.0)) == (1.0, 0.0)
    (door,) = site.premises.doors_of(RoomId("a"))
    assert indoors(site, R1, (1.0, 0.2), door.id) == (1.0, 0.2)  # by this one it leaves


def test_who_waits_to_be_let_in_is_avoided(fleet_world: FleetWorld, run_fleet: RunFleet) -> None:
    """r2 holds in the corridor because r1 has broken down in its way; the room's robots know of r2."""
    world = fleet_world(on_map="hello").robot("r1", "east", at=(14.9, 2.5))
    world.robot("r2", "west", at=(4.5, 2.5), wants="(at-robot r2 east)").happens(RobotSlowed(0.0, R1, 0.0))
    run = run_fleet(world)
    while not run.mission.site.holding():
        assert not run.done
        run.step()
    assert run.mission.site.holding() == {R2: "east"}
    (agent,) = at_doors(run.mission.site)
    assert (agent.id, agent.group, agent.max_speed) == ("r2", "east", 0.0)
    assert agent.position == pytest.approx(run.robot("r2").pose.point)
    assert Avoidance().velocities([agent]) == [(0.0, 0.0)]
