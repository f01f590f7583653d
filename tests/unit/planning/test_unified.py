"""PDDL and problems of unified-planning in ground form, judged by unified-planning."""

import random
import warnings
from itertools import product
from pathlib import Path

import pytest
from unified_planning.engines import UPSequentialSimulator
from unified_planning.engines.compilers.grounder import GrounderHelper
from unified_planning.model import Object, UPState
from unified_planning.shortcuts import BoolType, Fluent, InstantaneousAction, IntType, Problem

from clo_fleet.clo.plan import first_fault, number
from clo_fleet.clo.task import Action, Condition, Fact, apply, fact_text, unmet
from clo_fleet.errors import CloFleetError
from clo_fleet.planning import pddl_files
from clo_fleet.planning.environments import as_global
from clo_fleet.planning.first_plan import Limits
from clo_fleet.planning.lifting import UnsupportedProblemError
from clo_fleet.planning.pddl_files import PddlFileError, problem_of
from clo_fleet.planning.planner import Verdict
from clo_fleet.planning.unified import ForeignActionError, Grounded, ground, read

IPC = Path(__file__).resolve().parents[4] / "shared" / "pddl"
needs_ipc = pytest.mark.skipif(not IPC.is_dir(), reason=f"no IPC domains in {IPC}")

YARD = """
(define (domain yard) ; a yard where it may rain
  (:requirements :adl :action-costs)
  (:types place thing - object crate lamp - thing)
  (:constants dock - place)
  (:predicates (at ?t - thing ?p - place) (here ?p - place) (road ?a ?b - place) (lit ?l - lamp) (broken ?l - lamp)
    (packed ?t - thing) (wet ?p - place))
  (:functions (total-cost) - number (length ?a ?b - place) - number)
  (:action drive :parameters (?a ?b - place)
    :precondition (and (here ?a) (or (road ?a ?b) (road ?b ?a)) (not (= ?a ?b)))
    :effect (and (here ?b) (not (here ?a)) (increase (total-cost) (length ?a ?b))))
  (:action pack :parameters (?p - place)
    :precondition (and (here ?p) (exists (?l - lamp) (and (at ?l ?p) (lit ?l))))
    :effect (and (forall (?t - thing) (when (at ?t ?p) (packed ?t))) (increase (total-cost) 3)))
  (:action switch :parameters (?l - lamp)
    :precondition (or (not (broken ?l)) (here dock))
    :effect (and (when (lit ?l) (not (lit ?l))) (when (not (lit ?l)) (lit ?l))))
  (:action storm :parameters ()
    :precondition (forall (?l - lamp) (imply (lit ?l) (packed ?l)))
    :effect (and (forall (?p - place) (when (not (here ?p)) (wet ?p))) (when (here dock) (not (wet dock))))))
"""
YARD_PROBLEM = """
(define (problem small) (:domain yard)
  (:objects gate lawn - place c1 c2 - crate l1 l2 - lamp)
  (:init (here dock) (at c1 lawn) (at c2 gate) (at l1 lawn) (at l2 gate) (broken l2) (wet lawn)
    (road dock gate) (road gate lawn)
    (= (total-cost) 0) (= (length dock gate) 2) (= (length gate dock) 3) (= (length gate lawn) 4)
    (= (length lawn gate) 5))
  (:goal (and (forall (?c - crate) (packed ?c)) (exists (?p - place) (and (here ?p) (not (wet ?p))))))
  (:metric minimize (total-cost)))
"""
# What unified-planning's reader refuses: sections in another order, no parameters, two parameters of one name, a type
# and an action of one name.
ODD = """
(define (domain odd)
  (:predicates (in ?box ?box) (shut))
  (:requirements :strips :typing)
  (:types put)
  (:action put :parameters (?a ?b) :precondition (not (shut)) :effect (in ?a ?b))
  (:action shut :effect (shut)))
"""
ODD_PROBLEM = "(define (problem p) (:domain odd) (:objects x y) (:init) (:goal (and (in x y) (shut))))"


