"""From rows to cells: what came out for each problem, probability and strategy, beside what the paper reports."""

import csv
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from types import MappingProxyType

import numpy as np

from clo_fleet.paper.calls import Route
from clo_fleet.paper.reference import Reported, reported
from clo_fleet.paper.rows import Row
from clo_fleet.paper.settings import problem_name

__all__ = [
    "Cell",
    "Figure",
    "Key",
    "Spread",
    "Where",
    "cells",
    "later_time",
    "paired",
    "ratios",
    "spread_at",
    "total_time",
    "write_csv",
]

LOW, HIGH = 2.5, 97.5  # percentiles over the seeds

Key = tuple[str, int, float, str, str]
"""Domain, size, probability, strategy, route."""
Where = tuple[str, int, float]
"""Domain, size, probability."""
Figure = Callable[[Row], float]

FIGURES: Mapping[str, Figure] = MappingProxyType(
    {
        "executed": lambda row: row.executed,
        "total_s": lambda row: row.wall_planning + row.wall_deciding,
        "planning_s": lambda row: row.wall_planning,
        "search_s": lambda row: row.wall_search,
        "deciding_s": lambda row: row.wall_deciding,
        "first_planning_s": lambda row: row.wall_first_planning,
        "first_deciding_s": lambda row: row.wall_first_deciding,
        "planner_calls": lambda row: row.planner_calls,
        "expansions": lambda row: row.expansions,
        "looked_at": lambda row: row.looked_at,
        "opportunities": lambda row: row.helped,
        "failed": lambda row: row.failed,
    }
)


@dataclass(frozen=True, slots=True)
class Spread:
    """The mean over the seeds, and the percentiles between which nearly all of them lie."""

    mean: float
    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Whether the value lies within."""
        return self.low <= value <= self.high


@dataclass(frozen=True, slots=True)
class Cell:
    """All runs of one strategy on one problem with one probability.

    Attributes:
        key: domain, size, probability, strategy, route.
        rows: its runs, by seed.
        paper: what the paper reports for it, if it does.
    """

    key: Key
    rows: tuple[Row, ...]
    paper: Reported | None

    @property
    def done(self) -> tuple[Row, ...]:
        """The runs that reached their goals within the limits. All figures are theirs."""
        return tuple(row for row in self.rows if row.done)

    @property
    def dash(self) -> bool:
        """Whether most runs met a limit, so that the paper would print a dash."""
        return 2 * len(self.done) < len(self.rows)

    @property
    def why(self) -> str:
        """Why runs were not done, with how many times."""
        reasons = sorted(row.outcome for row in self.rows if not row.done)
        return "; ".join(f"{reason} ({reasons.count(reason)} of {len(self.rows)})" for reason in dict.fromkeys(reasons))

    def spread(self, figure: Figure) -> Spread | None:
        """The spread of a figure; ``None`` if no run was done."""
        values = [figure(row) for row in self.done]
        if not values:
            return None
        low, high = np.percentile(values, (LOW, HIGH))
        return Spread(mean(values), float(low), float(high))

    @property
    def executed(self) -> Spread | None:
        """Executed actions."""
        return self.spread(lambda row: row.executed)

    @property
    def inside(self) -> bool | None:
        """Whether the paper's number lies within ours, a dash being met by a dash; ``None`` if it has none."""
        if self.paper is None:
            return None
        if self.paper.executed is None or self.dash:
            return self.dash is (self.paper.executed is None)
        executed = self.executed
        return executed is not None and executed.holds(self.paper.executed)


def cells(rows: Iterable[Row]) -> Mapping[Key, Cell]:
    """The cells that the rows fill, in order."""
    found: dict[Key, list[Row]] = {}
    for row in sorted(rows, key=lambda row: row.run):
        found.setdefault((row.domain, row.size, row.probability, row.strategy, row.route), []).append(row)
    return {
        key: Cell(key, tuple(group), reported(*key[:4]) if key[4] == Route.IN_PROCESS.value else None)
        for key, group in found.items()
    }


def total_time(row: Row) -> float:
    """Planning and deciding of the whole run [s]."""
    return row.wall_planning + row.wall_deciding


def later_time(row: Row) -> float:
    """The same without the first plan, which every strategy needs [s]."""
    return total_time(row) - row.wall_first_planning - row.wall_first_deciding


def spread_at(
    found: Mapping[Key, Cell], where: Where, strategy: str, figure: Figure, route: Route = Route.IN_PROCESS
) -> Spread | None:
    """The spread of a figure in a cell; ``None`` if there is no such cell, or a dash in it."""
    cell = found.get((*where, strategy, route.value))
    return None if cell is None or cell.dash else cell.spread(figure)


def paired(found: Mapping[Key, Cell], where: Where, *strategies: str) -> tuple[tuple[Row, ...], ...]:
    """The runs of each strategy on those seeds that all of them have done; none where one of them has a dash."""
    chosen = [found.get((*where, strategy, Route.IN_PROCESS.value)) for strategy in strategies]
    there = [cell for cell in chosen if cell is not None and not cell.dash]
    if len(there) < len(strategies):
        return ((),) * len(strategies)
    seeds = set[int].intersection(*({row.seed for row in cell.done} for cell in there))
    return tuple(tuple(row for row in cell.done if row.seed in seeds) for cell in there)


def ratios(found: Mapping[Key, Cell], figure: Figure) -> Mapping[Where, float]:
    """For each place, how many times CLO's mean REPLAN's is, on the same seeds."""
    result = {}
    for where in dict.fromkeys(key[:3] for key in found):
        clo, replan = (mean(map(figure, rows)) if rows else 0.0 for rows in paired(found, where, "clo", "replan"))
        if clo > 0:
            result[where] = replan / clo
    return result


def write_csv(found: Mapping[Key, Cell], path: Path) -> None:
    """Write one line for each cell: means and percentiles of all figures, and the paper's number."""
    spreads = [f"{name}_{what}" for name in FIGURES for what in ("mean", "low", "high")]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        who = ("domain", "problem", "probability", "strategy", "route", "runs", "done")
        writer.writerow([*who, *spreads, "paper_executed", "paper_cell", "inside", "why_not_done"])
        for (domain, size, probability, strategy, route), cell in found.items():
            numbers: list[object] = []
            for figure in FIGURES.values():
                spread = cell.spread(figure)
                numbers += (
                    ["", "", ""] if spread is None else [round(x, 6) for x in (spread.mean, spread.low, spread.high)]
                )
            paper = ["", "", ""]
            if cell.paper is not None:
                executed = "-" if cell.paper.executed is None else f"{cell.paper.executed:g}"
                paper = [executed, cell.paper.cell, "yes" if cell.inside else "no"]
            place = [domain, problem_name(size), probability, strategy, route, len(cell.rows), len(cell.done)]
            writer.writerow([*place, *numbers, *paper, cell.why])
