"""Robots that are to put things into each other's hands."""

from clo_fleet.testing import FleetWorld, RunFleet, assert_goals_reached, assert_sound


def test_two_that_are_to_give_each_other_something_both_do_so(fleet_world: FleetWorld, run_fleet: RunFleet) -> None:
    """Neither has a plan when the other asks for its first one; each plans when it hears where the other is."""
    world = fleet_world("a", "b").robot("r1", "a", wants="(holding r2 cup)").robot("r2", "b", wants="(holding r1 pen)")
    run = run_fleet(world.thing("cup", "a").thing("pen", "b"))
    assert_sound(run)
    assert_goals_reached(run)
