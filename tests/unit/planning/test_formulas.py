"""Formulas and their cases."""

from collections.abc import Set
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clo_fleet.clo.task import Fact
from clo_fleet.planning import formulas
from clo_fleet.planning.formulas import (
    FALSE,
    MOST_CASES,
    TRUE,
    AllOf,
    AnyOf,
    Formula,
    Literal,
    Same,
    TooManyCasesError,
    cases,
    negated,
)

RAIN, WIND, FROST = (("rain",), ("wind",), ("frost",))
LEAVES: st.SearchStrategy[Formula] = st.one_of(
    st.builds(Literal, st.sampled_from([RAIN, WIND, FROST]), st.booleans()),
    st.builds(Same, st.just(0), st.sampled_from(["a", "b"]), st.booleans()),
    st.sampled_from([TRUE, FALSE]),
)
FORMULAS: st.SearchStrategy[Formula] = st.recursive(
    LEAVES,
    lambda parts: st.one_of(
        st.builds(AllOf, st.lists(parts, max_size=3).map(tuple)),
        st.builds(AnyOf, st.lists(parts, max_size=3).map(tuple)),
    ),
    max_leaves=12,
)


def truth(formula: Formula, facts: Set[Fact]) -> bool:
    """Whether the formula holds for the argument ``a``: the obvious way."""
    match formula:
        case Literal(atom, positive):
            return (atom in facts) is positive
        case Same(_, right, positive):
            return (right == "a") is positive
        case AllOf(parts):
            return all(truth(part, facts) for part in parts)
        case AnyOf(parts):
            return any(truth(part, facts) for part in parts)


@given(FORMULAS, st.booleans())
def test_the_cases_of_a_formula_hold_together_exactly_where_it_does(formula: Formula, frost: bool) -> None:
    """In every state some case holds if and only if the formula does; static facts are decided beforehand."""
    static = {FROST} if frost else set()
    found = cases(formula, ("a",), {"frost"}, static)
    assert all(FROST not in case for case in found)
    for rain, wind in product([False, True], repeat=2):
        facts = static | ({RAIN} if rain else set()) | ({WIND} if wind else set())
        some = any(all((fact in facts) is value for fact, value in case.items()) for case in found)
        assert some is truth(formula, facts)


@given(FORMULAS)
def test_a_negated_formula_holds_where_the_formula_does_not(formula: Formula) -> None:
    """Signs are moved to the leaves without a change of meaning."""
    for facts in ({RAIN}, {RAIN, WIND}, {FROST}, set()):
        assert truth(negated(formula), facts) is not truth(formula, facts)


def test_too_many_cases_are_refused() -> None:
    """2^13 cases are named as too many before they are made."""
    either = tuple(AnyOf((Literal(("a", str(i))), Literal(("b", str(i))))) for i in range(13))
    with pytest.raises(TooManyCasesError, match="more than 4096 cases") as caught:
        cases(AllOf(either), (), set(), set())
    assert caught.value.limit == MOST_CASES == formulas.MOST_CASES
    with pytest.raises(TooManyCasesError):
        cases(AnyOf(tuple(Literal(("a", str(i))) for i in range(MOST_CASES + 1))), (), set(), set())
