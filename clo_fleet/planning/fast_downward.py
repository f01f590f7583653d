"""Fast Downward, called through unified-planning. Runs in a planner's process only: the import takes seconds.

| here              | unified-planning                    |
|-------------------|-------------------------------------|
| predicate         | Boolean `Fluent`                    |
| cost function     | integer `Fluent`                    |
| `Schema`          | `InstantaneousAction`               |
| `Schema.cost`     | `MinimizeActionCosts`               |
| `PlanningTask`    | `Problem`                           |
| step              | `ActionInstance`                    |

Each call gets a fresh `Environment`: expressions are numbered in the order in which an environment first sees them, and
nothing that an earlier call left behind may reach a plan.
"""

import contextlib
import gc
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fast_downward.translate import main as translator  # type: ignore[import-untyped]  # ships no types
from fast_downward.translate import options as translator_options
from unified_planning.engines.results import LogLevel, LogMessage, PlanGenerationResult, PlanGenerationResultStatus
from unified_planning.environment import Environment
from unified_planning.io import PDDLWriter
from unified_planning.model import Fluent, InstantaneousAction, Object, Parameter, Problem
from unified_planning.model.metrics import MinimizeActionCosts
from up_fast_downward import FastDownwardPDDLPlanner
from up_fast_downward.downward.driver.aliases import ALIASES
from up_fast_downward.downward.driver.util import BUILDS_DIR

from clo_fleet.clo.task import Condition, Fact
from clo_fleet.planning.planner import Answer, Verdict
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import EQUALS, OBJECT, Domain, Schema

__all__ = ["Call", "Finished", "solve", "solve_text"]

ALIAS = "lama-first"
_ENGINE = "fast-downward"
_EXHAUSTED = "Completely explored state space"
_NO_MEMORY = "MemoryError"
_EXPANDED = re.compile(r"\b(?:Expanded (\d+) state|(\d+) expanded\b)")
_VERDICTS = {
    PlanGenerationResultStatus.SOLVED_SATISFICING: Verdict.PLAN,
    PlanGenerationResultStatus.SOLVED_OPTIMALLY: Verdict.PLAN,
    PlanGenerationResultStatus.UNSOLVABLE_PROVEN: Verdict.NO_PLAN_PROVEN,
    PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY: Verdict.NO_PLAN,
    PlanGenerationResultStatus.TIMEOUT: Verdict.OUT_OF_TIME,
    PlanGenerationResultStatus.MEMOUT: Verdict.OUT_OF_MEMORY,
}
_SEARCH_VERDICTS = {  # exit codes of the search itself, https://www.fast-downward.org/ExitCodes
    0: Verdict.PLAN,
    10: Verdict.NO_PLAN_PROVEN,
    11: Verdict.NO_PLAN_PROVEN,
    12: Verdict.NO_PLAN,
    22: Verdict.OUT_OF_MEMORY,
    23: Verdict.OUT_OF_TIME,
    24: Verdict.OUT_OF_MEMORY,
    None: Verdict.OUT_OF_TIME,
}


@dataclass(frozen=True, slots=True)
class Finished:
    """How a command ended: what it printed, and its exit code (``None``: it was stopped at the time limit)."""

    log: str
    exit_code: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """How to call Fast Downward.

    Attributes:
        run: runs a command to its end, or to the time limit.
        directory: an own directory for the files that are exchanged.
        cpu_limit: seconds of processor time, for a search that nobody watches any more.
        memory_limit: bytes.
    """

    run: Callable[[Sequence[str]], Finished]
    directory: Path
    cpu_limit: int
    memory_limit: int


