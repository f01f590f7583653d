"""What an executive does while there is no plan to all of its goals: it works for those within reach."""

import json
from collections.abc import Iterable

import pytest

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.messages import (
    ActionFailed,
    ActionFinished,
    AskPlan,
    Begin,
    Command,
    Flip,
    Observed,
    PlanAdopted,
    PlanArrived,
    PlanFailure,
    PlanMended,
    PlanMissing,
    StartAction,
    Waits,
)
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.strategies import Clo, ReplanOnFailure, Strategy
from clo_fleet.clo.task import Action, Condition, State, parse_fact

NO_PLAN = PlanMissing(1, PlanFailure.NO_PLAN)
WITHIN_REACH = "there is none to all goals: for those within reach"
WAITS = Waits("no plan exists as things are believed")


def take(item: str) -> Action:
    """Taking up an object that lies about."""
    return Action(
        schema="take", args=(item,), needs=(Condition(("lies", item)),), adds=frozenset({("has", item)}),
        deletes=frozenset({("lies", item)}),
    )  # fmt: skip


class Hands:
    """One can take what lies about."""

    def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
        """To take either object."""
        return Operators(map(take, ("o1", "o2", "o3")), goals)


def robot(*lying: str, goals: Iterable[str] = ("(has o1)", "(has o2)"), strategy: Strategy | None = None) -> Executive:
    """One that has begun, where these objects lie."""
    beliefs = {("lies", item) for item in lying}
    executive = Executive(strategy or Clo(), beliefs, goals_of(map(parse_fact, goals)), Hands(), partly=True)
    executive.handle(Begin(0))
    return executive


def part(*goals: str) -> AskPlan:
    """The question for these goals only."""
    return AskPlan(WITHIN_REACH, goals_of(map(parse_fact, goals)))


def started(commands: Iterable[Command]) -> list[str]:
    """The steps that are to be started."""
    return [str(command.step) for command in commands if isinstance(command, StartAction)]


def test_goals_within_reach_are_worked_for_while_others_are_not() -> None:
    """Then all are asked for again, but not the part that holds."""
    one = robot("o2")
    assert one.handle(NO_PLAN) == (part("(has o2)"),)
    commands = one.handle(PlanArrived(2, (take("o2"),)))
    assert [type(command) for command in commands] == [PlanAdopted, StartAction]
    assert one.handle(ActionFinished(3, 1)) == (AskPlan("the plan ended without its goals"),)
    assert one.handle(NO_PLAN) == (WAITS,)
    assert one.mode is Mode.WAITING
    assert one.tally.adds_up


def test_what_has_been_found_again_is_put_into_the_plan_for_the_rest() -> None:
    """The strategy looks at all goals as soon as something changes."""
    one = robot("o2")
    one.handle(NO_PLAN)
    one.handle(PlanArrived(2, (take("o2"),)))
    commands = one.handle(Observed(3, (Flip(("lies", "o1"), True),)))
    assert [str(step) for command in commands if isinstance(command, PlanMended) for step in command.added] == [
        "take(o1)"
    ]
    assert started(one.handle(ActionFinished(4, 1))) == ["take(o1)"]


def test_nothing_is_asked_for_where_all_goals_or_none_are_within_reach_one_by_one() -> None:
    """Whatever keeps them from holding together is not found out."""
    assert robot("o1", "o2").handle(NO_PLAN) == (WAITS,)
    assert robot().handle(NO_PLAN) == (WAITS,)


@pytest.mark.parametrize("failure", PlanFailure)
def test_without_a_plan_to_the_part_the_robot_waits(failure: PlanFailure) -> None:
    """It does not give up either: that it would only if all its goals were at stake."""
    one = robot("o2", "o3", goals=("(has o1)", "(has o2)", "(has o3)"))
    assert one.handle(NO_PLAN) == (part("(has o2)", "(has o3)"),)
    assert one.handle(PlanMissing(2, failure)) == (WAITS,)
    assert one.mode is Mode.WAITING


@pytest.mark.parametrize("strategy", [Clo(), ReplanOnFailure()])
def test_step_for_a_part_that_failed_is_tried_again(strategy: Strategy) -> None:
    """Though nothing has changed since the planner found that there is no plan."""
    one = robot("o2", strategy=strategy)
    one.handle(NO_PLAN)
    one.handle(PlanArrived(2, (take("o2"),)))
    assert started(one.handle(ActionFailed(3, 1, "it slipped"))) == ["take(o2)"]


def test_saved_in_the_middle_it_goes_on_equally() -> None:
    """Between question and answer, and with a plan to a part under way."""
    one = robot("o2")
    for event in (NO_PLAN, PlanArrived(2, (take("o2"),)), ActionFailed(3, 1, "it slipped")):
        again = Executive.from_state(Clo(), json.loads(json.dumps(one.state())), Hands(), partly=True)
        assert again.handle(event) == one.handle(event)
        assert again.state() == one.state()


def test_an_executive_that_is_not_told_to_or_cannot_know_what_is_within_reach_waits() -> None:
    """As in the paper."""
    goals = goals_of(map(parse_fact, ("(has o1)", "(has o2)")))
    for one in (
        Executive(Clo(), {("lies", "o2")}, goals, Hands()),
        Executive(Clo(), {("lies", "o2")}, goals, partly=True),
    ):
        one.handle(Begin(0))
        assert one.handle(NO_PLAN) == (WAITS,)
