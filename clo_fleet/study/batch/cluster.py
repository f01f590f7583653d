"""A batch on other machines: its runs as tasks of a Dask cluster that sees the batch's folder under the same path.

Dask only says which worker does which run. A worker starts the run's process itself, with its limits, and writes its
row; when Dask repeats a task because it lost a worker, a row that is there already is the answer. So each run is done
once, or once more where its worker died with it.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from clo_fleet.errors import CloFleetError
from clo_fleet.study.batch.definition import Definition
from clo_fleet.study.batch.launching import Launcher
from clo_fleet.study.batch.row import Row, row_of, write_row
from clo_fleet.study.batch.running import Executor
from clo_fleet.study.batch.spec import Limits

__all__ = ["ClusterError", "on_cluster"]

PATIENCE = 20.0  # [s] for the scheduler to answer


class ClusterError(CloFleetError):
    """The cluster cannot be used.

    Attributes:
        address: of its scheduler.
    """

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(f"the cluster at {address} cannot be used: {reason}")
        self.address = address


def on_cluster(address: str, patience: float = PATIENCE) -> Executor:
    """Runs on the cluster whose scheduler has this address, such as ``tcp://10.0.0.7:8786``.

    Raises (when runs are asked for):
        ClusterError: if Dask is not installed, or the scheduler does not answer.
    """

    def executor(runs: Sequence[Definition], folder: Path, limits: Limits) -> Iterator[Row]:
        try:
            import distributed
        except ImportError:
            raise ClusterError(address, "install it with pip install 'clo-fleet[cluster]'") from None
        dask: Any = distributed  # which is not typed
        folder = folder.resolve()
        try:
            client = dask.Client(address, timeout=patience)
        except (OSError, ValueError) as error:
            raise ClusterError(address, str(error)) from error
        with client:
            known = {
                client.submit(_launch, run.to_json(), str(folder), limits.wall, limits.memory, key=run.id): run
                for run in runs
            }
            for future in dask.as_completed(known):
                failure = future.exception()
                yield _lost(known[future], folder, failure) if failure else Row.from_json(future.result())

    return executor


def _launch(definition: str, folder: str, wall: float, memory: int) -> str:
    """On a worker."""
    return Launcher(Path(folder), Limits(wall, memory)).launch(Definition.from_json(definition)).to_json()


def _lost(run: Definition, folder: Path, error: BaseException) -> Row:
    """The row of a run that took its workers with it, again and again."""
    own = folder / run.id
    own.mkdir(exist_ok=True)
    row = row_of(run, own, ending="crashed", why=f"on the cluster: {error}", wall=0.0)
    write_row(row, own)
    return row
