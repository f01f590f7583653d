"""What happened in a batch's runs, counted: how they failed, and who helped whom."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from clo_fleet.study.batch.row import Row
from clo_fleet.study.report.comparing import REACHED, Setting, setting_of

__all__ = ["Failure", "Helps", "failures", "helps"]


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
