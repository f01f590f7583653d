"""A corridor may be closed at the very moment at which a robot changes from its room into the corridor."""

import pytest

from clo_fleet.testing import FleetWorld, RunFleet, assert_goals_reached, assert_sound
from clo_fleet.world.disturbances import CorridorClosed, CorridorOpened
from clo_fleet.world.model import CorridorId

HALL = CorridorId("hall")


@pytest.mark.parametrize("tick", [6, 10, 12, 14, 16])
def test_whenever_a_corridor_is_closed_the_robot_gets_through_when_it_is_open_again(
    tick: int, fleet_world: FleetWorld, run_fleet: RunFleet
) -> None:
    """In the room, in the doorway, while it is being let in, or just behind the door."""
    world = fleet_world(on_map="hello").robot("r1", "west", at=(4.0, 2.5), wants="(at-robot r1 east)")
    run = run_fleet(world.happens(CorridorClosed(0.2 * tick, HALL), CorridorOpened(0.2 * tick + 15.0, HALL)))
    assert_sound(run)
    assert_goals_reached(run)


@pytest.mark.parametrize("tick", [12, 16, 20])
def test_whenever_the_direct_way_is_closed_for_good_the_robot_goes_round(
    tick: int, fleet_world: FleetWorld, run_fleet: RunFleet
) -> None:
    """It has the right of way already, and exchanges it for another way out of the same door."""
    world = fleet_world(on_map="office").robot("r1", "lab", at=(4.0, 23.0), wants="(at-robot r1 kitchen)")
    run = run_fleet(world.happens(CorridorClosed(0.2 * tick, CorridorId("west"))))
    assert_sound(run)
    assert_goals_reached(run)
