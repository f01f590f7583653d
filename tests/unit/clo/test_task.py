"""Facts, conditions and actions mean what PDDL means by them."""

import pytest

from clo_fleet.clo.task import Action, Condition, FactSyntaxError, apply, fact_text, holds, parse_fact, unmet
from clo_fleet.errors import CloFleetError

HERE, THERE, SHUT = ("at-robot", "l1"), ("at-robot", "l2"), ("shut", "d1")
MOVE = Action(
    schema="move",
    args=("l1", "l2"),
    needs=(Condition(SHUT, positive=False), Condition(HERE)),
    adds=frozenset({THERE}),
    deletes=frozenset({HERE}),
)


@pytest.mark.parametrize("text", ["(holding r1 o2)", "(shut)", "(at-robot r_1 l-2)"])
def test_fact_text_and_parse_fact_are_inverse(text: str) -> None:
    """What one writes the other reads."""
    assert fact_text(parse_fact(text)) == text


def test_facts_are_read_as_pddl_reads_them() -> None:
    """Case and blanks do not matter."""
    assert parse_fact("  ( Holding R1\n O2 ) ") == ("holding", "r1", "o2")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "holding r1 o2",
        "(holding r1 o2",
        "holding r1 o2)",
        "()",
        "(not (shut d1))",
        "(a) (b)",
        '(a "b")',
        "(a; b)",
        "(a, b)",
    ],
)
def test_other_texts_are_refused(text: str) -> None:
    """The error says what was given and what was expected."""
    with pytest.raises(FactSyntaxError, match="expected one fact such as") as raised:
        parse_fact(text)
    assert raised.value.text == text
    assert isinstance(raised.value, CloFleetError)


def test_fact_that_is_not_in_the_state_is_false() -> None:
    """The world is closed: a negative condition holds where its fact is missing."""
    assert holds(Condition(HERE), {HERE})
    assert not holds(Condition(THERE), {HERE})
    assert holds(Condition(SHUT, positive=False), {HERE})
    assert not holds(Condition(HERE, positive=False), {HERE})


def test_conditions_are_written_as_in_pddl() -> None:
    """Negative ones in ``not``."""
    assert str(Condition(HERE)) == "(at-robot l1)"
    assert str(Condition(SHUT, positive=False)) == "(not (shut d1))"


def test_unmet_conditions_come_in_their_written_order() -> None:
    """All of them, positive and negative."""
    assert unmet(MOVE, {HERE}) == ()
    assert unmet(MOVE, {SHUT}) == MOVE.needs


def test_applying_an_action_changes_its_effects_only() -> None:
    """Adds are true after it, deletes false, the rest is as it was."""
    assert apply([HERE, SHUT], MOVE) == {THERE, SHUT}


def test_what_an_action_deletes_and_adds_it_adds() -> None:
    """So PDDL wants it; the delete effect is gone from the start."""
    stay = Action(schema="stay", args=(), needs=(), adds=frozenset({HERE}), deletes=frozenset({HERE, THERE}))
    assert stay.deletes == {THERE}
    assert apply({THERE}, stay) == {HERE}


def test_action_is_named_as_one_writes_it() -> None:
    """Schema and objects, whatever it costs."""
    assert (MOVE.name, MOVE.cost) == ("move(l1, l2)", 1)
