"""Every kind of opportunity that one robot makes for another, and of conflict: each told by the log, with its cause."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.assertions import assert_goals_reached, assert_helped
from clo_fleet.testing.buildings import rooms_in_a_row, shipped_map
from clo_fleet.testing.recorded import events_of
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import ObjectDropped, RobotBroken, RobotRepaired
from clo_fleet.world.events import ActionEnded, ActionStarted, PlanFollowed, RepairFailed, Sensed, StepsLeftOut
from clo_fleet.world.model import ObjectId, PlanningTime, Radio, RobotId, World

ROOMS = rooms_in_a_row("a", "b", "c")


def finished(world: World | WorldBuilder, fleet_planners: PlannerPool, strategy: str = "clo") -> Run:
    """The world run to its end."""
    with Run(world.build() if isinstance(world, WorldBuilder) else world, strategy, planners=fleet_planners) as run:
        run.finish()
        return run


def doing(run: Run, cause: int | None) -> str:
    """The action that the cause of a change is."""
    assert cause is not None
    event = run.log[cause][2]
    assert isinstance(event, ActionStarted)
    return event.action


def ending(run: Run, action: str) -> str:
    """How an action ended, the last time it was begun."""
    (*_, (_, event)) = events_of(run, ActionEnded, action=action)
    assert isinstance(event, ActionEnded)
    return event.ending


# ---- opportunities -----------------------------------------------------------------------------------------


def test_prepared_by_another(fleet_planners: PlannerPool) -> None:
    """What r2 prepares for itself r1 need not prepare, and r2's very action is named."""
    world = WorldBuilder(ROOMS).thing("cup", "a")
    world.robot("r1", "c", wants="(holding r1 cup)").robot("r2", "a", wants="(prepared cup)")
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    help_ = assert_helped(run, by="r2", robot="r1", fact="(prepared cup)", kind="prepared")
    assert (help_.action, help_.dropped) == ("prepare(r2, cup, a)", ("prepare(r1, cup, a)",))


def test_a_goal_reached_by_another(fleet_planners: PlannerPool) -> None:
    """Both want the cup in b: r1 waits while r2 has it in hand, and drops all its steps when r2 puts it down."""
    world = WorldBuilder(ROOMS).thing("cup", "a", prepared=True)
    world.robot("r1", "c", wants="(at-object cup b)").robot("r2", "a", wants="(at-object cup b)")
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    help_ = assert_helped(run, by="r2", robot="r1", fact="(at-object cup b)", kind="delivered")
    assert help_.action == "place(r2, cup, b)"
    assert help_.dropped == ("move(r1, b, a)", "grasp(r1, cup, a)", "move(r1, a, b)", "place(r1, cup, b)")
    assert run.result().robots["r1"].planner_calls == 1


def test_handed_over(fleet_planners: PlannerPool) -> None:
    """r2 meets r1 where r1 has something to do anyway, and saves it the way."""
    world = WorldBuilder(ROOMS).thing("cup", "a").thing("pen", "b")
    world.robot("r1", "c", wants=["(holding r1 cup)", "(holding r1 pen)"]).robot("r2", "a", wants="(holding r1 cup)")
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    help_ = assert_helped(run, by="r2", robot="r1", fact="(holding r1 cup)", kind="handed_over")
    assert (help_.action, help_.dropped) == ("give(r2, r1, cup, b)", ("move(r1, b, a)", "grasp(r1, cup, a)"))


def test_left_by_the_door_on_the_way(fleet_planners: PlannerPool) -> None:
    """Out of radio range, r1 sees the cup lie where r2 has left it, turns back before the door, and takes it there.

    r2 wants the cup to stay: that is a conflict, and the run ends with its name.
    """
    world = WorldBuilder(rooms_in_a_row("a", "b", "c", "d")).thing("cup", "b", prepared=True, at=(7, 4))
    world.robot("r1", "d", wants="(holding r1 cup)", max_speed=0.3)
    world.robot("r2", "a", wants="(at-object cup c)", at=(5, 4))
    run = finished(replace(world.build(), radio=Radio(range=3.0)), fleet_planners)
    help_ = assert_helped(run, by="r2", robot="r1", fact="(at-object cup c)", kind="delivered")
    assert help_.action == "place(r2, cup, c)"
    ((_, seen),) = events_of(run, Sensed, robot="r1", fact=("at-object", "cup", "c"), value=True)
    assert isinstance(seen, Sensed)
    assert (seen.source, doing(run, seen.cause)) == ("sight", "place(r2, cup, c)")
    assert ending(run, "move(r1, c, b)") == "cancelled"
    assert ending(run, "grasp(r1, cup, c)") == "finished"
    result = run.result()
    assert result.robots["r1"].goals_reached
    assert result.outcome == "no_plan"
    assert "r2" in result.why


