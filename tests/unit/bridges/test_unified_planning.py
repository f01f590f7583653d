"""The engine ``clo`` does for users of unified-planning what an engine should, and refuses what it cannot do."""

import io
import subprocess
import sys
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest
from unified_planning import shortcuts as up
from unified_planning.engines import OperationMode, SequentialPlanValidator
from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.environment import Environment, get_environment
from unified_planning.exceptions import (
    UPNoRequestedEngineAvailableException,
    UPNoSuitableEngineAvailableException,
    UPUsageError,
)
from unified_planning.io import PDDLReader
from unified_planning.plans import ActionInstance, PlanKind, SequentialPlan
from unified_planning.test.examples import get_example_problems

from clo_fleet.bridges.unified_planning import NAME, register
from clo_fleet.bridges.unified_planning.engine import CloRepairer, UnsupportedError
from clo_fleet.bridges.unified_planning.groundings import Groundings
from clo_fleet.bridges.unified_planning.question import ForeignPlanError
from clo_fleet.clo.task import apply, unmet
from clo_fleet.errors import CloFleetError
from clo_fleet.planning import pddl_files
from clo_fleet.planning.unified import ground

ROOMS = """
(define (domain rooms)
  (:requirements :strips :typing :action-costs)
  (:types room thing)
  (:predicates (at ?r - room) (door ?a ?b - room) (lies ?o - thing ?r - room) (prepared ?o - thing) (held ?o - thing))
  (:functions (total-cost) - number)
  (:action go :parameters (?a ?b - room)
    :precondition (and (at ?a) (door ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (total-cost) 5)))
  (:action prepare :parameters (?o - thing ?r - room)
    :precondition (and (at ?r) (lies ?o ?r))
    :effect (and (prepared ?o) (increase (total-cost) 2)))
  (:action grasp :parameters (?o - thing ?r - room)
    :precondition (and (at ?r) (lies ?o ?r) (prepared ?o))
    :effect (and (not (lies ?o ?r)) (held ?o) (increase (total-cost) 1))))
"""

# Four rooms in a row, from west to east, and one without a door. The robot starts in the west.
TWO_THINGS = """
(define (problem two-things)
  (:domain rooms)
  (:objects west hall study east cellar - room cup book - thing)
  (:init (at west) (lies cup hall) (lies book east) (= (total-cost) 0)
    (door west hall) (door hall west) (door hall study) (door study hall) (door study east) (door east study))
  (:goal (and (held cup) (held book)))
  (:metric minimize (total-cost)))
"""
FETCH_BOTH = [
    "go west hall",
    "prepare cup hall",
    "grasp cup hall",
    "go hall study",
    "go study east",
    "prepare book east",
    "grasp book east",
]


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine is where the shortcuts look for it, and no credits are printed."""
    monkeypatch.setattr(get_environment(), "credits_stream", None)
    register()


def problem_of(domain: str = ROOMS, problem: str = TWO_THINGS, environment: Environment | None = None) -> Any:
    """The problem that the texts say."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reader uses what its own library calls outdated
        return PDDLReader(environment).parse_problem_string(domain, problem)


def plan_of(problem: Any, steps: list[str]) -> Any:
    """The steps, each written as an action and its objects, as a plan for the problem."""
    instances = []
    for step in steps:
        action, *objects = step.split()
        instances.append(ActionInstance(problem.action(action), [problem.object(name) for name in objects]))
    return SequentialPlan(instances, problem.environment)


def text_of(plan: Any) -> list[str]:
    """The plan as ``plan_of`` takes it."""
    return [" ".join((step.action.name, *map(str, step.actual_parameters))) for step in plan.actions]


def holds(problem: Any, fact: str, value: bool = True) -> None:
    """Make a fact true, or false, in the present."""
    fluent, *objects = fact.split()
    problem.set_initial_value(problem.fluent(fluent)(*map(problem.object, objects)), value)


def valid(problem: Any, plan: Any) -> bool:
    """Whether unified-planning's own validator finds the plan valid."""
    return bool(SequentialPlanValidator().validate(problem.clone(), plan))


def repaired(problem: Any, steps: list[str], **params: Any) -> Any:
    """What a new engine with these parameters answers."""
    with up.PlanRepairer(name=NAME, params=params) as repairer:
        return repairer.repair(problem, plan_of(problem, steps))


# ---- being an engine -------------------------------------------------------------------------------------------


