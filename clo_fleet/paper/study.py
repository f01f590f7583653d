"""A study from its selection to its files. It can be stopped at any moment and gone on with by the same call.

In the study's folder:

| file                      | holds                                                        |
|---------------------------|--------------------------------------------------------------|
| `study.json`              | machine, versions, limits, date                              |
| `rows.jsonl`              | a line for each run, written as it ends                      |
| `rows.parquet`            | the same, sorted, in the end                                 |
| `table.csv`, `table.md`   | every cell beside the paper's number                         |
| `figure.svg`, `figure.png`| total time against problem                                   |
"""

import json
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.paper.crew import Crew
from clo_fleet.paper.episode import PAPER_LIMITS, Limits
from clo_fleet.paper.figure import draw
from clo_fleet.paper.report import report
from clo_fleet.paper.rows import Journal, Row, Run, write_parquet
from clo_fleet.paper.runs import Selection, runs
from clo_fleet.paper.summary import cells, write_csv

__all__ = ["OtherStudyError", "Progress", "study", "write_files"]

FORMAT = 1
PACKAGES = ("clo-fleet", "fast-downward.translate", "up-fast-downward", "unified-planning")

Progress = Callable[[int, int, tuple[Run, ...]], None]
"""Told how many runs are done, how many there are, and which are under way."""


class OtherStudyError(CloFleetError):
    """A folder holds a study made with other versions or limits; its rows cannot be compared with new ones.

    Attributes:
        folder: the folder.
    """

    def __init__(self, folder: Path, what: str) -> None:
        super().__init__(f"{folder} holds a study made with other {what}; choose another folder")
        self.folder = folder


def study(
    selected: Selection,
    folder: Path,
    *,
    limits: Limits = PAPER_LIMITS,
    workers: int = 2,
    progress: Progress = lambda done, all_, under_way: None,
) -> tuple[Row, ...]:
    """Does the runs that the folder does not hold yet, and writes the files; returns all rows.

    Raises:
        OtherStudyError: if the folder holds a study made with other versions or limits.
        JournalError: if its rows cannot be used, or are being written by somebody else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with Journal(folder / "rows.jsonl") as journal:
        made = _made(folder, limits, begun=bool(journal.rows))
        known = {row.run for row in journal.rows}
        wanted = runs(selected)
        left = [run for run in wanted if run not in known]
        done = len(wanted) - len(left)
        with Crew(limits, workers) as crew:
            progress(done, len(wanted), ())
            for row in crew.rows(left):
                journal.append(row)
                done += 1
                progress(done, len(wanted), crew.under_way)
        write_files(journal.rows, made, folder)
        return tuple(journal.rows)


def write_files(rows: Sequence[Row], made: Mapping[str, Mapping[str, object]], folder: Path) -> None:
    """Write the tables, the figure and the Parquet file of these rows; ``made``: what ``study.json`` holds."""
    found = cells(rows)
    write_csv(found, folder / "table.csv")
    seeds = max((len(cell.rows) for cell in found.values()), default=0)
    lines = [f"{what}: {', '.join(f'{key} {value}' for key, value in facts.items())}" for what, facts in made.items()]
    lines.append(f"runs: {len(rows)}, up to {seeds} seeds a cell")
    (folder / "table.md").write_text(report(found, lines), encoding="utf-8")
    draw(found, (folder / "figure.svg", folder / "figure.png"))
    write_parquet(rows, folder / "rows.parquet")


def _made(folder: Path, limits: Limits, *, begun: bool) -> dict[str, dict[str, object]]:
    """With what the folder's rows are made; noted in it when the first ones are."""
    path = folder / "study.json"
    own: dict[str, dict[str, object]] = {
        "made": {"format": FORMAT, "date": datetime.now(UTC).date().isoformat()},
        "machine": {"system": platform.platform(), "processor": _processor(), "cores": os.cpu_count()},
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
        "limits [s]": asdict(limits),
    }
    if begun and path.exists():
        noted: dict[str, dict[str, object]] = json.loads(path.read_text(encoding="utf-8"))
        for what in ("versions", "limits [s]"):
            if noted.get(what) != own[what]:
                raise OtherStudyError(folder, what.removesuffix(" [s]"))
        return noted
    path.write_text(json.dumps(own, indent=2) + "\n", encoding="utf-8")
    return own


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.processor()
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
