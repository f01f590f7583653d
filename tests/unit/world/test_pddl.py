"""The reader of PDDL."""

import warnings

import pytest

from clo_fleet.world.pddl import fleet_domain, read_domain
from clo_fleet.world.pddl_forms import PddlError

LAMPS = """
; a lamp may be lit only while it is not broken
(define (domain Lamps)
  (:requirements :typing :negative-preconditions :equality)
  (:types lamp - thing hall)
  (:constants hub - hall)
  (:predicates (on ?l - lamp) (broken ?l - thing) (near ?a ?b - lamp))
  (:action LIGHT
    :parameters (?l ?from - lamp)
    :precondition (and (on ?from) (and (not (broken ?l)) (near ?from ?l)) (not (= ?l ?from)))
    :effect (on ?l))
  (:action wait :parameters () :precondition () :effect ()))
"""


def test_a_domain_is_read_in_lower_case_with_its_types_and_signatures() -> None:
    """Names are lower-cased, typed lists are spread, what has no type is an object."""
    domain = read_domain(LAMPS.replace("- thing hall)", "- thing thing hall)"))
    assert domain.name == "lamps"
    assert domain.types == (("lamp", "thing"), ("thing", "object"), ("hall", "object"))
    assert domain.constants == (("hub", "hall"),)
    assert domain.predicates == (("on", ("lamp",)), ("broken", ("thing",)), ("near", ("lamp", "lamp")))
    assert [schema.name for schema in domain.schemas] == ["light", "wait"]
    assert domain.schemas[0].parameters == (("?l", "lamp"), ("?from", "lamp"))


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("(on ?l))\n", "(on ?x))\n", "action light: (on ?x): unknown term ?x"),
        (":effect (on ?l)", ":effect (lit ?l)", "action light: (lit ?l): lit is not declared"),
        (":effect (on ?l)", ":effect (on ?l ?l)", "action light: (on ?l ?l): expected 1 terms, got 2"),
        ("- thing hall", "- lamp hall", "type lamp is its own supertype"),
        ("(:types", "(:derived", "line 5: :derived is not supported"),
        (":effect (on ?l)", ":effect (when (on ?l) (on ?l))", "line 11: (when ...) is not supported here"),
        (":effect (on ?l)", ":effect (increase (total-cost) 1.5)", "line 11: expected a whole number, got 1.5"),
        (":effect ()))", ":effect ())", "line 3: this parenthesis is never closed"),
        (":effect ()))", ":effect ())))", "line 12: a parenthesis is closed that was never opened"),
    ],
)
def test_a_fault_in_a_domain_is_named_with_its_place(old: str, new: str, fault: str) -> None:
    """The error says where and what."""
    text = LAMPS.replace("- thing hall)", "- thing thing hall)")
    text = text.replace(old.replace("- thing hall", "- thing thing hall"), new)
    with pytest.raises(PddlError) as caught:
        read_domain(text)
    assert any(str(found).endswith(fault) for found in caught.value.faults)
    assert all(found.line > 1 and found.column > 0 for found in caught.value.faults)


def test_an_exogenous_predicate_must_be_declared() -> None:
    """A typing error in the set does not go unnoticed."""
    with pytest.raises(PddlError, match="exogenous predicate rain is not declared"):
        read_domain(LAMPS.replace("- thing hall)", "- thing thing hall)"), exogenous={"rain"})


def test_our_reading_of_the_fleet_domain_is_that_of_unified_planning() -> None:
    """Same actions, parameters, preconditions and effects as unified-planning's own reader finds."""
    from unified_planning.environment import Environment
    from unified_planning.io import PDDLReader

    domain = fleet_domain()
    environment = Environment()
    environment.error_used_name = False
    with warnings.catch_warnings(action="ignore"):  # type and action `place` share a name, as they may
        problem = PDDLReader(environment).parse_problem_string(domain.text)

    def written(atom: tuple[str, ...]) -> str:
        terms = ", ".join(term.lstrip("?") for term in atom[1:])
        return f"{atom[0]}({terms})" if terms else atom[0]

    assert [action.name for action in problem.actions] == [schema.name for schema in domain.schemas]
    for action, schema in zip(problem.actions, domain.schemas, strict=True):
        assert [(f"?{p.name}", p.type.name) for p in action.parameters] == list(schema.parameters)
        needs = {str(need) for condition in action.preconditions for need in (condition.args or [condition])}
        effects = [effect for effect in action.effects if effect.fluent.fluent().name != "total-cost"]
        costs = [effect.value for effect in action.effects if effect.fluent.fluent().name == "total-cost"]
        assert len(action.preconditions) == 1
        assert {str(need) for need in action.preconditions[0].args} == {written(n.fact) for n in schema.needs}, needs
        assert {str(e.fluent) for e in effects if e.value.is_true()} == {written(atom) for atom in schema.adds}
        assert {str(e.fluent) for e in effects if e.value.is_false()} == {written(atom) for atom in schema.deletes}
        assert not isinstance(schema.cost, int)
        assert [str(cost) for cost in costs] == [written(schema.cost)]
