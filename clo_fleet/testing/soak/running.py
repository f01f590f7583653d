"""Does a soak: worlds one after another in a child process, which is replaced when it hangs or dies."""

import json
import os
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clo_fleet.fleet.outcome import Outcome
from clo_fleet.testing.soak.verdict import Ending, Verdict
from clo_fleet.testing.soak.worlds import SoakWorld, write_soak_world

__all__ = ["Limits", "soak"]

LAST_WORDS = 2000  # characters of a dead child's standard error that are kept


@dataclass(frozen=True, slots=True)
class Limits:
    """What a run may take: real time [s], and memory of each process [bytes]."""

    wall: float = 600.0
    memory: int = 4 << 30


def soak(numbers: Iterable[int], folder: Path, limits: Limits = Limits()) -> Iterator[Verdict]:
    """Run the worlds of these numbers; gives what became of each as it ends.

    All verdicts are written to ``soak.jsonl`` in the folder. Worlds whose runs did not reach their goals stay there,
    each in a folder of its own with its map and ``verdict.json``: ``clo-fleet run world.yaml --strategy ...`` plays one
    again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with _Child(folder / "errors.txt", limits) as child, (folder / "soak.jsonl").open("a", encoding="utf-8") as rows:
        for number in numbers:
            own = folder / f"world-{number}"
            world = write_soak_world(number, own)
            verdict = child.run(world)
            (own / "verdict.json").write_text(verdict.to_json() + "\n", encoding="utf-8")
            if not verdict.is_fault and verdict.outcome == Outcome.GOALS_REACHED.value:
                shutil.rmtree(own)
            rows.write(verdict.to_json() + "\n")
            rows.flush()
            yield verdict


class _Child:
    """A process that does runs; a new one after each that was lost."""

    def __init__(self, errors: Path, limits: Limits) -> None:
        self._errors, self._limits = errors, limits
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "_Child":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._errors.unlink(missing_ok=True)

    def run(self, world: SoakWorld) -> Verdict:
        """What became of the world's run, waited for as long as the limit says."""
        begin = time.monotonic()
        answer = self._answer(world)
        return Verdict(
            world=world.number,
            building=world.building,
            robots=world.robots,
            strategy=world.strategy,
            wall_s=round(time.monotonic() - begin, 2),
            **answer | {"ending": Ending(answer["ending"])},
        )

    def _answer(self, world: SoakWorld) -> dict[str, Any]:
        process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        wanted = {"world": str(world.path), "strategy": world.strategy}
        process.stdin.write(json.dumps(wanted).encode() + b"\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], self._limits.wall)
        line = process.stdout.readline() if ready else b""
        if line.endswith(b"\n"):
            answer: dict[str, Any] = json.loads(line)
            return answer
        said = self._end()
        if not ready:
            return {"ending": Ending.HUNG.value, "why": f"no end within {self._limits.wall:g} s{said}"}
        return {"ending": Ending.CRASHED.value, "why": said}

    def _start(self) -> subprocess.Popen[bytes]:
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        with self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    "-P",
                    "-X",
                    "faulthandler",
                    "-m",
                    "clo_fleet.testing.soak.child",
                    str(self._limits.memory),
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=os.environ | {"PYTHONPATH": path},
                start_new_session=True,
            )
        return self._process

    def _end(self) -> str:
        """End the process, if there is one; its last words."""
        if self._process is None:
            return ""
        process, self._process = self._process, None
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGABRT)  # faulthandler says where it was
        process.communicate()
        said = self._errors.read_text(encoding="utf-8", errors="replace").strip()
        return f"exit code {process.returncode}: {said[-LAST_WORDS:]}"
