"""How a batch's figures grow with the number of robots.

The lines of several strategies are comparable only if they rest on the same runs: a strategy that fails in the hard
ones would look better for it. So for each size of the fleet only worlds, settings and seeds count in which all
strategies reached their goals; the share of runs that did is a figure of its own.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from clo_fleet.study.batch.row import Row
from clo_fleet.study.report.comparing import METRICS, REACHED, Place, Setting, by_strategy, estimate, setting_of

__all__ = ["FIGURES", "SHARE", "Growth", "growth"]

SHARE = "share"
FIGURES: Mapping[str, str] = MappingProxyType({SHARE: "goals reached [%]", **METRICS})
FLEET_SIZE = "fleet_size"
SINGLE = "worlds of one fleet size"


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """A point of a line.

    Attributes:
        setting: what is the same along the line.
        figure: a key of ``FIGURES``.
        runs: how many runs the mean is of. ``of``: how many there are with as many robots.
        mean: and its interval from ``low`` to ``high``.
    """

    setting: Setting
    figure: str
    strategy: str
    robots: int
    runs: int
    of: int
    mean: float
    low: float
    high: float


def growth(rows: Iterable[Row], swept: Sequence[str]) -> tuple[Growth, ...]:
    """A line for each setting that was run with fleets of several sizes, strategy and figure.

    Worlds that have one size each make lines together.
    """
    others = [key for key in swept if key != FLEET_SIZE]
    sized = [(setting_of(row, others), robots, row) for row, robots in _fleets(rows, swept)]
    sizes: dict[Setting, set[int]] = defaultdict(set)
    for setting, robots, _ in sized:
        sizes[setting].add(robots)
    points: dict[tuple[Setting, int], list[Row]] = defaultdict(list)
    for setting, robots, row in sized:
        points[setting if len(sizes[setting]) > 1 else Setting(SINGLE, setting.swept), robots].append(row)
    several = Counter(setting for setting, _ in points)
    return tuple(
        point
        for (setting, robots), group in sorted(points.items())
        if several[setting] > 1
        for point in _points(setting, robots, by_strategy(group, swept))
    )


def _fleets(rows: Iterable[Row], swept: Sequence[str]) -> Iterator[tuple[Row, int]]:
    """The rows with how many robots they had, or were to have; without those that nobody can tell."""
    rows = tuple(rows)
    known = {setting_of(row, swept): row.robots for row in rows if row.robots}
    for row in rows:
        robots = row.robots or known.get(setting_of(row, swept)) or json.loads(row.changes).get(FLEET_SIZE)
        if robots:
            yield row, robots


def _points(setting: Setting, robots: int, runs: Mapping[str, Mapping[Place, Row]]) -> Iterator[Growth]:
    places = set.intersection(*(set(own) for own in runs.values()))
    reached = sorted(place for place in places if all(own[place].outcome == REACHED for own in runs.values()))
    for strategy, own in runs.items():
        values = {SHARE: [100.0 * (row.outcome == REACHED) for row in own.values()]}
        values |= {metric: [float(getattr(own[place], metric)) for place in reached] for metric in METRICS}
        for figure, numbers in values.items():
            if numbers:
                mean, low, high = estimate(np.array(numbers))
                yield Growth(
                    setting=setting,
                    figure=figure,
                    strategy=strategy,
                    robots=robots,
                    runs=len(numbers),
                    of=len(own),
                    mean=mean,
                    low=low,
                    high=high,
                )
