"""What faults do to a fleet, and what the fleet does about them: each kind in a small world without corridors."""

import json
from dataclasses import replace

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.assertions import assert_goals_reached
from clo_fleet.testing.buildings import rooms_in_a_row
from clo_fleet.testing.recorded import events_of
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.disturbances import (
    Disturbance,
    ObjectDropped,
    ObjectMoved,
    ObjectPrepared,
    ObjectReturned,
    ObjectTaken,
    PlannerKilled,
    PlannerSlowed,
    RadioLost,
    RadioRestored,
    RobotBroken,
    RobotRecovered,
    RobotRepaired,
    RobotSlowed,
    SensorBlinded,
    SensorRestored,
    SkillFails,
)
from clo_fleet.world.events import (
    ActionEnded,
    ActionStarted,
    Disturbed,
    FactChanged,
    PlanFailed,
    PlanFollowed,
    PlanRequested,
    Sensed,
    Waiting,
)
from clo_fleet.world.model import ObjectId, Radio, RobotId, World

R1, R2, CUP = RobotId("r1"), RobotId("r2"), ObjectId("cup")


def fetch(*faults: Disturbance) -> World:
    """Robot r1 in room a is to have the cup that lies in room b."""
    builder = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(holding r1 cup)", at=(1, 2.5))
    return builder.thing("cup", "b", at=(10, 1.5)).happens(*faults).build()


def finished(world: World, fleet_planners: PlannerPool) -> Run:
    """A run of the world that has come to its end, closed."""
    with Run(world, planners=fleet_planners) as run:
        run.finish()
    return run


def disturbed(run: Run) -> list[tuple[str, str, bool]]:
    """What befell whom, and whether anything came of it."""
    return [(e.disturbance, e.subject, e.effect) for _, _, e in run.log if isinstance(e, Disturbed)]


def test_an_object_that_was_taken_is_missed_and_fetched_when_it_is_back(fleet_planners: PlannerPool) -> None:
    """While it is gone no fact about it holds; who comes for it waits, and takes it up when somebody returns it."""
    run = finished(fetch(ObjectTaken(2.0, CUP), ObjectReturned(40.0, CUP)), fleet_planners)
    assert_goals_reached(run)
    (gone, left), (back, returned) = events_of(run, FactChanged, fact=("at-object", "cup", "b"))[:2]
    assert (gone, back) == (2.0, 40.0)
    assert (left.value, left.by, returned.value, returned.by) == (False, None, True, None)
    assert events_of(run, Sensed, fact=("at-object", "cup", "b"), value=False)
    assert events_of(run, Waiting, why="no plan exists as things are believed")


def test_what_a_person_prepared_need_not_be_prepared(fleet_planners: PlannerPool) -> None:
    """It is nobody's action that made the fact true, and still the step for it is dropped."""
    run = finished(fetch(ObjectPrepared(1.0, CUP)), fleet_planners)
    assert_goals_reached(run)
    assert [event for _, event in events_of(run, FactChanged, fact=("prepared", "cup"))] == [
        FactChanged(("prepared", "cup"), True, None, None)
    ]
    assert not events_of(run, ActionStarted, action="prepare(r1, cup, b)")
    assert len(events_of(run, PlanRequested)) == 1


def test_what_slips_from_the_hand_is_picked_up_again(fleet_planners: PlannerPool) -> None:
    """The carrier sees it lie, goes back for it, and delivers it."""
    builder = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-object cup b)", at=(1, 2.5))
    world = builder.thing("cup", "a", at=(2.5, 1), prepared=True).happens(ObjectDropped(6.0, CUP)).build()
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    assert disturbed(run) == [("object_dropped", "cup", True)]
    (_, let_go), *_ = events_of(run, FactChanged, fact=("holding", "r1", "cup"), value=False)
    assert let_go.by is None
    assert len(events_of(run, ActionEnded, action="grasp(r1, cup, a)", ending="finished")) == 2


@pytest.mark.parametrize("times", [1, 2])
def test_a_skill_that_fails_is_tried_again(fleet_planners: PlannerPool, times: int) -> None:
    """A grasp that goes wrong once or twice is made good without the planner."""
    run = finished(fetch(SkillFails(time=0.0, skill="grasp", times=times)), fleet_planners)
    assert_goals_reached(run)
    assert len(events_of(run, ActionEnded, action="grasp(r1, cup, b)", ending="failed", reason="a mishap")) == times
    assert len(events_of(run, PlanRequested)) == 1


