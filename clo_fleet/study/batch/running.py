"""A batch from its runs to its rows. It can be stopped at any moment and gone on with by the same call.

In the batch's folder:

| path             | holds                                                                         |
|------------------|-------------------------------------------------------------------------------|
| `batch.json`     | the runs that were asked for, and the keys that are swept                     |
| `runs/<id>/`     | `events.jsonl`, `result.json`, and `row.json` once the run has ended           |
| `tables/`        | the rows and the events as Parquet, for `clo-fleet query` (`tables`)          |
"""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.study.atomic import write_whole
from clo_fleet.study.batch.definition import Definition
from clo_fleet.study.batch.launching import Launcher
from clo_fleet.study.batch.row import Row, read_row
from clo_fleet.study.batch.shard import Shard
from clo_fleet.study.batch.spec import Batch, Limits

__all__ = ["RERUNS", "NotABatchError", "Progress", "local", "read_swept", "rows", "run_batch"]

FORMAT = "clo-fleet/batch-folder/1"
RERUNS = ("failed", "all")

Progress = Callable[[Row | None, int, int], None]
"""Told the row that has come, how many runs are done, and how many there are."""
Executor = Callable[[Sequence[Definition], Path, Limits], Iterator[Row]]
"""Does the runs in folders below the path, in any order; yields their rows as they end."""


class NotABatchError(CloFleetError):
    """A folder holds no batch.

    Attributes:
        folder: the folder.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder}: holds no batch (no batch.json); run one with clo-fleet batch SPEC --out {folder}")
        self.folder = folder


def run_batch(
    batch: Batch,
    folder: Path,
    executor: Executor,
    *,
    shard: Shard | None = None,
    rerun: str | None = None,
    progress: Progress = lambda row, done, all_: None,
) -> tuple[Row, ...]:
    """Does the runs that have no row in the folder yet; returns the rows of all (of the shard).

    Args:
        batch: from ``read_batch``.
        folder: for its files.
        executor: such as ``local(2)``.
        shard: the part of it to do; all if not given.
        rerun: ``failed``: runs whose process was lost are done again; ``all``: all are.
        progress: called at the start and with each row.
    """
    wanted = (shard or Shard()).part(batch.runs)
    runs = folder / "runs"
    runs.mkdir(parents=True, exist_ok=True)
    _note(batch, folder)
    done: dict[str, Row] = {}
    for run in wanted:
        row = read_row(runs / run.id)
        if row is not None and (rerun == "all" or (rerun == "failed" and row.lost)):
            (runs / run.id / "row.json").unlink()
        elif row is not None:
            done[run.id] = row
    progress(None, len(done), len(wanted))
    for row in executor([run for run in wanted if run.id not in done], runs, batch.limits):
        done[row.run_id] = row
        progress(row, len(done), len(wanted))
    return tuple(done[run.id] for run in wanted)


def local(workers: int) -> Executor:
    """Runs on this machine, so many at a time."""

    def executor(runs: Sequence[Definition], folder: Path, limits: Limits) -> Iterator[Row]:
        launcher = Launcher(folder, limits)
        left = iter(runs)
        with ThreadPoolExecutor(workers) as pool:
            try:
                busy: set[Future[Row]] = set()
                while True:
                    while len(busy) < workers and (run := next(left, None)) is not None:
                        busy.add(pool.submit(launcher.launch, run))
                    if not busy:
                        return
                    ended, busy = wait(busy, return_when=FIRST_COMPLETED)
                    for future in ended:
                        yield future.result()
            finally:
                launcher.stop()

    return executor


def rows(folder: Path) -> tuple[Row, ...]:
    """The rows of all runs in the batch's folder that have ended, in the order of their ids.

    Raises:
        NotABatchError: if there is no batch.
    """
    read_swept(folder)
    found = (read_row(path) for path in sorted((folder / "runs").iterdir()))
    return tuple(row for row in found if row is not None)


def read_swept(folder: Path) -> tuple[str, ...]:
    """The keys that the folder's batch sweeps.

    Raises:
        NotABatchError: if there is no batch.
    """
    try:
        noted = json.loads((folder / "batch.json").read_text(encoding="utf-8"))
        return tuple(noted["swept"])
    except (OSError, ValueError, KeyError, TypeError):
        raise NotABatchError(folder) from None


def _note(batch: Batch, folder: Path) -> None:
    """Write ``batch.json``, whole or not at all."""
    noted = {
        "format": FORMAT,
        "swept": list(batch.swept),
        "runs": [json.loads(run.to_json()) for run in batch.runs],
    }
    write_whole(folder / "batch.json", (json.dumps(noted, indent=1) + "\n").encode())
