"""A bar that says how far a study is."""

import contextlib
import sys
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as RichProgress

from clo_fleet.paper.rows import Run
from clo_fleet.paper.study import Progress

__all__ = ["bar"]


@contextlib.contextmanager
def bar() -> Iterator[Progress]:
    """On a terminal, how many runs are left and which are under way; elsewhere nothing."""
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with RichProgress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as shown:
        task = shown.add_task("")

        def progress(done: int, total: int, under_way: tuple[Run, ...]) -> None:
            now = f"{total - done} left; under way: {'; '.join(map(str, under_way))}" if under_way else ""
            shown.update(task, completed=done, total=total, description=now)

        yield progress
