"""Supports and deletions of random plans, judged after each change by the plain pass over the whole plan."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from clo_fleet.clo.deletion import delete
from clo_fleet.clo.journal import Mark
from clo_fleet.clo.links import Consumer, End, Guard, Link, Unsupported, causal_links
from clo_fleet.clo.plan import Plan, Step, first_fault, number
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Action, Condition, Fact, apply, holds, unmet

FACTS: tuple[Fact, ...] = tuple((name,) for name in "abcde")

facts = st.sampled_from(FACTS)
some_facts = st.frozensets(facts, max_size=2)
conditions = st.builds(Condition, facts, st.booleans())
actions = st.builds(
    lambda needs, adds, deletes: Action(schema="act", args=(), needs=needs, adds=adds, deletes=deletes),
    needs=st.lists(conditions, max_size=2).map(tuple),
    adds=some_facts,
    deletes=some_facts,
)
many = settings(max_examples=200, deadline=None, derandomize=True)
Changes = list[tuple[str, object]]
changes: st.SearchStrategy[Changes] = st.lists(
    st.one_of(
        st.tuples(st.just("flip"), st.tuples(facts, st.sampled_from([True, False, None]))),
        st.tuples(st.just("advance"), st.none()),
        st.tuples(st.just("remove"), st.integers(1, 7)),
        st.tuples(st.just("take_needless"), st.none()),
        st.tuples(st.just("prepend"), st.lists(actions, min_size=1, max_size=3)),
        st.tuples(st.just("mark"), st.none()),
        st.tuples(st.just("undo"), st.integers(0, 3)),
    ),
    max_size=15,
)


@dataclass
class Slow:
    """What ``Supports`` should say, worked out from scratch each time."""

    state: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    unknown: frozenset[Fact]
    next_id: int = 1_000

    def flip(self, fact: Fact, value: bool | None) -> None:
        """The fact has this value now."""
        self.state = self.state | {fact} if value else self.state - {fact}
        self.unknown = self.unknown | {fact} if value is None else self.unknown - {fact}

    def advance(self) -> None:
        """The first step has been done."""
        first, *rest = self.plan
        self.state, self.plan = apply(self.state, first.action), tuple(rest)
        self.unknown -= first.action.adds | first.action.deletes

    def prepend(self, new: list[Action]) -> Plan:
        """The actions come first, as the steps returned."""
        steps = number(new, self.next_id)
        self.next_id += len(steps)
        self.plan = (*steps, *self.plan)
        return steps

    def take_needless(self) -> None:
        """Steps that support neither a goal nor a step that does go, all at once, until there are none."""
        rest = None
        while rest != self.plan:
            needed: set[Consumer] = {End.GOAL}
            by_producer: dict[int, list[Link]] = {}
            for link in causal_links(self.state, self.plan, self.goals, self.unknown).links:
                by_producer.setdefault(link.producer, []).append(link)
            for step in reversed(self.plan):
                if any(link.consumer in needed for link in by_producer.get(step.id, ())):
                    needed.add(step.id)
            rest, self.plan = self.plan, tuple(step for step in self.plan if step.id in needed)

    def copy(self) -> "Slow":
        """The same, unaffected by what happens to this one."""
        return Slow(self.state, self.plan, self.goals, self.unknown, self.next_id)


slow_plans = st.builds(
    Slow,
    state=st.frozensets(facts),
    plan=st.lists(actions, min_size=1, max_size=5).flatmap(
        lambda some: st.lists(st.sampled_from(some), max_size=8).map(number)
    ),
    goals=st.lists(conditions, max_size=3).map(tuple),
    unknown=some_facts,
)


def check(supports: Supports, slow: Slow) -> None:
    """Both say the same."""
    expected = causal_links(slow.state, slow.plan, slow.goals, slow.unknown)
    assert supports.plan == slow.plan
    assert len(supports) == len(slow.plan)
    assert supports.state == slow.state - slow.unknown
    assert supports.links() == expected
    assert supports.gaps() == expected.unsupported
    assert supports.is_whole() is not bool(expected.unsupported)
    assert supports.watched == expected.watched
    uses = Counter(link.producer for link in expected.links)
    timeline = supports.timeline
    assert {timeline.steps[place].id: supports.uses[place] for place in timeline.places()} == {
        step.id: uses[step.id] for step in slow.plan
    }
    named: list[Link | Guard | Unsupported] = [*expected.links, *expected.guards, *expected.unsupported]
    for support in named:
        assert supports.support_of(support.condition, support.consumer) == support


@dataclass
class Driver:
    """Makes the same changes to both."""

    supports: Supports
    slow: Slow
    marks: list[tuple[Mark, Slow]] = field(default_factory=list)

    def make(self, kind: str, what: object) -> None:
        """One change."""
        getattr(self, kind)(what)

    def flip(self, what: tuple[Fact, bool | None]) -> None:
        """A fact changes."""
        fact, value = what
        before = self.supports.timeline.value(fact)
        assert self.supports.flip(fact, value) is (before is not value)
        self.slow.flip(fact, value)

    def advance(self, _: None) -> None:
        """The first step is done, if there is one."""
        if self.slow.plan:
            assert self.supports.advance() == self.slow.plan[0]
            self.slow.advance()

    def remove(self, every: int) -> None:
        """Some steps go, whether they are needed or not."""
        gone = self.slow.plan[::every]
        self.supports.remove([self.supports.timeline.place_of(step.id) for step in gone])
        self.slow.plan = tuple(step for step in self.slow.plan if step not in gone)

    def take_needless(self, _: None) -> None:
        """All needless steps go."""
        before = {step.id for step in self.slow.plan}
        places = self.supports.take_needless()
        self.slow.take_needless()
        assert {self.supports.timeline.steps[place].id for place in places} == before - {
            step.id for step in self.slow.plan
        }
        assert not self.supports.has_needless()

    def prepend(self, new: list[Action]) -> None:
        """New steps come first."""
        self.supports.prepend(self.slow.prepend(new))

    def mark(self, _: None) -> None:
        """A mark is set."""
        self.marks.append((self.supports.mark(), self.slow.copy()))

    def undo(self, back: int) -> None:
        """The last mark, or one before it, is gone back to."""
        if back < len(self.marks):
            mark, self.slow = self.marks[-1 - back]
            del self.marks[-1 - back :]
            self.supports.undo(mark)


@many
@given(slow_plans, changes)
def test_supports_are_those_of_a_new_pass_after_any_changes(slow: Slow, made: Changes) -> None:
    """Flips, steps done, put in front, taken out or needless, and all of that taken back: nothing is left behind."""
    driver = Driver(Supports(slow.state, slow.plan, slow.goals, slow.unknown), slow)
    check(driver.supports, driver.slow)
    for kind, what in made:
        driver.make(kind, what)
        check(driver.supports, driver.slow)


@dataclass(frozen=True)
class Surprise:
    """A plan that reached its goals from ``start``, and facts that changed."""

    start: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    changed: dict[Fact, bool]

    @property
    def now(self) -> frozenset[Fact]:
        """The state after the change."""
        return (self.start - self.changed.keys()) | {fact for fact, value in self.changed.items() if value}


@st.composite
def surprises(draw: st.DrawFn) -> Surprise:
    """Actions that can be done one after the other, some literals of the end as goals, and a few changes."""
    start = state = draw(st.frozensets(facts))
    plan = []
    for i in range(draw(st.integers(0, 10))):
        needs = tuple(Condition(fact, fact in state) for fact in sorted(draw(some_facts)))
        plan.append(Action(schema=f"s{i}", args=(), needs=needs, adds=draw(some_facts), deletes=draw(some_facts)))
        state = apply(state, plan[-1])
    goals = tuple(Condition(fact, fact in state) for fact in sorted(draw(st.frozensets(facts, min_size=1, max_size=3))))
    return Surprise(start, number(plan), goals, draw(st.dictionaries(facts, st.booleans(), max_size=3)))


def without(case: Surprise, plan: Plan, goes: Callable[[Step], bool]) -> Plan | None:
    """The plan without the steps that go or cannot be done; ``None`` if a goal is lost."""
    state, kept = case.now, []
    for step in plan:
        if not goes(step) and not unmet(step.action, state):
            kept.append(step)
            state = apply(state, step.action)
    return tuple(kept) if all(holds(goal, state) for goal in case.goals) else None


@many
@given(surprises(), st.booleans())
def test_deletion_leaves_a_plan_that_runs_through_or_names_what_is_missing(case: Surprise, everywhere: bool) -> None:
    """It drops steps only, names news only, and agrees with the run from the present state."""
    supports = Supports(case.start, case.plan, case.goals)
    found = delete(supports, case.changed, everywhere=everywhere)
    assert supports.links() == causal_links(case.now, supports.plan, case.goals)
    assert found.gaps == supports.gaps()
    assert bool(found.gaps) is bool(first_fault(case.now, supports.plan, case.goals))
    left = set(supports.plan)
    assert [drop.step for drop in found.drops] == [step for step in case.plan if step not in left]
    assert all(case.changed[fact] for drop in found.drops for fact in drop.because)


@many
@given(surprises())
def test_deletion_succeeds_where_skipping_what_cannot_be_done_does(case: Surprise) -> None:
    """It gives up only if the plan breaks, and also if the steps that break are left out."""
    if delete(Supports(case.start, case.plan, case.goals), case.changed).gaps:
        assert without(case, case.plan, lambda step: False) is None


@many
@given(surprises())
def test_deletion_everywhere_leaves_nothing_to_skip(case: Surprise) -> None:
    """No step that ends a fact which another one restores can be left out with all that fails then."""
    supports = Supports(case.start, case.plan, case.goals)
    if delete(supports, case.changed, everywhere=True).gaps:
        return
    plan = supports.plan
    slow = Slow(case.now, plan, case.goals, frozenset())
    slow.take_needless()
    assert slow.plan == plan
    restored = {(link.producer, link.condition) for link in causal_links(case.now, plan, case.goals).links}
    state: frozenset[Fact] = case.now
    ended: dict[Condition, Step] = {}
    for step in plan:
        after = apply(state, step.action)
        for fact in sorted(state ^ after):
            begun = Condition(fact, fact in after)
            if (step.id, begun) in restored and begun in ended:
                assert without(case, plan, lambda other, undoer=ended[begun]: other == undoer) is None  # type: ignore[misc]
            ended[Condition(fact, fact in state)] = step
        state = after


@many
@given(surprises())
def test_deletion_can_be_tried_and_taken_back(case: Surprise) -> None:
    """Afterwards all is as it was, and the same deletion gives the same again."""
    supports = Supports(case.start, case.plan, case.goals)
    slow = Slow(case.start, case.plan, case.goals, frozenset())
    mark = supports.mark()
    found = delete(supports, case.changed)
    supports.undo(mark)
    check(supports, slow)
    assert delete(supports, case.changed) == found
