"""One row for each run, on the disk as soon as the run has ended, so that a study can be stopped and gone on with."""

import fcntl
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Self

from clo_fleet.errors import CloFleetError
from clo_fleet.paper.episode import GOALS_REACHED
from clo_fleet.paper.settings import problem_name

__all__ = ["Journal", "JournalError", "Row", "Run", "write_parquet"]

SQL_TYPES: Mapping[object, str] = MappingProxyType({str: "varchar", int: "bigint", float: "double"})


@dataclass(frozen=True, slots=True, order=True)
class Run:
    """What tells one run from another.

    Attributes:
        domain: the paper's domain, lower-case.
        size: of the problem.
        probability: of an opportunity after an action.
        strategy: its name.
        route: how the planner is called.
        seed: of the world.
    """

    domain: str
    size: int
    probability: float
    strategy: str
    route: str
    seed: int

    def __str__(self) -> str:
        return f"{self.domain} {problem_name(self.size)} {self.probability:g} {self.strategy} seed {self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """How a run went. ``wall_*`` [s] depend on the machine, the rest does not.

    Attributes:
        outcome: ``goals reached``, or why the run counts as not done; the counts then go as far as it came.
        executed, failed: actions carried out, and tried in vain.
        first_plan: steps of the first plan.
        planned_again, added, dropped, superseded: steps, as an executive's tally counts them.
        planner_calls, expansions: calls, and states expanded in them.
        helped: opportunities that appeared.
        looked_at: facts that the senses attended to, summed over the actions.
        noticed: facts seen that were not expected.
        repairs: surprises after which steps left the plan.
        wall_planning: of all calls. ``wall_search``: of their searches alone. ``wall_deciding``: of the executive.
        wall_first_*: the share of the first plan.
    """

    domain: str
    size: int
    probability: float
    strategy: str
    route: str
    seed: int
    outcome: str
    executed: int = 0
    failed: int = 0
    first_plan: int = 0
    planned_again: int = 0
    added: int = 0
    dropped: int = 0
    superseded: int = 0
    planner_calls: int = 0
    expansions: int = 0
    helped: int = 0
    looked_at: int = 0
    noticed: int = 0
    repairs: int = 0
    wall_planning: float = 0.0
    wall_search: float = 0.0
    wall_deciding: float = 0.0
    wall_first_planning: float = 0.0
    wall_first_search: float = 0.0
    wall_first_deciding: float = 0.0

    @property
    def run(self) -> Run:
        """Which run it is."""
        return Run(self.domain, self.size, self.probability, self.strategy, self.route, self.seed)

    @property
    def done(self) -> bool:
        """Whether the goals were reached within the limits."""
        return self.outcome == GOALS_REACHED

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, line: str) -> Self:
        """The row that ``to_json`` wrote."""
        return cls(**json.loads(line))


class JournalError(CloFleetError):
    """A study's rows cannot be used.

    Attributes:
        path: the file.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path


class Journal:
    """The rows of a study, one JSON line each, brought to the disk one by one. A context manager.

    Raises:
        JournalError: if somebody else is writing to the file, or it holds something else.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self.rows = self._read(path)
        except BlockingIOError as error:
            self._file.close()
            raise JournalError(path, "another study is being written here") from error
        except (TypeError, ValueError) as error:
            self._file.close()
            raise JournalError(path, f"not the rows of a study: {error}") from error

    def _read(self, path: Path) -> list[Row]:
        """The rows there are. Half a line, the last one of a study that was killed, is taken away."""
        self._file.seek(0)
        text = self._file.read()
        whole = text.rfind(b"\n") + 1
        self._file.truncate(whole)
        return [Row.from_json(line.decode()) for line in text[:whole].splitlines()]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def append(self, row: Row) -> None:
        """Note a row, for good."""
        self._file.write(row.to_json().encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.rows.append(row)


def write_parquet(rows: Iterable[Row], path: Path) -> None:
    """Write the rows, sorted, as a Parquet file."""
    import duckdb  # heavy, and of use here only

    lines: Sequence[Row] = sorted(rows, key=lambda row: row.run)
    columns = ", ".join(f"{field.name} {SQL_TYPES[field.type]}" for field in fields(Row))
    marks = ", ".join("?" for _ in fields(Row))
    with duckdb.connect() as database:
        database.execute(f"create table rows ({columns})")
        if lines:
            database.executemany(f"insert into rows values ({marks})", [list(asdict(row).values()) for row in lines])
        database.table("rows").write_parquet(str(path))
