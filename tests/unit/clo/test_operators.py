"""Operators: actions, states and conditions as bit sets."""

from collections.abc import Collection

import pytest

from clo_fleet.clo.operators import Operators, bits, run
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact


def yes(text: str) -> Condition:
    """It is true."""
    return Condition(parse_fact(text))


def no(text: str) -> Condition:
    """It is false."""
    return Condition(parse_fact(text), positive=False)


def action(
    name: str, *needs: Condition, adds: Collection[str] = (), deletes: Collection[str] = (), cost: int = 1
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    return Action(
        schema=schema, args=tuple(args), needs=needs, cost=cost,
        adds=frozenset(map(parse_fact, adds)), deletes=frozenset(map(parse_fact, deletes)),
    )  # fmt: skip


def state(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


MOVE = action("move l1 l2", yes("(at l1)"), no("(shut l2)"), adds=["(at l2)"], deletes=["(at l1)"])
BACK = action("move l2 l1", yes("(at l2)"), adds=["(at l1)"], deletes=["(at l2)"], cost=0)
OPEN = action("open l2", deletes=["(shut l2)"], cost=7)
SHUT = action("shut l2", yes("(at l1)"), adds=["(shut l2)"])
ROOMS = Operators([MOVE, BACK, OPEN, SHUT])


def names(operators: Operators, here: int) -> list[str]:
    """What can be done."""
    return [operator.action.name for operator in operators.applicable(here)]


def test_what_needs_nothing_comes_first_then_what_the_state_allows() -> None:
    """The order is always the same; a shut door keeps the robot out."""
    assert names(ROOMS, ROOMS.state(state("(at l1)"))) == ["open(l2)", "shut(l2)", "move(l1, l2)"]
    assert names(ROOMS, ROOMS.state(state("(at l1)", "(shut l2)"))) == ["open(l2)", "shut(l2)"]


def test_unknown_fact_meets_no_condition() -> None:
    """Nobody knows whether the door is shut: the robot does not rely on its being open."""
    here = ROOMS.state(state("(at l1)"), unknown=state("(shut l2)", "(dark l2)"))
    assert names(ROOMS, here) == ["open(l2)", "shut(l2)"]
    assert set(ROOMS.conditions(here)) == {yes("(at l1)")}


def test_after_an_action_it_is_known_what_it_changes() -> None:
    """Opening the door makes it open, whatever it was."""
    here = ROOMS.state(state("(at l1)"), unknown=state("(shut l2)"))
    then = run(here, [ROOMS.operator(OPEN), ROOMS.operator(MOVE)])
    assert then == ROOMS.state(state("(at l2)"))


def test_actions_that_cannot_be_done_in_turn_lead_nowhere() -> None:
    """The robot is not in l2 yet."""
    assert run(ROOMS.state(state("(at l1)")), [ROOMS.operator(BACK)]) is None


def test_every_action_has_a_price() -> None:
    """Also one that costs nothing: otherwise a search could go on for ever."""
    assert [operator.price for operator in ROOMS.all] == [1, 1, 7, 1]
    assert ROOMS.prices == (1, 1, 7, 1)


def test_actions_are_listed_by_what_they_need_and_gain() -> None:
    """By their places."""
    (at_l1,) = bits(ROOMS.mask([yes("(at l1)")]))
    (is_open,) = bits(ROOMS.mask([no("(shut l2)")]))
    assert (ROOMS.consumers[at_l1], ROOMS.achievers[at_l1]) == ([0, 3], [1])
    assert (ROOMS.consumers[is_open], ROOMS.achievers[is_open]) == ([0], [2])
    assert (ROOMS.needs_count, ROOMS.always) == ((2, 1, 0, 1), (2,))


def test_negation_that_nobody_asks_about_has_no_bit() -> None:
    """Unless it is a goal."""
    assert not ROOMS.covers([yes("(at l1)"), no("(at l1)")])
    assert Operators([MOVE], [no("(at l1)")]).covers([no("(at l1)")])
    with pytest.raises(KeyError):
        ROOMS.mask([no("(at l1)")])


def test_only_conditions_with_bits_are_put_into_a_set() -> None:
    """The others are left out."""
    assert ROOMS.covered([yes("(at l1)"), no("(at l1)"), yes("(dark l1)")]) == ROOMS.mask([yes("(at l1)")])


def test_conditions_are_added_to_those_covered() -> None:
    """The same actions then tell them apart; what is covered stays as it is."""
    assert ROOMS.covering([yes("(at l1)"), no("(shut l2)")]) is ROOMS
    more = ROOMS.covering([no("(at l1)"), yes("(dark l1)")])
    assert [operator.action for operator in more.all] == [MOVE, BACK, OPEN, SHUT]
    assert more.covers([yes("(at l1)"), no("(at l1)"), no("(shut l2)"), yes("(dark l1)")])
    then = run(more.state(state("(at l1)")), [more.operator(MOVE)])
    assert then is not None
    assert set(more.conditions(then)) == {yes("(at l2)"), no("(at l1)"), no("(shut l2)")}


def test_action_from_elsewhere_changes_what_has_bits() -> None:
    """What else it changes is nobody's concern; it must not need what nobody speaks of."""
    lit = action("walk l1 l2", yes("(at l1)"), adds=["(at l2)", "(lit l2)"], deletes=["(at l1)", "(lit l1)"])
    then = run(ROOMS.state(state("(at l1)")), [ROOMS.operator(lit)])
    assert then == ROOMS.state(state("(at l2)"))
    with pytest.raises(KeyError):
        ROOMS.operator(action("read", yes("(lit l1)")))


def test_operator_of_a_given_action_is_not_made_twice() -> None:
    """Another action of the same name is another operator."""
    assert ROOMS.operator(MOVE) is ROOMS.all[0]
    other = action("move l1 l2", yes("(at l1)"))
    assert ROOMS.operator(other).action is other


def test_operators_are_found_by_name() -> None:
    """There may be none."""
    assert ROOMS.named("move", ("l2", "l1")) is ROOMS.all[1]
    assert ROOMS.named("move", ("l1", "l1")) is None


def test_objects_of_a_parameter_are_sorted() -> None:
    """Over all actions of the schema, however many parameters they have."""
    operators = Operators([action("go b a"), action("go a c"), action("go d")])
    assert operators.objects("go", 0) == ("a", "b", "d")
    assert operators.objects("go", 1) == ("a", "c")
    assert operators.objects("go", 2) == ()


def test_conditions_about_an_object_name_it() -> None:
    """As an argument, not as a predicate; the second time they are remembered."""
    for _ in range(2):
        assert set(ROOMS.conditions(ROOMS.about("l2"))) == {yes("(at l2)"), yes("(shut l2)"), no("(shut l2)")}
    assert ROOMS.about("at") == 0
