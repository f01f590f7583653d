"""A bar that says how far a batch is, how long it may still take, and how many runs were lost."""

import contextlib
import sys
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as RichProgress

from clo_fleet.study.batch.row import Row
from clo_fleet.study.batch.running import Progress

__all__ = ["bar"]


@contextlib.contextmanager
def bar() -> Iterator[Progress]:
    """A bar on a terminal; elsewhere a line at each tenth, for logs of jobs."""
    console = Console(stderr=True)
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with RichProgress(*columns, console=console, disable=not sys.stderr.isatty()) as shown:
        task = shown.add_task("")
        lost = told = 0

        def progress(row: Row | None, done: int, total: int) -> None:
            nonlocal lost, told
            lost += row is not None and row.lost
            shown.update(task, completed=done, total=total, description=f"{lost} lost" if lost else "")
            if not sys.stderr.isatty() and total and 10 * done // total > told:
                told = 10 * done // total
                console.print(f"{done} of {total} runs, {lost} lost", highlight=False)

        yield progress
