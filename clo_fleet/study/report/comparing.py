"""Strategies compared run by run: the same world, the same setting and the same seed, one strategy against another.

Two means beside each other hide that seeds differ more than strategies do; so every comparison here is a mean of paired
differences with its interval, from a percentile bootstrap over the seeds (Efron and Tibshirani, 1993, chapter 13). Only
pairs in which both runs reached their goals are compared, and how many those are is always said.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from clo_fleet.study.batch.row import Row

__all__ = [
    "METRICS",
    "OVERALL",
    "REACHED",
    "Difference",
    "Outcomes",
    "Place",
    "Setting",
    "by_strategy",
    "differences",
    "estimate",
    "outcomes",
    "setting_of",
]

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
AT_ONCE = 4_000_000  # numbers drawn at once: 32 MB
LOW, HIGH = 2.5, 97.5  # percentiles: an interval of 95 %


@dataclass(frozen=True, slots=True, order=True)
class Setting:
    """What is the same for all strategies and seeds that are compared: the world, and the swept values in words."""

    world: str
    swept: str

    def __str__(self) -> str:
        return f"{self.world}, {self.swept}" if self.swept else self.world


OVERALL = Setting("all settings", "")


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
    def worth_showing(self) -> bool:
        """Whether the figure is not zero in all of the runs."""
        return bool(self.mean or self.baseline_mean)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcomes:
    """How many runs of a strategy reached their goals, and how many of the pairs with the baseline's runs.

    Attributes:
        runs: of the strategy; ``reached`` of them reached their goals.
        both, alone, baseline_alone, neither: of the pairs, those in which both, only the strategy, only the baseline,
            or neither of them did.
    """

    strategy: str
    runs: int
    reached: int
    both: int
    alone: int
    baseline_alone: int
    neither: int


Place = tuple[Setting, int]
"""A setting and a seed: what the runs of a pair have in common."""


def setting_of(row: Row, swept: Sequence[str]) -> Setting:
    """The row's setting."""
    changes = json.loads(row.changes)
    return Setting(row.world, ", ".join(f"{key} {changes[key]}" for key in swept if key in changes))


def differences(rows: Iterable[Row], swept: Sequence[str], baseline: str) -> tuple[Difference, ...]:
    """Every other strategy against the baseline, in every figure: in every setting, then over all if there are several.

    The seeds of several settings are resampled together.
    """
    runs = by_strategy(rows, swept)
    pairs: dict[Setting, dict[str, list[tuple[Row, Row]]]] = defaultdict(lambda: defaultdict(list))
    for strategy in sorted(runs.keys() - {baseline}):
        for (setting, _), pair in _pairs(runs, strategy, baseline):
            pairs[setting][strategy].append(pair)
    settings = sorted(pairs)
    if len(settings) > 1:
        for setting in settings:
            for strategy, some in pairs[setting].items():
                pairs[OVERALL][strategy] += some
        settings.append(OVERALL)
    return tuple(
        difference
        for setting in settings
        for strategy, some in sorted(pairs[setting].items())
        for difference in _compared(some, setting, strategy, baseline)
    )


def outcomes(rows: Iterable[Row], swept: Sequence[str], baseline: str) -> tuple[Outcomes, ...]:
    """Who reached the goals, the baseline first."""
    runs = by_strategy(rows, swept)
    found = []
    for strategy in sorted(runs, key=lambda name: (name != baseline, name)):
        ends = Counter(
            (one.outcome == REACHED, other.outcome == REACHED) for _, (other, one) in _pairs(runs, strategy, baseline)
        )
        found.append(
            Outcomes(
                strategy=strategy,
                runs=len(runs[strategy]),
                reached=sum(row.outcome == REACHED for row in runs[strategy].values()),
                both=ends[True, True],
                alone=ends[True, False],
                baseline_alone=ends[False, True],
                neither=ends[False, False],
            )
        )
    return tuple(found)


def by_strategy(rows: Iterable[Row], swept: Sequence[str]) -> Mapping[str, Mapping[Place, Row]]:
    """The runs of each strategy, by setting and seed."""
    found: dict[str, dict[Place, Row]] = defaultdict(dict)
    for row in rows:
        found[row.strategy][setting_of(row, swept), row.seed] = row
    return found


def estimate(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> tuple[float, float, float]:
    """The mean, and its interval by resampling: the value itself where there is only one."""
    random, count = np.random.default_rng(0), len(values)
    blocks = np.array_split(np.arange(RESAMPLES), -(-RESAMPLES * count // AT_ONCE))
    means = [values[random.integers(0, count, (len(block), count))].mean(axis=1) for block in blocks]
    low, high = np.percentile(np.concatenate(means), (LOW, HIGH))
    return float(values.mean()), float(low), float(high)


def _pairs(
    runs: Mapping[str, Mapping[Place, Row]], strategy: str, baseline: str
) -> Iterator[tuple[Place, tuple[Row, Row]]]:
    """The baseline's run and the strategy's, for every place where there are both."""
    own, base = runs[strategy], runs.get(baseline, {})
    for place in sorted(own.keys() & base.keys()):
        yield place, (base[place], own[place])


def _compared(pairs: Sequence[tuple[Row, Row]], setting: Setting, strategy: str, baseline: str) -> Iterator[Difference]:
    both = [pair for pair in pairs if all(row.outcome == REACHED for row in pair)]
    for metric in METRICS if both else ():
        values = np.array([[getattr(row, metric) for row in pair] for pair in both], dtype=np.float64)
        change = values[:, 1] - values[:, 0]
        difference, low, high = estimate(change)
        yield Difference(
            setting=setting,
            metric=metric,
            baseline=baseline,
            strategy=strategy,
            seeds=len(both),
            of=len(pairs),
            baseline_mean=float(values[:, 0].mean()),
            mean=float(values[:, 1].mean()),
            difference=difference,
            low=low,
            high=high,
        )
