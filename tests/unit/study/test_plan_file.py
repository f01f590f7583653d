"""Plans in files, as planners write them."""

from pathlib import Path

import pytest

from clo_fleet.planning.planner import Answer, Verdict
from clo_fleet.planning.unified import Grounded, read
from clo_fleet.study.plan_file import MOST_FAULTS, no_plan_because, read_plan
from clo_fleet.world.faults import FileFaultsError

DOMAIN = """
(define (domain rooms)
  (:requirements :strips :typing :conditional-effects :disjunctive-preconditions)
  (:types room item)
  (:predicates (at-robot ?l - room) (at-object ?o - item ?l - room) (holding ?o - item) (wet) (dry))
  (:action move
    :parameters (?a ?b - room)
    :precondition (at-robot ?a)
    :effect (and (not (at-robot ?a)) (at-robot ?b)))
  (:action grasp
    :parameters (?o - item ?l - room)
    :precondition (and (at-object ?o ?l) (at-robot ?l))
    :effect (and (holding ?o) (not (at-object ?o ?l)) (when (wet) (and (dry) (not (wet)))))))
"""
PROBLEM = """
(define (problem one)
  (:domain rooms)
  (:objects l1 l2 l3 - room o1 - item)
  (:init (at-robot l3) (at-object o1 l1))
  (:goal (or (holding o1) (wet))))
"""


@pytest.fixture(scope="module")
def grounded(tmp_path_factory: pytest.TempPathFactory) -> Grounded:
    """A robot, three rooms, an object, and a goal with two cases."""
    folder = tmp_path_factory.mktemp("pddl")
    (folder / "domain.pddl").write_text(DOMAIN, encoding="utf-8")
    (folder / "problem.pddl").write_text(PROBLEM, encoding="utf-8")
    return read(folder / "domain.pddl", folder / "problem.pddl")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where the plan is."""
    return tmp_path / "one.plan"


def test_plan_is_read_whatever_its_case_and_comments(path: Path, grounded: Grounded) -> None:
    """Comments and empty lines are left out, names are lower-cased; a goal of several cases is noted at the end."""
    path.write_text("; found by hand\n\n  ( MOVE l3  L1 ) ; go\n(grasp o1 l1)\n; cost = 2\n", encoding="utf-8")
    actions = read_plan(path, grounded)
    assert [grounded.original(action) for action in actions] == [
        ("move", ("l3", "l1")),
        ("grasp", ("o1", "l1")),
        None,
    ]


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("(mvoe l3 l1)", ["1:1: step 1: got '(mvoe l3 l1)', expected an action of this problem, one of grasp, move"]),
        ("\n  move l3 l1", ["2:3: step 1: got 'move l3 l1', expected one action such as (move l1 l2)"]),
        ("(move l3 l1) (grasp o1 l1)", ["1:1: step 1: got '(move l3 l1) (grasp o1 l1)', expected one action"]),
        ("(move l3 l9)", ["1:1: step 1: got '(move l3 l9)', expected for l9 one of l1, l2, l3"]),
        ("(move l3)", ["1:1: step 1: got '(move l3)', expected 2 objects after move, not 1"]),
        ("(grasp o1 l3)", ["1:1: step 1: got '(grasp o1 l3)', expected for l3 one of l1"]),
        (
            "(move l3 l1)\n(move l3 l2)\n(grasp o1 l1)",
            ["2:1: step 2: got '(move l3 l2)', expected a step that can be done here: this needs (at-robot l3)"],
        ),
        ("(move l3 l1)", ["1:1: step 2: got 'the end of the plan', expected more steps: the goal needs"]),
        ("", ["1:1: step 1: got 'the end of the plan', expected more steps"]),
        ("(a)\n(b)", ["1:1: step 1: got '(a)', expected an action", "2:1: step 2: got '(b)', expected an action"]),
        ("\x00\xff", ["1:1: step 1: got"]),
    ],
)
def test_fault_is_named_with_its_place_and_what_was_expected(
    path: Path, grounded: Grounded, text: str, faults: list[str]
) -> None:
    """Unknown actions and objects line by line; else the first step that cannot be done, or the end."""
    path.write_text(text, encoding="latin-1")
    with pytest.raises(FileFaultsError) as caught:
        read_plan(path, grounded)
    lines = str(caught.value).splitlines()
    assert len(lines) == len(faults)
    for line, fault in zip(lines, faults, strict=True):
        assert line.startswith(f"{path}:{fault}")


def test_a_file_of_something_else_is_given_up_early(path: Path, grounded: Grounded) -> None:
    """Some faults are enough to see that this is no plan."""
    path.write_text("what is this\n" * 10_000, encoding="utf-8")
    with pytest.raises(FileFaultsError) as caught:
        read_plan(path, grounded)
    assert len(caught.value.faults) == MOST_FAULTS


def test_why_there_is_no_plan_is_said_in_words() -> None:
    """The planner's own words where it died, ours otherwise."""
    assert no_plan_because(Answer(verdict=Verdict.DIED, reason="a fault")) == "a fault"
    said = {no_plan_because(Answer(verdict=verdict)) for verdict in Verdict}
    assert len(said) == len(Verdict)