def files(folder: Path, domain: str, problem: str) -> tuple[Path, Path]:
    """The texts as files."""
    paths = folder / "domain.pddl", folder / "problem.pddl"
    for path, text in zip(paths, (domain, problem), strict=True):
        path.write_text(text, encoding="utf-8")
    return paths


@pytest.fixture
def yard(tmp_path: Path) -> Grounded:
    """A problem with quantifiers, disjunctions, conditional effects and costs."""
    return read(*files(tmp_path, YARD, YARD_PROBLEM))


def steps(grounded: Grounded, *names: str) -> tuple[Action, ...]:
    """The actions of a plan written as ``drive dock gate``."""
    return grounded.actions_of((name.split()[0], tuple(name.split()[1:])) for name in names)


def test_an_adl_problem_becomes_plain_actions(yard: Grounded) -> None:
    """Names, static facts and costs of the ground task."""
    assert yard.task.name == "small"
    assert not any(fact[0] in ("road", "at", "broken") for fact in yard.task.state)
    drives = {action.args: action for action in yard.task.actions if action.schema == "drive"}
    assert {args: action.cost for args, action in drives.items()} == {
        ("dock", "gate"): 2,
        ("gate", "dock"): 3,
        ("gate", "lawn"): 4,
        ("lawn", "gate"): 5,
    }
    assert drives["dock", "gate"].needs == (Condition(("here", "dock")),)
    pack = next(action for action in yard.task.actions if action.schema == "pack" and action.args == ("lawn",))
    assert pack.cost == 3
    assert pack.adds == {("packed", "c1"), ("packed", "l1")}
    assert {action.schema for action in yard.task.actions if action.args == ("l1",)} == {"switch/1", "switch/2"}


@pytest.mark.parametrize("seed", range(3))
def test_ground_actions_do_what_unified_planning_says_they_do(yard: Grounded, tmp_path: Path, seed: int) -> None:
    """On a random walk: the same actions are applicable, one variant of each, and lead to the same states."""
    problem = problem_of(*files(tmp_path, YARD, YARD_PROBLEM))
    random_ = random.Random(seed)
    changing = [problem.fluent(name) for name in ("here", "lit", "packed", "wet")]
    expressions = [fluent(*args) for fluent in changing for args in _combinations(problem, fluent)]

    def facts(state: UPState) -> frozenset[Fact]:
        true = (expression for expression in expressions if state.get_value(expression).is_true())
        return frozenset((e.fluent().name, *(arg.object().name for arg in e.args)) for e in true)

    with as_global(problem.environment), warnings.catch_warnings(action="ignore"):
        simulator = UPSequentialSimulator(problem, error_on_failed_checks=False)
        state = simulator.get_initial_state()
        for _ in range(25):
            here = facts(state)
            ours = [action for action in yard.task.actions if yard.original(action) and not unmet(action, here)]
            after = {}
            for action, args in simulator.get_applicable_actions(state):
                successor = simulator.apply(state, action, args)
                after[action.name, tuple(arg.object().name for arg in args)] = successor
            assert {yard.original(action): apply(here, action) - _notes(yard) for action in ours} == {
                name: facts(successor) for name, successor in after.items()
            }
            state = after[random_.choice(sorted(after))]


def test_a_plan_is_judged_by_the_original_problem(yard: Grounded) -> None:
    """A plan that reaches the goals is valid, also from another state; any other is not."""
    plan = steps(
        yard, "drive dock gate", "drive gate lawn", "switch l1", "pack lawn", "drive lawn gate", "drive gate dock"
    )
    plan += steps(yard, "switch l2", "drive dock gate", "pack gate")
    lit = yard.task.state | {("lit", "l2")}
    assert yard.valid(yard.task.state, plan)
    assert yard.valid(yard.task.state | _notes(yard), plan, goals=yard.task.goals)
    assert not yard.valid(yard.task.state, plan[:-1])
    assert not yard.valid(lit, plan)
    assert yard.valid(lit, steps(yard, "drive dock gate", "pack gate"), goals=[Condition(("packed", "c2"))])
    assert not yard.valid(lit, (), goals=[Condition(("wet", "lawn"), positive=False)])
    assert yard.valid(yard.task.state, plan)


