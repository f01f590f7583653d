"""Which runs make up a study, and in which order.

An *arm* is a strategy with the way in which its planner is called: only for the paper's REPLAN there are two, so that
what planning costs through unified-planning stands beside the least that it can cost.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.errors import CloFleetError
from clo_fleet.paper.calls import Route
from clo_fleet.paper.catalogue import PROBABILITIES, SETTINGS, SIZES
from clo_fleet.paper.rows import Run
from clo_fleet.paper.settings import problem_name

__all__ = ["ARMS", "THROUGH_UP", "Arm", "Selection", "UnknownNameError", "narrowed", "quick", "runs"]

REPLAN = "replan"
THROUGH_UP = f"{REPLAN}-{Route.UNIFIED_PLANNING.value}"
# In DIALOG the planner's task grows with the square of the people seen, and REPLAN solves it at every step: minutes a
# run at p-10, the time limit at p-40. Such runs are done for a share of the seeds.
DIALOG_SHARES: Mapping[int, float] = MappingProxyType({10: 1 / 3, 20: 1 / 4, 40: 1 / 10})
THROUGH_UP_SHARE = 1 / 5


@dataclass(frozen=True, slots=True)
class Arm:
    """A strategy and how its planner is called."""

    name: str
    strategy: str
    route: Route = Route.IN_PROCESS


ARMS: Mapping[str, Arm] = MappingProxyType(
    {name: Arm(name, name) for name in STRATEGIES} | {THROUGH_UP: Arm(THROUGH_UP, REPLAN, Route.UNIFIED_PLANNING)}
)


class UnknownNameError(CloFleetError):
    """A problem or strategy is asked for that there is not.

    Attributes:
        name: as given.
    """

    def __init__(self, kind: str, name: str, known: Sequence[str]) -> None:
        super().__init__(f"unknown {kind} {name!r}; expected one of {', '.join(known)}")
        self.name = name


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What is to be studied.

    Attributes:
        problems: domains and sizes.
        probabilities: of opportunities.
        arms: the strategies.
        seeds: how many runs a cell, from seed 0; costly ones fewer.
        through_up: the sizes for which planning through unified-planning is measured as well.
    """

    problems: tuple[tuple[str, int], ...] = tuple((domain, size) for domain in SETTINGS for size in SIZES)
    probabilities: tuple[float, ...] = PROBABILITIES
    arms: tuple[Arm, ...] = tuple(ARMS.values())
    seeds: int = 20
    through_up: tuple[int, ...] = SIZES


def quick() -> Selection:
    """Minutes instead of hours: the two smaller problems of each domain, three seeds."""
    problems = tuple((domain, size) for domain in SETTINGS for size in SIZES[:2])
    return Selection(problems=problems, seeds=3, through_up=SIZES[:1])


def narrowed(
    base: Selection, *, problems: Sequence[str] = (), strategies: Sequence[str] = (), seeds: int | None = None
) -> Selection:
    """The selection with only the problems and strategies that are named, if any are.

    A name of a problem is ``rooms/p-05``, or ``p-05`` in all domains, or ``rooms`` in all sizes.

    Raises:
        UnknownNameError: if there is no such problem or strategy.
    """
    every = Selection()
    names = {pair: (f"{pair[0]}/{problem_name(pair[1])}", problem_name(pair[1]), pair[0]) for pair in every.problems}
    for name in problems:
        if not any(name in known for known in names.values()):
            raise UnknownNameError("problem", name, sorted({known for three in names.values() for known in three}))
    for name in strategies:
        if name not in ARMS:
            raise UnknownNameError("strategy", name, tuple(ARMS))
    chosen = tuple(pair for pair, known in names.items() if set(known) & set(problems))
    return replace(
        base,
        problems=chosen or base.problems,
        arms=tuple(ARMS[name] for name in strategies) or base.arms,
        seeds=base.seeds if seeds is None else seeds,
        through_up=every.through_up if strategies else base.through_up,
    )


def runs(selected: Selection) -> tuple[Run, ...]:
    """The runs, a seed at a time, the longest of each seed first: two workers end at about the same time then."""
    found = [
        Run(domain, size, probability, arm.strategy, arm.route.value, seed)
        for seed in range(selected.seeds)
        for domain, size in selected.problems
        for probability in selected.probabilities
        for arm in selected.arms
        if seed < _seeds(arm, domain, size, selected)
    ]
    return tuple(sorted(found, key=_order))


def _seeds(arm: Arm, domain: str, size: int, selected: Selection) -> int:
    """How many seeds the cell gets."""
    share = 1.0
    if arm.strategy == REPLAN and domain == "dialog":
        share *= DIALOG_SHARES.get(size, 1.0)
    if arm.route is Route.UNIFIED_PLANNING:
        share *= THROUGH_UP_SHARE if size in selected.through_up else 0.0
    return math.ceil(share * selected.seeds)


def _order(run: Run) -> tuple[object, ...]:
    return run.seed, run.strategy != REPLAN, run.domain != "dialog", -run.size, run.probability, run.route, run
