"""Regression: what must hold where a plan is entered, and the last place that a state can enter."""

import pytest

from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.regression import NEVER, entries, regressed, turns
from clo_fleet.clo.task import Action, Condition, Fact


def at(room: str) -> Fact:
    """The robot is in the room."""
    return ("at", room)


def move(start: str, end: str) -> Action:
    """From room to room."""
    return Action(
        schema="move",
        args=(start, end),
        needs=(Condition(at(start)),),
        adds=frozenset({at(end)}),
        deletes=frozenset({at(start)}),
    )


LAMP = Action(schema="light", args=(), needs=(), adds=frozenset({("lit",)}), deletes=frozenset())
CORRIDOR = Operators([move("l1", "l2"), move("l2", "l3"), move("l3", "l2"), LAMP], [Condition(at("l3"))])


def plan(*actions: Action) -> tuple[Operator, ...]:
    """The actions as operators."""
    return tuple(map(CORRIDOR.operator, actions))


def needed(*actions: Action, goals: tuple[Fact, ...]) -> list[set[str] | None]:
    """What must hold at each place; ``None``: whatever holds, the rest cannot be done."""
    masks = regressed(plan(*actions), CORRIDOR.mask(map(Condition, goals)))
    return [None if mask == NEVER else set(map(str, CORRIDOR.conditions(mask))) for mask in masks]


def test_at_each_place_the_steps_ahead_need_what_they_do_not_make() -> None:
    """At the end the goals hold."""
    assert needed(move("l1", "l2"), LAMP, move("l2", "l3"), goals=(at("l3"), ("lit",))) == [
        {"(at l1)"},
        {"(at l2)"},
        {"(at l2)", "(lit)"},
        {"(at l3)", "(lit)"},
    ]


def test_plan_that_undoes_its_goal_can_be_entered_only_behind_that() -> None:
    """No state is good enough before."""
    assert needed(move("l1", "l2"), move("l2", "l3"), move("l3", "l2"), goals=(at("l3"),)) == [
        None,
        None,
        None,
        {"(at l3)"},
    ]


def test_no_state_meets_never() -> None:
    """Not even one in which all conditions hold."""
    everything = (1 << 1000) - 1
    assert NEVER & everything != NEVER
    assert entries((NEVER, NEVER), 0).latest(everything) is None
    assert entries((NEVER,), everything).latest_at_origin() is None


def test_latest_entry_is_found_for_a_state_that_has_gained_something() -> None:
    """The robot was nowhere on its plan."""
    steps = plan(move("l1", "l2"), move("l2", "l3"), move("l3", "l2"))
    found = entries(regressed(steps, CORRIDOR.mask([Condition(at("l2"))])), CORRIDOR.state(frozenset()))
    assert found.latest_at_origin() is None
    assert [found.latest(CORRIDOR.state({at(room)})) for room in ("l1", "l2", "l3")] == [0, 3, 2]
    assert found.latest(CORRIDOR.state({("lit",)})) is None


def test_place_that_is_lacked_twice_is_filed_once() -> None:
    """Under the bit that fewer places lack, also where a bit comes, goes and comes again."""
    found = entries((0b011, 0b001, 0b011, 0b101), origin=0)
    assert found.lacking == {1: (2, 0), 0: (1,), 2: (3,)}
    assert found.key == 0b111
    assert entries((0b10, 0b01), origin=0).latest(0b11) == 1
    assert [found.latest(state) for state in (0b001, 0b011, 0b101, 0b111, 0b110)] == [1, 2, 3, 3, None]


@pytest.mark.parametrize("origin", [0b00, 0b01, 0b11])
def test_what_the_origin_can_enter_is_told_apart(origin: int) -> None:
    """The last of it; other states are told only what they have gained."""
    found = entries((0b00, 0b01, 0b11, 0b10), origin)
    assert found.latest_at_origin() == {0b00: 0, 0b01: 1, 0b11: 3}[origin]
    assert found.latest(0b11) == {0b00: 3, 0b01: 3, 0b11: None}[origin]


def test_turns_add_up_to_what_is_needed() -> None:
    """Gone through from the end."""
    masks = (NEVER, 0b0110, 0b0011, 0b1000)
    held: set[int] = set()
    for mask, (begun, ended) in zip(reversed(masks), reversed(turns(masks)), strict=True):
        held = held - set(ended) | set(begun)
        assert sum(1 << bit for bit in held) == (0 if mask == NEVER else mask)