def test_importing_the_bridge_imports_no_unified_planning() -> None:
    """Whoever does not register pays nothing."""
    code = "import sys, clo_fleet.bridges.unified_planning; print('unified_planning' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_registering_twice_changes_nothing() -> None:
    """The second call finds the engine there; another environment knows nothing of it until it is told."""
    environment = Environment()
    assert NAME not in environment.factory.engines
    register(environment)
    before = list(environment.factory.preference_list)
    register(environment)
    assert environment.factory.preference_list == before
    assert environment.factory.engine(NAME) is CloRepairer


def test_it_is_found_by_the_kinds_of_problem_and_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who asks for any plan repairer gets this one, if none that can do it comes first in the list of preferences."""
    problem, factory = problem_of(), get_environment().factory
    monkeypatch.setattr(factory, "preference_list", ["fast-downward", NAME])
    found = factory.get_all_applicable_engines(
        problem.kind,
        OperationMode.PLAN_REPAIRER,
        plan_kind=PlanKind.SEQUENTIAL_PLAN,
        optimality_guarantee="SATISFICING",
    )
    assert found == [NAME]
    with up.PlanRepairer(problem_kind=problem.kind, plan_kind="SEQUENTIAL_PLAN") as repairer:
        assert isinstance(repairer, CloRepairer)
        assert repairer.repair(problem, plan_of(problem, FETCH_BOTH)).status is Status.SOLVED_SATISFICING


def test_credits_name_the_idea_and_its_licence(monkeypatch: pytest.MonkeyPatch) -> None:
    """unified-planning prints whom to thank, as of any engine."""
    printed = io.StringIO()
    monkeypatch.setattr(get_environment(), "credits_stream", printed)
    with up.PlanRepairer(name=NAME):
        pass
    assert "Engine name: clo" in printed.getvalue()
    CloRepairer.get_credits().write_credits(printed, full_credits=True)
    assert "Borrajo and Veloso" in printed.getvalue()
    assert "Apache-2.0" in printed.getvalue()


# ---- repairing -------------------------------------------------------------------------------------------------


def test_a_plan_that_works_is_returned_as_it_is() -> None:
    """Nothing changed: the same steps, the very same objects."""
    problem = problem_of()
    plan = plan_of(problem, FETCH_BOTH)
    with up.PlanRepairer(name=NAME) as repairer:
        result = repairer.repair(problem, plan)
    assert result.status is Status.SOLVED_SATISFICING
    assert [id(step) for step in result.plan.actions] == [id(step) for step in plan.actions]
    assert result.engine_name == NAME
    assert result.metrics["means"] == "deletion"


def test_steps_that_somebody_else_has_done_are_dropped() -> None:
    """The book is in the robot's hand already: neither the way nor the work is left, and the log says so."""
    problem = problem_of()
    holds(problem, "held book")
    holds(problem, "lies book east", False)
    result = repaired(problem, FETCH_BOTH)
    assert text_of(result.plan) == FETCH_BOTH[:3]
    assert {key: result.metrics[key] for key in ("steps_kept", "steps_dropped", "steps_added")} == {
        "steps_kept": "3",
        "steps_dropped": "4",
        "steps_added": "0",
    }
    assert "dropped go(hall, study): nothing that is left needs it" in [m.message for m in result.log_messages]


def test_a_broken_plan_is_mended_with_new_steps() -> None:
    """The cup lies elsewhere: what is new in the plan is counted and logged, and the validator is content."""
    problem = problem_of()
    holds(problem, "lies cup hall", False)
    holds(problem, "lies cup study")
    result = repaired(problem, FETCH_BOTH)
    assert result.status is Status.SOLVED_SATISFICING
    assert valid(problem, result.plan)
    kept, dropped, added = (int(result.metrics[f"steps_{what}"]) for what in ("kept", "dropped", "added"))
    assert kept + dropped == len(FETCH_BOTH)
    assert kept + added == len(result.plan.actions)
    assert added == 2
    assert "added grasp(cup, study)" in [m.message for m in result.log_messages]


def test_metrics_are_strings() -> None:
    """As unified-planning's type for them says."""
    metrics = repaired(problem_of(), FETCH_BOTH).metrics
    assert {"means", "effort", "touched_conditions", "milliseconds", "grounding"} <= metrics.keys()
    assert {type(value) for value in metrics.values()} == {str}


