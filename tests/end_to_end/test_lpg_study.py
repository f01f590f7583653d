"""A longer study (``make study``): plans that others have broken, repaired by the engine ``clo`` and by LPG.

LPG (Gerevini and Serina) can start from a plan: its option ``-input_plan``. The package ``up-lpg`` brings the program;
the plan repairer in it never passes that option on, so the program is called here. Fast Downward, which plans anew, is
there to compare with. Distances are those of Fox, Gerevini, Long and Serina 2006: the steps that only one plan has.
"""

import os
import re
import resource
import signal
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from random import Random
from statistics import mean, median
from time import perf_counter
from typing import Any

import pytest
from unified_planning.io import PDDLWriter

from clo_fleet.bridges.unified_planning import NAME, register
from clo_fleet.clo.plan import first_fault, number
from clo_fleet.clo.task import Action, apply, unmet
from clo_fleet.planning.grounding import Name
from clo_fleet.planning.pddl_files import problem_of
from clo_fleet.planning.unified import Grounded, ground

IPC = Path(__file__).resolve().parents[3] / "shared" / "pddl"
PROBLEMS = (
    "blocks/probBLOCKS-8-0",
    "blocks/probBLOCKS-10-2",
    "driverlog/p05",
    "driverlog/p13",
    "gripper/prob05",
    "gripper/prob13",
    "logistics00/probLOGISTICS-6-2",
    "logistics00/probLOGISTICS-10-0",
    "miconic/s5-0",
    "rovers/p05",
    "rovers/p13",
)
FOREIGN_ACTIONS = (1, 5)
SURPRISES = 5  # that break a plan, for each problem and number of foreign actions
SECONDS, MEMORY = 20, 2 << 30  # for each call of LPG
WAYS = ("clo", "clo, improve", "lpg", "fast downward")
LPG_STEP = re.compile(r"^[\d.]+:\s*\((.+?)\s*\)\s*\[[\d.]+\]", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Broken:
    """The rest of a plan that does not go through any more."""

    grounded: Grounded
    problem: Any
    state: frozenset[tuple[str, ...]]
    rest: tuple[Action, ...]


@dataclass(frozen=True, slots=True)
class Answer:
    """A plan, or none, and how long that took [s]: of LPG the program alone, of the others the whole call."""

    plan: tuple[Name, ...] | None
    seconds: float


def program() -> Path | None:
    """LPG, if ``up-lpg`` is installed. The package is not imported: it asks for an outdated part of setuptools."""
    package = find_spec("up_lpg")
    return Path(package.origin).with_name("lpg") if package and package.origin else None


LPG = program()


def broken_plans(problem: Any, foreign: int, random: Random) -> Iterator[Broken]:
    """A plan for the problem, carried out to a random place, and then broken by random actions of others."""
    grounded = ground(problem.clone())
    plan = grounded.actions_of((step[0], step[1:]) for step in grounded.plan().steps)
    while True:
        done, state = random.randrange(len(plan)), grounded.task.state
        for action in plan[:done]:
            state = apply(state, action)
        for _ in range(foreign):
            state = apply(state, random.choice([act for act in grounded.task.actions if not unmet(act, state)]))
        if first_fault(state, number(plan[done:]), grounded.task.goals) is None:
            continue
        now = problem.clone()
        for fact in sorted(grounded.task.state ^ state):
            now.set_initial_value(now.fluent(fact[0])(*map(now.object, fact[1:])), fact in state)
        yield Broken(grounded, now, state, plan[done:])


def by_engine(engine: Any, broken: Broken) -> Answer:
    """The plan of a plan repairer of unified-planning."""
    given = broken.grounded.plan_of(broken.rest)
    start = perf_counter()
    result = engine.repair(broken.problem, given)
    seconds = perf_counter() - start
    return Answer(None if result.plan is None else tuple(map(name_of, result.plan.actions)), seconds)


def name_of(instance: Any) -> Name:
    """A step of a plan of unified-planning by name."""
    return instance.action.name, tuple(term.object().name for term in instance.actual_parameters)


def by_fast_downward(broken: Broken) -> Answer:
    """A new plan."""
    found = broken.grounded.plan(broken.state)
    return Answer(tuple((step[0], step[1:]) for step in found.steps) or None, found.wall_seconds)


def by_lpg(broken: Broken, folder: Path) -> Answer:
    """The plan that LPG makes of the broken one; nothing of LPG is left running."""
    writer = PDDLWriter(broken.problem.clone())
    writer.write_domain(str(folder / "domain.pddl"))
    writer.write_problem(str(folder / "problem.pddl"))
    steps = [
        f"{place}: ({' '.join(map(writer.get_pddl_name, (step.action, *objects_of(step))))}) [1]"
        for place, step in enumerate(broken.grounded.plan_of(broken.rest).actions)
    ]
    (folder / "input.plan").write_text("\n".join(steps) + "\n", encoding="utf-8")
    solution = folder / "output_1.SOL"
    solution.unlink(missing_ok=True)
    files = ("-o", "domain.pddl", "-f", "problem.pddl", "-input_plan", "input.plan", "-out", "output")
    start = perf_counter()
    with subprocess.Popen(
        [str(LPG), *files, "-n", "1", "-seed", "1", "-cputime", str(SECONDS)],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=limited,
    ) as process:
        with suppress(subprocess.TimeoutExpired):
            process.wait(SECONDS)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    seconds = perf_counter() - start
    if not solution.exists():
        return Answer(None, seconds)
    plan = []
    for step in LPG_STEP.findall(solution.read_text(encoding="utf-8")):
        action, *things = map(writer.get_item_named, step.lower().split())
        plan.append((str(action.name), tuple(str(thing.name) for thing in things)))
    return Answer(tuple(plan), seconds)


def objects_of(instance: Any) -> list[Any]:
    """The objects that a step is about."""
    return [term.object() for term in instance.actual_parameters]


def limited() -> None:
    """Run in the child, before LPG: so much time and memory, and no more."""
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def checked(broken: Broken, answer: Answer) -> Answer:
    """The answer, but no plan if the plan does not go through."""
    if answer.plan is None:
        return answer
    steps = number(broken.grounded.actions_of(answer.plan, broken.state))
    fault = first_fault(broken.state, steps, broken.grounded.task.goals)
    return answer if fault is None else Answer(None, answer.seconds)


def distance(broken: Broken, plan: Sequence[Name]) -> int:
    """How many steps only one of the plans has."""
    before, after = Counter(name for act in broken.rest if (name := broken.grounded.original(act))), Counter(plan)
    return (before - after).total() + (after - before).total()


@pytest.mark.study
@pytest.mark.skipif(LPG is None, reason="up-lpg is not installed (pip install up-lpg)")
@pytest.mark.skipif(not IPC.is_dir(), reason=f"no IPC domains in {IPC}")
def test_clo_repairs_what_lpg_repairs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nearly all broken plans are repaired, each to a plan that goes through. Prints the table."""
    for foreign in FOREIGN_ACTIONS:
        table: list[tuple[Broken, dict[str, Answer]]] = []
        for name in PROBLEMS:
            problem = problem_of(IPC / name.split("/")[0] / "domain.pddl", IPC / f"{name}.pddl")
            problem.environment.credits_stream = None
            register(problem.environment)
            factory = problem.environment.factory
            plain = factory.PlanRepairer(name=NAME)
            improving = factory.PlanRepairer(name=NAME, params={"improve": True})
            ways: tuple[Callable[[Broken], Answer], ...] = (
                partial(by_engine, plain),
                partial(by_engine, improving),
                partial(by_lpg, folder=tmp_path),
                by_fast_downward,
            )
            plans = broken_plans(problem, foreign, Random(name))
            for _ in range(SURPRISES):
                broken = next(plans)
                table.append((broken, {way: checked(broken, ask(broken)) for way, ask in zip(WAYS, ways, strict=True)}))
        with capsys.disabled():
            show(foreign, table)
        for way in WAYS[:2]:
            assert sum(answers[way].plan is not None for _, answers in table) >= 0.9 * len(table)


def show(foreign: int, table: Sequence[tuple[Broken, dict[str, Answer]]]) -> None:
    """Prints what each way has done; lengths and distances where all ways have a plan."""
    common = [(broken, answers) for broken, answers in table if all(answer.plan for answer in answers.values())]
    rest = mean(len(broken.rest) for broken, _ in common)
    print(f"\n{len(table)} plans broken by {foreign} foreign action(s); {len(common)} repaired in every way, ", end="")
    print(f"{rest:.1f} steps long before")
    print(f"{'':14} repaired  length  distance  median ms  95% ms")
    for way in WAYS:
        share = mean(answers[way].plan is not None for _, answers in table)
        length = mean(len(answers[way].plan or ()) for _, answers in common)
        apart = mean(distance(broken, answers[way].plan or ()) for broken, answers in common)
        times = sorted(1000 * answers[way].seconds for _, answers in table)
        late = times[int(0.95 * len(times))]
        print(f"{way:14} {share:8.0%} {length:7.1f} {apart:9.1f} {median(times):10.1f} {late:7.0f}")
