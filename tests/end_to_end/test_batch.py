"""Batches, typed as a user types them, and stopped in every way."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from clo_fleet.study.batch.launching import Launcher
from clo_fleet.study.batch.row import ENDED
from clo_fleet.study.batch.running import local, rows, run_batch
from clo_fleet.study.batch.spec import Limits, read_batch
from clo_fleet.study.shipped import copy_out

SPEC = "format: clo-fleet/batch/1\nworlds: [worlds/hello.yaml]\n"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """An empty folder with the maps and worlds that come with the package."""
    copy_out(tmp_path)
    return tmp_path


def command(own: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command in that folder."""
    words = [sys.executable, "-m", "clo_fleet.cli", *arguments]
    return subprocess.run(words, cwd=own, capture_output=True, text=True, timeout=110, check=False)


def children() -> Iterator[str]:
    """The command lines of all runs' processes and planners of this user."""
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except (OSError, UnicodeDecodeError):
            continue
        if "clo_fleet.study.batch.child" in words or "clo_fleet.planning.worker" in words:
            yield f"{entry.name} {words}"


def gone(folder: Path) -> bool:
    """Whether nothing works for runs below the folder any more, within some seconds."""
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        if not any(str(folder) in words for words in children()):
            return True
        time.sleep(0.05)
    return False


def test_a_batch_is_run_asked_and_gone_on_with(own: Path) -> None:
    """Two runs in processes of their own, each log the same as that of ``run``; a second time nothing is left to do."""
    (own / "two.yaml").write_text(SPEC + "strategies: [clo, replan]\nseeds: [5]\n")
    done = command(own, "batch", "two.yaml", "--out", "two")
    assert (done.returncode, done.stdout) == (0, "2 of 2 runs reached their goals, 0 were lost; written to two\n")
    assert "2 of 2 runs, 0 lost" in done.stderr
    found = rows(own / "two")
    assert {row.strategy for row in found} == {"clo", "replan"}
    assert all(row.executed > 0 and row.wall_s > row.wall_run_s > 0 and row.peak_memory > 1 << 20 for row in found)
    assert command(own, "run", "worlds/hello.yaml", "--seed", "5", "--out", "one").returncode == 0
    run = next(row.run_id for row in found if row.strategy == "clo")
    log = own / "two" / "runs" / run / "events.jsonl"
    assert log.read_bytes() == (own / "one" / "events.jsonl").read_bytes()
    written = (own / "two" / "runs" / run / "row.json").stat().st_mtime_ns
    assert command(own, "batch", "two.yaml", "--out", "two").returncode == 0
    assert (own / "two" / "runs" / run / "row.json").stat().st_mtime_ns == written
    asked = command(own, "query", "two", "select strategy, executed from results order by 1", "--csv")
    assert asked.stdout.splitlines()[0] == "strategy,executed"
    assert len(asked.stdout.splitlines()) == 3
    assert "helps" in command(own, "query", "two", "select sum(helps) as helps from results").stdout


def test_shards_do_their_share(own: Path) -> None:
    """Each leaves the other's runs alone."""
    (own / "two.yaml").write_text(SPEC + "seeds: 2\n")
    for part in ("1/2", "2/2"):
        done = command(own, "batch", "two.yaml", "--out", "out", "--shard", part)
        assert done.stdout.startswith("1 of 1 runs"), done.stderr
    assert [row.seed for row in sorted(rows(own / "out"), key=lambda row: row.seed)] == [0, 1]
    assert "invalid part such as 1/8" in command(own, "batch", "two.yaml", "--out", "out", "--shard", "3/2").stderr


def test_a_run_that_takes_too_long_or_too_much_is_lost_alone(own: Path) -> None:
    """It says why, leaves nothing behind, and is done again when that is asked for."""
    (own / "one.yaml").write_text(SPEC)
    (run,) = read_batch(own / "one.yaml").runs
    for limits, ending in ((Limits(wall=0.5), "out of time"), (Limits(memory=40 << 20), "out of memory")):
        row = Launcher(own / ending, limits).launch(run)
        assert row.ending == ending, row
        assert row.why
        assert row.lost
        assert gone(own / ending)
    (own / "one.yaml").write_text(SPEC + "limits: {wall_s: 0.5}\n")
    done = command(own, "batch", "one.yaml", "--out", "out")
    assert done.returncode == 1
    assert "lost: hello clo seed 0" in done.stdout
    (own / "one.yaml").write_text(SPEC)
    assert command(own, "batch", "one.yaml", "--out", "out").returncode == 1  # a lost run is done too
    assert command(own, "batch", "one.yaml", "--out", "out", "--rerun", "failed").returncode == 0
    assert [row.ending for row in rows(own / "out")] == [ENDED]


def test_a_world_that_became_faulty_is_refused_by_its_run(own: Path) -> None:
    """In the words of the file's check."""
    (own / "one.yaml").write_text(SPEC)
    batch = read_batch(own / "one.yaml")
    (own / "worlds" / "hello.yaml").write_text("format: clo-fleet/world/1\n")
    (row,) = run_batch(batch, own / "out", local(1))
    assert row.ending == "refused"
    assert "hello.yaml" in row.why


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT])
def test_a_batch_that_is_killed_leaves_no_orphan_and_goes_on(own: Path, blow: signal.Signals) -> None:
    """Whatever has ended stays; what was under way is done again."""
    (own / "four.yaml").write_text(SPEC + "seeds: 3\n")
    words = [sys.executable, "-m", "clo_fleet.cli", "batch", "four.yaml", "--out", "out"]
    with subprocess.Popen(words, cwd=own, stderr=subprocess.PIPE, text=True) as process:
        while not list((own / "out").glob("runs/*/row.json")):
            assert process.poll() is None
            time.sleep(0.05)
        os.kill(process.pid, blow)
        _, said = process.communicate(timeout=60)
    assert gone(own / "out")
    assert process.returncode == (130 if blow is signal.SIGINT else -9)
    assert ("the same command goes on" in said) is (blow is signal.SIGINT)
    before = {path: path.stat().st_mtime_ns for path in (own / "out").glob("runs/*/row.json")}
    assert len(before) < 3
    assert command(own, "batch", "four.yaml", "--out", "out").returncode == 0
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in before.items())
    assert [row.ending for row in rows(own / "out")] == [ENDED] * 3
    noted = json.loads((own / "out" / "batch.json").read_text())
    assert {run["id"] for run in noted["runs"]} == {row.run_id for row in rows(own / "out")}