def test_the_nth_action_fails_and_nobody_elses(fleet_planners: PlannerPool) -> None:
    """A rule counts the actions that it is about: of this robot, this skill, from its time on."""
    rule = SkillFails(time=0.0, skill="grasp", robot=R1, nth=2)
    builder = WorldBuilder(rooms_in_a_row("a", "b")).happens(rule)
    builder.robot("r1", "a", wants=("(holding r1 cup)", "(holding r1 mug)")).robot("r2", "b", wants="(holding r2 pen)")
    for name, room in (("cup", "a"), ("mug", "a"), ("pen", "b")):
        builder.thing(name, room)
    run = finished(builder.build(), fleet_planners)
    assert_goals_reached(run)
    grasps = [e for _, _, e in run.log if isinstance(e, ActionEnded) and e.action.startswith("grasp")]
    assert [e.ending for e in grasps if e.robot == "r1"] == ["finished", "failed", "finished"]
    assert [e.ending for e in grasps if e.robot == "r2"] == ["finished"]


def test_a_move_that_fails_leaves_the_robot_in_its_room_to_try_again(fleet_planners: PlannerPool) -> None:
    """A drive breaks off before the door."""
    run = finished(fetch(SkillFails(time=0.0, skill="move")), fleet_planners)
    assert_goals_reached(run)
    moves = [event for _, _, event in run.log if isinstance(event, ActionEnded) and event.action == "move(r1, a, b)"]
    assert [move.ending for move in moves] == ["failed", "finished"]


def test_a_broken_robot_stays_where_it_is_until_it_is_repaired(fleet_planners: PlannerPool) -> None:
    """It says what it stands for, keeps its plan and its promises, and goes on without asking the planner."""
    world = fetch(RobotBroken(2.0, R1), RobotRepaired(30.0, R1))
    with Run(world, planners=fleet_planners) as run:
        run.step(20)
        pose, plan = run.robot("r1").pose, run.robot("r1").plan
        run.step(100)
        assert run.time < 30.0
        assert run.robot("r1").plan == plan
        assert abs(run.robot("r1").pose.x - pose.x) < 0.01
        run.finish()
    assert_goals_reached(run)
    assert events_of(run, Waiting, robot="r1", why="its repair")
    assert len(events_of(run, PlanRequested)) == 1


def test_a_slow_robot_recovers(fleet_planners: PlannerPool) -> None:
    """It takes longer, and not longer than it is slow."""
    plain, slowed, healed = (
        finished(fetch(*faults), fleet_planners).time
        for faults in ((), (RobotSlowed(1.0, R1, 0.2),), (RobotSlowed(1.0, R1, 0.2), RobotRecovered(11.0, R1)))
    )
    assert plain < healed < slowed


def test_a_blind_robot_does_not_take_what_it_does_not_see_for_gone(fleet_planners: PlannerPool) -> None:
    """It drives on, waits with its hands, believes as before, and works when it sees again."""
    world = fetch(SensorBlinded(1.0, R1), SensorRestored(50.0, R1))
    with Run(world, planners=fleet_planners) as run:
        run.step(220)
        assert run.robot("r1").place == "b"
        assert ("at-object", "cup", "b") in run.robot("r1").beliefs
        run.finish()
    assert_goals_reached(run)
    assert events_of(run, Waiting, robot="r1", why="its sight")
    blind = [event for _, time, event in run.log if isinstance(event, Sensed) and 1.0 <= time < 50.0]
    assert {event.fact[0] for event in blind} == {"at-robot"}


def test_a_blind_robot_finds_out_later_what_has_changed(fleet_planners: PlannerPool) -> None:
    """What was moved meanwhile it goes for when it sees it."""
    faults = (SensorBlinded(1.0, R1), ObjectMoved(20.0, CUP, (7.5, 4.0)), SensorRestored(50.0, R1))
    assert_goals_reached(finished(replace(fetch(*faults), until=200.0), fleet_planners))


