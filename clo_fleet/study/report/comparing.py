"""Strategies compared run by run: the same world, the same setting and the same seed, one strategy against another.

Two means beside each other hide that seeds differ more than strategies do; so every comparison here is a mean of paired
differences with its interval, from a percentile bootstrap over the seeds (Efron and Tibshirani, 1993, chapter 13). Only
pairs in which both runs reached their goals are compared, and how many those are is always said.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from clo_fleet.study.batch.row import Row

__all__ = ["METRICS", "Difference", "Failure", "Helps", "Setting", "differences", "failures", "helps", "setting_of"]

METRICS: Mapping[str, str] = MappingProxyType(
    {
        "makespan_s": "makespan [s]",
        "executed": "actions executed",
        "planner_calls": "planner calls",
        "planning_s": "planning, simulated [s]",
        "wall_planning_s": "planning, real [s]",
        "wall_deciding_s": "deciding, real [s]",
        "waiting_s": "waiting [s]",
        "distance_m": "way [m]",
    }
)
REACHED = "goals_reached"
RESAMPLES = 10_000
LOW, HIGH = 2.5, 97.5  # percentiles: an interval of 95 %


@dataclass(frozen=True, slots=True, order=True)
class Setting:
    """What is the same for all strategies and seeds that are compared: the world, and the swept values in words."""

    world: str
    swept: str

    def __str__(self) -> str:
        return f"{self.world}, {self.swept}" if self.swept else self.world


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A strategy against the baseline in one figure.

    Attributes:
        seeds: how many pairs were compared. ``of``: how many pairs there are.
        baseline_mean, mean: of the runs compared.
        difference: the mean of strategy less baseline, pair by pair, and its interval from ``low`` to ``high``.
    """

    setting: Setting
    metric: str
    baseline: str
    strategy: str
    seeds: int
    of: int
    baseline_mean: float
    mean: float
    difference: float
    low: float
    high: float

    @property
    def clear(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.seeds > 1 and not self.low <= 0.0 <= self.high


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """Runs that ended in the same way without their goals; ``why`` and ``example`` (an id) of the first of them."""

    setting: Setting
    strategy: str
    ending: str
    runs: int
    of: int
    why: str
    example: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Helps:
    """How often one robot's actions made steps of another's plan needless, and how many steps."""

    world: str
    strategy: str
    by: str
    robot: str
    kind: str
    times: int
    steps: int
    runs: int


def setting_of(row: Row, swept: Sequence[str]) -> Setting:
    """The row's setting."""
    changes = json.loads(row.changes)
    return Setting(row.world, ", ".join(f"{key} {changes[key]}" for key in swept if key in changes))


def differences(rows: Iterable[Row], swept: Sequence[str], baseline: str) -> tuple[Difference, ...]:
    """Every other strategy against the baseline, in every setting and figure."""
    found: dict[Setting, dict[str, dict[int, Row]]] = defaultdict(lambda: defaultdict(dict))
    for row in rows:
        found[setting_of(row, swept)][row.strategy][row.seed] = row
    compared = []
    for setting, by_strategy in sorted(found.items()):
        base = by_strategy.get(baseline, {})
        for strategy, runs in sorted(by_strategy.items()):
            seeds = sorted(base.keys() & runs.keys()) if strategy != baseline else []
            pairs = [(base[seed], runs[seed]) for seed in seeds]
            both = [(one, other) for one, other in pairs if one.outcome == other.outcome == REACHED]
            for metric in METRICS if both else ():
                values = np.array([[getattr(row, metric) for row in pair] for pair in both], dtype=np.float64)
                change = values[:, 1] - values[:, 0]
                low, high = _interval(change)
                compared.append(
                    Difference(
                        setting=setting,
                        metric=metric,
                        baseline=baseline,
                        strategy=strategy,
                        seeds=len(both),
                        of=len(pairs),
                        baseline_mean=float(values[:, 0].mean()),
                        mean=float(values[:, 1].mean()),
                        difference=float(change.mean()),
                        low=low,
                        high=high,
                    )
                )
    return tuple(compared)


def failures(rows: Iterable[Row], swept: Sequence[str]) -> tuple[Failure, ...]:
    """The runs without their goals, the most frequent kind first."""
    kinds: dict[tuple[Setting, str, str], list[Row]] = defaultdict(list)
    all_: Counter[tuple[Setting, str]] = Counter()
    for row in rows:
        setting = setting_of(row, swept)
        all_[setting, row.strategy] += 1
        if row.outcome != REACHED:
            kinds[setting, row.strategy, row.ending if row.lost else row.outcome].append(row)
    found = [
        Failure(
            setting=setting,
            strategy=strategy,
            ending=ending,
            runs=len(lost),
            of=all_[setting, strategy],
            why=lost[0].why,
            example=lost[0].run_id,
        )
        for (setting, strategy, ending), lost in kinds.items()
    ]
    return tuple(sorted(found, key=lambda failure: (-failure.runs, failure.setting, failure.strategy, failure.ending)))


def helps(rows: Iterable[Row], runs: Path) -> tuple[Helps, ...]:
    """Who helped whom, summed over the runs of each world and strategy, from their ``result.json``."""
    times: Counter[tuple[str, ...]] = Counter()
    steps: Counter[tuple[str, ...]] = Counter()
    count: Counter[tuple[str, str]] = Counter()
    for row in rows:
        count[row.world, row.strategy] += 1
        if not row.helps:
            continue
        result = json.loads((runs / row.run_id / "result.json").read_text(encoding="utf-8"))
        for given in result["helps"]:
            key = (row.world, row.strategy, given["by"], given["robot"], given["kind"])
            times[key] += 1
            steps[key] += len(given["dropped"])
    return tuple(
        Helps(
            world=key[0],
            strategy=key[1],
            by=key[2],
            robot=key[3],
            kind=key[4],
            times=number,
            steps=steps[key],
            runs=count[key[0], key[1]],
        )
        for key, number in sorted(times.items())
    )


def _interval(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> tuple[float, float]:
    """Of the mean; the value itself where there is only one."""
    picks = np.random.default_rng(0).integers(0, len(values), (RESAMPLES, len(values)))
    low, high = np.percentile(values[picks].mean(axis=1), (LOW, HIGH))
    return float(low), float(high)