def test_a_step_that_can_never_be_done_again_is_dropped() -> None:
    """A step out of reach from now on is no error: the robot is past it."""
    problem = problem_of()
    holds(problem, "lies cup hall", False)
    holds(problem, "held cup")
    result = repaired(problem, FETCH_BOTH)
    assert text_of(result.plan) == ["go west hall", *FETCH_BOTH[3:]]
    assert any("prepare(cup, hall): it can never be done" in message.message for message in result.log_messages)


def test_an_empty_plan_will_do() -> None:
    """Then all that is needed is new; it belongs to no environment in particular."""
    problem = problem_of()
    with up.PlanRepairer(name=NAME) as repairer:
        result = repairer.repair(problem, SequentialPlan([]))
    assert valid(problem, result.plan)
    assert result.metrics["steps_added"] == "7"


def test_goals_that_hold_need_no_steps() -> None:
    """The plan is empty, and solved."""
    problem = problem_of()
    problem.clear_goals()
    holds(problem, "held cup")
    problem.add_goal(problem.fluent("held")(problem.object("cup")))
    result = repaired(problem, FETCH_BOTH)
    assert result.status is Status.SOLVED_SATISFICING
    assert result.plan.actions == []


CORRIDOR = """
(define (problem corridor)
  (:domain rooms)
  (:objects west hall study east - room book - thing)
  (:init (at west) (lies book east) (= (total-cost) 0)
    (door west hall) (door hall study) (door study east) (door west east))
  (:goal (held book))
  (:metric minimize (total-cost)))
"""


def test_improve_takes_a_shorter_way_that_was_not_planned() -> None:
    """The long way works and is kept; with ``improve`` the door from west to east is used."""
    problem = problem_of(problem=CORRIDOR)
    long_way = ["go west hall", "go hall study", "go study east", "prepare book east", "grasp book east"]
    assert text_of(repaired(problem, long_way).plan) == long_way
    assert text_of(repaired(problem, long_way, improve=True).plan) == ["go west east", *long_way[3:]]


# ---- refusing --------------------------------------------------------------------------------------------------


def test_what_is_out_of_reach_is_proven_unsolvable() -> None:
    """The cup lies in a room without a door, and no fallback is troubled with that."""
    problem = problem_of()
    holds(problem, "lies cup hall", False)
    holds(problem, "lies cup cellar")
    result = repaired(problem, FETCH_BOTH, fallback="fast-downward")
    assert result.status is Status.UNSOLVABLE_PROVEN
    assert result.plan is None
    assert "fallback" not in result.metrics
    assert any("hold for the goal" in message.message for message in result.log_messages)


def tower(discs: int, environment: Environment | None = None) -> Any:
    """The towers of Hanoi: short to say, and too long a way for a repair."""
    sizes = [f"d{number}" for number in range(discs)]
    pegs = ["p0", "p1", "p2"]
    fits = [f"(fits {small} {big})" for i, small in enumerate(sizes) for big in sizes[i + 1 :] + pegs]
    stack = [f"(on {upper} {lower})" for upper, lower in pairwise(sizes)]
    return problem_of(
        """(define (domain hanoi) (:requirements :strips :typing) (:types disc - thing)
          (:predicates (on ?d - disc ?t - thing) (clear ?t - thing) (fits ?d - disc ?t - thing))
          (:action shift :parameters (?d - disc ?a ?b - thing)
            :precondition (and (on ?d ?a) (clear ?d) (clear ?b) (fits ?d ?b))
            :effect (and (not (on ?d ?a)) (on ?d ?b) (clear ?a) (not (clear ?b)))))""",
        f"""(define (problem tower) (:domain hanoi) (:objects {" ".join(sizes)} - disc {" ".join(pegs)} - thing)
          (:init {" ".join(fits + stack)} (on {sizes[-1]} p0) (clear d0) (clear p1) (clear p2))
          (:goal (and {" ".join(stack)} (on {sizes[-1]} p2))))""",
        environment,
    )


def test_a_search_at_the_end_of_its_budget_proves_nothing() -> None:
    """The status says that the engine is incomplete; the metrics say why it gave up."""
    result = repaired(tower(10), [])
    assert result.status is Status.UNSOLVABLE_INCOMPLETELY
    assert "budget" in result.metrics["refused"]