def test_without_radio_a_robot_works_from_sight(fleet_planners: PlannerPool) -> None:
    """What others do it hears of only when its radio works again; what it sees it uses."""

    def world(*faults: Disturbance) -> World:
        builder = WorldBuilder(rooms_in_a_row("a", "b", "c")).thing("cup", "c", at=(16, 1.5)).happens(*faults)
        builder.robot("r1", "a", wants="(holding r1 cup)", at=(1, 2.5), max_speed=0.5)
        return builder.robot("r2", "c", wants="(prepared cup)").build()

    told = finished(world(), fleet_planners)
    lost = finished(world(RadioLost(0.0, R1)), fleet_planners)
    for run in (told, lost):
        assert_goals_reached(run)
        assert not events_of(run, ActionStarted, action="prepare(r1, cup, c)")
    assert events_of(told, Sensed, robot="r1", fact=("prepared", "cup"), source="radio")
    assert events_of(lost, Sensed, robot="r1", fact=("prepared", "cup"), source="sight")
    assert not events_of(lost, Sensed, robot="r1", source="radio")


def test_a_robot_whose_radio_is_back_hears_what_others_mean_to_do(fleet_planners: PlannerPool) -> None:
    """A promise that was announced meanwhile keeps it from doing the same work."""
    builder = WorldBuilder(rooms_in_a_row("a", "b")).thing("cup", "b", at=(10, 1.5), prepared=True)
    builder.robot("r1", "a", wants="(at-object cup a)", at=(1, 2.5), max_speed=0.1)
    builder.robot("r2", "b", wants="(at-object cup a)", at=(9, 1.5))
    run = finished(builder.happens(RadioLost(0.2, R1), RadioRestored(4.0, R1)).build(), fleet_planners)
    assert_goals_reached(run)
    heard = events_of(run, Sensed, robot="r1", source="radio")
    assert heard[0] == (4.0, Sensed("r1", ("at-object", "cup", "b"), False, "radio", False, "r2", heard[0][1].cause))
    assert not events_of(run, ActionStarted, action="grasp(r1, cup, b)")


@pytest.mark.parametrize("back", [(), (RadioRestored(35.0, R1),)], ids=["never", "later"])
@pytest.mark.parametrize("radio", [Radio(), Radio(delay=0.4)], ids=["prompt", "slow"])
def test_a_robot_whose_radio_is_back_hears_what_others_do_not_mean_to_do_any_more(
    radio: Radio, back: tuple[Disturbance, ...], fleet_planners: PlannerPool
) -> None:
    """Nobody waits for a promise that was kept or taken back meanwhile; nor for long while its radio stays silent."""
    builder = WorldBuilder(rooms_in_a_row("a", "b", "c")).thing("cup", "b", at=(10, 1.5), prepared=True)
    builder.robot("r1", "c", wants="(at-object cup a)", max_speed=0.3)
    builder.robot("r2", "b", wants="(at-object cup a)", at=(9, 1.5))
    faults = (RadioLost(6.0, R1), ObjectMoved(30.0, CUP, (9.0, 1.5)), *back)
    run = finished(replace(builder.happens(*faults).build(), radio=radio, until=90.0), fleet_planners)
    assert_goals_reached(run)
    assert events_of(run, Waiting, robot="r1", why="for what another robot has in hand")
    assert events_of(run, ActionStarted, action="grasp(r1, cup, b)")


def test_a_planner_that_is_killed_is_asked_again(fleet_planners: PlannerPool) -> None:
    """It dies over the first question, really; the answer to the second is followed, and the log is always the same."""
    runs = [finished(fetch(PlannerKilled(0.0, R1)), fleet_planners) for _ in range(2)]
    for run in runs:
        assert_goals_reached(run)
        assert disturbed(run) == [("planner_killed", "r1", True)]
        assert len(events_of(run, PlanFailed, reason="the planner died", detail="killed")) == 1
        assert len(events_of(run, PlanRequested)) == 2
    assert runs[0].log == runs[1].log


