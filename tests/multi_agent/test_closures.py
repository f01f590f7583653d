"""Closed doors and corridors: who goes round, who waits, who hears of it, and that nobody waits for ever."""

import json
from dataclasses import replace

import pytest

from clo_fleet.fleet.outcome import Outcome
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.story import story
from clo_fleet.testing.assertions import assert_goals_reached
from clo_fleet.testing.buildings import rectangle, rooms_in_a_row, shipped_map
from clo_fleet.testing.recorded import events_of
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import (
    CorridorClosed,
    CorridorOpened,
    Disturbance,
    DoorClosed,
    DoorOpened,
    RadioLost,
)
from clo_fleet.world.events import (
    ActionEnded,
    ActionStarted,
    Disturbed,
    PlanMended,
    PlanRequested,
    Rerouted,
    Sensed,
    Waiting,
)
from clo_fleet.world.model import BuildingMap, CorridorId, Door, DoorId, Point, RobotId, Room, RoomId, SkillSettings

A, B, C = RoomId("a"), RoomId("b"), RoomId("c")
RING = BuildingMap(
    name="ring",
    rooms=(
        Room(A, rectangle(0, 0, 6, 5)),
        Room(B, rectangle(6, 0, 6, 5)),
        Room(C, rectangle(0, 5, 12, 5)),
    ),
    doors=(
        Door(id=DoorId("a-b"), rooms=(A, B), position=(6, 2.5), heading=0.0, width=1.2),
        Door(id=DoorId("a-c"), rooms=(A, C), position=(3, 5), heading=1.5708, width=1.2),
        Door(id=DoorId("b-c"), rooms=(B, C), position=(9, 5), heading=1.5708, width=1.2),
    ),
)


def finished(builder: WorldBuilder, fleet_planners: PlannerPool, *faults: Disturbance) -> Run:
    """A run that has come to its end, closed."""
    with Run(builder.happens(*faults).build(), planners=fleet_planners) as run:
        run.finish()
    return run


def test_who_sees_a_closed_door_goes_round_by_another_room(fleet_planners: PlannerPool) -> None:
    """The plan's drive is blocked; a bridge leads round, without the planner."""
    robot = WorldBuilder(RING).robot("r1", "a", wants="(at-robot r1 c)", at=(5, 1))
    run = finished(robot, fleet_planners, DoorClosed(0.4, DoorId("a-c")))
    assert_goals_reached(run)
    assert events_of(run, Sensed, fact=("closed", "a-c"), value=True, source="sight")
    (_, mended), *_ = events_of(run, PlanMended)
    assert [name for _, name in mended.steps][-2:] == ["move(r1, a, b)", "move(r1, b, c)"]
    assert len(events_of(run, PlanRequested)) == 1


def test_who_has_no_other_way_waits_until_the_door_is_open_again(fleet_planners: PlannerPool) -> None:
    """It says that there is no plan, sees the door open, and goes."""
    robot = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-robot r1 b)", at=(1, 2.5))
    run = finished(robot, fleet_planners, DoorClosed(0.4, DoorId("a-b")), DoorOpened(60.0, DoorId("a-b")))
    assert_goals_reached(run)
    assert events_of(run, Waiting, robot="r1", why="no plan exists as things are believed")
    assert [time for time, _ in events_of(run, Sensed, fact=("closed", "a-b"), value=False)] == [60.0]
    assert 60.0 < run.time < 75.0


def test_a_door_that_stays_closed_ends_the_run_as_no_plan(fleet_planners: PlannerPool) -> None:
    """Nobody tries for ever."""
    robot = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-robot r1 b)", at=(1, 2.5))
    run = finished(robot, fleet_planners, DoorClosed(0.4, DoorId("a-b")))
    assert run.result().outcome == Outcome.NO_PLAN.value
    assert run.time < 100.0


FAR = DoorId("c-d")


def far_away(fleet_planners: PlannerPool, *faults: Disturbance) -> Run:
    """r1 in room a is to go to d, three rooms on; r2 stands in d, beside the door that is closed."""
    builder = WorldBuilder(rooms_in_a_row("a", "b", "c", "d")).robot("r1", "a", wants="(at-robot r1 d)", at=(1, 2.5))
    builder.robot("r2", "d", at=(22, 4), wants="(at-robot r2 d)")
    return finished(builder, fleet_planners, DoorClosed(0.4, FAR), *faults)


