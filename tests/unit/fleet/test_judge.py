"""How runs end."""

import pytest

from clo_fleet.clo.executive import Executive
from clo_fleet.clo.messages import Begin, PlanFailure, PlanMissing
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.strategies import Clo
from clo_fleet.fleet.judge import GRIDLOCK_AFTER, PATIENCE, Judge
from clo_fleet.fleet.outcome import ADVICE, Outcome

DONE = ("prepared", "o1")


def executive(*beliefs: tuple[str, ...]) -> Executive:
    """An executive that wants ``DONE``, and has begun."""
    made = Executive(Clo(), beliefs, goals_of([DONE]))
    made.handle(Begin(0.0))
    return made


def test_goals_count_when_they_are_true_not_when_they_are_believed() -> None:
    """Belief and truth together end a run well; belief alone ends it as mistaken, after a while."""
    judge = Judge(frozenset({DONE}))
    robots = {"r1": executive(DONE)}
    assert judge.verdict(1.0, 99.0, frozenset({DONE}), robots, {}) == (Outcome.GOALS_REACHED, "all goals hold")
    assert judge.verdict(1.0, 99.0, frozenset(), robots, {}) is None
    late = judge.verdict(1.2 + PATIENCE, 99.0, frozenset(), robots, {})
    assert late is not None
    assert late[0] is Outcome.MISTAKEN


@pytest.mark.parametrize(
    ("failure", "outcome"),
    [(PlanFailure.NO_PLAN, Outcome.NO_PLAN), (PlanFailure.OUT_OF_TIME, Outcome.PLANNER_FAILED)],
)
def test_standstill_has_a_name(failure: PlanFailure, outcome: Outcome) -> None:
    """A robot without a plan, or without a planner."""
    robot = executive()
    robot.handle(PlanMissing(0.0, failure))
    judge = Judge(frozenset({DONE}))
    assert judge.verdict(1.0, 99.0, frozenset(), {"r1": robot}, {}) is None
    verdict = judge.verdict(1.2 + PATIENCE, 99.0, frozenset(), {"r1": robot}, {})
    assert verdict is not None
    assert verdict[0] is outcome


def test_work_without_any_motion_is_gridlock_and_says_who_waits_for_what() -> None:
    """Robots that act but do not get on do not run for ever."""
    judge = Judge(frozenset({DONE}))
    verdict = judge.verdict(1.0 + GRIDLOCK_AFTER, 1e6, frozenset(), {"r1": executive()}, {"r1": "door d1"})
    assert verdict == (Outcome.GRIDLOCK, "r1 waits for door d1")


def test_every_outcome_but_success_comes_with_advice() -> None:
    """Whoever reads an outcome is told what to do."""
    assert set(ADVICE) == set(Outcome) - {Outcome.GOALS_REACHED}