# ---- conflicts ---------------------------------------------------------------------------------------------


def test_the_helper_takes_away_what_it_prepared(fleet_planners: PlannerPool) -> None:
    """r1 drops a step for r2's sake, loses the object to r2, and takes it where r2 has said that it will put it."""
    world = WorldBuilder(ROOMS).thing("cup", "a", at=(2, 2)).robot("r1", "c", wants="(holding r1 cup)")
    world.robot("r2", "a", wants=["(prepared cup)", "(at-object cup b)"])
    run = finished(world, fleet_planners)
    help_ = assert_helped(run, by="r2", robot="r1", fact="(prepared cup)")
    ((broken, _), *_) = events_of(run, RepairFailed, robot="r1")
    assert help_.time_s < broken
    *_, (mended, plan) = events_of(run, PlanFollowed, robot="r1")
    assert isinstance(plan, PlanFollowed)
    assert mended == broken
    assert [name for _, name in plan.steps] == ["move(r1, a, b)", "grasp(r1, cup, b)"]
    ((put, _),) = events_of(run, ActionEnded, action="place(r2, cup, b)", ending="finished")
    ((taken, _),) = events_of(run, ActionStarted, action="grasp(r1, cup, b)")
    assert mended < put < taken
    assert run.result().robots["r1"].goals_reached


def test_who_promised_does_not_deliver(fleet_planners: PlannerPool) -> None:
    """r2 takes the cup, breaks down and loses it: its promise is gone, r1 does the work, and so helps r2 in turn."""
    world = WorldBuilder(ROOMS).thing("cup", "a", prepared=True, at=(1.7, 1))
    world.robot("r1", "c", wants="(at-object cup b)").robot("r2", "a", wants="(at-object cup b)", at=(1, 1))
    r2 = RobotId("r2")
    world.happens(RobotBroken(3.0, r2), ObjectDropped(3.2, ObjectId("cup")), RobotRepaired(30.0, r2))
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    help_ = assert_helped(run, by="r1", robot="r2", fact="(at-object cup b)", kind="delivered")
    assert help_.action == "place(r1, cup, b)"
    assert run.result().robots["r1"].executed == 5


# ---- what runs is stopped when it has become needless ------------------------------------------------------


def needless_prepare() -> World:
    """Both prepare the cup, r2 first; then r1 has something else to do."""
    world = WorldBuilder(ROOMS).thing("cup", "a", at=(2, 4)).robot("r2", "a", wants="(prepared cup)", at=(1.2, 4))
    return world.robot("r1", "a", wants=["(prepared cup)", "(at-robot r1 b)"], at=(4, 4)).build()


def needless_move() -> World:
    """r1 crawls to the cup's room while r2 brings the cup."""
    world = WorldBuilder(ROOMS).thing("cup", "a", prepared=True, at=(3, 2.5))
    world.robot("r1", "b", wants="(at-object cup b)", at=(11, 1), max_speed=0.2)
    return world.robot("r2", "a", wants="(at-object cup b)", at=(4, 2.5)).build()