def test_a_closed_door_is_heard_of_by_radio(fleet_planners: PlannerPool) -> None:
    """Who is far away learns it from who sees it, and likewise that it is open again."""
    run = far_away(fleet_planners, DoorOpened(15.0, FAR))
    assert_goals_reached(run)
    heard = [
        (time, event.value) for time, event in events_of(run, Sensed, robot="r1", fact=("closed", FAR), source="radio")
    ]
    assert heard == [(0.4, True), (15.0, False)]
    assert events_of(run, Waiting, robot="r1", why="no plan exists as things are believed")


def test_without_radio_a_robot_finds_the_closed_door_by_itself(fleet_planners: PlannerPool) -> None:
    """It drives as planned, and sees it from the room before."""
    run = far_away(fleet_planners, RadioLost(0.2, RobotId("r1")), DoorOpened(40.0, FAR))
    assert_goals_reached(run)
    assert events_of(run, ActionEnded, action="move(r1, b, c)", ending="finished")
    assert events_of(run, Sensed, robot="r1", fact=("closed", FAR), value=True, source="sight")
    assert not events_of(run, Sensed, robot="r1", source="radio")


def test_what_was_heard_to_be_closed_is_tried_again(fleet_planners: PlannerPool) -> None:
    """Nobody tells the robot that the door is open again; after a while it goes and looks."""
    run = far_away(fleet_planners, RadioLost(1.0, RobotId("r1")), DoorOpened(4.0, FAR))
    assert_goals_reached(run)
    assert events_of(run, Waiting, robot="r1", why="no plan exists as things are believed")
    assert 20.0 < run.time < 60.0


def test_a_closed_corridor_is_waited_for(fleet_planners: PlannerPool) -> None:
    """The only corridor is closed before anybody is in it; who wants through it waits in the room."""
    builder = WorldBuilder(shipped_map("hello")).robot("r1", "west", wants="(at-robot r1 east)", at=(1, 1))
    run = finished(
        builder, fleet_planners, CorridorClosed(0.4, CorridorId("hall")), CorridorOpened(40.0, CorridorId("hall"))
    )
    assert_goals_reached(run)
    assert 40.0 < run.time < 100.0


@pytest.mark.parametrize("strategy", ["clo", "clo-improve", "replan"])
def test_a_plan_made_for_a_closed_door_gets_shorter_once_the_door_is_open_again(
    strategy: str, fleet_planners: PlannerPool
) -> None:
    """The way round by another room goes while the robot has other work; it does not go while the door is closed."""

    def run(*faults: Disturbance) -> Run:
        robot = WorldBuilder(RING).robot("r1", "a", at=(1, 1), wants=["(prepared cup)", "(at-robot r1 c)"])
        world = robot.thing("cup", "a", at=(3, 2)).happens(DoorClosed(0.4, DoorId("a-c")), *faults).build()
        with Run(world, strategy, planners=fleet_planners) as run:
            run.finish()
        assert_goals_reached(run)
        return run

    opened, shut = run(DoorOpened(3.0, DoorId("a-c"))), run()
    assert not events_of(opened, ActionStarted, action="move(r1, a, b)")
    assert events_of(shut, ActionStarted, action="move(r1, a, b)")
    assert opened.time < shut.time - 3.0
    if strategy == "clo":
        (time, mended), *_ = events_of(opened, PlanMended, means="a shorter way")
        assert (time, [name for _, name in mended.added]) == (3.0, ["move(r1, a, c)"])


SQUARE = BuildingMap(
    name="square",
    rooms=(
        Room(A, rectangle(0, 0, 6, 5)),
        Room(B, rectangle(6, 0, 6, 5)),
        Room(C, rectangle(6, 5, 6, 5)),
        Room(RoomId("d"), rectangle(0, 5, 6, 5)),
    ),
    doors=(
        Door(id=DoorId("a-b"), rooms=(A, B), position=(6, 2.5), heading=0.0, width=1.2),
        Door(id=DoorId("b-c"), rooms=(B, C), position=(11, 5), heading=1.5708, width=1.2),
        Door(id=DoorId("c-d"), rooms=(RoomId("d"), C), position=(6, 9), heading=0.0, width=1.2),
        Door(id=DoorId("a-d"), rooms=(A, RoomId("d")), position=(5, 5), heading=1.5708, width=1.2),
    ),
)


