"""A batch's report: one page that needs no network, and the same tables and figures as files.

In the batch's folder: ``report.html``, and in ``report/`` the tables as CSV and Markdown and the figures as SVG.
"""

import csv
import html
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.study.batch.row import Row
from clo_fleet.study.batch.running import read_swept, rows
from clo_fleet.study.report.comparing import METRICS, REACHED, differences, failures, helps
from clo_fleet.study.report.figures import difference_figure, growth_figure, help_figure

__all__ = ["NothingToReportError", "UnknownBaselineError", "report"]


class NothingToReportError(CloFleetError):
    """No run of the batch has ended yet.

    Attributes:
        folder: the batch's folder.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder}: no run has ended yet")
        self.folder = folder


class UnknownBaselineError(CloFleetError):
    """The batch has no runs with the strategy that others are to be compared with.

    Attributes:
        strategy: as given.
    """

    def __init__(self, strategy: str, known: Sequence[str]) -> None:
        super().__init__(f"no runs with the strategy {strategy!r}; expected one of {', '.join(known)}")
        self.strategy = strategy


@dataclass(frozen=True, slots=True)
class _Table:
    """A table: its file's name, columns and rows."""

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]


def report(folder: Path, baseline: str = "") -> Path:
    """Write the report of a batch; returns the page.

    Args:
        folder: the batch's.
        baseline: the strategy with which the others are compared; by default ``clo`` or else the first by name.

    Raises:
        NotABatchError: if the folder holds no batch.
        NothingToReportError: if no run has ended.
        UnknownBaselineError: if there are no runs with the baseline.
    """
    found, swept = rows(folder), read_swept(folder)
    if not found:
        raise NothingToReportError(folder)
    strategies = sorted({row.strategy for row in found})
    if baseline and baseline not in strategies:
        raise UnknownBaselineError(baseline, strategies)
    baseline = baseline or ("clo" if "clo" in strategies else strategies[0])
    compared = differences(found, swept, baseline)
    lost, given = failures(found, swept), helps(found, folder / "runs")
    failed = _Table(
        "failures",
        ("setting", "strategy", "ending", "runs", "of", "why", "example"),
        tuple((str(one.setting), one.strategy, one.ending, one.runs, one.of, one.why, one.example) for one in lost),
    )
    paired = _Table(
        "comparison",
        ("setting", "figure", "strategy", "seeds", "of", baseline, "strategy's", "difference", "low", "high"),
        tuple(
            (
                *(str(one.setting), METRICS[one.metric], one.strategy, one.seeds, one.of),
                *(one.baseline_mean, one.mean, one.difference, one.low, one.high),
            )
            for one in compared
        ),
    )
    helped = _Table(
        "helps",
        ("world", "strategy", "by", "robot", "kind", "times", "steps not needed", "runs"),
        tuple((one.world, one.strategy, one.by, one.robot, one.kind, one.times, one.steps, one.runs) for one in given),
    )
    figures = {f"difference_{metric}": difference_figure(compared, metric) for metric in METRICS}
    figures["growth"] = growth_figure(found)
    for world in sorted({one.world for one in given}):
        figures[f"helps_{world}"] = help_figure(
            [one for one in given if one.world == world and one.strategy == baseline]
        )
    drawn = {name: figure for name, figure in figures.items() if figure is not None}
    _write_files(folder / "report", (failed, paired, helped), drawn)
    page = folder / "report.html"
    _write(page, _page(folder.name, found, baseline, (failed, paired, helped), drawn))
    return page


def _page(
    name: str, found: Sequence[Row], baseline: str, tables: tuple[_Table, _Table, _Table], figures: dict[str, str]
) -> str:
    failed, paired, helped = tables
    reached = sum(row.outcome == REACHED for row in found)
    summary = f"{reached} of {len(found)} runs reached their goals."
    parts = [f"<h1>{html.escape(name)}</h1><p>{summary}</p>", "<h2>What failed</h2>"]
    parts.append(_html(failed) if failed.rows else "<p>Nothing.</p>")
    if failed.rows:
        parts.append('<p class="faint">Look at one with <code>clo-fleet view DIR/runs/EXAMPLE</code>.</p>')
    parts.append("<h2>Strategies on the same seeds</h2>")
    parts.append(
        f'<p class="faint">Differences to {html.escape(baseline)}, run by run, with 95 % bootstrap intervals; only'
        " seeds on which both reached their goals. An interval of one seed says nothing."
        " Real times are this machine's.</p>"
    )
    parts.append('<div class="figures">')
    parts += [_figure(figure, "") for key, figure in figures.items() if key.startswith("difference_")]
    parts.append("</div>")
    for key, figure in figures.items():
        if key == "growth":
            parts.append("<h2>Growth with the fleet</h2>")
            parts.append(_figure(figure, "Means of the runs that reached their goals, against the number of robots."))
        elif key.startswith("helps_"):
            parts.append(f"<h2>Who helped whom: {html.escape(key.removeprefix('helps_'))}</h2>")
            parts.append(_figure(figure, f"Helps a run with {baseline}, an arrow from helper to helped."))
    parts.append("<h2>All numbers</h2>")
    parts += [_html(paired)] if paired.rows else ["<p>Only one strategy was run: there is nothing to compare.</p>"]
    parts += ["<h2>All helps</h2>", _html(helped)] if helped.rows else []
    style = (files("clo_fleet.study.report") / "report.css").read_text(encoding="utf-8")
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{html.escape(name)}: report</title><style>{style}</style></head>\n<body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _figure(figure: str, caption: str) -> str:
    return f"<figure>{figure}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _html(table: _Table) -> str:
    def cell(tag: str, value: object) -> str:
        number = isinstance(value, int | float)
        return f"<{tag}{' class=number' * number}>{html.escape(_text(value))}</{tag}>"

    head = "".join(cell("th", column) for column in table.columns)
    body = "".join("<tr>" + "".join(cell("td", value) for value in row) + "</tr>\n" for row in table.rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def _markdown(table: _Table) -> str:
    def line(values: Iterable[object]) -> str:
        return "| " + " | ".join(_text(value).replace("|", "\\|").replace("\n", " ") for value in values) + " |\n"

    return line(table.columns) + "|" + "---|" * len(table.columns) + "\n" + "".join(map(line, table.rows))


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _write_files(folder: Path, tables: Iterable[_Table], figures: dict[str, str]) -> None:
    folder.mkdir(exist_ok=True)
    for table in tables:
        _write(folder / f"{table.name}.md", _markdown(table))
        with (folder / f"{table.name}.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table.columns)
            writer.writerows(table.rows)
    for name, figure in figures.items():
        safe = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
        _write(folder / f"{safe}.svg", figure)


def _write(path: Path, text: str) -> None:
    """Whole or not at all."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    draft.write_text(text, encoding="utf-8")
    draft.replace(path)
