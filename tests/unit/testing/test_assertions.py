"""Assertions about runs hold where they should, and where they fail they say what did happen instead."""

from collections.abc import Iterator

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing import (
    RunFleet,
    WorldBuilder,
    assert_dropped,
    assert_goals_reached,
    assert_helped,
    assert_no_contacts,
    assert_outcome,
    assert_replanned,
    rooms_in_a_row,
)
from clo_fleet.world.disturbances import ObjectMoved
from clo_fleet.world.model import ObjectId


@pytest.fixture(scope="module")
def helped(fleet_planners: PlannerPool) -> Iterator[Run]:
    """A run in which r2 prepares the cup before r1 comes for it."""
    world = WorldBuilder(rooms_in_a_row("kitchen", "hall", "office"))
    world.robot("r1", "office", wants="(holding r1 cup)").robot("r2", "kitchen", wants="(prepared cup)")
    with RunFleet(fleet_planners) as run_fleet:
        run = run_fleet(world.thing("cup", "kitchen"))
        run.finish()
        yield run


@pytest.fixture(scope="module")
def alone(fleet_planners: PlannerPool) -> Iterator[Run]:
    """A run cut short, in which somebody takes away what a robot is about to grasp."""
    world = WorldBuilder(rooms_in_a_row("kitchen", "office")).robot("r1", "kitchen", wants="(holding r1 cup)")
    world.thing("cup", "kitchen", at=(5, 4)).happens(ObjectMoved(8.0, ObjectId("cup"), (9.0, 4.0)))
    with RunFleet(fleet_planners) as run_fleet:
        run = run_fleet(world)
        run.finish(until=12.0)
        yield run


def test_what_is_so_passes(helped: Run, alone: Run) -> None:
    """Every assertion holds of a run of which it is true; some take the result as well."""
    for of in (helped, helped.result()):
        assert_goals_reached(of)
        assert_outcome(of, "goals_reached")
        assert_no_contacts(of, "robot_robot")
        given = assert_helped(of, by="r2", robot="r1", fact="(prepared cup)", kind="prepared")
        assert given.dropped == ("prepare(r1, cup, kitchen)",)
        assert assert_helped(of) == given
    assert_dropped(helped, robot="r1", action="prepare(r1, cup, kitchen)")
    assert_dropped(helped, robot="r1", action="prepare")
    assert_replanned(helped, "r1")
    assert_replanned(alone, "r1", times=1)
    assert_outcome(alone, "out_of_time")


def failure(*lines: str) -> str:
    """A pattern for a message in which these stand, in this order."""
    return r"(?s)" + ".*".join(lines)


def test_a_help_that_was_not_given_is_told_with_those_that_were(helped: Run, alone: Run) -> None:
    """Who helped whom, with what, when; then the story of the robot in question."""
    told = failure(
        r"^r1 did not help r2 with \(prepared cup\); the run ended as goals_reached after [\d.]+ s \(all goals hold\)",
        r"who helped whom:\n  [\d.]+ s: r2 helped r1 with \(prepared cup\) \(prepared\); needless: prepare\(r1, cup",
        r"the story of r2:\n.*finished prepare\(r2, cup, kitchen\)",
    )
    with pytest.raises(AssertionError, match=told):
        assert_helped(helped, by="r1", robot="r2", fact="(prepared cup)")
    with pytest.raises(AssertionError, match=r"^nobody helped anybody \(delivered\); .*\nwho helped whom:\n"):
        assert_helped(helped.result(), kind="delivered")
    with pytest.raises(AssertionError, match=r"\nnobody helped anybody$"):
        assert_helped(alone)


def test_a_missed_outcome_is_told_with_who_wants_what(alone: Run) -> None:
    """How it ended instead, which goals are open, and how it came to that."""
    told = failure(
        r"^expected outcome goals_reached, but the run ended as out_of_time after 12\.0 s \(12 s are over\)",
        r"\nr1 wants \(holding r1 cup\)\nthe story of r1, the last 10 of \d+ sentences:\n",
        r"failed grasp\(r1, cup, kitchen\): not there|failed prepare\(r1, cup, kitchen\): not there",
    )
    with pytest.raises(AssertionError, match=told):
        assert_goals_reached(alone)
    with pytest.raises(AssertionError, match=r"r1 wants \(holding r1 cup\)$"):
        assert_goals_reached(alone.result())


def test_a_run_that_goes_on_is_told(run_fleet: RunFleet) -> None:
    """Who asserts too early is told what to do."""
    world = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-robot r1 b)")
    with pytest.raises(AssertionError, match=r"not ended yet, at 0\.0 s: call run\.finish"):
        assert_goals_reached(run_fleet(world))


def test_a_step_that_was_not_dropped_is_told_with_what_became_of_it(helped: Run, alone: Run) -> None:
    """What was dropped instead, and how the step ended."""
    told = failure(
        r"^r1 dropped no grasp; the run ended",
        r"what it dropped:\n  [\d.]+ s: prepare\(r1, cup, kitchen\) \(",
        r"\ngrasp\(r1, cup, kitchen\) was begun, and finished at [\d.]+ s\n",
    )
    with pytest.raises(AssertionError, match=told):
        assert_dropped(helped, robot="r1", action="grasp")
    with pytest.raises(AssertionError, match=r"it dropped nothing\n"):
        assert_dropped(alone, robot="r1", action="move")


def test_plans_too_many_or_too_few_are_told_with_their_reasons(helped: Run, alone: Run) -> None:
    """When the planner was asked again, and why."""
    with pytest.raises(AssertionError, match=r"^expected r1 to plan again 2 times, but it did so never\n"):
        assert_replanned(helped, "r1", 2)
    with pytest.raises(AssertionError, match=r"^expected r1 to plan again never, but it did so once\n  [\d.]+ s: \w+"):
        assert_replanned(alone, "r1")


def test_contacts_are_told_by_kind(helped: Run) -> None:
    """How often who touched what."""
    result = helped.result()
    result.contacts.update(robot_wall=2)
    assert_no_contacts(result, "robot_robot")
    with pytest.raises(AssertionError, match=r"^expected no contacts, but there were: .*robot_wall 2"):
        assert_no_contacts(result)
