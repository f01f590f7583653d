"""A robot that has become very slow is in nobody's way longer than it takes, and never driven into."""

import pytest

from clo_fleet.testing import FleetWorld, RunFleet, assert_goals_reached, assert_sound
from clo_fleet.world.disturbances import RobotSlowed
from clo_fleet.world.model import RobotId

CRAWL = 0.1  # [m/s]


@pytest.mark.parametrize("time", [4.0, 9.0, 11.0, 12.0, 13.0, 14.0])
def test_whoever_follows_keeps_off_one_that_is_hardly_moving(
    time: float, fleet_world: FleetWorld, run_fleet: RunFleet
) -> None:
    """Wherever it is at that time: between rooms, at the door, half in the room."""
    world = fleet_world(on_map="hello").robot("r1", "west", at=(5.0, 2.5), wants="(at-robot r1 east)")
    world = world.robot("r2", "west", at=(4.0, 2.5), wants="(at-robot r2 east)")
    run = run_fleet(world.happens(RobotSlowed(time, RobotId("r1"), CRAWL)))
    assert_sound(run)
    assert_goals_reached(run)
