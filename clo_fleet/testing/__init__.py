"""For those who test fleets: small worlds in a few lines, runs that are closed after them, assertions that explain.

With pytest nothing has to be imported but the assertions; the fixtures ``fleet_world`` and ``run_fleet`` are there as
soon as clo-fleet is installed::

    from clo_fleet.testing import assert_goals_reached, assert_helped

    def test_r2_saves_r1_some_work(fleet_world, run_fleet):
        world = (
            fleet_world("kitchen", "hall", "office")
            .robot("r1", "office", wants="(holding r1 cup)")
            .robot("r2", "kitchen", wants="(prepared cup)")
            .thing("cup", "kitchen")
        )
        run = run_fleet(world)
        run.finish()
        assert_goals_reached(run)
        assert_helped(run, by="r2", robot="r1", fact="(prepared cup)")
"""

from clo_fleet.testing.assertions import (
    assert_dropped,
    assert_goals_reached,
    assert_helped,
    assert_no_contacts,
    assert_outcome,
    assert_replanned,
    assert_sound,
)
from clo_fleet.testing.buildings import rooms_in_a_row, rooms_on_a_corridor, shipped_map
from clo_fleet.testing.fixtures import FleetWorld, RunFleet
from clo_fleet.testing.recorded import events_of
from clo_fleet.testing.worlds import NoSpotError, UnsoundWorldError, WorldBuilder

__all__ = [
    "FleetWorld",
    "NoSpotError",
    "RunFleet",
    "UnsoundWorldError",
    "WorldBuilder",
    "assert_dropped",
    "assert_goals_reached",
    "assert_helped",
    "assert_no_contacts",
    "assert_outcome",
    "assert_replanned",
    "assert_sound",
    "events_of",
    "rooms_in_a_row",
    "rooms_on_a_corridor",
    "shipped_map",
]
