"""How long a decision takes, against the quickest way to plan again. Run with ``make bench``.

The paper's ROOMS, half way through its plan, when another robot hands an object over. Planning again is Fast Downward's
``lama-first`` with the translator in this process, so that a call costs the start of one process, its search's; what
such a start costs alone is measured apart. Nothing is asserted about times.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path
from statistics import median

import pytest

from clo_fleet.clo.deletion import delete
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import goals_of, number
from clo_fleet.clo.repair import repair
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import apply
from clo_fleet.paper.rooms import Rooms
from clo_fleet.paper.settings import problem_text
from clo_fleet.planning.fast_downward import Call, Finished, solve_text
from clo_fleet.planning.planner import Verdict
from clo_fleet.planning.problem import PlanningTask

pytestmark = [
    pytest.mark.bench,
    pytest.mark.timeout(600),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),  # the translator closes no files
]

SIZES = (5, 10, 20, 40)
CALLS = 5


def planned(task: PlanningTask, directory: Path) -> tuple[tuple[str, ...], ...]:
    """The plan that Fast Downward finds."""
    answer = solve_text(
        Rooms().domain().text,
        problem_text(task, "rooms"),
        Call(run=run, directory=directory, cpu_limit=60, memory_limit=2 << 30),
    )
    assert answer.verdict is Verdict.PLAN
    return answer.steps


def run(command: Sequence[str]) -> Finished:
    """Run the search."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return Finished(done.stdout, done.returncode)


def milliseconds(action: Callable[[], object], times: int) -> float:
    """The median of so many calls."""
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        action()
        taken.append(time.perf_counter() - start)
    return 1000 * median(taken)


def row(size: int, directory: Path) -> tuple[str, ...]:
    """One problem, half done: the times [ms], and how many repairs one call of the planner is worth."""
    domain, task = Rooms().domain(), Rooms().task(size)
    actions = tuple(domain.ground(step[0], step[1:], {}) for step in planned(task, directory))
    half = len(actions) // 2
    before = reduce(apply, actions[:half], task.facts)
    rest, goals = number(actions[half:]), goals_of(task.goals)
    item, room = next((fact[1], fact[2]) for fact in sorted(before) if fact[0] == "at-object")
    changed = {("holding", item): True, ("at-object", item, room): False}
    now = before ^ changed.keys()
    operators = Operators(dict.fromkeys(actions), goals)
    supports = Supports(before, rest, goals)

    def kept() -> None:
        mark = supports.mark()
        delete(supports, changed)
        supports.undo(mark)

    costs = (
        milliseconds(kept, 200),
        milliseconds(lambda: repair(now, rest, goals, changed=changed), 50),
        milliseconds(lambda: repair(now, rest, goals, changed=changed, operators=operators, improve=True), 50),
        milliseconds(lambda: planned(replace(task, facts=now), directory), CALLS),
        milliseconds(lambda: run(["sh", "-c", "exec true"]), CALLS),
    )
    return f"p-{size:02}", str(len(rest)), *(f"{cost:.3f}" for cost in costs), f"{costs[3] / costs[1]:.0f}"


def test_decisions_against_planning_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A table: milliseconds of a repair in its forms, of planning again, and their ratio."""
    titles = (
        "rooms",
        "steps left",
        "kept supports",
        "repair",
        "repair, improve",
        "plan again",
        "of it a start",
        "ratio",
    )
    rows = [titles, *(row(size, tmp_path) for size in SIZES)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    with capsys.disabled():
        sys.stdout.write("\n".join(["", *("  ".join(map(str.rjust, row, widths)) for row in rows), ""]))
