"""Values and windows of opportunities, judged by making each of them come true at each place of the plan."""

from dataclasses import dataclass, replace

from hypothesis import assume, event, given, settings
from hypothesis import strategies as st

from clo_fleet.clo.links import Consumer, End, causal_links
from clo_fleet.clo.plan import Plan, cost, number
from clo_fleet.clo.repair import Refused, Repaired, repair
from clo_fleet.clo.task import Action, Condition, Fact, apply, holds, unmet
from clo_fleet.clo.worth import worths

FACTS: tuple[Fact, ...] = tuple((name,) for name in "abcde")

some_facts = st.frozensets(st.sampled_from(FACTS), max_size=2)
many = settings(max_examples=300, deadline=None, derandomize=True)


@dataclass(frozen=True)
class Task:
    """A plan for some goals, and what is known of the state that it is to start from."""

    state: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    unknown: frozenset[Fact] = frozenset()

    def holds(self, condition: Condition) -> bool:
        """Whether the condition is known to hold."""
        return condition.fact not in self.unknown and holds(condition, self.state)

    def come_true(self, condition: Condition) -> "Task":
        """The task after the condition has come to hold by itself."""
        fact = {condition.fact}
        state = self.state | fact if condition.positive else self.state - fact
        return replace(self, state=state, unknown=self.unknown - fact)

    def after(self, place: int) -> "Task":
        """The task when so many steps of the plan have been done as modelled."""
        state, unknown = self.state, self.unknown
        for step in self.plan[:place]:
            state = apply(state, step.action)
            unknown -= step.action.adds | step.action.deletes
        return Task(state, self.plan[place:], self.goals, unknown)


@st.composite
def tasks(draw: st.DrawFn) -> Task:
    """Actions that can be done one after the other, new or done before, for some literals of the end."""
    facts = st.sampled_from(FACTS[: draw(st.integers(2, len(FACTS)))])
    few = st.frozensets(facts, max_size=2)
    start = state = draw(st.frozensets(facts))
    actions: list[Action] = []
    for i in range(draw(st.integers(2, 12))):
        again = [action for action in actions if not unmet(action, state)]
        if again and draw(st.integers(0, 2)) > 0:
            action = draw(st.sampled_from(again))
        else:
            action = Action(
                schema=f"s{i}",
                args=(),
                needs=tuple(Condition(fact, fact in state) for fact in sorted(draw(few))),
                adds=draw(few),
                deletes=draw(few),
                cost=draw(st.integers(0, 3)),
            )
        actions.append(action)
        state = apply(state, action)
    goals = tuple(Condition(fact, fact in state) for fact in sorted(draw(st.frozensets(facts, min_size=1))))
    return Task(start, number(actions), goals)


@st.composite
def surprised_tasks(draw: st.DrawFn) -> Task:
    """Tasks in whose state some facts have changed or been forgotten since; the plan may be broken by that."""
    task = draw(tasks())
    unknown = draw(st.sampled_from([frozenset[Fact]()] * 3 + [draw(some_facts)]))
    return replace(task, state=(task.state ^ draw(some_facts)) - unknown, unknown=unknown)


@st.composite
def terse_tasks(draw: st.DrawFn) -> Task:
    """Tasks whose plans have no needless step; loops and gaps there may be."""
    task = draw(tasks() | surprised_tasks())
    gone = needless(task)
    return replace(task, plan=tuple(step for step in task.plan if step.id not in gone))


@st.composite
def repaired_tasks(draw: st.DrawFn) -> Task:
    """Tasks whose plans are what a repair has left of them."""
    task = draw(tasks() | surprised_tasks())
    found = repair(task.state, task.plan, task.goals, unknown=task.unknown)
    assume(isinstance(found, Repaired))
    assert isinstance(found, Repaired)
    return replace(task, plan=found.plan)


def needless(task: Task) -> frozenset[int]:
    """The steps that go by the needless rule alone: drop what supports nothing needed, link anew, until all are."""
    left = task.plan
    while True:
        links = causal_links(task.state, left, task.goals, task.unknown).links
        needed: set[Consumer] = {End.GOAL}
        for step in reversed(left):
            if any(link.producer == step.id and link.consumer in needed for link in links):
                needed.add(step.id)
        rest = tuple(step for step in left if step.id in needed)
        if rest == left:
            return frozenset(step.id for step in task.plan) - {step.id for step in rest}
        left = rest


def helps(task: Task, condition: Condition, place: int) -> bool:
    """Whether a step becomes needless if the condition comes to hold when ``place`` steps have been done."""
    then = task.after(place)
    return not then.holds(condition) and bool(needless(then.come_true(condition)))


def saving(task: Task, condition: Condition) -> tuple[int, int]:
    """The cost and the number of steps that a repair drops if the condition comes to hold now."""
    now = task.come_true(condition)
    changed = () if task.holds(condition) else (condition.fact,)
    found = repair(now.state, now.plan, now.goals, changed=changed, unknown=now.unknown)
    rest = task.plan if isinstance(found, Refused) else found.plan
    return cost(task.plan) - cost(rest), len(task.plan) - len(rest)


@many
@given(terse_tasks())
def test_windows_are_the_places_where_it_helps(task: Task) -> None:
    """Found in one pass, they are those found by trying every place; they are in order and do not touch."""
    for worth in worths(task.state, task.plan, task.goals, task.unknown):
        places = [place for place in range(len(task.plan)) if any(place in window for window in worth.windows)]
        assert places == [place for place in range(len(task.plan)) if helps(task, worth.condition, place)]
        assert all(window.first <= window.last for window in worth.windows)
        assert all(a.last + 1 < b.first for a, b in zip(worth.windows, worth.windows[1:], strict=False))
        event(f"{min(len(worth.windows), 3)} windows, {'positive' if worth.condition.positive else 'negative'}")


@many
@given(repaired_tasks())
def test_value_is_what_a_repair_would_save_now(task: Task) -> None:
    """For every opportunity cost and steps are those of the repair on the changed state; none if it is refused.

    The most valuable comes first, equals in the order of their conditions.
    """
    found = worths(task.state, task.plan, task.goals, task.unknown)
    links = causal_links(task.state, task.plan, task.goals, task.unknown)
    assert {worth.condition for worth in found} == links.opportunities
    assert list(found) == sorted(found, key=lambda worth: (-worth.value, worth.condition))
    assert len(found) == len(links.opportunities)
    for worth in found:
        assert (worth.value, worth.steps) == saving(task, worth.condition)
        event(f"value {'0' if not worth.value else '> 0'}, {'no' if not worth.steps else 'some'} steps")