def solve(domain: Domain, task: PlanningTask, call: Call) -> Answer:
    """What Fast Downward answers to a task that fits the domain."""
    environment = Environment()
    environment.credits_stream = None
    environment.error_used_name = False  # a PDDL type and an action may share a name, as `place` does
    environment.factory.add_engine(_ENGINE, __name__, LimitedFastDownward.__name__)
    problem = _Translation(environment, domain, task).problem
    with environment.factory.OneshotPlanner(name=_ENGINE, params={"call": call}) as planner:
        planner.skip_checks = True  # the kinds it declares lack integer fluents, which it takes as costs
        result = planner.solve(problem)
    log = "".join(message.message for message in result.log_messages)
    verdict = _VERDICTS.get(result.status, Verdict.DIED)
    if verdict is Verdict.NO_PLAN and _EXHAUSTED in log:
        verdict = Verdict.NO_PLAN_PROVEN  # without axioms the heuristics of lama-first only cut what is dead
    if verdict is Verdict.DIED and _NO_MEMORY in log:
        verdict = Verdict.OUT_OF_MEMORY  # the translator does not always get as far as saying so itself
    expanded = _EXPANDED.findall(log)
    return Answer(
        verdict=verdict,
        steps=tuple(_step(instance) for instance in result.plan.actions) if result.plan else (),
        expansions=int(max(expanded[-1])) if expanded else None,
        reason=_last_words(log) if verdict is Verdict.DIED else "",
    )


class LimitedFastDownward(FastDownwardPDDLPlanner):  # type: ignore[misc]  # ships no types
    """Fast Downward with limits, run by us.

    unified-planning starts the planner in a session of its own, where the search outlives whoever asked for it, and in
    the current directory, where two planners overwrite each other's files. Hence the own `_solve`.
    """

    def __init__(self, call: Call) -> None:
        super().__init__(fast_downward_alias=ALIAS)
        self._call = call

    def _base_cmd(self, plan_filename: str) -> list[str]:
        command: list[str] = super()._base_cmd(plan_filename)
        command += ["--overall-time-limit", f"{self._call.cpu_limit}s"]
        command += ["--overall-memory-limit", f"{self._call.memory_limit // 1024}k"]
        return command

    def _solve(self, problem: Any, *_: object) -> Any:  # heuristic, time-out and stream are not ours to use
        directory = self._call.directory
        names = [str(directory / name) for name in ("domain.pddl", "problem.pddl", "plan")]
        writer = PDDLWriter(problem, self._needs_requirements)
        writer.write_domain(names[0])
        writer.write_problem(names[1])
        Path(names[2]).unlink(missing_ok=True)
        finished = self._call.run([str(word) for word in self._get_cmd(*names)])
        plan = None
        if finished.exit_code is None:
            status = PlanGenerationResultStatus.TIMEOUT
        else:
            if finished.exit_code == 0:
                plan = self._plan_from_file(problem, names[2], writer.get_item_named)
            status = self._result_status(problem, plan, finished.exit_code)
        messages = [LogMessage(LogLevel.INFO, finished.log)]
        return PlanGenerationResult(status, plan, self.name, log_messages=messages)


