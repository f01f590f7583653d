"""What bodies and traffic do to plans: objects that slip away, slow robots, queues, and partners who do not come."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from clo_fleet.clo.task import Fact
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.testing import RunFleet, events_of, shipped_map
from clo_fleet.world.disturbances import ObjectMoved, RobotSlowed
from clo_fleet.world.events import ActionEnded, ActionStarted, FactChanged, GoalsReached, Waiting
from clo_fleet.world.model import (
    BuildingMap,
    Door,
    DoorId,
    ObjectId,
    ObjectSpec,
    Perception,
    PerceptionMode,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    SkillSettings,
    World,
)
from clo_fleet.world.world_file import read_world

A, B = RoomId("a"), RoomId("b")
CUP = ObjectId("cup")
TWO_ROOMS = BuildingMap(
    name="two rooms",
    rooms=(Room(A, ((0, 0), (7, 0), (7, 6), (0, 6))), Room(B, ((7, 0), (14, 0), (14, 6), (7, 6)))),
    doors=(Door(id=DoorId("between"), rooms=(A, B), position=(7, 3), heading=0.0, width=1.2),),
)
HALL = shipped_map("hello")  # rooms west and east, a corridor of 8 m between them


def robot(name: str, room: str, at: Point, *goals: Fact) -> RobotSpec:
    """A robot."""
    return RobotSpec(id=RobotId(name), room=RoomId(room), pose=Pose(*at), goals=goals)


def world(building: BuildingMap, *robots: RobotSpec, cup: Point = (4.0, 3.0), **settings: float) -> World:
    """A world with one object, which lies in room a or west."""
    room = A if building is TWO_ROOMS else RoomId("west")
    return World(
        name="physics",
        map=building,
        robots=robots,
        objects=(ObjectSpec(id=CUP, room=room, position=cup),),
        until=300.0,
        skills=SkillSettings(**settings),
    )


def until(run: Run, happened: Callable[[], bool]) -> None:
    """Step until something has happened."""
    while not happened():
        assert not run.done, f"the run ended first: {run.mission.why}"
        run.step()


def running(run: Run, name: str) -> str:
    """The action that a robot carries out."""
    return run.mission.view(name).running


def endings(run: Run, robot: str) -> list[tuple[str, str, str]]:
    """How the robot's actions ended: the schema, the ending, the reason."""
    events = (event for _, _, event in run.log if isinstance(event, ActionEnded) and event.robot == robot)
    return [(event.action.split("(")[0], event.ending, event.reason) for event in events]


def time_of(run: Run, kind: type, **fields: str) -> float:
    """When such an event was first recorded [s]."""
    return events_of(run, kind, **fields)[0][0]


def mid_grasp(run: Run) -> None:
    """Step until robot r1 has been grasping for half a second."""
    until(run, lambda: running(run, "r1").startswith("grasp"))
    run.step(3)
    assert running(run, "r1").startswith("grasp")


def test_an_object_that_slides_away_under_the_hand_is_prepared_and_grasped_again(run_fleet: RunFleet) -> None:
    """A push in the middle of a grasp makes it fail; what was shoved is unprepared, and the plan is mended."""
    with run_fleet(world(TWO_ROOMS, robot("r1", "a", (1, 1), ("holding", "r1", "cup")))) as run:
        mid_grasp(run)
        run.mission.site.rooms.push_item(CUP, (2.2, 1.0))
        result = run.finish()
        assert result.outcome == Outcome.GOALS_REACHED.value
        (first, *_), grasped, *again = endings(run, "r1")
        assert (first, grasped[0]) == ("prepare", "grasp")
        assert grasped[1] != "finished"
        assert again == [("prepare", "finished", ""), ("grasp", "finished", "")]


@pytest.mark.parametrize(
    ("target", "reason"),
    [((1.5, 5.0), "out of reach"), ((12.0, 3.0), "not there")],
    ids=["in the room", "into the next room"],
)
def test_an_object_that_is_taken_away_from_under_the_hand_is_looked_for_and_grasped(
    target: Point, reason: str, run_fleet: RunFleet
) -> None:
    """Somebody moves it while it is being grasped: the grasp fails, and the robot goes where it sees it lie now."""
    everywhere = Perception(PerceptionMode.FULL)
    plain = replace(world(TWO_ROOMS, robot("r1", "a", (1, 1), ("holding", "r1", "cup"))), perception=everywhere)
    with run_fleet(plain) as run:
        mid_grasp(run)
        now = run.time
    with run_fleet(replace(plain, disturbances=(ObjectMoved(now + 0.2, CUP, target),))) as run:
        result = run.finish()
        assert result.outcome == Outcome.GOALS_REACHED.value, run.mission.why
        assert ("grasp", "failed", reason) in endings(run, "r1")
        assert run.mission.site.rooms.carrier(CUP) == "r1"


