"""Supports: what each step supports, kept up to date while facts flip and steps come and go."""

import pytest

from clo_fleet.clo.journal import MarkError
from clo_fleet.clo.links import End, Guard, Link, Unsupported, causal_links
from clo_fleet.clo.plan import Plan, goals_of, number
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Action, Condition, Fact
from clo_fleet.clo.timeline import NoStepError

HUB, L1, L2 = ("at-robot", "hub"), ("at-robot", "l1"), ("at-robot", "l2")
LIT = ("lit",)
SHUT = Condition(("shut",), positive=False)


def act(name: str, *, needs: str = "", lacks: str = "", adds: str = "", deletes: str = "") -> Action:
    """The action ``name``; each effect and condition is one fact without objects, split by blanks."""
    return Action(
        schema=name,
        args=(),
        needs=(
            *(Condition((fact,)) for fact in needs.split()),
            *(Condition((fact,), positive=False) for fact in lacks.split()),
        ),
        adds=frozenset((fact,) for fact in adds.split()),
        deletes=frozenset((fact,) for fact in deletes.split()),
    )


def move(here: Fact, there: Fact) -> Action:
    """Go from place to place, if the door is not shut."""
    return Action(
        schema="move",
        args=(here[1], there[1]),
        needs=(Condition(here), SHUT),
        adds=frozenset({there}),
        deletes=frozenset({here}),
    )


PLAN = number([move(HUB, L1), act("look", lacks="dark", adds="seen"), move(L1, HUB), move(HUB, L2)])
GOALS = goals_of([("seen",), L2])


def tour() -> Supports:
    """From the hub to one room and to another."""
    return Supports({HUB}, PLAN, GOALS)


def ids(plan: Plan) -> list[int]:
    """The ids of the steps."""
    return [step.id for step in plan]


def uses(supports: Supports) -> dict[int, int]:
    """How many conditions each step that is left supports, by its id."""
    timeline = supports.timeline
    return {timeline.steps[place].id: supports.uses[place] for place in timeline.places()}


# ---- what there is -----------------------------------------------------------------------------------------


def test_counts_are_those_of_the_links() -> None:
    """Each step but the last supports the one after the next; the last and the look reach goals."""
    supports = tour()
    assert uses(supports) == {0: 1, 1: 1, 2: 1, 3: 1}
    assert supports.links() == causal_links({HUB}, PLAN, GOALS)
    assert (supports.plan, supports.goals, supports.state) == (PLAN, GOALS, frozenset({HUB}))
    assert supports.is_whole()
    assert len(supports) == 4


def test_support_is_the_present_a_step_or_nothing() -> None:
    """Also for a condition that the consumer does not have, or that nobody speaks of."""
    supports = tour()
    assert supports.support_of(Condition(HUB), 0) == Guard(Condition(HUB), 0)
    assert supports.support_of(Condition(HUB), 3) == Link(2, Condition(HUB), 3)
    assert supports.support_of(Condition(L2), End.GOAL) == Link(3, Condition(L2), End.GOAL)
    assert supports.support_of(Condition(HUB), End.GOAL) == Unsupported(Condition(HUB), End.GOAL)
    assert supports.support_of(Condition(LIT), 2) == Unsupported(Condition(LIT), 2)


def test_watched_are_the_facts_of_links_and_guards() -> None:
    """Not those that are only missing, nor those that nobody needs."""
    supports = Supports({HUB}, PLAN, (*GOALS, Condition(LIT)))
    assert supports.watched == causal_links({HUB}, PLAN, (*GOALS, Condition(LIT))).watched
    assert supports.watches(("dark",))
    assert not supports.watches(LIT)
    assert not supports.watches(("far", "away"))


def test_facts_of_the_state_that_the_plan_does_not_speak_of_stay() -> None:
    """They are part of what holds now, until they flip."""
    supports = Supports({HUB, LIT}, PLAN, GOALS)
    assert supports.state == {HUB, LIT}
    supports.flip(LIT, False)
    supports.flip(("warm",), True)
    assert supports.state == {HUB, ("warm",)}


def test_unknown_fact_supports_neither_sign() -> None:
    """Until it is known, or a step makes it so."""
    supports = Supports({HUB, ("dark",)}, PLAN, GOALS, unknown=frozenset({("dark",), LIT}))
    dark = Condition(("dark",), positive=False)
    assert supports.gaps() == (Unsupported(dark, 1),)
    assert supports.support_of(Condition(("dark",)), 1) == Unsupported(Condition(("dark",)), 1)
    assert supports.state == {HUB}
    assert supports.timeline.value(LIT) is None
    supports.flip(("dark",), False)
    assert supports.is_whole()
    assert supports.flip(("dark",), None)
    assert not supports.flip(("dark",), None)
    assert supports.gaps() == (Unsupported(dark, 1),)