def test_the_fallback_plans_where_the_repair_is_refused() -> None:
    """The metrics say that, the steps are counted as ever, and the plan is valid."""
    problem = tower(10)
    result = repaired(problem, ["shift d0 d1 p1"], fallback="fast-downward", timeout=60)
    assert result.status is Status.SOLVED_SATISFICING
    assert valid(problem, result.plan)
    assert result.engine_name == NAME
    assert (result.metrics["means"], result.metrics["fallback"]) == ("planner", "fast-downward")
    assert any("refused" in key for key in result.metrics)
    assert int(result.metrics["steps_kept"]) + int(result.metrics["steps_added"]) == len(result.plan.actions)


def test_no_time_left_for_the_fallback_is_a_timeout() -> None:
    """The planner is not even started."""
    result = repaired(tower(10), [], fallback="fast-downward", timeout=0.01)
    assert result.status is Status.TIMEOUT
    assert result.plan is None


def test_what_the_fallback_says_instead_of_a_plan_is_passed_on() -> None:
    """Its parameters are passed on as well: here it may look for plans of no step only."""
    params = {"fast_downward_search_config": "astar(blind(),bound=1)"}
    result = repaired(tower(10), [], fallback="fast-downward", fallback_params=params)
    assert result.status is Status.UNSOLVABLE_INCOMPLETELY
    assert result.metrics["fallback"] == "fast-downward"
    assert any("Planner time" in message.message for message in result.log_messages)


def test_an_unknown_fallback_is_named_at_once() -> None:
    """Not only on the day when it is needed."""
    with pytest.raises(UPNoRequestedEngineAvailableException, match="no engine nobody"):
        repaired(problem_of(), FETCH_BOTH, fallback="nobody")


def numeric() -> Any:
    """A problem with a battery."""
    problem = problem_of()
    battery = problem.add_fluent("battery", up.IntType(), default_initial_value=9)
    problem.action("go").add_precondition(up.GE(battery, 1))
    problem.action("go").add_decrease_effect(battery, 1)
    return problem


def test_unsupported_features_are_named_although_the_engine_was_asked_for_by_name() -> None:
    """unified-planning itself would only warn."""
    problem = numeric()
    with pytest.raises(UPUsageError, match="DECREASE_EFFECTS, INT_FLUENTS") as caught:
        repaired(problem, FETCH_BOTH)
    assert isinstance(caught.value, UnsupportedError)
    assert isinstance(caught.value, CloFleetError)
    assert "INT_FLUENTS" in caught.value.what


def test_unsupported_features_are_no_match_when_asked_for_by_kind() -> None:
    """unified-planning says itself that it has no engine."""
    with pytest.raises(UPNoSuitableEngineAvailableException):
        up.PlanRepairer(problem_kind=numeric().kind, plan_kind=PlanKind.SEQUENTIAL_PLAN)


def test_skipping_the_checks_does_not_make_numbers_work() -> None:
    """What has no ground form is refused in any case."""
    problem = numeric()
    with up.PlanRepairer(name=NAME) as repairer:
        repairer.skip_checks = True
        with pytest.raises(UnsupportedError, match="battery"):
            repairer.repair(problem, plan_of(problem, FETCH_BOTH))


def test_plans_of_other_kinds_are_refused() -> None:
    """A partial order has to be made a sequence first."""
    problem = problem_of()
    partial = plan_of(problem, FETCH_BOTH).convert_to(PlanKind.PARTIAL_ORDER_PLAN, problem)
    with up.PlanRepairer(name=NAME) as repairer, pytest.raises(UnsupportedError, match="PARTIAL_ORDER_PLAN"):
        repairer.repair(problem, partial)


def test_optimal_plans_are_not_promised() -> None:
    """Asked for by kind it is no match; asked for by name it refuses."""
    with (
        up.PlanRepairer(name=NAME, optimality_guarantee="SOLVED_OPTIMALLY") as repairer,
        pytest.raises(UnsupportedError, match="optimal"),
    ):
        repairer.repair(problem_of(), SequentialPlan([]))
    assert not CloRepairer.satisfies(up.OptimalityGuarantee.SOLVED_OPTIMALLY)


def test_a_plan_of_another_environment_is_refused() -> None:
    """Its actions and objects are not those of the problem, whatever their names."""
    plan = plan_of(tower(2, Environment()), ["shift d0 d1 p1"])
    with up.PlanRepairer(name=NAME) as repairer, pytest.raises(ForeignPlanError, match="another environment"):
        repairer.repair(tower(2), plan)


