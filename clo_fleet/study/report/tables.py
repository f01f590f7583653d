"""A report's tables, from what was compared and counted, and as CSV and Markdown."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from clo_fleet.study.report.comparing import METRICS, OVERALL, Difference, Outcomes
from clo_fleet.study.report.counting import Failure, Helps
from clo_fleet.study.report.growing import FIGURES, Growth

__all__ = [
    "Table",
    "as_csv",
    "as_markdown",
    "comparison_table",
    "failure_table",
    "growth_table",
    "help_table",
    "overview_table",
    "text",
]


@dataclass(frozen=True, slots=True)
class Table:
    """A table: its file's name, columns and rows."""

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]


def overview_table(ends: Sequence[Outcomes], compared: Sequence[Difference], baseline: str) -> Table:
    """A line for each strategy: how its runs ended, and its differences to the baseline over all settings."""
    overall = [one for one in compared if one.setting == OVERALL] or compared  # a single setting is all there is
    shown = [metric for metric in METRICS if any(one.metric == metric and one.worth_showing for one in overall)]
    cells = {(one.strategy, one.metric): _difference(one) for one in overall}
    return Table(
        "overview",
        (
            *("strategy", "runs", "goals reached", "both", "it alone", f"{baseline} alone"),
            *(METRICS[metric] for metric in shown),
        ),
        tuple(
            (
                *(one.strategy, one.runs, one.reached),
                *(("", "", "") if one.strategy == baseline else (one.both, one.alone, one.baseline_alone)),
                *(cells.get((one.strategy, metric), "") for metric in shown),
            )
            for one in ends
        ),
    )


def failure_table(found: Iterable[Failure]) -> Table:
    """How runs missed their goals."""
    return Table(
        "failures",
        ("setting", "strategy", "ending", "runs", "of", "why", "example"),
        tuple((str(one.setting), one.strategy, one.ending, one.runs, one.of, one.why, one.example) for one in found),
    )


def comparison_table(found: Iterable[Difference], baseline: str) -> Table:
    """Every strategy against the baseline, in every setting and figure."""
    return Table(
        "comparison",
        ("setting", "figure", "strategy", "seeds", "of", baseline, "strategy's", "difference", "low", "high"),
        tuple(
            (
                *(str(one.setting), METRICS[one.metric], one.strategy, one.seeds, one.of),
                *(one.baseline_mean, one.mean, one.difference, one.low, one.high),
            )
            for one in found
        ),
    )


def growth_table(found: Iterable[Growth]) -> Table:
    """Every figure for every size of the fleet."""
    return Table(
        "growth",
        ("setting", "figure", "strategy", "robots", "runs", "of", "mean", "low", "high"),
        tuple(
            (
                *(str(one.setting), FIGURES[one.figure], one.strategy, one.robots, one.runs, one.of),
                *(one.mean, one.low, one.high),
            )
            for one in found
        ),
    )


def help_table(found: Iterable[Helps]) -> Table:
    """Who helped whom."""
    return Table(
        "helps",
        ("world", "strategy", "by", "robot", "kind", "times", "steps not needed", "runs"),
        tuple((one.world, one.strategy, one.by, one.robot, one.kind, one.times, one.steps, one.runs) for one in found),
    )


def text(value: object) -> str:
    """A cell's value for people."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def as_markdown(table: Table) -> str:
    """The table in Markdown."""

    def line(values: Iterable[object]) -> str:
        return "| " + " | ".join(text(value).replace("|", "\\|").replace("\n", " ") for value in values) + " |\n"

    return line(table.columns) + "|" + "---|" * len(table.columns) + "\n" + "".join(map(line, table.rows))


def as_csv(table: Table) -> str:
    """The table as CSV, numbers in full."""
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return lines.getvalue()


def _difference(one: Difference) -> str:
    """With its sign and its interval."""
    mean = f"{one.difference:+.3g}" if one.difference else "0"
    return f"{mean} [{one.low:.3g}, {one.high:.3g}]"