def test_plans_are_told_in_the_terms_of_the_problem_and_back(yard: Grounded) -> None:
    """Variants are chosen by the state that is reached by then; the note of the goal is added and left out again."""
    names = [("switch", ("l1",)), ("switch", ("l1",)), ("drive", ("dock", "gate"))]
    actions = yard.actions_of(names)
    assert [action.schema for action in actions[:2]] in (["switch/1", "switch/2"], ["switch/2", "switch/1"])
    assert [yard.original(action) for action in actions] == names
    plan = yard.plan_of(actions)
    assert [str(step) for step in plan.actions] == ["switch(l1)", "switch(l1)", "drive(dock, gate)"]
    assert yard.actions_of_plan(plan) == actions
    with pytest.raises(ForeignActionError, match=r"no reachable action drive\(dock, lawn\)") as caught:
        steps(yard, "drive dock lawn")
    assert caught.value.name == ("drive", ("dock", "lawn"))


def test_fast_downward_plans_for_it(yard: Grounded) -> None:
    """The answer's steps are a valid plan here and there; a state and goals of one's own are taken."""
    answer = yard.plan()
    actions = yard.actions_of((step[0], step[1:]) for step in answer.steps)
    assert answer.verdict is Verdict.PLAN
    assert first_fault(yard.task.state, number(actions), yard.task.goals) is None
    assert yard.valid(yard.task.state, actions)
    nothing = yard.plan(yard.task.state | {("packed", "c1")}, goals=[Condition(("packed", "c1"))])
    assert (nothing.verdict, nothing.steps) == (Verdict.PLAN, ())
    assert yard.plan(limits=Limits(seconds=0.001)).verdict is Verdict.OUT_OF_TIME
    assert yard.plan(yard.task.state - {("here", "dock")}).verdict is Verdict.NO_PLAN_PROVEN


def test_what_unified_planning_refuses_is_written_anew(tmp_path: Path) -> None:
    """Odd order, no parameters, one name for two things: the file is read all the same."""
    grounded = read(*files(tmp_path, ODD, ODD_PROBLEM))
    assert [fact_text(fact) for action in grounded.task.actions for fact in action.adds][:2] == ["(in x x)", "(in x y)"]
    assert grounded.valid(frozenset(), steps(grounded, "put x y", "shut"))


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("(:goal", "(:goal)(:goal", "unified-planning cannot read it"),
        (":parameters (?l - lamp)", ":parameters (?l - lump)", "lump"),
        ("(here ?p) (exists", "(> (length ?p dock) 1) (exists", "action pack: not supported: the condition"),
        ("(increase (total-cost) 3)", "(increase (length ?p ?p) 3)", "not supported: fluents in actions cost"),
        ("(= (length dock gate) 2)", "(= (length dock gate) -2)", "a cost below zero, -2"),
        ("(= (length dock gate) 2)", "", r"the cost \(length dock gate\) has no value"),
    ],
)
def test_what_cannot_be_used_is_refused_with_file_and_reason(tmp_path: Path, old: str, new: str, reason: str) -> None:
    """The error names the file, and what is wrong with it."""
    paths = files(tmp_path, YARD.replace(old, new), YARD_PROBLEM.replace(old, new))
    with pytest.raises(PddlFileError, match=reason) as caught:
        read(*paths)
    assert caught.value.path == paths[1]
    assert isinstance(caught.value, CloFleetError)


def test_durative_actions_are_refused(tmp_path: Path) -> None:
    """Time has no ground form here."""
    domain = ODD.replace("action shut", "durative-action shut :parameters () :duration (= ?duration 2) :condition ()")
    with pytest.raises(PddlFileError, match="the problem: not supported: continuous time"):
        read(*files(tmp_path, domain.replace("(shut)))", "(at end (shut))))"), ODD_PROBLEM))