def without_prepare() -> Any:
    """A problem that lacks an action."""
    problem = problem_of()
    actions = [action for action in problem.actions if action.name != "prepare"]
    problem.clear_actions()
    problem.clear_quality_metrics()
    problem.add_actions(actions)
    return problem


def changed_grasp() -> Any:
    """A problem in which an action asks for more."""
    problem = problem_of()
    problem.action("grasp").add_precondition(up.Not(problem.fluent("held")(problem.object("cup"))))
    return problem


@pytest.mark.parametrize(
    ("problem", "why"),
    [
        (without_prepare, "there is no action prepare"),
        (changed_grasp, "the action grasp is another one"),
        (lambda: problem_of(problem=CORRIDOR), "there is no object cup"),
    ],
)
def test_a_plan_for_another_problem_is_refused(problem: Callable[[], Any], why: str) -> None:
    """The first step at fault is named."""
    plan = plan_of(problem_of(), ["go west hall", "prepare cup hall", "grasp cup hall"])
    with up.PlanRepairer(name=NAME) as repairer, pytest.raises(ForeignPlanError, match=why) as caught:
        repairer.repair(problem(), plan)
    assert caught.value.step in ("prepare(cup, hall)", "grasp(cup, hall)")


# ---- what conditions and effects may say ------------------------------------------------------------------------

# Crates go by lift; a light that is on wherever somebody is; a gate that takes crates only if all is locked.
HOUSE = """
(define (domain house)
  (:requirements :adl :typing)
  (:types floor crate - object)
  (:constants cellar attic - floor)
  (:predicates (lift ?f - floor) (on ?c - crate ?f - floor) (in ?c - crate) (heavy ?c - crate) (lit ?f - floor)
    (locked) (done))
  (:action ride :parameters (?from ?to - floor)
    :precondition (and (lift ?from) (not (= ?from ?to)) (or (not (locked)) (exists (?c - crate) (in ?c))))
    :effect (and (lift ?to) (not (lift ?from)) (lit ?to)))
  (:action load :parameters (?c - crate ?f - floor)
    :precondition (and (lift ?f) (on ?c ?f) (not (exists (?o - crate) (and (heavy ?o) (in ?o)))))
    :effect (and (in ?c) (not (on ?c ?f)) (when (heavy ?c) (locked))))
  (:action empty :parameters (?f - floor)
    :precondition (lift ?f)
    :effect (and (not (locked)) (forall (?c - crate) (when (in ?c) (and (on ?c ?f) (not (in ?c)))))))
  (:action finish :parameters ()
    :precondition (forall (?c - crate) (imply (heavy ?c) (on ?c attic)))
    :effect (done)))
"""
MOVING = """
(define (problem moving) (:domain house)
  (:objects ground first - floor big small - crate)
  (:init (lift ground) (on big cellar) (on small first) (heavy big))
  (:goal (and (done) (forall (?c - crate) (not (in ?c))) (or (lit cellar) (on small attic)))))
"""
MOVE = ["ride ground cellar", "load big cellar", "ride cellar attic", "empty attic", "finish"]


@pytest.mark.parametrize(
    ("now", "before"),
    [
        ([], []),
        (["on big attic"], ["on big cellar"]),
        (["in big", "locked"], ["on big cellar"]),
        (["on big first"], ["on big cellar"]),
        (["in small"], ["on small first"]),
        (["lift attic"], ["lift ground"]),
        (["lit cellar", "done"], []),
    ],
)
def test_adl_problems_are_repaired(now: list[str], before: list[str]) -> None:
    """Disjunctions, quantifiers, equality, conditional effects, constants and goals of several cases."""
    problem = problem_of(HOUSE, MOVING)
    for fact in now:
        holds(problem, fact)
    for fact in before:
        holds(problem, fact, False)
    result = repaired(problem, MOVE)
    assert result.status is Status.SOLVED_SATISFICING
    assert valid(problem, result.plan)
    kept, dropped, added = (int(result.metrics[f"steps_{what}"]) for what in ("kept", "dropped", "added"))
    assert (kept + dropped, kept + added) == (len(MOVE), len(result.plan.actions))


