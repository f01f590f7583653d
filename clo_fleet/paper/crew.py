"""Several workers at once, each with one run at a time. A worker that dies or hangs costs its run, which says so."""

import contextlib
import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, astuple, dataclass, field
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from clo_fleet.paper.episode import Limits
from clo_fleet.paper.rows import Row, Run

__all__ = ["Crew"]

GRACE = 60.0  # [s] past all limits before a worker counts as hanging: imports, writing, a busy machine
LONG = 60.0  # [s] a run after which a worker is replaced: a big task leaves gigabytes behind
LAST_WORDS = 300  # characters of a dead worker's standard error that make the reason
GONE = 1.0  # [s] in which a killed group should be gone
ERRORS = "worker.err"


@dataclass(slots=True, eq=False)
class _Worker:
    """A child process and what it is doing."""

    process: subprocess.Popen[bytes]
    input: IO[bytes]
    output: IO[bytes]
    directory: Path
    run: Run | None = None
    since: float = 0.0
    incoming: bytes = b""


@dataclass(slots=True)
class Crew:
    """Up to ``size`` workers. A context manager: on leaving it they are ended, with all that they started."""

    limits: Limits
    size: int = 2
    _workers: list[_Worker] = field(default_factory=list, init=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self._workers:
            _end(worker)
        self._workers.clear()

    @property
    def under_way(self) -> tuple[Run, ...]:
        """The runs being done."""
        return tuple(worker.run for worker in self._workers if worker.run is not None)

    @property
    def pids(self) -> tuple[int, ...]:
        """The workers' process ids, which are those of their groups."""
        return tuple(worker.process.pid for worker in self._workers)

    def rows(self, runs: Iterable[Run]) -> Iterator[Row]:
        """Does the runs, begun in their order; yields their rows as they end."""
        left = iter(runs)
        self._assign(left)
        while self.under_way:
            ended = list(self._ended())
            self._assign(left)  # before the rows are looked at: nobody need wait for that
            yield from ended

    def _assign(self, left: Iterator[Run]) -> None:
        while len(self.under_way) < self.size:
            run = next(left, None)
            if run is None:
                return
            worker = next((worker for worker in self._workers if worker.run is None), None) or self._start()
            worker.run, worker.since = run, time.monotonic()
            with contextlib.suppress(BrokenPipeError):  # its end is seen where we read
                worker.input.write(json.dumps(astuple(run)).encode() + b"\n")
                worker.input.flush()

    def _ended(self) -> Iterator[Row]:
        """Waits until something happens; the rows of the runs that have ended."""
        patience = self.limits.run + self.limits.call + self.limits.links + GRACE
        busy = [worker for worker in self._workers if worker.run is not None]
        with selectors.DefaultSelector() as selector:
            for worker in busy:
                selector.register(worker.output, selectors.EVENT_READ, worker)
            deadline = min(worker.since for worker in busy) + patience
            ready = [key.data for key, _ in selector.select(max(0.0, deadline - time.monotonic()))]
        for worker in busy:
            if worker in ready:
                yield from self._read(worker)
            elif worker.since + patience <= time.monotonic():
                yield self._lost(worker, "its process did not answer")

    def _read(self, worker: _Worker) -> Iterator[Row]:
        chunk = os.read(worker.output.fileno(), 1 << 16)
        if not chunk:
            yield self._lost(worker, _how_it_ended(worker.process.pid))
            return
        worker.incoming += chunk
        line, newline, rest = worker.incoming.partition(b"\n")
        if newline:
            worker.incoming, worker.run = rest, None
            if time.monotonic() - worker.since > LONG:
                self._workers.remove(worker)
                _end(worker)
            yield Row.from_json(line.decode())

    def _lost(self, worker: _Worker, why: str) -> Row:
        """Ends the worker; its run is a row all the same."""
        assert worker.run is not None
        self._workers.remove(worker)
        said = (worker.directory / ERRORS).read_text(encoding="utf-8", errors="replace").strip()
        _end(worker)
        return Row(**asdict(worker.run), outcome=why + (f": ...{said[-LAST_WORDS:]}" if said else ""))

    def _start(self) -> _Worker:
        directory = Path(tempfile.mkdtemp(prefix="clo-fleet-paper-"))
        # The child finds the same modules as we do, and hashes as every other worker does.
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        environment = os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": "0", "PYTHONWARNINGS": "ignore"}
        limits = map(str, (self.limits.run, self.limits.call, self.limits.links))
        with (directory / ERRORS).open("wb") as errors:
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "clo_fleet.paper.worker", str(directory), *limits],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=environment,
                start_new_session=True,
            )
        assert process.stdin is not None
        assert process.stdout is not None
        worker = _Worker(process, process.stdin, process.stdout, directory)
        self._workers.append(worker)
        return worker


def _end(worker: _Worker) -> None:
    """Kills the worker's whole group, waits until it is gone, and takes its files away."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(worker.process.pid, signal.SIGKILL)  # no other group has this number before the leader is waited for
    worker.process.wait()
    deadline = time.monotonic() + GONE
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() < deadline:  # a planner that holds gigabytes takes a moment to die
            os.killpg(worker.process.pid, 0)
            time.sleep(0.001)
    worker.output.close()
    with contextlib.suppress(BrokenPipeError):
        worker.input.close()
    shutil.rmtree(worker.directory, ignore_errors=True)


def _how_it_ended(pid: int) -> str:
    """How a child ended that has closed its output. It is not reaped yet, so that its group keeps its number."""
    ended = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    assert ended is not None
    if ended.si_code == os.CLD_EXITED:
        return f"its process ended with code {ended.si_status}"
    return f"its process was killed by {signal.Signals(ended.si_status).name}"