def test_files_that_cannot_be_read_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Missing, too large, no PDDL, or nested beyond reason."""
    domain, problem = files(tmp_path, YARD, "(" * 100_000)
    with pytest.raises(PddlFileError, match=r"none\.pddl: No such file"):
        read(tmp_path / "none.pddl", problem)
    with pytest.raises(PddlFileError, match=r"problem\.pddl: unified-planning cannot read it"):
        read(domain, problem)
    monkeypatch.setattr(pddl_files, "MOST_BYTES", 99_999)
    with pytest.raises(PddlFileError, match="has more than the 99,999 bytes that are read"):
        read(domain, problem)


def test_a_problem_made_in_memory_becomes_ground() -> None:
    """Without any file, in unified-planning's own environment; numbers that nobody asks for do not matter."""
    here, there, steps_ = Fluent("here"), Fluent("there", BoolType()), Fluent("steps", IntType())
    go = InstantaneousAction("go")
    go.add_precondition(here)
    go.add_effect(there, here)
    go.add_effect(here, False)
    go.add_increase_effect(steps_, 1)
    problem = Problem("two")
    problem.add_fluents([here, there])
    problem.add_fluent(steps_, default_initial_value=0)
    problem.add_action(go)
    problem.set_initial_value(here, True)
    with pytest.raises(UnsupportedProblemError, match="not supported: undefined initial symbolic"):
        ground(problem)
    problem.set_initial_value(there, False)
    problem.add_goal(there)
    grounded = ground(problem)
    assert grounded.task.state == {("here",)}
    (action,) = grounded.task.actions
    assert action.needs == (Condition(("here",)),)
    assert action.adds == {("there",)}
    assert action.deletes == {("here",)}
    assert grounded.valid(grounded.task.state, grounded.task.actions)


@needs_ipc
@pytest.mark.parametrize(
    "problem",
    ["blocks/probBLOCKS-4-0", "gripper/prob01", "miconic/s2-3", "rovers/p01"],
)
def test_the_reachable_actions_are_those_of_unified_planning(problem: str) -> None:
    """Its grounder and a plain fixed point find the same actions as the join does."""
    path = (IPC / problem).with_suffix(".pddl")
    source = problem_of(path.parent / "domain.pddl", path)
    with as_global(source.environment):
        actions = [
            found
            for found in GrounderHelper(source, prune_actions=False).get_grounded_actions()
            if found[2] is not None
        ]
    reached = {atom for atom, value in source.explicit_initial_values.items() if value.is_true()}
    possible: set[tuple[str, tuple[str, ...]]] = set()
    growing = True
    while growing:
        growing = False
        for action, args, bound in actions:
            conditions = [part for need in bound.preconditions for part in (need.args if need.is_and() else [need])]
            positive = [part for part in conditions if part.is_fluent_exp()]
            name = (action.name, tuple(arg.object().name for arg in args))
            if name not in possible and reached.issuperset(positive):
                possible.add(name)
                reached |= {effect.fluent for effect in bound.effects if effect.value.is_true()}
                growing = True
    ours = read(path.parent / "domain.pddl", path)
    assert {(action.schema, action.args) for action in ours.task.actions} == possible


@needs_ipc
@pytest.mark.parametrize("domain", sorted(path.name for path in IPC.iterdir()) if IPC.is_dir() else [])
def test_a_problem_of_each_ipc_domain_is_read(domain: str) -> None:
    """The first problem of each; to ground tidybot takes seconds, so of it only the reading is tried."""
    path = min(path for path in (IPC / domain).glob("*.pddl") if path.name != "domain.pddl")
    if domain == "tidybot":
        assert len(problem_of(path.parent / "domain.pddl", path).actions) == 30
    else:
        assert read(path.parent / "domain.pddl", path).task.actions


def _combinations(problem: Problem, fluent: Fluent) -> list[tuple[Object, ...]]:
    return list(product(*(problem.objects(parameter.type) for parameter in fluent.signature)))


def _notes(grounded: Grounded) -> set[Fact]:
    """The facts that only note that a goal is reached."""
    return {fact for action in grounded.task.actions if grounded.original(action) is None for fact in action.adds}
