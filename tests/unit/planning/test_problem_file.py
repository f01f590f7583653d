"""The reader of PDDL problems."""

import pytest

from clo_fleet.planning.problem import PlanningTaskError
from clo_fleet.planning.problem_file import read_problem
from clo_fleet.world.pddl import read_domain

LAMPS = """(define (domain lamps)
  (:types lamp)
  (:predicates (on ?l - lamp) (near ?a ?b - lamp))
  (:action light :parameters (?l ?from - lamp) :precondition (and (on ?from) (near ?from ?l)) :effect (on ?l)))"""
THREE = "(define (problem three) (:domain lamps) (:objects a B c - lamp) (:init (on a) (near a b)) (:goal (on b)))"


def test_a_problem_becomes_a_task() -> None:
    """Objects, facts and goals of a PDDL problem arrive in a planning task."""
    domain = read_domain(LAMPS)
    task = read_problem(THREE, domain)
    assert task.objects == (("lamp", ("a", "b", "c")),)
    assert task.facts == {("on", "a"), ("near", "a", "b")}
    assert task.goals == (("on", "b"),)
    with pytest.raises(PlanningTaskError, match="unknown object d"):
        read_problem(THREE.replace("(on b)", "(on d)"), domain)
