"""Facts that turn true or false by themselves, as somebody writes them down."""

from pathlib import Path

import pytest

from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.task import Action, Condition, FactSyntaxError
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.study.surprise import Surprise, SurpriseError, predicates, read_surprise

GRASP = Action(
    schema="grasp",
    args=("o1", "L1"),
    needs=(Condition(("at-object", "o1", "L1")), Condition(("broken",), positive=False)),
    adds=frozenset({("holding", "o1")}),
    deletes=frozenset({("at-object", "o1", "L1")}),
)
TASK = GroundTask("one", frozenset({("at-object", "o1", "L1")}), goals_of([("holding", "o1")]), (GRASP,))
DECLARED = frozenset({"at-object", "holding", "broken", "room"})


def test_facts_are_read_in_the_spelling_of_the_task() -> None:
    """PDDL knows no upper case; a task may. A fact that no action reaches may turn true all the same."""
    read = read_surprise(["(HOLDING o1)", "(broken)"], ["( at-object O1 l1 )"], TASK, DECLARED)
    assert read == Surprise(frozenset({("holding", "o1"), ("broken",)}), frozenset({("at-object", "o1", "L1")}))
    assert [str(condition) for condition in read.conditions] == [
        "(broken)",
        "(holding o1)",
        "(not (at-object o1 L1))",
    ]
    assert read_surprise(["(holding l1)"], [], TASK).true == {("holding", "L1")}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "(hodling o1)",
            "unknown predicate hodling; expected one of at-object, broken, holding; did you mean holding?",
        ),
        ("(holding o2)", "unknown object o2; expected one of l1, o1"),
        ("(holding o1 l1)", "expected 1 names after holding, got 2"),
        ("(room l1)", "room is static: no action of this problem changes it"),
    ],
)
def test_fact_that_cannot_change_is_refused_with_what_is_known(text: str, says: str) -> None:
    """Predicate, object, number of names, and facts that hold for ever."""
    with pytest.raises(SurpriseError) as caught:
        read_surprise([], [text], TASK, DECLARED)
    assert says in str(caught.value)
    assert caught.value.fact[0] in text


def test_texts_that_are_no_facts_and_contradictions_are_refused() -> None:
    """One parenthesised list of names; not true and false at once."""
    with pytest.raises(FactSyntaxError, match="expected one fact"):
        read_surprise(["holding o1"], [], TASK)
    with pytest.raises(SurpriseError, match="both true and false"):
        read_surprise(["(holding o1)"], ["(HOLDING o1)"], TASK)


def test_predicates_of_a_domain_are_found(tmp_path: Path) -> None:
    """Static ones too, whatever stands around them; none in a file without any."""
    domain = tmp_path / "domain.pddl"
    domain.write_text(
        "(define (domain d) (:types a (either b) - c)\n (:PREDICATES (on ?x ?y - a) ; (off ?x)\n (Lit))\n"
        " (:action light :parameters () :effect (dark)))",
        encoding="utf-8",
    )
    assert predicates(domain) == {"on", "lit"}
    domain.write_text(")(", encoding="utf-8")
    assert predicates(domain) == frozenset()