@pytest.mark.parametrize("strategy", ["clo", "replan"])
def test_who_has_a_way_round_does_not_come_back_to_try_the_door(strategy: str, fleet_planners: PlannerPool) -> None:
    """Back through a were shorter if the door there were open, which the robot has not seen for long."""
    robot = WorldBuilder(SQUARE).robot("r1", "a", at=(1, 1), wants=["(prepared cup)", "(at-robot r1 d)"])
    world = robot.thing("cup", "b", at=(11, 1)).happens(DoorClosed(0.4, DoorId("a-d"))).build()
    with Run(replace(world, skills=SkillSettings(prepare=60.0)), strategy, planners=fleet_planners) as run:
        run.finish()
    assert_goals_reached(run)
    assert not [time for kind in (PlanRequested, PlanMended) for time, _ in events_of(run, kind) if 1.0 < time < 60.0]
    assert [event.action for _, event in events_of(run, ActionStarted)] == [
        "move(r1, a, b)",
        "prepare(r1, cup, b)",
        "move(r1, b, c)",
        "move(r1, c, d)",
    ]


MIDDLE, WEST = CorridorId("middle-2"), CorridorId("west")  # of the office: without them desk-b is a long way round


def to_desk_b(fleet_planners: PlannerPool, at: Point, *faults: Disturbance) -> Run:
    """r1 goes from the library to desk-b, with the short way closed at first."""
    builder = WorldBuilder(shipped_map("office")).robot("r1", "library", wants="(at-robot r1 desk-b)", at=at)
    return finished(builder, fleet_planners, CorridorClosed(0.0, MIDDLE), CorridorClosed(0.0, WEST), *faults)


@pytest.mark.parametrize(("at", "opened"), [((17, 26), 1.4), ((16, 22), 10.0)], ids=["in its room", "on its way"])
def test_a_short_way_that_is_open_again_is_taken(at: Point, opened: float, fleet_planners: PlannerPool) -> None:
    """The robot is there 15 s sooner, and its story says why; nobody plans or repairs for that."""
    run = to_desk_b(fleet_planners, at, CorridorOpened(opened, MIDDLE))
    assert_goals_reached(run)
    ((turned, _),) = events_of(run, Rerouted, robot="r1", why=f"open again: {MIDDLE}")
    assert opened <= turned < opened + 5.0
    assert any(line.endswith(f"takes another way: open again: {MIDDLE}") for line in story(run.log, "r1"))
    round_about = to_desk_b(fleet_planners, at)
    assert not events_of(round_about, Rerouted)
    assert run.time < round_about.time - 15.0
    result = run.result().robots["r1"]
    assert (result.planner_calls, result.repairs) == (1, 0)


def test_what_is_so_already_has_no_effect(fleet_planners: PlannerPool) -> None:
    """A random closing may hit what is closed; the log says that nothing came of it."""
    robot = WorldBuilder(RING).robot("r1", "a", wants="(at-robot r1 b)")
    world = replace(robot.build(), disturbances=(DoorOpened(0.2, DoorId("a-c")), *[DoorClosed(0.4, DoorId("a-c"))] * 2))
    with Run(world, planners=fleet_planners) as run:
        run.finish()
    assert [event.effect for _, event in events_of(run, Disturbed)] == [False, True, False]


def test_a_run_with_closures_is_repeatable_and_its_state_is_plain(fleet_planners: PlannerPool) -> None:
    """Beliefs about doors are in the state; two runs agree event by event."""
    assert far_away(fleet_planners, DoorOpened(15.0, FAR)).log == far_away(fleet_planners, DoorOpened(15.0, FAR)).log
    builder = WorldBuilder(RING).robot("r1", "a", wants="(at-robot r1 c)").happens(DoorClosed(0.4, DoorId("a-c")))
    with Run(builder.build(), planners=fleet_planners) as run:
        run.step(5)
        state = json.loads(json.dumps(run.mission.state()))
        assert [*state["disturbances"]["closures"]["believed"]["r1"]] == ["a-c"]
