"""One run in a process of its own, with limits. Whatever happens to it, it ends as a row."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

from clo_fleet.study.batch.child import REFUSED
from clo_fleet.study.batch.definition import Definition
from clo_fleet.study.batch.row import ENDED, Row, read_row, row_of, write_row
from clo_fleet.study.batch.spec import Limits

__all__ = ["Launcher", "StoppedError"]

LAST_WORDS = 300  # characters of a lost child's standard error that are kept as the reason
OUT_OF_MEMORY = ("MemoryError", "bad_alloc", "Cannot allocate memory", "failed to map segment", "start new thread")


class StoppedError(Exception):
    """The batch is being stopped: the run has no row."""


@dataclass(slots=True)
class Launcher:
    """Does runs, each in a folder of its own below ``folder``, from as many threads as one likes."""

    folder: Path
    limits: Limits
    _children: set[subprocess.Popen[bytes]] = field(default_factory=set, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)
    _stopped: bool = field(default=False, init=False)

    def launch(self, definition: Definition) -> Row:
        """Does the run, unless its row is there already, and waits for its end.

        Raises:
            StoppedError: if ``stop`` was called meanwhile.
        """
        own = self.folder / definition.id
        if (row := read_row(own)) is not None:
            return row
        own.mkdir(parents=True, exist_ok=True)
        (own / "child.json").unlink(missing_ok=True)
        begin = time.monotonic()
        errors = own / "errors.txt"
        child = self._start(definition, own, errors)
        try:
            code = child.wait(self.limits.wall)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            self._end(child)
        if self._stopped:
            raise StoppedError
        said = errors.read_text(encoding="utf-8", errors="replace").strip()
        ending, why = _verdict(code, said, self.limits)
        if ending == ENDED:
            errors.unlink()
        row = row_of(definition, own, ending=ending, why=why, wall=time.monotonic() - begin)
        write_row(row, own)
        return row

    def stop(self) -> None:
        """Ends all children, for good; from another thread."""
        with self._lock:
            self._stopped = True
            for child in self._children:
                _kill(child)

    def _start(self, definition: Definition, own: Path, errors: Path) -> subprocess.Popen[bytes]:
        # The child finds the same modules as we do, whatever way we found them.
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        with self._lock, errors.open("wb") as stream:
            if self._stopped:
                raise StoppedError
            child = subprocess.Popen(
                [sys.executable, "-P", "-m", "clo_fleet.study.batch.child", str(own), str(self.limits.memory)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=stream,
                env=os.environ | {"PYTHONPATH": path},
                start_new_session=True,
            )
            self._children.add(child)
        assert child.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # its end is seen where we wait
            child.stdin.write(definition.to_json().encode() + b"\n")
            child.stdin.flush()
        return child

    def _end(self, child: subprocess.Popen[bytes]) -> None:
        with self._lock:
            _kill(child)
            self._children.discard(child)
        child.wait()
        assert child.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            child.stdin.close()


def _kill(child: subprocess.Popen[bytes]) -> None:
    if child.returncode is None:  # not waited for yet: no other group has its number
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)


def _verdict(code: int | None, said: str, limits: Limits) -> tuple[str, str]:
    """How a child ended, by its exit code (``None``: it did not) and its last words."""
    last = f": ...{said[-LAST_WORDS:]}" if len(said) > LAST_WORDS else f": {said}" * bool(said)
    if code is None:
        return "out of time", f"after {limits.wall:g} s{last}"
    if code == 0:
        return ENDED, ""
    if any(sign in said for sign in OUT_OF_MEMORY):
        return "out of memory", f"with {limits.memory / (1 << 20):g} MB{last}"
    if code == REFUSED:
        return "refused", said[-LAST_WORDS:]
    how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    return "crashed", how + last
