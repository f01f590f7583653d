"""How an episode ends when things go wrong, with a planner that gives the answers it is told to."""

from dataclasses import dataclass, field, replace

import pytest

from clo_fleet.clo.messages import PlanFailure
from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.clo.task import Action
from clo_fleet.paper.calls import Called
from clo_fleet.paper.catalogue import SETTINGS
from clo_fleet.paper.episode import GOALS_REACHED, PAPER_LIMITS, Episode, Limits
from clo_fleet.paper.symbolic import SymbolicWorld
from clo_fleet.planning.problem import PlanningTask

SETTING = SETTINGS["rooms"]
PLAN = (("prepare", "o1", "l1"), ("grasp", "o1", "l1"))


@dataclass(slots=True)
class Oracle:
    """Gives its answers one by one, the last one again and again; remembers how long it was given."""

    answers: list[Called]
    given: list[float] = field(default_factory=list)

    def call(self, task: PlanningTask, seconds: float) -> Called:
        """The next answer."""
        self.given.append(seconds)
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


def plan(*steps: tuple[str, ...], wall: float = 0.0) -> Called:
    """A plan, found within ``wall`` seconds."""
    domain = SETTING.domain()
    actions: tuple[Action, ...] = tuple(domain.ground(step[0], step[1:], {}) for step in steps)
    return Called(actions=actions, wall=wall)


def failure(why: PlanFailure) -> Called:
    """No plan."""
    return Called(actions=None, failure=why)


def episode(*answers: Called, strategy: str = "clo", limits: Limits = PAPER_LIMITS) -> Episode:
    """ROOMS with one object, where nobody helps."""
    world = SymbolicWorld(setting=SETTING, task=SETTING.task(1), probability=0.0, seed=0)
    return Episode(world, STRATEGIES[strategy], Oracle(list(answers)), limits)


@pytest.mark.parametrize(
    ("why", "outcome", "calls"),
    [
        (PlanFailure.NO_PLAN, "ended waiting", 1),
        (PlanFailure.OUT_OF_MEMORY, "the planner ran out of memory", 1),
        (PlanFailure.OUT_OF_TIME, "limit of a planner call, 500 s", 1),
        (PlanFailure.DIED, "planner failed: the planner died", 2),
    ],
)
def test_a_planner_that_fails_ends_the_run_with_its_reason(why: PlanFailure, outcome: str, calls: int) -> None:
    """A dead one is asked once more."""
    run = episode(failure(why))
    assert run.finish() == outcome
    assert run.meters.calls == calls


def test_a_call_is_given_what_is_left_of_the_run() -> None:
    """500 s each, as long as 1,800 s are not used up; then the run is late, not the call."""
    run = episode(plan(*PLAN, wall=900), plan(*PLAN, wall=700), failure(PlanFailure.OUT_OF_TIME), strategy="replan")
    assert run.finish() == "limit of the run, 1800 s"
    planner = run.planner
    assert isinstance(planner, Oracle)
    assert planner.given[:2] == [500, 500]
    assert 199 < planner.given[2] < 200


def test_a_decision_that_takes_too_long_ends_the_run() -> None:
    """The paper's third limit, 300 s for the opportunities."""
    assert episode(plan(*PLAN), limits=replace(PAPER_LIMITS, links=0.0)).finish() == "limit of a decision, 0 s"


def test_an_action_that_cannot_be_done_is_tried_in_vain_and_teaches_why() -> None:
    """Nobody saw that the object is gone; the plan is made anew with what was learnt."""
    run = episode(plan(*PLAN), failure(PlanFailure.NO_PLAN))
    run.world.facts -= {("at-object", "o1", "l1")}
    assert run.finish() == "ended waiting"
    assert run.executive.tally.failed == 1
    assert ("at-object", "o1", "l1") not in run.executive.beliefs


def test_replan_asks_for_no_plan_when_its_last_action_reaches_the_goals() -> None:
    """It sees five new objects then too, but there is nothing left to plan for."""
    run = episode(plan(*PLAN), plan(PLAN[1]), strategy="replan")
    assert run.finish() == GOALS_REACHED
    assert (run.meters.calls, run.executive.tally.executed) == (2, 2)
    assert run.executive.tally.adds_up
