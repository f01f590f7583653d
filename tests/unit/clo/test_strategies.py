"""What each strategy looks at, and what it makes of a surprise."""

import pytest

from clo_fleet.clo.links import causal_links
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import Plan, goals_of, number
from clo_fleet.clo.repair import Repaired
from clo_fleet.clo.strategies import (
    STRATEGIES,
    Adopt,
    AsPrinted,
    Clo,
    Everything,
    Keep,
    PlanAgain,
    Replan,
    ReplanOnFailure,
    ReplanOnOpportunity,
    Revision,
    Situation,
    Strategy,
)
from clo_fleet.clo.task import Action, Condition, Fact, State, parse_fact


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def action(schema: str, needs: str, adds: str) -> Action:
    """An action with one condition and one effect."""
    return Action(schema=schema, args=(), needs=goals_of(facts(needs)), adds=facts(adds), deletes=frozenset())


PLAN = number([action("fetch", "(open)", "(key)"), action("unlock", "(key)", "(done)")])
GOALS = goals_of(facts("(done)"))


def situation(state: frozenset[Fact], *, promised: frozenset[Fact] = frozenset(), plan: Plan = PLAN) -> Situation:
    """What came of ``(open)``, with a plan to fetch the key and unlock."""
    before = facts("(open)")
    return Situation(
        state=state,
        plan=plan,
        goals=GOALS,
        changed=state ^ before,
        since=state ^ before,
        past=before,
        promised=promised,
    )


def test_strategies_are_found_by_the_names_that_users_write() -> None:
    """And by these only; nobody can add to the table in passing."""
    assert {name: type(strategy) for name, strategy in STRATEGIES.items()} == {
        "clo": Clo,
        "clo-improve": Clo,
        "clo-as-printed": AsPrinted,
        "replan": Replan,
        "replan-on-opportunity": ReplanOnOpportunity,
        "replan-on-failure": ReplanOnFailure,
    }
    assert all(strategy.name == name for name, strategy in STRATEGIES.items())
    with pytest.raises(TypeError):
        STRATEGIES["mine"] = Clo()  # type: ignore[index]  # that is the point


def test_clo_looks_at_what_holds_its_plan_together() -> None:
    """Opportunities, guards and the effects of the running action; nothing else."""
    links = causal_links(facts("(open)"), PLAN, GOALS)
    assert Clo().watch(links, facts("(lit)")) == facts("(open)", "(key)", "(done)", "(lit)")


@pytest.mark.parametrize("strategy", [Replan(), ReplanOnFailure()])
def test_replanning_strategies_look_at_everything(strategy: Strategy) -> None:
    """Whatever their sensors reach."""
    watch = strategy.watch(causal_links(facts("(open)"), PLAN, GOALS), frozenset())
    assert watch == Everything()
    assert ("anything", "at", "all") in watch


def test_clo_adopts_the_repaired_plan() -> None:
    """Somebody brought the key."""
    revision = Clo().revise(situation(facts("(open)", "(key)")))
    assert isinstance(revision, Adopt)
    assert revision.repaired.plan == PLAN[1:]
    assert [drop.because for drop in revision.repaired.dropped] == [(("key",),)]
    assert not revision.on_promise


def test_clo_plans_again_only_if_the_repair_is_refused() -> None:
    """And says what is missing for which step."""
    assert Clo().revise(situation(facts("(shut)"))) == PlanAgain(
        "the repair was refused", refused="nothing brings about (open) for fetch()"
    )


def test_clo_says_which_goal_is_missing() -> None:
    """When the plan could be run, but does not reach it."""
    assert Clo().revise(situation(facts("(open)"), plan=PLAN[:1])) == PlanAgain(
        "the repair was refused", refused="nothing brings about the goal (done)"
    )


def test_clo_counts_on_a_promise_only_if_it_must() -> None:
    """The steps that it would spare are told apart from those that are gone for good."""
    promised = facts("(key)")
    revision = Clo().revise(situation(facts("(shut)"), promised=promised))
    assert isinstance(revision, Adopt)
    assert revision.on_promise
    assert revision.repaired.plan == PLAN[1:]
    alone = Clo().revise(situation(facts("(open)"), promised=promised))
    assert isinstance(alone, Adopt)
    assert not alone.on_promise
    assert alone.repaired.plan == PLAN


def test_plan_that_a_promise_makes_whole_is_kept() -> None:
    """Planning again would not bring about what another robot has in hand."""
    assert isinstance(ReplanOnOpportunity().revise(situation(facts("(shut)"))), PlanAgain)
    assert ReplanOnOpportunity().revise(situation(facts("(shut)"), promised=facts("(open)"))) == Keep()


@pytest.mark.parametrize("promised", [facts("(lit)"), facts("(shut)")])
def test_promise_that_does_not_help_is_no_reason_to_wait(promised: frozenset[Fact]) -> None:
    """Nor is one that is kept already."""
    assert isinstance(Clo().revise(situation(facts("(shut)"), promised=promised)), PlanAgain)


def test_clo_adopts_a_plan_to_which_nothing_happened() -> None:
    """Nothing is dropped from it."""
    revision = Clo().revise(situation(facts("(open)")))
    assert isinstance(revision, Adopt)
    assert revision.repaired == Repaired(PLAN, ())
    assert revision.repaired.links == causal_links(facts("(open)"), PLAN, GOALS)


@pytest.mark.parametrize(
    ("strategy", "state", "revision"),
    [
        (Replan(), facts("(open)"), Keep()),
        (Replan(), facts("(key)"), PlanAgain("unexpected: (key), (open)")),
        (ReplanOnFailure(), facts("(open)"), Keep()),
        (ReplanOnFailure(), facts("(key)"), Keep()),
    ],
)
def test_replanning_strategies_repair_nothing(strategy: Strategy, state: frozenset[Fact], revision: Revision) -> None:
    """One plans again at any difference, the other when its plan cannot go on."""
    assert strategy.revise(situation(state)) == revision


def test_an_obstacle_that_is_gone_is_a_reason_to_look_for_shorter_ways() -> None:
    """But not what a step of the plan removes itself, and not what no step minds."""

    def go(name: str, start: str, end: str, door: str, *deletes: str) -> Action:
        needs = (*goals_of(facts(start)), Condition(("shut", door), positive=False))
        return Action(schema=name, args=(), needs=needs, adds=facts(end), deletes=facts(start, *deletes))

    direct = go("direct", "(at a)", "(at c)", "x")
    round_about = number([go("there", "(at a)", "(at b)", "y"), go("on", "(at b)", "(at c)", "y")])
    goals = goals_of(facts("(at c)"))

    class Source:
        """All three actions."""

        def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
            """Whatever the state and the goals."""
            return Operators([direct, *(step.action for step in round_about)], goals)

    def revised(gone: Fact, plan: Plan = round_about) -> list[str]:
        state = facts("(at a)")
        since = frozenset({gone})
        change = Situation(
            state=state,
            plan=plan,
            goals=goals,
            changed=since,
            since=since,
            past=state | since,
            promised=frozenset(),
            actions=Source(),
        )
        revision = Clo().revise(change)
        assert isinstance(revision, Adopt)
        return [step.action.schema for step in revision.repaired.plan]

    assert revised(("shut", "x")) == ["direct"]
    assert revised(("noisy", "x")) == ["there", "on"]
    opener = number([go("there", "(at a)", "(at b)", "y", "(shut z)"), go("on", "(at b)", "(at c)", "y")])
    assert revised(("shut", "x"), opener) == ["there", "on"]
