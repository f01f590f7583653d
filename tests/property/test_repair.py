"""Links and repairs of random plans, judged by the obvious slow definition and by unified-planning."""

from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st
from unified_planning.engines import SequentialPlanValidator, ValidationResultStatus
from unified_planning.environment import Environment
from unified_planning.model import Fluent, InstantaneousAction, Problem
from unified_planning.plans import ActionInstance, SequentialPlan

from clo_fleet.clo.links import Consumer, End, Guard, Link, Links, Unsupported, causal_links
from clo_fleet.clo.plan import Plan, cost, first_fault, number
from clo_fleet.clo.repair import Refused, Repaired, repair
from clo_fleet.clo.task import Action, Condition, Fact, State, apply, holds

FACTS: tuple[Fact, ...] = tuple((name,) for name in "abcdef")

facts = st.sampled_from(FACTS)
some_facts = st.frozensets(facts, max_size=2)
many = settings(max_examples=200, deadline=None, derandomize=True)
few = settings(max_examples=30, deadline=None, derandomize=True)


@dataclass(frozen=True)
class Surprise:
    """A plan that reached its goals from ``planned_from``, and the state ``now`` after some facts changed."""

    planned_from: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    now: frozenset[Fact]

    @property
    def changed(self) -> frozenset[Fact]:
        """The facts that changed."""
        return self.planned_from ^ self.now


@st.composite
def surprises(draw: st.DrawFn) -> Surprise:
    """Actions that can be done one after the other, some literals of the end as goals, and a few changes."""
    start = state = draw(st.frozensets(facts))
    actions = []
    for i in range(draw(st.integers(0, 8))):
        needs = tuple(Condition(fact, fact in state) for fact in sorted(draw(some_facts)))
        actions.append(
            Action(
                schema=f"s{i}",
                args=(),
                needs=needs,
                adds=draw(some_facts),
                deletes=draw(some_facts),
                cost=draw(st.integers(0, 3)),
            )
        )
        state = apply(state, actions[-1])
    goals = tuple(Condition(fact, fact in state) for fact in sorted(draw(st.frozensets(facts, min_size=1, max_size=3))))
    return Surprise(start, number(actions), goals, start ^ draw(st.frozensets(facts, max_size=3)))


def obvious_links(state: State, plan: Plan, goals: tuple[Condition, ...]) -> Links:
    """The support rule word by word: now, unless a step before undoes it; else the first that makes it again."""
    links, guards, unsupported = [], [], []
    consumers: list[tuple[int, Consumer, tuple[Condition, ...]]] = [
        *((place, step.id, step.action.needs) for place, step in enumerate(plan)),
        (len(plan), End.GOAL, goals),
    ]
    for place, consumer, needs in consumers:
        for need in needs:
            makes = [need.fact in (s.action.adds if need.positive else s.action.deletes) for s in plan[:place]]
            undoes = [need.fact in (s.action.deletes if need.positive else s.action.adds) for s in plan[:place]]
            if holds(need, state) and not any(undoes):
                guards.append(Guard(need, consumer))
                continue
            since = max((i + 1 for i in range(place) if undoes[i]), default=0)
            producers = [plan[i].id for i in range(since, place) if makes[i]]
            if producers:
                links.append(Link(producers[0], need, consumer))
            else:
                unsupported.append(Unsupported(need, consumer))
    return Links(tuple(links), tuple(guards), tuple(unsupported))


def is_valid_for_unified_planning(state: State, plan: Plan, goals: tuple[Condition, ...]) -> bool:
    """What unified-planning's own validator says of the plan."""
    environment = Environment()
    environment.credits_stream = None
    problem = Problem("task", environment)
    fluents = {fact: Fluent(f"is_{fact[0]}", environment=environment) for fact in FACTS}

    def literal(condition: Condition) -> object:
        fluent = fluents[condition.fact]
        return fluent if condition.positive else environment.expression_manager.Not(fluent)

    for fact, fluent in fluents.items():
        problem.add_fluent(fluent, default_initial_value=fact in state)
    instances = []
    for step in plan:
        action = InstantaneousAction(step.action.schema, _env=environment)
        for need in step.action.needs:
            action.add_precondition(literal(need))
        for value, changed in ((True, step.action.adds), (False, step.action.deletes)):
            for fact in changed:
                action.add_effect(fluents[fact], value)
        problem.add_action(action)
        instances.append(ActionInstance(action))
    for goal in goals:
        problem.add_goal(literal(goal))
    verdict = SequentialPlanValidator().validate(problem, SequentialPlan(instances, environment))
    return bool(verdict.status is ValidationResultStatus.VALID)


@many
@given(surprises())
def test_links_are_those_of_the_obvious_definition(case: Surprise) -> None:
    """In one pass the same links, guards and gaps come out as by looking at every pair of steps."""
    for state in (case.planned_from, case.now):
        assert causal_links(state, case.plan, case.goals) == obvious_links(state, case.plan, case.goals)


@many
@given(surprises())
def test_plan_without_gaps_is_valid(case: Surprise) -> None:
    """Nothing is unsupported exactly if the plan can be run to its goals."""
    found = causal_links(case.now, case.plan, case.goals)
    assert bool(found.unsupported) is bool(first_fault(case.now, case.plan, case.goals))


@many
@given(surprises())
def test_repaired_plan_is_valid_and_no_dearer(case: Surprise) -> None:
    """What is left of a plan reaches its goals, in the old order, at no higher cost, and with its own links."""
    found = repair(case.now, case.plan, case.goals, changed=case.changed)
    if isinstance(found, Refused):
        assert found.missing
        return
    kept = {step.id for step in found.plan}
    assert first_fault(case.now, found.plan, case.goals) is None
    assert found.plan == tuple(step for step in case.plan if step.id in kept)
    assert [drop.step for drop in found.dropped] == [step for step in case.plan if step.id not in kept]
    assert cost(found.plan) <= cost(case.plan)
    assert found.links == obvious_links(case.now, found.plan, case.goals)
    assert all(set(drop.because) <= case.changed & case.now for drop in found.dropped)


@many
@given(surprises())
def test_repair_is_finished_after_one_call(case: Surprise) -> None:
    """A repaired plan has nothing left to drop."""
    found = repair(case.now, case.plan, case.goals)
    if isinstance(found, Repaired):
        assert repair(case.now, found.plan, case.goals) == Repaired(found.plan, ())


@many
@given(surprises())
def test_plan_that_can_go_on_is_never_refused(case: Surprise) -> None:
    """A repair is refused only if the plan breaks, also when the steps that break are left out."""
    if isinstance(repair(case.now, case.plan, case.goals), Refused):
        state, rest = case.now, []
        for step in case.plan:
            if all(holds(need, state) for need in step.action.needs):
                rest.append(step)
                state = apply(state, step.action)
        assert first_fault(case.now, case.plan, case.goals)
        assert first_fault(case.now, tuple(rest), case.goals)


@few
@given(surprises())
def test_unified_planning_agrees(case: Surprise) -> None:
    """The validator of unified-planning accepts every repaired plan, and the broken one no sooner than we do."""
    broken = first_fault(case.now, case.plan, case.goals) is not None
    assert is_valid_for_unified_planning(case.now, case.plan, case.goals) is not broken
    found = repair(case.now, case.plan, case.goals)
    if isinstance(found, Repaired):
        assert is_valid_for_unified_planning(case.now, found.plan, case.goals)
