"""An executive's memory is plain data, and every step is accounted for."""

import json
from dataclasses import fields, replace

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.plan import number
from clo_fleet.clo.state import ExecutiveState, Tally
from clo_fleet.clo.task import Action, Condition

HERE, THERE, SHUT = ("at-robot", "l1"), ("at-robot", "l2"), ("shut", "l2")
MOVE = Action(
    schema="move",
    args=("l1", "l2"),
    needs=(Condition(HERE), Condition(SHUT, positive=False)),
    adds=frozenset({THERE}),
    deletes=frozenset({HERE}),
    cost=35,
)
FULL = ExecutiveState(
    beliefs={HERE, SHUT},
    goals=(Condition(THERE), Condition(SHUT, positive=False)),
    begun=True,
    satisfied=True,
    cancelling=True,
    running=7,
    outcome="stuck",
    waiting="for a handover to end",
    plan=list(number([MOVE, MOVE], first=7)),
    suspended={8},
    promised=frozenset({THERE}),
    offers={3: (Condition(HERE), Condition(SHUT, positive=False)), 1: ()},
    question=frozenset({HERE}),
    news={SHUT: Cause("r2", "close(l2)", 41), HERE: None},
    attempts={"move(l1, l2)": 2},
    unsolvable=frozenset(),
    unknown={("open", "l3")},
    asked=(Condition(HERE),),
    part=(Condition(SHUT),),
    meanwhile={7},
    planner_deaths=1,
    relapses=4,
    next_step=9,
    tally=Tally(planned=2, plans=1, planner_calls=1),
)
EMPTY = ExecutiveState(beliefs=set(), goals=())


def test_memory_survives_being_written_as_json() -> None:
    """Full or empty, every field of it, in the same order."""
    for memory in (FULL, EMPTY):
        restored = ExecutiveState.from_state(json.loads(json.dumps(memory.state())))
        assert restored == memory
        assert list(restored.offers) == list(memory.offers)
        assert list(restored.news) == list(memory.news)


def test_every_field_is_saved() -> None:
    """So that a new one is not forgotten: the full memory differs from the empty one in each."""
    names = {field.name for field in fields(ExecutiveState)}
    assert FULL.state().keys() == names
    assert all(getattr(FULL, name) != getattr(EMPTY, name) for name in names)


def test_what_is_saved_does_not_depend_on_the_order_of_sets() -> None:
    """Two executives that remember the same save the same bytes."""
    other = replace(FULL, beliefs={SHUT, HERE}, suspended=set(FULL.suspended))
    assert json.dumps(other.state()) == json.dumps(FULL.state())


def test_restored_memory_shares_nothing_with_what_was_saved() -> None:
    """Going on with one does not change the other."""
    saved = FULL.state()
    before = json.dumps(saved)
    restored = ExecutiveState.from_state(saved)
    restored.plan.clear()
    restored.beliefs.clear()
    restored.attempts["wait()"] = 1
    restored.suspended.clear()
    assert json.dumps(saved) == before


def test_tally_adds_up_only_if_every_step_is_accounted_for() -> None:
    """What came in is what went, and what is still to be done."""
    assert Tally().adds_up
    assert Tally(
        planned=3, planned_again=2, added=1, executed=1, dropped=1, cancelled=1, failed=1, superseded=1, pending=1
    ).adds_up
    assert not Tally(planned=1).adds_up
    assert not Tally(executed=1).adds_up


def test_tally_counts_what_becomes_of_steps() -> None:
    """Each count by itself; what is not named stays."""
    counted = Tally(executed=1).plus(executed=1, dropped=2, cancelled=3, failed=4, added=5, planner_calls=6)
    assert counted == Tally(executed=2, dropped=2, cancelled=3, failed=4, added=5, planner_calls=6)
    assert counted.plus() == counted


def test_tally_tells_the_first_plan_from_later_ones() -> None:
    """Both count as plans; what a later one replaces is superseded."""
    tally = Tally().with_plan(3, 0, first=True).with_plan(2, 3, first=False)
    assert tally == Tally(planned=3, planned_again=2, superseded=3, plans=2)
    assert replace(tally, pending=2).adds_up