def test_places_of_steps_are_found_by_their_ids() -> None:
    """Also after steps went, came back or came in front; others are refused."""
    supports = tour()
    timeline = supports.timeline
    assert [timeline.place_of(step.id) for step in PLAN] == list(timeline.places())
    mark = supports.mark()
    supports.remove([timeline.place_of(1)])
    with pytest.raises(NoStepError) as caught:
        timeline.place_of(1)
    assert caught.value.step == 1
    supports.prepend(number([act("wake")], first=9))
    assert timeline.steps[timeline.place_of(9)].id == 9
    supports.undo(mark)
    assert timeline.is_left(timeline.place_of(1))
    with pytest.raises(NoStepError, match="no step 9"):
        timeline.place_of(9)


def test_same_action_may_stand_in_a_plan_many_times() -> None:
    """Each of its steps has its own links, and a fact with many makers and readers is like any other."""
    there, back = move(HUB, L1), move(L1, HUB)
    plan = number([there, back] * 6)
    supports = Supports({HUB}, plan, goals_of([HUB]))
    assert supports.links() == causal_links({HUB}, plan, goals_of([HUB]))
    mark = supports.mark()
    supports.remove([3, 4, 5, 6])
    assert supports.plan == (*plan[:3], *plan[7:])
    assert supports.links() == causal_links({HUB}, supports.plan, goals_of([HUB]))
    supports.undo(mark)
    assert supports.links() == causal_links({HUB}, plan, goals_of([HUB]))


# ---- flips -------------------------------------------------------------------------------------------------


def test_fact_that_came_true_takes_the_uses_of_its_maker() -> None:
    """The step is needless then, and with it what only served it."""
    supports = tour()
    assert supports.flip(L2, True)
    assert not supports.flip(L2, True)
    assert uses(supports) == {0: 1, 1: 1, 2: 1, 3: 0}
    assert supports.has_needless()
    assert [supports.timeline.steps[place].id for place in supports.take_needless()] == [0, 2, 3]
    assert ids(supports.plan) == [1]


def test_fact_that_was_lost_leaves_gaps_or_goes_to_its_next_maker() -> None:
    """The first reader has nothing; those behind a maker have that."""
    plan = number([act("use", needs="f"), act("make", adds="f"), act("use", needs="f")])
    supports = Supports({("f",)}, plan, ())
    assert uses(supports) == {0: 0, 1: 0, 2: 0}
    supports.flip(("f",), False)
    assert uses(supports) == {0: 0, 1: 1, 2: 0}
    assert supports.gaps() == (Unsupported(Condition(("f",)), 0),)
    assert (supports.lacking(), supports.is_whole()) == ([0], False)
    supports.flip(("f",), True)
    assert uses(supports) == {0: 0, 1: 0, 2: 0}
    assert supports.is_whole()


def test_flip_of_a_negative_condition_is_the_mirror() -> None:
    """A shut door takes the support of all who pass it before it is opened."""
    plan = number([move(HUB, L1), act("open", deletes="shut"), move(L1, HUB)])
    supports = Supports({HUB, ("shut",)}, plan, goals_of([HUB]))
    assert supports.gaps() == (Unsupported(SHUT, 0),)
    assert uses(supports) == {0: 1, 1: 1, 2: 1}
    supports.flip(("shut",), False)
    assert uses(supports) == {0: 1, 1: 0, 2: 1}
    assert supports.is_whole()


# ---- steps that leave and come -----------------------------------------------------------------------------


def test_removed_threat_gives_its_readers_back_to_the_support_before() -> None:
    """To the present or to a step; what made the fact again loses them."""
    plan = number([act("break", adds="x", deletes="f"), act("make", adds="f"), act("use", needs="f", adds="g")])
    supports = Supports({("f",)}, plan, goals_of([("g",)]))
    assert uses(supports) == {0: 0, 1: 1, 2: 1}
    supports.take_needless()
    assert ids(supports.plan) == [2]
    assert supports.links() == causal_links({("f",)}, supports.plan, supports.goals)


def test_removed_maker_leaves_its_readers_to_the_next_or_without() -> None:
    """Even if it is needed: then there is a gap."""
    plan = number([act("make", adds="f"), act("use", needs="f"), act("make", adds="f"), act("use", needs="f")])
    supports = Supports(frozenset(), plan, ())
    assert uses(supports) == {0: 2, 1: 0, 2: 0, 3: 0}
    supports.remove([0])
    assert uses(supports) == {1: 0, 2: 1, 3: 0}
    assert supports.gaps() == (Unsupported(Condition(("f",)), 1),)
    supports.remove([1])
    assert supports.is_whole()


def test_removed_threat_ends_a_gap() -> None:
    """Without the step that breaks it, what was made before is enough."""
    plan = number([act("make", adds="f"), act("break", deletes="f"), act("use", needs="f")])
    supports = Supports(frozenset(), plan, ())
    assert supports.gaps() == (Unsupported(Condition(("f",)), 2),)
    supports.remove([1])
    assert supports.is_whole()
    assert uses(supports) == {0: 1, 2: 0}


def test_step_that_left_is_not_removed_again() -> None:
    """Nothing changes then, not even for the others that are named."""
    supports = tour()
    supports.remove([1])
    with pytest.raises(NoStepError, match="no step 1"):
        supports.remove([0, 1])
    assert ids(supports.plan) == [0, 2, 3]