@pytest.mark.parametrize("steps", [[], MOVE[:2], MOVE[:-1], MOVE[1:]])
def test_half_a_plan_is_completed(steps: list[str]) -> None:
    """The goal has several cases; the one that the steps come closest to is aimed at, and all of them are kept."""
    problem = problem_of(HOUSE, MOVING)
    result = repaired(problem, steps)
    assert valid(problem, result.plan)
    assert result.metrics["steps_dropped"] == "0"


def test_effects_may_copy_what_is_true_elsewhere() -> None:
    """An assignment of one fluent to another is two effects, each on a condition."""
    problem = up.Problem("signals", initial_defaults={up.BoolType(): False})
    lamp, switch, wired = (problem.add_fluent(name) for name in ("lamp", "switch", "wired"))
    connect, press = up.InstantaneousAction("connect"), up.InstantaneousAction("press")
    connect.add_effect(lamp, switch)
    connect.add_precondition(wired)
    press.add_effect(switch, True)
    problem.add_actions([connect, press])
    problem.set_initial_value(wired, True)
    problem.add_goal(lamp)
    assert "FLUENTS_IN_BOOLEAN_ASSIGNMENTS" in problem.kind.features
    assert text_of(repaired(problem, ["connect"]).plan) == ["press", "connect"]
    problem.set_initial_value(switch, True)
    assert text_of(repaired(problem, ["press", "connect"]).plan) == ["connect"]


def test_the_house_has_all_that_is_declared_about_conditions() -> None:
    """So the tests with it speak for the declaration."""
    kind = problem_of(HOUSE, MOVING).kind
    assert CloRepairer.supports(kind)
    about = {
        "NEGATIVE_CONDITIONS",
        "DISJUNCTIVE_CONDITIONS",
        "EQUALITIES",
        "EXISTENTIAL_CONDITIONS",
        "UNIVERSAL_CONDITIONS",
        "CONDITIONAL_EFFECTS",
        "FORALL_EFFECTS",
    }
    assert about <= kind.features


# ---- remembering groundings ------------------------------------------------------------------------------------


def test_a_grounding_serves_for_other_facts_and_other_goals() -> None:
    """As long as only what actions can change is different, and the goals are plain."""
    problem = problem_of()
    plan = plan_of(problem, FETCH_BOTH)
    with up.PlanRepairer(name=NAME) as repairer:
        assert repairer.repair(problem, plan).metrics["grounding"] == "new"
        holds(problem, "prepared book")
        assert repairer.repair(problem, plan).metrics["grounding"] == "known"
        again = problem_of(problem=TWO_THINGS.replace("(held cup) (held book)", "(held book) (not (held cup))"))
        result = repairer.repair(again, plan_of(again, FETCH_BOTH))
        assert result.metrics["grounding"] == "known"
        assert [step for step in text_of(result.plan) if "cup" in step] == []
        assert valid(again, result.plan)
        repairer.destroy()
        assert repairer.repair(problem, plan).metrics["grounding"] == "new"


def open_cellar(problem: Any) -> None:
    """A static fact."""
    holds(problem, "door hall cellar")


def put_cup_into_cellar(problem: Any) -> None:
    """A fact that could not become true before."""
    holds(problem, "lies cup cellar")


def forbid(problem: Any) -> None:
    """An action, changed in place; unified-planning would not find its cost again."""
    problem.clear_quality_metrics()
    problem.action("grasp").add_precondition(up.Not(problem.fluent("held")(problem.object("cup"))))


def add_vase(problem: Any) -> None:
    """An object."""
    problem.add_object("vase", problem.user_type("thing"))


def wish_for_either(problem: Any) -> None:
    """A goal with two cases."""
    held = problem.fluent("held")
    problem.add_goal(up.Or(held(problem.object("cup")), held(problem.object("book"))))


def charge(problem: Any) -> None:
    """Costs."""
    problem.clear_quality_metrics()
    problem.add_quality_metric(up.MinimizeActionCosts({action: up.Int(7) for action in problem.actions}))


@pytest.mark.parametrize("change", [open_cellar, put_cup_into_cellar, forbid, add_vase, wish_for_either, charge])
def test_what_decides_which_actions_there_are_is_grounded_anew(change: Callable[[Any], None]) -> None:
    """The very same problem, changed between two repairs, is not taken for what it was."""
    problem = problem_of()
    groundings = Groundings()
    first = groundings.of(problem)
    assert groundings.of(problem).known
    change(problem)
    second = groundings.of(problem)
    assert [first.known, second.known] == [False, False]
    assert groundings.of(problem).known


