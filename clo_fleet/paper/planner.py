"""Fast Downward, called from the process that runs an episode. Importing this takes seconds: it is for workers.

A call is interrupted by an alarm, wherever it is. All that it started stays in this process's group and is ended by a
signal to the group, which this process itself ignores: whoever ends the group ends the planner too.
"""

import contextlib
import math
import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from clo_fleet.clo.messages import PlanFailure
from clo_fleet.errors import CloFleetError
from clo_fleet.paper.calls import Called, Route
from clo_fleet.paper.settings import problem_text
from clo_fleet.planning.fast_downward import Call, Finished, solve, solve_text
from clo_fleet.planning.planner import Answer, PlanFound, Verdict, reply_to
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import Domain

__all__ = ["FastDownward", "NotLeaderError"]

MEMORY_LIMIT = 8 << 30  # bytes: DIALOG p-40 with a thousand people takes three
_SEARCH_TIME = re.compile(r"Total time: ([0-9.]+)s")
_FAILURES = {
    Verdict.NO_PLAN: PlanFailure.NO_PLAN,
    Verdict.NO_PLAN_PROVEN: PlanFailure.NO_PLAN,
    Verdict.OUT_OF_TIME: PlanFailure.OUT_OF_TIME,
    Verdict.OUT_OF_MEMORY: PlanFailure.OUT_OF_MEMORY,
    Verdict.DIED: PlanFailure.DIED,
}


class NotLeaderError(CloFleetError):
    """This process leads no group of its own: to end its planner would end others too.

    Attributes:
        group: the group that it is in.
    """

    def __init__(self, group: int) -> None:
        super().__init__(f"a process that plans for the paper's study must lead its group; it is in group {group}")
        self.group = group


class _TimeIsUp(BaseException):
    """The alarm rang. No library on the way may take it for an error of its own."""


@dataclass(slots=True)
class FastDownward:
    """Fast Downward for one domain, called on one route.

    Attributes:
        domain: of all tasks.
        route: how it is called.
        directory: for the files that are exchanged.

    Raises:
        NotLeaderError: if the process does not lead a process group of its own.
    """

    domain: Domain
    route: Route
    directory: Path
    _log: str = field(default="", init=False)

    def __post_init__(self) -> None:
        if os.getpgrp() != os.getpid():
            raise NotLeaderError(os.getpgrp())

    def call(self, task: PlanningTask, seconds: float) -> Called:
        """What Fast Downward answers within ``seconds``."""
        self._log = ""
        start = time.perf_counter()
        try:
            with _alarm(seconds):
                answer = self._answer(task, math.ceil(seconds) + 1)
        except _TimeIsUp:
            _end_planner()
            answer = Answer(verdict=Verdict.OUT_OF_TIME)
        except MemoryError:  # in the translator
            answer = Answer(verdict=Verdict.OUT_OF_MEMORY)
        wall = time.perf_counter() - start
        searched = _SEARCH_TIME.findall(self._log)
        reply = reply_to(task, self.domain, answer)
        return Called(
            actions=reply.actions if isinstance(reply, PlanFound) else None,
            failure=_FAILURES.get(answer.verdict),
            expansions=answer.expansions or 0,
            wall=wall,
            wall_search=float(searched[-1]) if searched else 0.0,
        )

    def _answer(self, task: PlanningTask, cpu_limit: int) -> Answer:
        call = Call(run=self._run, directory=self.directory, cpu_limit=cpu_limit, memory_limit=MEMORY_LIMIT)
        if self.route is Route.UNIFIED_PLANNING:
            return solve(self.domain, task, call)
        return solve_text(self.domain.text, problem_text(task, self.domain.name), call)

    def _run(self, command: Sequence[str]) -> Finished:
        with subprocess.Popen(
            command, cwd=self.directory, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        ) as child:
            try:
                said, _ = child.communicate()
            except _TimeIsUp:
                _end_planner()  # or else we would wait for its end on the way out
                raise
        self._log = said.decode(errors="replace")
        return Finished(self._log, child.returncode)


@contextlib.contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    """Raises ``_TimeIsUp`` inside the block after so many seconds."""

    def ring(*_: object) -> None:
        raise _TimeIsUp

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _end_planner() -> None:
    """Ends all of this process's group but this process."""
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.killpg(0, signal.SIGTERM)
    signal.signal(signal.SIGTERM, before)