@pytest.mark.parametrize(
    ("made", "action", "then"),
    [(needless_prepare, "prepare(r1, cup, a)", "move(r1, a, b)"), (needless_move, "move(r1, b, a)", "")],
    ids=["prepare", "move"],
)
def test_a_running_action_is_stopped_when_another_has_done_it(
    made: Callable[[], World], action: str, then: str, fleet_planners: PlannerPool
) -> None:
    """It is cancelled within a tick of the news, and the next step starts."""
    run = finished(made(), fleet_planners)
    assert_goals_reached(run)
    ((stopped, event),) = events_of(run, ActionEnded, action=action)
    assert isinstance(event, ActionEnded)
    assert event.ending == "cancelled"
    news = max(time for time, event in events_of(run, Sensed, robot="r1", opportunity=True) if time <= stopped)
    assert stopped - news <= 0.2 + 1e-9
    result = run.result().robots["r1"]
    assert (result.cancelled, result.opportunities_used) == (1, 1)
    assert assert_helped(run, by="r2", robot="r1").dropped[0] == action
    if then:
        ((begun, _),) = events_of(run, ActionStarted, action=then)
        assert begun == stopped


def test_a_drive_under_way_in_a_corridor_ends_where_it_can(fleet_planners: PlannerPool) -> None:
    """In a corridor without a junction there is no turning back: it ends in the other room, and the rest is dropped."""
    world = WorldBuilder(shipped_map("hello")).thing("cup", "east", at=(19, 4))
    world.robot("r1", "west", wants="(prepared cup)", at=(5, 3)).robot("r2", "east", wants="(prepared cup)", at=(16, 4))
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    assert_helped(run, by="r2", robot="r1", fact="(prepared cup)", kind="prepared")
    assert ending(run, "move(r1, west, east)") in ("finished", "cancelled")
    assert not events_of(run, ActionStarted, action="prepare(r1, cup, east)")


# ---- planning takes time -----------------------------------------------------------------------------------


def helped_three_times() -> World:
    """r2 prepares what r1 collects."""
    world = WorldBuilder(ROOMS).thing("cup", "a").thing("pen", "a").thing("book", "b")
    world.robot("r1", "c", wants=[f"(holding r1 {thing})" for thing in ("cup", "pen", "book")])
    return world.robot("r2", "a", wants=[f"(prepared {thing})" for thing in ("cup", "pen", "book")]).build()


@pytest.mark.parametrize(
    "planning",
    [PlanningTime(fixed=4.0), PlanningTime(per_expansion=0.5)],
    ids=["fixed", "by expansions"],
)
def test_planning_time_is_simulated_and_a_repair_takes_none(
    planning: PlanningTime, fleet_planners: PlannerPool
) -> None:
    """Each call takes what the world says; clo makes one a robot and is done sooner than replan, which makes more."""
    world = replace(helped_three_times(), planning=planning)
    clo, replan = (finished(world, fleet_planners, strategy).result() for strategy in ("clo", "replan"))
    for result in (clo, replan):
        assert result.outcome == "goals_reached"
        for robot in result.robots.values():
            took = planning.fixed * robot.planner_calls + planning.per_expansion * robot.expansions
            assert robot.planning_s == pytest.approx(took)
    assert clo.robots["r1"].planner_calls == 1 < replan.robots["r1"].planner_calls
    assert clo.makespan_s < replan.makespan_s


def test_planning_that_takes_no_time_is_answered_at_once(fleet_planners: PlannerPool) -> None:
    """The first action starts at time 0, and with a fixed time just when that is over."""
    for fixed in (0.0, 4.0):
        run = finished(replace(helped_three_times(), planning=PlanningTime(fixed=fixed)), fleet_planners)
        assert min(time for time, _ in events_of(run, ActionStarted)) == fixed
        assert min(time for time, _ in events_of(run, StepsLeftOut)) > fixed


def test_a_giver_that_planned_before_it_knew_the_others_plans_asks_again(fleet_planners: PlannerPool) -> None:
    """All first plans take five seconds here: when r2's answer is that there is none, r1's plan is known at last."""
    world = WorldBuilder(ROOMS).thing("cup", "a").thing("pen", "b").robot("r2", "a", wants="(holding r1 cup)")
    world.robot("r1", "c", wants=["(holding r1 cup)", "(holding r1 pen)"])
    run = finished(replace(world.build(), planning=PlanningTime(fixed=5.0)), fleet_planners)
    assert_goals_reached(run)
    assert run.result().robots["r2"].executed > 0