class _Translation:
    """Builds the unified-planning problem of a task."""

    def __init__(self, environment: Any, domain: Domain, task: PlanningTask) -> None:
        self._environment = environment
        self._expressions = environment.expression_manager
        self._types = {OBJECT: environment.type_manager.UserType(OBJECT)}
        self._parents = dict(domain.types)
        boolean = environment.type_manager.BoolType()
        self.problem = Problem("task", environment, initial_defaults={boolean: self._expressions.FALSE()})
        self._fluents = {name: self._fluent(name, types, boolean) for name, types in domain.predicates}
        integer = environment.type_manager.IntType()
        self._functions = {name: self._fluent(name, types, integer) for name, types in domain.functions}
        names = [*domain.constants, *((name, type_) for type_, group in task.objects for name in group)]
        self._objects = {name: Object(name, self._type(type_), environment) for name, type_ in names}
        self.problem.add_objects(self._objects.values())
        constants = {name: self._expressions.ObjectExp(object_) for name, object_ in self._objects.items()}
        costs = {}
        for schema in domain.schemas:
            action = self._action(schema, constants)
            self.problem.add_action(action)
            terms = {**constants, **_parameters(schema, action)}
            costs[action] = (
                self._expressions.Int(schema.cost)
                if isinstance(schema.cost, int)
                else self._atom(schema.cost, terms, self._functions)
            )
        self.problem.add_quality_metric(MinimizeActionCosts(costs, environment=environment))
        for fact in sorted(task.facts):
            self.problem.set_initial_value(self._atom(fact, constants, self._fluents), True)
        for term, cost in task.costs:
            self.problem.set_initial_value(self._atom(term, constants, self._functions), cost)
        for goal in task.goals:
            self.problem.add_goal(self._atom(goal, constants, self._fluents))

    def _type(self, name: str) -> Any:
        if name not in self._types:
            parent = self._parents[name]
            father = None if parent == OBJECT else self._type(parent)
            self._types[name] = self._environment.type_manager.UserType(name, father)
        return self._types[name]

    def _fluent(self, name: str, types: tuple[str, ...], value_type: Any) -> Any:
        parameters = [Parameter(f"x{i}", self._type(type_), self._environment) for i, type_ in enumerate(types)]
        fluent = Fluent(name, value_type, parameters, self._environment)
        self.problem.add_fluent(fluent)
        return fluent

    def _action(self, schema: Schema, constants: Mapping[str, Any]) -> Any:
        variables = {variable.lstrip("?"): self._type(type_) for variable, type_ in schema.parameters}
        action = InstantaneousAction(schema.name, variables, self._environment)
        terms = {**constants, **_parameters(schema, action)}
        for need in schema.needs:
            action.add_precondition(self._condition(need, terms))
        for atom in schema.adds:
            action.add_effect(self._atom(atom, terms, self._fluents), True)
        for atom in schema.deletes:
            if atom not in schema.adds:
                action.add_effect(self._atom(atom, terms, self._fluents), False)
        return action

    def _condition(self, need: Condition, terms: Mapping[str, Any]) -> Any:
        if need.fact[0] == EQUALS:
            expression = self._expressions.Equals(*(terms[term] for term in need.fact[1:]))
        else:
            expression = self._atom(need.fact, terms, self._fluents)
        return expression if need.positive else self._expressions.Not(expression)

    def _atom(self, atom: Fact, terms: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
        return self._expressions.FluentExp(fluents[atom[0]], [terms[term] for term in atom[1:]])


def _parameters(schema: Schema, action: Any) -> dict[str, Any]:
    return {variable: action.parameter(variable.lstrip("?")) for variable, _ in schema.parameters}


def _step(instance: Any) -> tuple[str, ...]:
    return (instance.action.name, *(argument.object().name for argument in instance.actual_parameters))


def _last_words(log: str) -> str:
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    return "Fast Downward failed: " + " | ".join(lines[-5:])


def solve_text(domain: str, problem: str, call: Call) -> Answer:
    """What Fast Downward answers to PDDL texts, the quickest way: translated in this process, no driver between.

    The translator heeds none of the call's limits: who calls has to interrupt it.
    """
    names = [str(call.directory / name) for name in ("domain.pddl", "problem.pddl", "output.sas", "plan")]
    Path(names[0]).write_text(domain, encoding="utf-8")
    Path(names[1]).write_text(problem, encoding="utf-8")
    Path(names[3]).unlink(missing_ok=True)
    translator_options.set_options([*names[:2], "--sas-file", names[2]])
    gc.disable()  # the translator makes many objects and no cycles: looking for some takes half of its time
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            translator.main()
    finally:
        gc.enable()
    limits = f"ulimit -t {call.cpu_limit} -v {call.memory_limit // 1024}"
    search = [str(BUILDS_DIR / "release" / "bin" / "downward"), *("".join(word.split()) for word in ALIASES[ALIAS])]
    start = f'{limits}; input=$1; shift; exec "$@" <"$input"'
    finished = call.run(["sh", "-c", start, "sh", names[2], *search, "--internal-plan-file", names[3]])
    verdict = _SEARCH_VERDICTS.get(finished.exit_code, Verdict.DIED)
    if verdict is Verdict.NO_PLAN and _EXHAUSTED in finished.log:
        verdict = Verdict.NO_PLAN_PROVEN
    expanded = _EXPANDED.findall(finished.log)
    return Answer(
        verdict=verdict,
        steps=_steps(Path(names[3])) if verdict is Verdict.PLAN else (),
        expansions=int(max(expanded[-1])) if expanded else None,
        reason=_last_words(finished.log) if verdict is Verdict.DIED else "",
    )


def _steps(plan: Path) -> tuple[tuple[str, ...], ...]:
    lines = plan.read_text(encoding="utf-8").splitlines()
    return tuple(tuple(line.strip("()").split()) for line in lines if not line.startswith(";"))
