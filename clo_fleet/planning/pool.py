"""Planners in processes of their own, so that a simulation can go on while they search, and survive them.

Theory of operation. A job waits in a queue until a worker has none. A worker that is still importing is given its
first job already, and starts on it without us. Nothing here happens by itself (there are no threads): each call moves
everything on by what the workers have written since, and `result` waits. Which worker plans, and how fast, cannot
change a plan; only the wall limit can, which is a safety net. A worker that ends, or stays silent past the limit, is
killed with its whole process group; its job is answered, and the next job starts a new worker.
"""

import contextlib
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.planning import wire
from clo_fleet.planning.planner import Answer, PlanReply, Verdict, reply_to
from clo_fleet.planning.problem import PlanningTask, check
from clo_fleet.world.schemas import Domain

__all__ = ["KILLED", "JobError", "PlannerPool"]

START_LIMIT = 60.0  # [s] for a worker to import unified-planning: 20 times what it takes on a busy machine
GRACE = 1.0  # [s] past the wall limit, in which a worker may end its planner itself and live
LAST_WORDS = 500  # characters of a dead worker's standard error that make the reason
CHUNK = 1 << 16
ERRORS = "worker.err"
KILLED = "killed"  # the reason, whatever the worker was about


class JobError(CloFleetError):
    """A key names no job where it should, or a job where it should not.

    Attributes:
        key: the key as given.
    """

    def __init__(self, key: str, reason: str) -> None:
        super().__init__(f"planning job {key!r}: {reason}")
        self.key = key


@dataclass(slots=True, eq=False)
class _Worker:
    """A child process. ``job`` is the key of what it works on; ``deadline`` says when to lose patience."""

    process: subprocess.Popen[bytes]
    input: IO[bytes]
    output: IO[bytes]
    directory: Path
    outgoing: bytes
    incoming: bytearray = field(default_factory=bytearray)
    job: str | None = None
    since: float = 0.0
    deadline: float = 0.0
    ready: bool = False