def test_step_that_was_done_leaves_all_counts_as_they_are() -> None:
    """What it made the present gives now."""
    supports = tour()
    assert supports.advance() == PLAN[0]
    assert uses(supports) == {1: 1, 2: 1, 3: 1}
    assert supports.state == {L1}
    assert supports.links() == causal_links({L1}, PLAN[1:], GOALS)
    assert [supports.advance() for _ in range(3)] == list(PLAN[1:])
    assert supports.is_whole()
    with pytest.raises(NoStepError, match="no step left") as caught:
        supports.advance()
    assert caught.value.step is None


def test_step_that_lacked_something_and_was_done_all_the_same_lacks_nothing_any_more() -> None:
    """What the world allowed the plan need not."""
    supports = Supports(frozenset(), PLAN, GOALS)
    assert supports.lacking() == [0]
    supports.advance()
    assert supports.is_whole()


def test_steps_in_front_change_what_those_behind_find() -> None:
    """They bridge a gap, and one of them that serves nothing is needless."""
    supports = Supports({L1}, PLAN, GOALS)
    new = number([act("wave", adds="waved"), move(L1, HUB)], first=7)
    supports.prepend(new)
    assert supports.plan == (*new, *PLAN)
    assert supports.state == {L1}
    assert supports.is_whole()
    assert uses(supports) == {7: 0, 8: 1, 0: 1, 1: 1, 2: 1, 3: 1}
    assert [supports.timeline.steps[place].id for place in supports.take_needless()] == [7]


def test_step_in_front_may_break_the_plan_and_lack_something_itself() -> None:
    """It is said of each."""
    supports = tour()
    supports.prepend(number([act("slam", needs="door", adds="shut")], first=7))
    assert supports.gaps() == causal_links({HUB}, supports.plan, GOALS).unsupported
    assert [gap.consumer for gap in supports.gaps()] == [7, 0, 2, 3]


def test_any_number_of_steps_can_be_put_in_front() -> None:
    """One by one or together."""
    supports = tour()
    plan = PLAN
    for i in range(40):
        new = number([act("push", adds="f"), act("pull", needs="f", deletes="f")], first=10 + 2 * i)
        supports.prepend(new)
        plan = (*new, *plan)
    assert supports.plan == plan
    assert supports.links() == causal_links({HUB}, plan, GOALS)
    assert supports.advance() == plan[0]


def test_suspects_are_steps_that_lost_a_use_or_end_what_would_hold_without_them() -> None:
    """Each is named once; those without any use are needless rather."""
    plan = number([act("make", adds="f"), act("use", needs="f"), act("use", needs="f"), act("end", deletes="f")])
    supports = Supports(frozenset(), plan, goals_of([("f",)]))
    supports.remove([1])
    assert supports.suspects() == [0]
    assert supports.suspects() == []
    supports.flip(("g",), True)
    supports.flip(("f",), True)
    assert supports.suspects() == []
    ending = Supports(frozenset(), number([act("end", deletes="f"), act("make", adds="f")]), goals_of([("f",)]))
    ending.flip(("f",), True)
    assert ending.suspects() == [0]


# ---- marks -------------------------------------------------------------------------------------------------


def test_all_since_a_mark_is_taken_back() -> None:
    """Flips, steps that left, were done or came in front, and what was to be looked at."""
    supports = Supports({HUB}, (*PLAN, *number([act("wave")], first=5)), GOALS)
    before = supports.links(), supports.plan, supports.state
    mark = supports.mark()
    supports.flip(("dark",), True)
    supports.flip(L2, None)
    supports.prepend(number([move(L1, HUB)], first=7))
    supports.advance()
    supports.take_needless()
    supports.undo(mark)
    assert (supports.links(), supports.plan, supports.state) == before
    assert supports.is_whole()
    assert [supports.timeline.steps[place].id for place in supports.take_needless()] == [5]


def test_marks_nest() -> None:
    """To go back to the outer one takes the inner one with it."""
    supports = tour()
    outer = supports.mark()
    supports.flip(L2, True)
    inner = supports.mark()
    supports.take_needless()
    supports.undo(inner)
    assert supports.plan == PLAN
    last = supports.mark()
    supports.take_needless()
    supports.undo(outer)
    assert (supports.plan, supports.state) == (PLAN, frozenset({HUB}))
    for used in (inner, last, outer):
        with pytest.raises(MarkError) as caught:
            supports.undo(used)
        assert caught.value.mark is used


def test_what_is_kept_goes_with_an_outer_mark_only() -> None:
    """Without one it stays."""
    supports = tour()
    outer = supports.mark()
    inner = supports.mark()
    supports.advance()
    supports.keep(inner)
    assert supports.plan == PLAN[1:]
    supports.undo(outer)
    assert supports.plan == PLAN
    only = supports.mark()
    supports.advance()
    supports.keep(only)
    with pytest.raises(MarkError):
        supports.keep(only)
    assert supports.plan == PLAN[1:]