def test_a_planner_that_dies_while_it_plans_is_asked_again(fleet_planners: PlannerPool) -> None:
    """Planning takes ten seconds here; after four the planner dies, and the answer comes ten seconds later."""
    slow = replace(fetch(PlannerKilled(4.0, R1)), planning=replace(fetch().planning, fixed=10.0))
    run = finished(slow, fleet_planners)
    assert_goals_reached(run)
    assert [time for time, _ in events_of(run, PlanFailed, reason="the planner died", detail="killed")] == [4.0]
    assert [time for time, _ in events_of(run, PlanFollowed)] == [14.0]


def test_a_slow_planner_answers_later(fleet_planners: PlannerPool) -> None:
    """The delay adds to what planning takes anyway, from the next question on."""
    world = replace(fetch(PlannerSlowed(0.2, R1, 5.0), ObjectTaken(1.0, CUP), ObjectReturned(30.0, CUP, (8.0, 4.0))))
    run = finished(world, fleet_planners)
    assert_goals_reached(run)
    asked = [time for time, _ in events_of(run, PlanRequested) if time > 0.0]
    answered = [time for _, time, e in run.log if isinstance(e, PlanFollowed | PlanFailed) and time > 0.0]
    assert asked
    assert answered == pytest.approx([time + 5.0 for time in asked])


def test_what_cannot_happen_is_told_with_the_reason(fleet_planners: PlannerPool) -> None:
    """An object in a hand is not moved, one that lies is not dropped, and who works is not repaired."""
    builder = WorldBuilder(rooms_in_a_row("a", "b"))
    builder.robot("r1", "a", wants=("(holding r1 cup)", "(at-robot r1 b)"), at=(1, 2.5), max_speed=0.3)
    builder.thing("cup", "a", at=(2.0, 1.5), prepared=True)
    faults = (
        ObjectDropped(0.2, CUP),
        ObjectReturned(0.4, CUP),
        RobotRecovered(0.6, R1),
        RobotRepaired(0.6, R1),
        SensorRestored(0.6, R1),
        RadioRestored(0.6, R1),
        ObjectPrepared(0.8, CUP),
        ObjectMoved(12.0, CUP, (1.0, 4.0)),
        ObjectTaken(12.0, CUP),
    )
    run = finished(replace(builder.build(), disturbances=faults), fleet_planners)
    assert_goals_reached(run)
    told = [event.detail for _, event in events_of(run, Disturbed, effect=False)]
    assert told == [
        "no effect: nobody carries it",
        "no effect: it is not gone",
        *["no effect: it is so already"] * 4,
        "no effect: prepared already",
        *["no effect: carried by r1"] * 2,
    ]


def test_the_same_faults_give_the_same_log(fleet_planners: PlannerPool) -> None:
    """Two runs of one world agree event by event, whatever befalls it."""
    faults = (
        SkillFails(time=0.0, skill="grasp", times=None, chance=0.5, until=60.0),
        PlannerKilled(0.2, R1),
        ObjectMoved(3.0, CUP, (3.0, 1.0)),
        RobotBroken(4.0, R1),
        RobotRepaired(9.0, R1),
    )
    assert finished(fetch(*faults), fleet_planners).log == finished(fetch(*faults), fleet_planners).log


def test_a_mission_with_faults_goes_on_from_its_state(fleet_planners: PlannerPool) -> None:
    """All that faults have left behind is in the state, as JSON."""
    faults = (RobotSlowed(1.0, R1, 0.4), SensorBlinded(1.0, R1), RadioLost(1.0, R1), PlannerSlowed(1.0, R1, 2.0))
    rest = (RobotRecovered(20.0, R1), SensorRestored(30.0, R1), RadioRestored(30.0, R1), ObjectTaken(1.0, CUP))
    with Run(
        fetch(*faults, *rest, SkillFails(time=1.0, skill="move"), ObjectReturned(40.0, CUP)), planners=fleet_planners
    ) as run:
        run.step(10)
        state = json.loads(json.dumps(run.mission.state()))
        assert state["robots"]["r1"]["blind"]
        assert state["conversation"]["radio"]["lost"] == ["r1"]
        assert state["conversation"]["questions"]["faults"] == {"doomed": [], "slower": {"r1": 2.0}}
        assert state["site"]["rooms"]["custody"]["gone"] == ["cup"]
        assert state["disturbances"]["slowed"] == {"r1": 0.4}