def test_an_object_moved_into_another_room_is_there_at_once(run_fleet: RunFleet) -> None:
    """Its place follows its position in the same tick, whichever rooms lie between."""
    three_rooms = read_world(shipped("worlds") / "three_rooms.yaml")
    moved = replace(three_rooms, disturbances=(ObjectMoved(0.4, ObjectId("o1"), (2.0, 5.0)),))
    with run_fleet(moved) as run:
        run.step(2)
        assert ("at-object", "o1", "l3") in run.mission.facts
        changes = [event.fact for _, _, event in run.log if isinstance(event, FactChanged) and "o1" in event.fact]
        assert changes == [("at-object", "o1", "l1"), ("at-object", "o1", "l3")]


def test_a_slow_robot_in_a_corridor_delays_those_behind_it(run_fleet: RunFleet) -> None:
    """Nobody passes in a corridor: who drives behind a robot that was slowed arrives later, and after it."""
    robots = (
        robot("r1", "west", (4.5, 2.5), ("at-robot", "r1", "east")),
        robot("r2", "west", (2, 1.5), ("at-robot", "r2", "east")),
    )
    arrivals = {}
    for name, disturbances in (("free", ()), ("slowed", (RobotSlowed(6.0, RobotId("r1"), 0.2),))):
        with run_fleet(replace(world(HALL, *robots, cup=(1, 4.5)), disturbances=disturbances)) as run:
            assert run.finish().outcome == Outcome.GOALS_REACHED.value
            arrivals[name] = [time_of(run, GoalsReached, robot=robot) for robot in ("r1", "r2")]
    assert arrivals["free"][0] < arrivals["free"][1]
    assert arrivals["slowed"][0] < arrivals["slowed"][1]
    assert arrivals["slowed"][1] > arrivals["free"][1] + 10.0


def test_of_two_that_grasp_in_the_same_tick_the_first_by_id_wins(run_fleet: RunFleet) -> None:
    """The other's grasp fails, it knows that the object is gone, and the winner brings about what both wanted."""
    goal = ("at-object", "cup", "b")
    mirrored = world(TWO_ROOMS, robot("r1", "a", (4, 1), goal), robot("r2", "a", (4, 5), goal))
    prepared = replace(mirrored, objects=(replace(mirrored.objects[0], prepared=True),))
    with run_fleet(prepared) as run:
        until(run, lambda: bool(endings(run, "r2")))
        assert endings(run, "r1") == [("grasp", "finished", "")]
        assert endings(run, "r2") == [("grasp", "failed", "taken by r1")]
        assert time_of(run, ActionEnded, robot="r1") == time_of(run, ActionEnded, robot="r2")
        assert ("at-object", "cup", "a") not in run.mission.view("r2").beliefs
        assert run.finish().outcome == Outcome.GOALS_REACHED.value
        assert [event.by for _, _, event in run.log if isinstance(event, FactChanged) and event.fact == goal] == ["r1"]


def test_who_waits_for_a_door_says_for_which_and_after_whom(run_fleet: RunFleet) -> None:
    """Of three robots that leave together, the second waits for the first, the third for the second; all arrive."""
    robots = [robot(f"r{n}", "west", (2.0 + n, 2.5), (("at-robot", f"r{n}", "east"))) for n in (1, 2, 3)]
    with run_fleet(world(HALL, *robots, cup=(1, 4.5))) as run:
        assert run.finish().outcome == Outcome.GOALS_REACHED.value
        said = [(event.robot, event.why) for _, _, event in run.log if isinstance(event, Waiting)]
    door = [(robot, why) for robot, why in said if why.startswith("door west-door, after robot")]
    assert {why.removeprefix("door west-door, after robot ") for _, why in door} <= {"r1", "r2", "r3"}
    assert len({robot for robot, _ in door}) == 2


def test_a_giver_whose_partner_does_not_come_fails_when_its_patience_ends(run_fleet: RunFleet) -> None:
    """It waits as long as the world's settings say, where they were to meet, and then gives up the step."""
    late = replace(
        world(
            TWO_ROOMS,
            robot("r1", "a", (2, 1), ("holding", "r2", "cup")),
            robot("r2", "b", (12, 3), ("at-robot", "r2", "a")),
            partner_wait=12.0,
        ),
        disturbances=(RobotSlowed(1.0, RobotId("r2"), 0.01),),
    )
    with run_fleet(late) as run:
        until(run, lambda: any(schema == "give" for schema, _, _ in endings(run, "r1")))
        assert endings(run, "r1")[-1] == ("give", "failed", "r2 did not take it")
        began = time_of(run, ActionStarted, robot="r1", action="give(r1, r2, cup, a)")
        assert run.time - began == pytest.approx(12.0, abs=0.5)
        assert any(isinstance(event, Waiting) and event.why == "robot r2" for _, _, event in run.log)
        assert run.mission.site.rooms.carrier(CUP) == "r1"
