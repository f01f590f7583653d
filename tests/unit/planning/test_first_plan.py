"""The call of Fast Downward for a single question."""

import os
import select
import time
from pathlib import Path

from clo_fleet.planning.first_plan import run


def test_a_command_is_run_and_heard(tmp_path: Path) -> None:
    """What it prints, and its exit code; it runs in the directory given."""
    finished = run(["sh", "-c", "pwd; echo oh >&2; exit 3"], tmp_path, time.monotonic() + 30)
    assert finished.log.split() == [str(tmp_path), "oh"]
    assert finished.exit_code == 3


def test_nothing_that_a_command_started_outlives_its_deadline(tmp_path: Path) -> None:
    """A pipe that its child holds open is closed soon after."""
    os.mkfifo(tmp_path / "alive")
    pipe = os.open(tmp_path / "alive", os.O_RDONLY | os.O_NONBLOCK)
    finished = run(["sh", "-c", "exec 3>alive; echo yes >&3; sleep 60 & wait"], tmp_path, time.monotonic() + 1)
    assert finished.exit_code is None
    said: list[bytes] = []
    while not said or said[-1]:
        assert select.select([pipe], [], [], 30)[0]
        said.append(os.read(pipe, 10))
    os.close(pipe)
    assert said in ([b"yes\n", b""], [b""])  # nothing, if the machine was too busy to start it
