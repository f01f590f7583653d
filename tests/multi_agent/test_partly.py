"""A robot with several goals, one of which cannot be reached as things are believed: ``planning: {partly: true}``."""

from dataclasses import replace

import pytest

from clo_fleet.fleet.outcome import Outcome
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.testing.recorded import events_of
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import Disturbance, ObjectReturned, ObjectTaken
from clo_fleet.world.events import ActionStarted
from clo_fleet.world.model import ObjectId, Perception, PerceptionMode, PlanningTime, World

CUP = ObjectId("cup")


def errands(*happens: Disturbance) -> World:
    """Robot r1 is to fetch the tray from room b, and the cup; that was taken away from room c."""
    builder = WorldBuilder(rooms_in_a_row("a", "b", "c")).robot(
        "r1", "a", wants=("(holding r1 cup)", "(holding r1 tray)"), at=(1, 2.5)
    )
    builder.thing("tray", "b", at=(10, 1.5)).thing("cup", "c", at=(16, 1.5))
    world = builder.happens(ObjectTaken(0.0, CUP), *happens).build()
    return replace(world, perception=Perception(mode=PerceptionMode.FULL), until=150.0)


@pytest.mark.parametrize("strategy", ["clo", "replan-on-failure"])
def test_what_is_within_reach_is_done_and_the_rest_when_it_is(strategy: str, fleet_planners: PlannerPool) -> None:
    """The tray is fetched while nobody knows where the cup is; when that is back, it is fetched too, and not before."""
    world = errands(ObjectReturned(60.0, CUP))
    with Run(replace(world, planning=PlanningTime(partly=True)), strategy, planners=fleet_planners) as run:
        assert run.finish().outcome == Outcome.GOALS_REACHED.value
    assert events_of(run, ActionStarted, action="grasp(r1, tray, b)")[0][0] < 60.0
    assert events_of(run, ActionStarted, action="grasp(r1, cup, c)")[0][0] > 60.0


def test_nothing_is_done_unless_the_world_says_so(fleet_planners: PlannerPool) -> None:
    """All or nothing: the robot waits, and the run ends for want of a plan."""
    with Run(errands(), planners=fleet_planners) as run:
        assert run.finish().outcome == Outcome.NO_PLAN.value
    assert not events_of(run, ActionStarted, action="grasp(r1, tray, b)")
