"""Workers: what becomes of a run that meets a limit, of a worker that dies, and of a crew that is left."""

import os
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.paper.crew import Crew
from clo_fleet.paper.episode import PAPER_LIMITS
from clo_fleet.paper.rows import Run

RUN = Run("rooms", 5, 0.5, "clo", "in-process", 0)


@pytest.mark.parametrize("route", ["in-process", "unified-planning"])
def test_a_run_that_meets_a_limit_is_a_row_with_the_reason(route: str) -> None:
    """The planner is stopped within its call, and the same worker goes on with the next run."""
    late = replace(RUN, domain="dialog", size=40, route=route)
    with Crew(replace(PAPER_LIMITS, call=0.05), size=1) as crew:
        rows = crew.rows([late, replace(late, seed=1)])
        row = next(rows)
        assert row.outcome == "limit of a planner call, 0.05 s"
        assert (row.done, row.planner_calls, row.executed) == (False, 1, 0)
        worker = crew.pids
        assert next(rows).outcome == row.outcome
        assert crew.pids == worker
    with Crew(replace(PAPER_LIMITS, run=0.05), size=1) as crew:
        assert next(crew.rows([late])).outcome == "limit of the run, 0.05 s"


def test_a_worker_that_dies_costs_its_run_alone() -> None:
    """Its run is a row that says so; the other runs are done."""
    victim = replace(RUN, domain="dialog", size=10, strategy="replan", probability=0.1)
    with Crew(PAPER_LIMITS, size=1) as crew:
        rows = crew.rows([RUN, victim, replace(RUN, seed=1)])
        assert next(rows).done
        assert crew.under_way == (victim,)
        (pid,) = crew.pids
        os.kill(pid, signal.SIGKILL)
        died, last = rows
    assert died.run == victim
    assert died.outcome == "its process was killed by SIGKILL"
    assert last.done


def test_nothing_is_left_of_a_crew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither processes nor files, also when it is left in the middle of a run."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    with Crew(PAPER_LIMITS) as crew:
        rows = crew.rows([RUN, replace(RUN, domain="dialog", size=10, strategy="replan")])
        next(rows)
        groups = crew.pids
        assert len(list(tmp_path.iterdir())) == 2
    assert list(tmp_path.iterdir()) == []
    for group in groups:
        while alive(group):  # killed, but not reaped yet
            pass


def alive(group: int) -> bool:
    """Whether there is a process in the group."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
