"""Simulated planning time: each mode delays answers as it says, and robots go on with what they are doing."""

import math
from dataclasses import replace

import pytest

from clo_fleet.fleet.mission import TICK
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.assertions import assert_goals_reached
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import ObjectMoved
from clo_fleet.world.events import ActionEnded, ActionStarted, PlanFollowed, PlanRequested
from clo_fleet.world.model import ObjectId, Perception, PerceptionMode, PlanningTime, World


def world(planning: PlanningTime, moved: float = 3.0) -> World:
    """The robot knows everything; the cup is moved to another room, at a time [s], while it drives to where it lay."""
    builder = WorldBuilder(rooms_in_a_row("a", "b", "c")).robot("r1", "a", wants="(holding r1 cup)", at=(1, 2.5))
    builder.thing("cup", "c", at=(16, 1.5)).happens(ObjectMoved(moved, ObjectId("cup"), (10.0, 1.5)))
    return replace(builder.build(), planning=planning, perception=Perception(PerceptionMode.FULL))


def answers(run: Run) -> list[tuple[float, float, int]]:
    """Each question's time and that of its answer [s], and the states that were expanded for it."""
    asked = [time for _, time, event in run.log if isinstance(event, PlanRequested)]
    followed = [(time, event.expansions) for _, time, event in run.log if isinstance(event, PlanFollowed)]
    return [(begin, end, expansions) for begin, (end, expansions) in zip(asked, followed, strict=True)]


@pytest.mark.parametrize(
    "planning",
    [
        PlanningTime(),
        PlanningTime(fixed=3.0),
        PlanningTime(per_expansion=0.25),
        PlanningTime(fixed=1.0, per_expansion=0.25),
    ],
    ids=["zero", "fixed", "per expansion", "both"],
)
def test_an_answer_comes_when_the_planning_time_is_over(planning: PlanningTime, fleet_planners: PlannerPool) -> None:
    """At the next tick; with none, in the tick of the question."""
    with Run(world(planning), "replan", planners=fleet_planners) as run:
        run.finish()
    assert_goals_reached(run)
    found = answers(run)
    assert len(found) >= 2
    for asked, answered, expansions in found:
        due = asked + planning.fixed + planning.per_expansion * expansions
        assert answered == pytest.approx(math.ceil((due - 1e-9) / TICK) * TICK, abs=1e-6)
    spent = run.result().robots["r1"].planning_s
    assert spent == pytest.approx(sum(planning.fixed + planning.per_expansion * n for *_, n in found))


def test_the_running_action_goes_on_while_the_planner_plans(fleet_planners: PlannerPool) -> None:
    """The robot drives on through the door, does nothing new, and then follows the new plan."""
    with Run(world(PlanningTime(fixed=10.0), moved=12.0), "replan", planners=fleet_planners) as run:
        run.finish()
    assert_goals_reached(run)
    _, (asked, answered, _), *_ = answers(run)
    assert answered == pytest.approx(asked + 10.0)
    between = [event for _, time, event in run.log if asked < time < answered]
    assert [event.action for event in between if isinstance(event, ActionEnded)] == ["move(r1, a, b)"]
    assert not [event for event in between if isinstance(event, ActionStarted)]