class PlannerPool:
    """Up to ``size`` planner processes for one domain. Use as a context manager, or call ``close``.

    Args:
        domain: the domain of all tasks.
        size: how many processes may plan at once.
        wall_limit: real seconds for each task, from when a worker takes it up.
        memory_limit: bytes for each planner.
    """

    def __init__(self, domain: Domain, *, size: int = 2, wall_limit: float = 60.0, memory_limit: int = 2 << 30) -> None:
        self._domain = domain
        self._size = size
        self._wall_limit = wall_limit
        self._memory_limit = memory_limit
        self._tasks: dict[str, PlanningTask] = {}
        self._queue: deque[str] = deque()
        self._answers: dict[str, Answer] = {}
        self._workers: list[_Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def warm(self) -> None:
        """Starts all workers without waiting for them."""
        while len(self._workers) < self._size:
            self._start()
        self._advance(0.0)

    def submit(self, key: str, task: PlanningTask) -> None:
        """Asks for a plan, to be fetched by ``result`` with the same key.

        Raises:
            JobError: if the key is in use.
            PlanningTaskError: if the task does not fit the domain.
        """
        if key in self._tasks:
            raise JobError(key, "submitted twice")
        check(task, self._domain)
        self._tasks[key] = task
        self._queue.append(key)
        self._advance(0.0)

    def result(self, key: str) -> PlanReply:
        """The reply to the job, waited for; the key is free again.

        Raises:
            JobError: if there is no such job.
        """
        if key not in self._tasks:
            raise JobError(key, "never submitted, or fetched already")
        while key not in self._answers:
            self._advance(None)
        return reply_to(self._tasks.pop(key), self._domain, self._answers.pop(key))

    def plan(self, task: PlanningTask) -> PlanReply:
        """The reply to ``task``, waited for."""
        self.submit("", task)
        return self.result("")

    def kill(self, key: str) -> None:
        """Kills the worker that plans for the job, as a fault would. Its reply is that the planner died, in any case.

        Raises:
            JobError: if there is no such job.
        """
        if key not in self._tasks:
            raise JobError(key, "never submitted, or fetched already")
        worker = next((worker for worker in self._workers if worker.job == key), None)
        if worker is not None:
            self._lose(worker, Verdict.DIED)
        elif key in self._queue:
            self._queue.remove(key)
        wall_seconds = self._answers[key].wall_seconds if key in self._answers else 0.0
        self._answers[key] = Answer(verdict=Verdict.DIED, reason=KILLED, wall_seconds=wall_seconds)

    def kill_one(self) -> None:
        """Kills a worker, a busy one if there is one, as a fault would: the job that it has is answered so."""
        for worker in sorted(self._workers, key=lambda worker: worker.job is None)[:1]:
            os.kill(worker.process.pid, signal.SIGKILL)
            os.waitid(os.P_PID, worker.process.pid, os.WEXITED | os.WNOWAIT)  # dead, but `_end` has yet to wait for it

    def like(self, other: "PlannerPool") -> bool:
        """Whether both plan in the same domain and within the same limits."""
        return all(getattr(self, name) == getattr(other, name) for name in ("_domain", "_wall_limit", "_memory_limit"))

    def close(self) -> None:
        """Ends all workers with all that they started, and forgets all jobs."""
        self._forget(self._workers)

    def forget(self) -> None:
        """Forgets all jobs; workers that have one are ended, and the others stay for whoever asks next."""
        self._forget([worker for worker in self._workers if worker.job is not None])

    def state(self) -> dict[str, object]:
        """The jobs whose results were not fetched: planning them again gives the same."""
        return {"jobs": [[key, wire.task_json(task)] for key, task in self._tasks.items()]}

    def resume(self, state: Mapping[str, object]) -> None:
        """Submits the jobs that ``state`` wrote down."""
        for key, task in wire.jobs_of(state):
            self.submit(key, task)

    def _forget(self, lost: Sequence[_Worker]) -> None:
        for worker in lost:
            _end(worker)
        self._workers = [worker for worker in self._workers if worker not in lost]
        self._tasks.clear()
        self._queue.clear()
        self._answers.clear()

    def _advance(self, patience: float | None) -> None:
        """Moves jobs and answers on. Waits up to ``patience`` [s] (``None``: until something happens)."""
        self._assign()
        busy = [worker for worker in self._workers if worker.job is not None]
        if patience is None and busy:
            patience = max(0.0, min(worker.deadline for worker in busy) - time.monotonic())
        with selectors.DefaultSelector() as selector:
            for worker in self._workers:
                selector.register(worker.output, selectors.EVENT_READ, worker)
                if worker.outgoing:
                    selector.register(worker.input, selectors.EVENT_WRITE, worker)
            news = selector.select(patience)
        for key, events in news:
            if key.data in self._workers:
                (self._read if events & selectors.EVENT_READ else self._write)(key.data)
        heard = [key.data for key, _ in news]  # perhaps half an answer that came in time, while we were away
        now = time.monotonic()
        for worker in busy:
            if worker.job is not None and worker.deadline <= now and worker not in heard:
                self._lose(worker, Verdict.OUT_OF_TIME if worker.ready else Verdict.DIED)
        self._assign()

    def _assign(self) -> None:
        """Gives queued jobs to workers without one, ready ones first, and starts workers while there are too few."""
        while self._queue:
            free = [worker for worker in self._workers if worker.job is None]
            free.sort(key=lambda worker: not worker.ready)
            if not free and len(self._workers) >= self._size:
                return
            worker = free[0] if free else self._start()
            worker.job = self._queue.popleft()
            worker.since = time.monotonic()
            worker.deadline = worker.since + self._wall_limit + GRACE + (0.0 if worker.ready else START_LIMIT)
            worker.outgoing += wire.task_line(self._tasks[worker.job])
            self._write(worker)

    def _start(self) -> _Worker:
        directory = Path(tempfile.mkdtemp(prefix="clo-fleet-planner-"))
        # The child finds the same modules as we do, and hashes as every other worker does.
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        environment = os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": "0", "PYTHONWARNINGS": "ignore"}
        with (directory / ERRORS).open("wb") as errors:
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "clo_fleet.planning.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                bufsize=0,
                env=environment,
                start_new_session=True,
            )
        assert process.stdin is not None
        assert process.stdout is not None
        os.set_blocking(process.stdin.fileno(), False)
        setting = wire.Setting(
            domain=self._domain, wall_limit=self._wall_limit, memory_limit=self._memory_limit, directory=directory
        )
        worker = _Worker(process, process.stdin, process.stdout, directory, wire.setting_line(setting))
        self._workers.append(worker)
        return worker

    def _write(self, worker: _Worker) -> None:
        with contextlib.suppress(BlockingIOError, BrokenPipeError):  # the end of a worker is seen where we read
            while worker.outgoing:
                worker.outgoing = worker.outgoing[os.write(worker.input.fileno(), worker.outgoing) :]

    def _read(self, worker: _Worker) -> None:
        chunk = os.read(worker.output.fileno(), CHUNK)
        if not chunk:
            self._lose(worker, Verdict.DIED)
            return
        worker.incoming += chunk
        while b"\n" in worker.incoming:
            line, _, rest = worker.incoming.partition(b"\n")
            worker.incoming = rest
            if not worker.ready:
                worker.ready = True
                worker.deadline = time.monotonic() + self._wall_limit + GRACE
            elif worker.job is not None:
                self._answers[worker.job] = wire.answer_of(bytes(line))
                worker.job = None

    def _lose(self, worker: _Worker, verdict: Verdict) -> None:
        """Ends a worker and answers its job."""
        self._workers.remove(worker)
        reason = _end(worker)
        if worker.job is not None:
            wall_seconds = time.monotonic() - worker.since
            self._answers[worker.job] = Answer(verdict=verdict, reason=reason, wall_seconds=wall_seconds)


def _end(worker: _Worker) -> str:
    """Kills the worker's whole group, waits until it is gone, and returns how the worker ended."""
    process = worker.process
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # no other group can have this number before the leader is waited for
    code = process.wait()
    deadline = time.monotonic() + GRACE
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() < deadline:  # a planner that holds gigabytes takes a moment to die
            os.killpg(process.pid, 0)
            time.sleep(0.001)
    worker.input.close()
    worker.output.close()
    said = ""
    with contextlib.suppress(OSError):  # something may have cleaned up before us
        said = (worker.directory / ERRORS).read_text(encoding="utf-8", errors="replace").strip()
    shutil.rmtree(worker.directory, ignore_errors=True)
    end = f"killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
    return f"worker {end}" + (f": ...{said[-LAST_WORDS:]}" if said else "")
