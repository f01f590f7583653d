"""The witness sees whatever is not as it must be, and says what, who and when; a sound run it lets pass."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import pytest

from clo_fleet.clo.messages import Flip, Observed
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.witness import BrokenInvariantError, Witness, watched
from clo_fleet.study.witness.facts import Facts
from clo_fleet.study.witness.minds import Minds
from clo_fleet.study.witness.record import Record
from clo_fleet.study.witness.space import Scene, Space
from clo_fleet.testing import RunFleet, WorldBuilder, assert_sound, rooms_in_a_row
from clo_fleet.world.disturbances import ObjectMoved
from clo_fleet.world.events import (
    ActionEnded,
    ActionStarted,
    Event,
    FactChanged,
    OfferAnswered,
    OfferMade,
    PlanFollowed,
    PlanMended,
    RunEnded,
)
from clo_fleet.world.model import ObjectId, Pose, RobotId, Room

R1, R2 = RobotId("r1"), RobotId("r2")
START = {R1: Pose(1.0, 1.0), R2: Pose(1.0, 4.0)}


def world() -> WorldBuilder:
    """r1 is to hold the cup; r2 stands by."""
    builder = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", at=(1, 1), wants="(holding r1 cup)")
    return builder.robot("r2", "a", at=(1, 4)).thing("cup", "b", at=(10, 4))


@pytest.fixture
def run(run_fleet: RunFleet) -> Run:
    """A run after its first tick."""
    run = run_fleet(world())
    run.step()
    return run


@pytest.fixture(scope="module")
def ended(fleet_planners: PlannerPool) -> Iterator[Run]:
    """A run that has reached its goals."""
    with RunFleet(fleet_planners) as run_fleet:
        run = run_fleet(world())
        run.finish()
        yield run


def scene(bodies: dict[RobotId, Pose], vehicles: dict[RobotId, Pose] | None = None) -> Scene:
    """Bodies and vehicles; who is not named stands where it began."""
    vehicles = vehicles or {}
    bodies = {robot: pose for robot, pose in START.items() if robot not in vehicles} | bodies
    return Scene(bodies, vehicles, bodies | vehicles)


def test_a_sound_run_passes_with_disturbances_too(run_fleet: RunFleet) -> None:
    """From the first tick to the last, or from the middle, or once it has ended."""
    disturbed = world().happens(ObjectMoved(3.0, ObjectId("cup"), (2.0, 2.5)))
    run = run_fleet(disturbed)
    ticks = sum(1 for _ in watched(run))
    assert run.done
    assert ticks == round(run.time / 0.2)
    assert_sound(run)
    late = run_fleet(disturbed)
    late.step(20)
    assert_sound(late)


def test_it_says_what_who_and_when(run: Run) -> None:
    """As text and as attributes, and in the assertion with the robot's story."""
    run.mission.robot("r1").executive.handle(Observed(run.time, (Flip(("holding", "r1", "cup"), True),)))
    with pytest.raises(BrokenInvariantError) as told:
        Witness(run).look()
    assert (told.value.who, told.value.time) == (("r1",), 0.2)
    assert str(told.value).startswith("at 0.2 s: r1: ")


def test_an_assertion_that_a_run_is_sound_tells_the_story_of_who_broke_what(run: Run) -> None:
    """What, who, when, by which seed and strategy."""
    run.mission._recorder.record(run.time, ActionEnded("r1", 9, "dance(r1)", "finished", "", 0))
    with pytest.raises(AssertionError, match=r"(?s)^an invariant is broken, at 0.2 s: r1: event .*the story of r1"):
        assert_sound(run)


