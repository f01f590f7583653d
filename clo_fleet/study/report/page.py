"""A batch's report: one page that needs no network, and the same tables and figures as files.

In the batch's folder: ``report.html``, and in ``report/`` the tables as CSV and Markdown and the figures as SVG.
"""

import html
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.study.atomic import write_whole
from clo_fleet.study.batch.row import Row
from clo_fleet.study.batch.running import read_swept, rows
from clo_fleet.study.report.comparing import METRICS, REACHED, differences, outcomes
from clo_fleet.study.report.counting import failures, helps
from clo_fleet.study.report.figures import difference_figure, growth_figure, help_figure
from clo_fleet.study.report.growing import growth
from clo_fleet.study.report.tables import (
    Table,
    as_csv,
    as_markdown,
    comparison_table,
    failure_table,
    growth_table,
    help_table,
    overview_table,
    text,
)

__all__ = ["NothingToReportError", "UnknownBaselineError", "report"]

FIGURE_KINDS = ("difference", "growth", "helps")  # what their names begin with
GROWTH = (
    "Means with 95 % bootstrap intervals over the runs in which all strategies reached their goals with so many robots;"
    " the share that did is of all runs."
)


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
    compared, grown, given = differences(found, swept, baseline), growth(found, swept), helps(found, folder / "runs")
    tables = (
        failure_table(failures(found, swept)),
        overview_table(outcomes(found, swept, baseline), compared, baseline),
        comparison_table(compared, baseline),
        growth_table(grown),
        help_table(given),
    )
    figures = {f"difference_{metric}": difference_figure(compared, metric) for metric in METRICS}
    for setting in sorted({one.setting for one in grown}):
        figures[f"growth_{setting}"] = growth_figure(grown, setting)
    for world in sorted({one.world for one in given}):
        figures[f"helps_{world}"] = help_figure(
            [one for one in given if one.world == world and one.strategy == baseline]
        )
    drawn = {name: figure for name, figure in figures.items() if figure is not None}
    _write_files(folder / "report", tables, drawn)
    page = folder / "report.html"
    write_whole(page, _page(folder.name, found, baseline, tables, drawn).encode())
    return page


def _page(name: str, found: Sequence[Row], baseline: str, tables: Sequence[Table], figures: Mapping[str, str]) -> str:
    failed, overview, paired, sizes, helped = tables
    reached = sum(row.outcome == REACHED for row in found)
    parts = [f"<h1>{html.escape(name)}</h1><p>{reached} of {len(found)} runs reached their goals.</p>"]
    parts += ["<h2>What failed</h2>", _html(failed) if failed.rows else "<p>Nothing.</p>"]
    if failed.rows:
        parts.append(_faint("Look at one with <code>clo-fleet view DIR/runs/EXAMPLE</code>."))
    parts += ["<h2>Strategies on the same seeds</h2>", _html(overview)]
    parts.append(
        _faint(
            f"Of the pairs of runs in the same setting with the same seed: in how many both, the strategy alone, or"
            f" {html.escape(baseline)} alone reached the goals; then, where both did, the mean difference to"
            f" {html.escape(baseline)} with its 95 % bootstrap interval, over all settings. An interval of one seed"
            " says nothing. Real times are this machine's."
        )
    )
    parts.append('<div class="figures">')
    parts += [_figure(figure, "") for key, figure in figures.items() if key.startswith("difference_")]
    parts.append("</div>")
    for key, figure in figures.items():
        kind, _, what = key.partition("_")
        if kind == "growth":
            parts.append(f"<h2>Growth with the fleet: {html.escape(what)}</h2>")
            parts.append(_figure(figure, GROWTH))
        elif kind == "helps":
            parts.append(f"<h2>Who helped whom: {html.escape(what)}</h2>")
            parts.append(_figure(figure, f"Helps a run with {baseline}, an arrow from helper to helped."))
    parts.append("<h2>All differences</h2>")
    parts += [_html(paired)] if paired.rows else ["<p>Only one strategy was run: there is nothing to compare.</p>"]
    parts += ["<h2>All sizes</h2>", _html(sizes)] if sizes.rows else []
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


def _faint(text: str) -> str:
    return f'<p class="faint">{text}</p>'


def _figure(figure: str, caption: str) -> str:
    return f"<figure>{figure}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _html(table: Table) -> str:
    def cell(tag: str, value: object) -> str:
        number = isinstance(value, int | float)
        return f"<{tag}{' class=number' * number}>{html.escape(text(value))}</{tag}>"

    head = "".join(cell("th", column) for column in table.columns)
    body = "".join("<tr>" + "".join(cell("td", value) for value in row) + "</tr>\n" for row in table.rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def _write_files(folder: Path, tables: Iterable[Table], figures: Mapping[str, str]) -> None:
    folder.mkdir(exist_ok=True)
    for table in tables:
        write_whole(folder / f"{table.name}.md", as_markdown(table).encode())
        write_whole(folder / f"{table.name}.csv", as_csv(table).encode())
    for kind in FIGURE_KINDS:  # of an earlier report
        for path in folder.glob(f"{kind}_*.svg"):
            path.unlink()
    for name, figure in figures.items():
        safe = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
        write_whole(folder / f"{safe}.svg", figure.encode())
