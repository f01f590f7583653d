"""What becomes of a team whose radio is late, out of range, or loses messages: nobody hangs, and nobody is misled."""

from dataclasses import replace

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.assertions import assert_goals_reached
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import RobotSlowed
from clo_fleet.world.events import PlanAnnounced, Sensed, Waiting
from clo_fleet.world.model import Radio, RobotId, World

PROMISED = "for what another robot has in hand"
NO_PLAN = "no plan exists as things are believed"


def deliveries(radio: Radio, seed: int = 0) -> World:
    """The cup is to come to b; r2 is nearer, and r1 waits in a, out of sight, for it and for a pen that r3 hands it."""
    world = (
        WorldBuilder(rooms_in_a_row("a", "b", "c"))
        .robot("r1", "c", wants=["(at-object cup b)", "(holding r1 pen)"], at=(16, 2.5))
        .robot("r2", "a", wants="(at-object cup b)", at=(1, 1))
        .robot("r3", "b", wants="(holding r1 pen)")
        .thing("cup", "a", at=(3, 3))
        .thing("pen", "a", at=(4, 1))
        .build()
    )
    return replace(world, radio=radio, seed=seed)


def finished(world: World, fleet_planners: PlannerPool) -> Run:
    """The world run to its end."""
    with Run(world, "clo", planners=fleet_planners) as run:
        run.finish()
        return run


def waits(run: Run, robot: str) -> list[tuple[float, str]]:
    """When and for what the robot waited."""
    return [(time, event.why) for _, time, event in run.log if isinstance(event, Waiting) and event.robot == robot]


@pytest.mark.parametrize(
    ("radio", "seed"),
    [(Radio(loss=0.7), 2), (Radio(loss=0.3), 0), (Radio(delay=5.0), 0), (Radio(range=3.0), 0)],
    ids=["loses most", "loses some", "late", "short"],
)
def test_what_is_lost_or_late_is_heard_in_the_end(radio: Radio, seed: int, fleet_planners: PlannerPool) -> None:
    """A robot that missed a promise, its withdrawal, or the deed itself goes on when that is said again."""
    assert_goals_reached(finished(deliveries(radio, seed), fleet_planners))


def test_the_same_messages_are_lost_again(fleet_planners: PlannerPool) -> None:
    """Two runs of the same world and seed have the same log."""
    world = deliveries(Radio(loss=0.5, delay=1.0, range=8.0), 1)
    assert finished(world, fleet_planners).log == finished(world, fleet_planners).log


def test_news_takes_its_time(fleet_planners: PlannerPool) -> None:
    """With a delay of 3 s a robot in another room learns of a deed 3 s after it was done."""
    told = {}
    for delay in (0.0, 3.0):
        run = finished(deliveries(Radio(delay=delay)), fleet_planners)
        told[delay] = next(
            time
            for _, time, event in run.log
            if isinstance(event, Sensed) and (event.robot, event.fact) == ("r1", ("prepared", "cup"))
        )
    assert told[3.0] == pytest.approx(told[0.0] + 3.0)


def test_first_plans_are_known_to_all_even_if_nothing_else_is_ever_heard(fleet_planners: PlannerPool) -> None:
    """They are exchanged before anybody leaves; then with every message lost the run still ends, and says why."""
    run = finished(deliveries(Radio(loss=1.0)), fleet_planners)
    result = run.result()
    assert result.outcome == "no_plan"
    assert result.robots["r2"].goals_reached
    assert result.robots["r3"].executed == 4  # it knew where to meet r1
    assert all(robot.facts_heard == 0 for robot in result.robots.values() if robot.goals_reached)
    assert {event.robot for _, time, event in run.log if isinstance(event, PlanAnnounced) and time == 0.0} == {
        "r1",
        "r2",
        "r3",
    }


def test_a_promise_of_a_robot_that_is_not_heard_any_more_lapses(fleet_planners: PlannerPool) -> None:
    """r2 takes the cup, breaks down, and r1 gets out of its range: r1 stops counting on it after the time given."""
    world = (
        WorldBuilder(rooms_in_a_row("a", "b", "c"))
        .robot("r1", "b", wants=["(at-object cup b)", "(at-robot r1 c)"], at=(7, 2.5))
        .robot("r2", "a", wants="(at-object cup b)", at=(0.8, 2.5))
        .thing("cup", "a", at=(1.5, 2.5), prepared=True)
        .happens(RobotSlowed(2.4, RobotId("r2"), 0.001))
        .build()
    )
    world = replace(world, until=40.0, radio=Radio(range=6.0, promise=20.0, repeat=2.0))
    run = finished(world, fleet_planners)
    said = waits(run, "r1")
    assert [why for _, why in said if why in (PROMISED, NO_PLAN)] == [PROMISED, NO_PLAN]
    lapsed = next(time for time, why in said if why == NO_PLAN)
    assert 20.0 < lapsed < 30.0  # it passed into b, out of range, after some six seconds
