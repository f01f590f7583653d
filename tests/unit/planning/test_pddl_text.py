"""PDDL texts in regular form."""

import pytest

from clo_fleet.planning.pddl_text import regular


def test_sections_are_put_in_order_and_the_rest_stays_as_it_is() -> None:
    """Sections come in the order that unified-planning's reader wants; actions stay behind, in theirs."""
    text = "(define (domain D) (:action b :effect (p)) ; why\n (:PREDICATES (p)) (:requirements :strips) (:action a))"
    assert regular(text) == (
        "(define (domain d) (:requirements :strips) (:predicates (p)) "
        "(:action b :parameters () :effect (p)) (:action a :parameters ()))"
    )


def test_parameters_of_a_predicate_get_names_of_their_own() -> None:
    """A predicate with one parameter's name twice keeps its two parameters, and their types."""
    text = "(define (domain d) (:predicates (in ?x ?x - thing) (on ?y)) (:functions (total-cost) - number (w ?z ?z)))"
    assert regular(text) == (
        "(define (domain d) (:predicates (in ?x1 ?x2 - thing) (on ?x1)) (:functions (total-cost) - number (w ?x1 ?x2)))"
    )


@pytest.mark.parametrize("text", ["", "x", "(define", "(define))", "(a) (b)", "(" * 1000 + ")" * 1000])
def test_what_is_no_definition_has_no_regular_form(text: str) -> None:
    """Nothing is made up, and no text, however deep its parentheses, does harm."""
    assert regular(text) is None