@pytest.mark.parametrize(
    ("bodies", "vehicles", "what"),
    [
        (
            {R1: Pose(1.35, 1.0)},
            {},
            r"went 0\.350 m in a tick, from \(1\.00, 1\.00\) to \(1\.35, 1\.00\); at most 0\.2",
        ),
        ({R1: Pose(0.2, 1.0)}, {}, r"from a wall"),
        ({R1: Pose(1.0, 1.0), R2: Pose(1.0, 1.45)}, {}, r"m into one another"),
        ({}, {R2: Pose(1.0, 4.0)}, r"a vehicle in room a"),
        ({R1: Pose(1.0, 1.0)}, {R1: Pose(1.0, 1.0)}, r"both body and vehicle"),
    ],
    ids=["jump", "wall", "overlap", "vehicle in a room", "two forms"],
)
def test_what_cannot_be_in_space_is_seen(
    run: Run, bodies: dict[RobotId, Pose], vehicles: dict[RobotId, Pose], what: str
) -> None:
    """Judged from poses alone."""
    mission = run.mission
    space = Space(mission.world, mission.site)
    begun = scene({}) if "went" in what else scene(bodies, vehicles)
    if "went" in what:
        space.look(begun, run.mission.site, 0.2)
    with pytest.raises(BrokenInvariantError, match=what):
        space.look(scene(bodies, vehicles), run.mission.site, 0.4)


def test_who_has_no_form_or_stands_in_an_obstacle_is_seen(run: Run) -> None:
    """A robot that is nowhere; a robot in a block that is wider than it, where no wall is near."""
    mission = run.mission
    block = ((3.0, 0.5), (5.0, 0.5), (5.0, 2.5), (3.0, 2.5))
    rooms = tuple(replace(room, obstacles=(block,)) if room.id == "a" else room for room in mission.world.map.rooms)
    space = Space(replace(mission.world, map=replace(mission.world.map, rooms=rooms)), mission.site)
    with pytest.raises(BrokenInvariantError, match="in an obstacle"):
        space.look(scene({R1: Pose(4.0, 1.5)}), run.mission.site, 0.2)
    with pytest.raises(BrokenInvariantError, match="neither body nor vehicle"):
        space.look(Scene({R1: START[R1]}, {}, {R1: START[R1]}), run.mission.site, 0.2)


def test_the_corners_of_vehicles_may_touch_but_not_the_robots(run: Run) -> None:
    """Vehicles are longer than robots are wide. A vehicle may come a little into a body that has just left its lane."""
    elsewhere = replace(run.mission.world, map=replace(run.mission.world.map, rooms=(_far_away(),)))
    space = Space(elsewhere, run.mission.site)
    crossing = {R1: Pose(0.0, 0.0), R2: Pose(0.0, 0.62, math.pi / 2)}
    space.look(Scene({}, crossing, crossing), run.mission.site, 0.2)
    for pose in (Pose(0.57, 0.0), Pose(0.0, 0.55), Pose(0.0, 0.55, math.pi / 2)):
        space = Space(elsewhere, run.mission.site)  # one that has not seen them jump
        inside = {R1: Pose(0.0, 0.0), R2: pose}
        with pytest.raises(BrokenInvariantError, match=r"into one another, at \(0\.00, 0\.00\) and"):
            space.look(Scene({}, inside, inside), run.mission.site, 0.2)
    following = Scene({R1: Pose(0.0, 0.0)}, {R2: Pose(0.51, 0.0)}, {R1: Pose(0.0, 0.0), R2: Pose(0.51, 0.0)})
    Space(elsewhere, run.mission.site).look(following, run.mission.site, 0.2)


def _far_away() -> Room:
    return replace(rooms_in_a_row("x").rooms[0], outline=((90.0, 90.0), (95.0, 90.0), (95.0, 95.0)))


def test_facts_that_do_not_follow_from_positions_are_seen(run: Run) -> None:
    """A robot in another room than it is said to be in; an object whose fact is missing."""
    facts = Facts(run.mission)
    with pytest.raises(BrokenInvariantError, match=r"r2: said to be in \['a'\], and by its position in \['b'\]"):
        facts.look(scene({R2: Pose(9.0, 2.5)}), ())
    with pytest.raises(BrokenInvariantError, match=r"said to be in \['a'\], and by its position in no room"):
        facts.look(scene({R2: Pose(-3.0, 2.5)}), ())
    with pytest.raises(BrokenInvariantError, match=r"do not add up to the truth: \(prepared cup\)"):
        facts.look(scene({}), [(9, 0.2, FactChanged(("prepared", "cup"), True, None, None))])


def test_an_object_prepared_by_nobody_is_seen(ended: Run) -> None:
    """The log names the action that prepared it; without that, it should not be."""
    assert ("prepared", "cup") in ended.facts
    facts = Facts(ended.mission)
    facts.look(Scene.of(ended.mission), ())
    facts._prepared.clear()
    with pytest.raises(BrokenInvariantError, match=r"nothing should be true, and \(prepared cup\) is"):
        facts.look(Scene.of(ended.mission), ())


