"""A planner's process: ``python -m clo_fleet.planning.worker``. Answers jobs, one line of JSON each (see ``wire``).

Theory of operation. The pool starts a worker as the leader of its own process group, and all that the planner starts
stays in that group, so one signal ends the lot. While the planner runs, the worker watches its standard input: when the
pool is gone, input ends, and the worker takes the whole group with it. At the wall limit it ends the planner but not
itself, so that the next job need not wait for unified-planning to be imported again. If it hangs, or is killed, the
pool ends the group.
"""

import json
import math
import os
import selectors
import shutil
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from clo_fleet.planning import wire
from clo_fleet.planning.light_import import stand_in_for_config_space

if TYPE_CHECKING:
    from clo_fleet.planning.fast_downward import Finished

__all__ = ["main"]

STDIN, STDOUT, STDERR = 0, 1, 2
CHUNK = 1 << 16


def main() -> None:
    """Answers jobs until standard input ends."""
    answers = os.dup(STDOUT)
    os.dup2(STDERR, STDOUT)  # whatever a library prints must not get between the answers
    signal.signal(signal.SIGTERM, lambda *_: None)  # meant for the planner: see `_run`
    stand_in_for_config_space()
    from clo_fleet.planning.fast_downward import Call, solve

    lines = _Lines()
    line = lines.next()
    if not line:
        return
    setting = wire.setting_of(line)
    _write(answers, wire.READY)
    while line := lines.next():
        start = time.monotonic()
        call = Call(
            run=partial(_run, directory=setting.directory, deadline=start + setting.wall_limit),
            directory=setting.directory,
            cpu_limit=math.ceil(setting.wall_limit) + 1,
            memory_limit=setting.memory_limit,
        )
        answer = solve(setting.domain, wire.task_of(json.loads(line)), call)
        _write(answers, wire.answer_line(replace(answer, wall_seconds=time.monotonic() - start)))
    _leave(setting.directory)


class _Lines:
    """Standard input by lines, with nothing read ahead of a line's end by anyone but us."""

    def __init__(self) -> None:
        self._buffer = b""

    def next(self) -> bytes:
        """The next line, empty at the end."""
        chunks = [self._buffer]
        while b"\n" not in chunks[-1]:
            chunk = os.read(STDIN, CHUNK)
            if not chunk:
                return b""
            chunks.append(chunk)
        line, _, self._buffer = b"".join(chunks).partition(b"\n")
        return line


def _run(command: Sequence[str], directory: Path, deadline: float) -> "Finished":
    """Runs the planner's command until it ends, the deadline, or the end of the pool."""
    from clo_fleet.planning.fast_downward import Finished

    if time.monotonic() >= deadline:  # writing a big task takes its time too
        return Finished("", None)
    log = bytearray()
    stopped = False
    with (
        subprocess.Popen(
            command, cwd=directory, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        ) as child,
        selectors.DefaultSelector() as selector,
    ):
        assert child.stdout is not None
        selector.register(child.stdout, selectors.EVENT_READ)
        selector.register(STDIN, selectors.EVENT_READ)
        while True:
            left = deadline - time.monotonic()
            if left <= 0 and not stopped:
                stopped = True
                os.killpg(0, signal.SIGTERM)
            for key, _ in selector.select(None if stopped else left):
                if key.fd == STDIN:  # nothing is sent to a busy worker: this is the end of input
                    _leave(directory)
                chunk = os.read(key.fd, CHUNK)
                log += chunk
                if not chunk:  # every process of the planner has closed it
                    exit_code = child.wait()
                    return Finished(log.decode(errors="replace"), None if stopped else exit_code)


def _leave(directory: Path) -> NoReturn:
    """Ends this process and all of its group."""
    shutil.rmtree(directory, ignore_errors=True)
    os.killpg(0, signal.SIGKILL)
    raise AssertionError("a killed process goes on")


def _write(fd: int, line: bytes) -> None:
    while line:
        line = line[os.write(fd, line) :]


if __name__ == "__main__":
    main()