@pytest.mark.parametrize("default", [False, True])
def test_the_present_is_read_alike_whether_grounded_or_known(default: bool) -> None:
    """Initial values may be explicit or by default, true or false: the facts are those of a grounding."""
    spot = up.UserType("spot")
    problem = up.Problem("marks")
    thing = [problem.add_object(f"s{number}", spot) for number in range(3)]
    marked = problem.add_fluent("marked", default_initial_value=default, s=spot)
    seen = problem.add_fluent("seen", s=spot)
    mark = up.InstantaneousAction("mark", s=spot)
    mark.add_precondition(seen(mark.parameter("s")))
    mark.add_effect(marked(mark.parameter("s")), not default)
    mark.add_effect(seen(mark.parameter("s")), False)
    problem.add_action(mark)
    for place, value in zip(thing, (True, False, True), strict=True):
        problem.set_initial_value(seen(place), value)
    problem.set_initial_value(marked(thing[0]), not default)
    problem.set_initial_value(marked(thing[1]), default)
    problem.add_goal(marked(thing[2]) if not default else up.Not(marked(thing[2])))
    groundings = Groundings()
    for _ in range(2):
        present, task = groundings.of(problem), ground(problem.clone()).task
        assert (present.state, present.goals) == (task.state, task.goals)
    assert present.known
    assert repaired(problem, []).metrics["steps_added"] == "1"


# ---- problems that nobody here wrote ---------------------------------------------------------------------------


def test_the_examples_of_unified_planning_are_repaired() -> None:
    """Every classical one: its own plan is left alone, and what is repaired after random changes is valid."""
    random = Random(1)
    examples = {name: e for name, e in get_example_problems().items() if CloRepairer.supports(e.problem.kind)}
    assert len(examples) > 20
    with up.PlanRepairer(name=NAME) as repairer:
        for example in examples.values():
            problem, plan = example.problem, example.valid_plans[0]
            assert repairer.repair(problem, plan).plan == plan
            terms = [term for term in problem.clone().initial_values if term.type.is_bool_type()]
            for _ in range(3):
                now = problem.clone()
                for term in random.choices(sorted(terms, key=str), k=2):
                    now.set_initial_value(term, not problem.initial_value(term).is_true())
                result = repairer.repair(now, plan)
                assert result.status in (Status.SOLVED_SATISFICING, Status.UNSOLVABLE_PROVEN)
                assert result.plan is None or valid(now, result.plan)


IPC = Path(__file__).resolve().parents[4] / "shared" / "pddl"


@pytest.mark.skipif(not IPC.is_dir(), reason=f"no IPC domains in {IPC}")
@pytest.mark.parametrize("name", ["blocks/probBLOCKS-6-2", "driverlog/p01", "miconic-simpleadl/s5-0", "rovers/p01"])
def test_repairs_after_foreign_actions_are_valid(name: str) -> None:
    """Others act at random: what is returned goes through, as unified-planning judges, and most is repaired.

    And a grounding that is remembered has every action that a new one would have.
    """
    domain = IPC / name.split("/")[0] / "domain.pddl"
    problem = pddl_files.problem_of(domain, IPC / f"{name}.pddl")
    grounded = ground(problem.clone())
    actions = grounded.actions_of((step[0], step[1:]) for step in grounded.plan().steps)
    environment = problem.environment
    environment.credits_stream = None
    register(environment)
    random, groundings = Random(1), Groundings()
    statuses = []
    with environment.factory.PlanRepairer(name=NAME) as repairer:
        for _ in range(8):
            done, present = random.randrange(len(actions)), grounded.task.state
            for action in actions[:done]:
                present = apply(present, action)
            for _ in range(3):
                possible = [action for action in grounded.task.actions if not unmet(action, present)]
                present = apply(present, random.choice(possible))
            now = problem.clone()
            for fact in sorted(grounded.task.state ^ present):
                holds(now, " ".join(fact), fact in present)
            remembered = {operator.action for operator in groundings.of(now).operators.all}
            assert remembered.issuperset(ground(now.clone()).task.actions)
            result = repairer.repair(now, grounded.plan_of(actions[done:]))
            statuses.append(result.status)
            if result.plan is not None:
                assert grounded.valid(present, grounded.actions_of_plan(result.plan, present))
    assert statuses.count(Status.SOLVED_SATISFICING) >= 7