def test_minds_that_are_not_in_order_are_seen(run: Run) -> None:
    """Steps lost or put off that there are not, links of another plan, a plan that lacks something unnoticed."""
    executive = run.mission.robot("r1").executive
    data = executive._data
    Minds(run.mission).look()
    kept = list(data.plan)
    for what, change in (
        ("its steps do not add up", lambda: data.plan.pop()),
        ("share ids", lambda: data.plan.append(data.plan[-1])),
        ("put off steps that are not in its plan: \\[99\\]", lambda: data.suspended.add(99)),
        ("its links are not those of its plan", lambda: data.beliefs.add(("prepared", "cup"))),
    ):
        executive.links  # noqa: B018  # as it was, from now on
        change()
        with pytest.raises(BrokenInvariantError, match=what):
            Minds(run.mission).look()
        data.plan[:] = kept
        data.suspended.clear()
    data.beliefs.clear()
    executive._links = None
    with pytest.raises(BrokenInvariantError, match="r1: goes on with a plan that lacks"):
        Minds(run.mission).look()


def test_a_satisfied_robot_without_its_goals_is_seen(ended: Run) -> None:
    """It lost what it wanted, and does not know it."""
    data = ended.mission.robot("r1").executive._data
    data.beliefs.discard(("holding", "r1", "cup"))
    try:
        with pytest.raises(BrokenInvariantError, match=r"r1: satisfied, without \(holding r1 cup\)"):
            Minds(ended.mission).look()
    finally:
        data.beliefs.add(("holding", "r1", "cup"))


STARTED = ActionStarted("r1", 1, "move(r1, a, b)")
FOLLOWED = PlanFollowed("r1", ((1, "move(r1, a, b)"),), (), 0, 1)


@pytest.mark.parametrize(
    ("entries", "what"),
    [
        ([(1, STARTED), (3, FOLLOWED)], r"event 3 \(plan_followed\): follows event 1"),
        ([(1, RunEnded("stuck", "why")), (2, STARTED)], "after the end"),
        ([(1, STARTED), (2, STARTED)], r"move\(r1, a, b\) begins before event 1 has ended"),
        ([(1, ActionEnded("r1", 1, "move(r1, a, b)", "finished", "", 0))], "nothing began with event 0"),
        ([(1, STARTED), (2, ActionEnded("r1", 2, "x(r1)", "finished", "", 1))], "with event 1 began"),
        ([(1, STARTED), (2, ActionEnded("r1", 1, "move(r1, a, b)", "failed", "", 1))], ""),
        ([(1, FactChanged(("prepared", "cup"), True, "r1", 0))], "by r1's event 0, which is no action that began"),
        ([(1, FactChanged(("prepared", "cup"), True, "r1", None))], "by r1, of whom no action is named"),
        ([(1, STARTED), (2, FactChanged(("prepared", "cup"), True, "r2", 1))], "by r2's event 1, which is Action"),
        ([(1, OfferAnswered(7, True, ""))], "nobody made offer 7"),
        ([(1, OfferMade(7, "r1", "r2", "cup", "a")), (2, OfferMade(7, "r1", "r2", "cup", "a"))], "made before"),
        (
            [(1, FOLLOWED), (2, PlanMended("r1", (), ((1, "grasp(r1, cup, a)"),), ""))],
            "step 1 is grasp.*, and was move",
        ),
    ],
)
def test_a_log_that_does_not_hang_together_is_seen(run: Run, entries: Sequence[tuple[int, Event]], what: str) -> None:
    """Ids have gaps, actions end that never began, causes are no actions, a step's id means two actions."""
    record = Record(run.mission)
    news = [(number, 0.2, event) for number, event in entries]
    if not what:
        record.look(news)
        return
    with pytest.raises(BrokenInvariantError, match=what):
        record.look(news)


def test_a_run_that_ends_without_saying_so_is_seen(ended: Run) -> None:
    """The last event is the end."""
    record = Record(ended.mission)
    record.look(ended.log[:-1])
    with pytest.raises(BrokenInvariantError, match="has ended, and the log ends with"):
        record.look_at_end()
