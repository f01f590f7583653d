"""A batch on a Dask cluster of a scheduler and two workers on loopback, one of which is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from clo_fleet.study.batch.cluster import ClusterError, on_cluster
from clo_fleet.study.batch.row import ENDED, Row
from clo_fleet.study.batch.running import rows, run_batch
from clo_fleet.study.batch.spec import read_batch
from clo_fleet.study.shipped import copy_out

SPEC = "format: clo-fleet/batch/1\nworlds: [worlds/hello.yaml]\nstrategies: [clo]\nseeds: 5\n"


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The scheduler's address, and the processes of two workers with one thread each."""
    noted = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    common = ["--host", "127.0.0.1", "--scheduler-file", str(noted)]
    dask = [sys.executable, "-m", "distributed.cli"]
    with ExitStack() as stack:

        def start(*words: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(words, cwd=tmp_path, **quiet)  # type: ignore[call-overload]
            stack.callback(process.wait)
            stack.callback(os.killpg, process.pid, signal.SIGKILL)
            assert isinstance(process, subprocess.Popen)
            return process

        start(*dask[:2], f"{dask[2]}.dask_scheduler", *common, "--no-dashboard")
        worker = [*dask[:2], f"{dask[2]}.dask_worker", "--scheduler-file", str(noted), "--host", "127.0.0.1"]
        workers = [start(*worker, "--nthreads", "1", "--no-nanny", "--no-dashboard") for _ in range(2)]
        deadline = time.monotonic() + 30
        while not (noted.exists() and (text := noted.read_text()).rstrip().endswith("}")):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        yield json.loads(text)["address"], workers


def test_all_runs_end_once_though_a_worker_is_killed(
    tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]]
) -> None:
    """Its run is done again by the other worker; each run is in the results exactly once."""
    copy_out(tmp_path)
    (tmp_path / "five.yaml").write_text(SPEC)
    batch = read_batch(tmp_path / "five.yaml")
    address, workers = cluster
    struck: list[int] = []

    def strike(row: Row | None, done: int, _: int) -> None:
        if row is not None and not struck:
            os.kill(workers[0].pid, signal.SIGKILL)
            struck.append(done)

    found = run_batch(batch, tmp_path / "out", on_cluster(address), progress=strike)
    assert struck == [1]
    assert [row.ending for row in found] == [ENDED] * 5
    assert sorted(row.run_id for row in rows(tmp_path / "out")) == sorted(run.id for run in batch.runs)


def test_a_cluster_that_does_not_answer_is_told(tmp_path: Path) -> None:
    """With its address."""
    copy_out(tmp_path)
    (tmp_path / "five.yaml").write_text(SPEC)
    with pytest.raises(ClusterError, match=r"tcp://127\.0\.0\.1:1 cannot be used"):
        run_batch(read_batch(tmp_path / "five.yaml"), tmp_path / "out", on_cluster("tcp://127.0.0.1:1", patience=1))
