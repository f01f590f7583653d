"""A plan by Fast Downward, called at once and waited for, for one problem of unified-planning.

A fleet has a pool of planners for that (``pool``), for one domain, in processes that stay. This is for a single
question about any problem.
"""

import math
import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from unified_planning.engines.results import PlanGenerationResultStatus

from clo_fleet.planning.fast_downward import Call, Finished, LimitedFastDownward
from clo_fleet.planning.planner import Answer, Verdict

__all__ = ["Limits", "first_plan", "run"]

LAST_WORDS = 500  # characters of the planner's log that make the reason
_VERDICTS = {
    PlanGenerationResultStatus.UNSOLVABLE_PROVEN: Verdict.NO_PLAN_PROVEN,
    PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY: Verdict.NO_PLAN,
    PlanGenerationResultStatus.TIMEOUT: Verdict.OUT_OF_TIME,
    PlanGenerationResultStatus.MEMOUT: Verdict.OUT_OF_MEMORY,
}


@dataclass(frozen=True, slots=True)
class Limits:
    """What a call of the planner may take: real time [s], and memory in bytes."""

    seconds: float = 60.0
    memory: int = 2 << 30


def first_plan(problem: Any, limits: Limits) -> Answer:
    """What Fast Downward (``lama-first``) answers to a ``unified_planning.model.Problem``."""
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="clo-fleet-plan-") as name:
        directory = Path(name)
        call = Call(
            run=partial(run, directory=directory, deadline=start + limits.seconds),
            directory=directory,
            cpu_limit=math.ceil(limits.seconds) + 1,
            memory_limit=limits.memory,
        )
        planner = LimitedFastDownward(call)
        planner.skip_checks = True  # the kinds it declares lack numbers, which it takes as costs
        result = planner.solve(problem)
    log = "".join(message.message for message in result.log_messages)
    verdict = Verdict.PLAN if result.plan is not None else _VERDICTS.get(result.status, Verdict.DIED)
    return Answer(
        verdict=verdict,
        steps=tuple(map(_step, result.plan.actions)) if result.plan is not None else (),
        reason=log[-LAST_WORDS:].strip() if verdict is Verdict.DIED else "",
        wall_seconds=time.monotonic() - start,
    )


def run(command: Sequence[str], directory: Path, deadline: float) -> Finished:
    """How the command ended, which has until ``deadline`` (monotonic clock).

    It runs in a process group of its own, of which nothing is left afterwards: a timeout that ended Fast Downward's
    driver alone would leave its search running.
    """
    with subprocess.Popen(
        command,
        cwd=directory,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:
        try:
            log, _ = process.communicate(timeout=max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            return Finished("", None)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    return Finished(log.decode(errors="replace"), process.returncode)


def _step(instance: Any) -> tuple[str, ...]:
    return (instance.action.name, *(argument.object().name for argument in instance.actual_parameters))
