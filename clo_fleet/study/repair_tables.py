"""What a study of repairs came to: tables by domain and kind of surprise, and files for further counting."""

import csv
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from itertools import groupby
from pathlib import Path
from statistics import mean

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table

from clo_fleet.clo.mending import Means
from clo_fleet.study.repair_episodes import Kind
from clo_fleet.study.repair_study import Study, Trial

__all__ = ["Row", "rows", "tables", "write_study"]

ALL = "all"
LEGEND = "surprises: others do so many actions; another does a later step of the plan (own action); 1 to 3 facts turn"
MOST_LISTED = 10  # invalid plans


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """The trials of one domain with one kind of surprise.

    Attributes:
        surprise: such as ``5 actions``.
        broken: plans that did not reach the goals any more: repaired by one of the next four means, or ``left``.
        why_left: the reasons, each with its number.
        no_plan: those left for which it was proved that no plan exists.
        only_back: those left for which the search saw no way on but through the state before the surprise.
        shorter: plans that got shorter, broken or not.
        ratio: the length of repaired plans, as a multiple of what was left of the plan before.
        back: repaired plans that lead through the state before the surprise.
        invalid: plans that do not reach the goals although the repair said so.
        printed_valid, printed_invalid: the plans of ``clo-as-printed``.
        wall_ms_50, wall_ms_95, wall_ms_99: the time of a decision on a broken plan [ms], percentiles.
    """

    domain: str
    surprise: str
    episodes: int
    broken: int
    deletion: int
    relinking: int
    rebinding: int
    bridge: int
    left: int
    why_left: str
    no_plan: int
    only_back: int
    shorter: int
    ratio: float
    back: int
    invalid: int
    printed_valid: int
    printed_invalid: int
    wall_ms_50: float
    wall_ms_95: float
    wall_ms_99: float

    @property
    def repaired(self) -> float:
        """The repaired part of the broken plans."""
        return 1 - self.left / self.broken if self.broken else 1.0

    @property
    def repaired_of_possible(self) -> float:
        """The same, of those that may have a way on: there is a plan, and not only one that goes back."""
        hopeless = self.no_plan + self.only_back
        possible = self.broken - hopeless
        return 1 - (self.left - hopeless) / possible if possible else 1.0


def rows(trials: Iterable[Trial]) -> tuple[Row, ...]:
    """A row for each domain and surprise; those of all domains together come last, if there are several domains."""
    trials = sorted(trials, key=lambda trial: trial.domain)
    found = [row for domain, group in groupby(trials, key=lambda trial: trial.domain) for row in _rows(domain, group)]
    domains = {row.domain for row in found}
    return (*found, *(_rows(ALL, trials) if len(domains) > 1 else ()))


def tables(study: Study) -> RenderableType:
    """The study for a terminal, some 120 characters wide."""
    found = rows(study.trials)
    parts: list[RenderableType] = [LEGEND, "", _repairs(found), _quality(found), *_summary(found)]
    if answers := _counted(trial.solvable for trial in study.trials if trial.solvable):
        parts.append(f"is there a plan where the repair was refused? {answers}")
    parts += [f"left out: {skipped.label}: {skipped.why}" for skipped in study.skipped]
    invalid = [trial for trial in study.trials if trial.valid is False]
    again = f"--seed {study.settings.seed} --actions {','.join(map(str, study.settings.sizes))}"
    parts += [f"INVALID: {again} --episode {trial.label}:{trial.number}" for trial in invalid[:MOST_LISTED]]
    return Group(*parts)


def write_study(study: Study, folder: Path) -> tuple[Path, Path]:
    """Write ``episodes.csv`` and ``summary.csv``; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    episodes, summary = folder / "episodes.csv", folder / "summary.csv"
    _write(episodes, [field.name for field in fields(Trial)], [_plain(trial) for trial in study.trials])
    _write(summary, [field.name for field in fields(Row)], [asdict(row) for row in rows(study.trials)])
    return episodes, summary


def _rows(domain: str, trials: Iterable[Trial]) -> Iterable[Row]:
    groups: dict[tuple[int, int], list[Trial]] = {}
    for trial in trials:
        size = trial.size if trial.kind is Kind.FOREIGN else 0
        groups.setdefault((list(Kind).index(trial.kind), size), []).append(trial)
    return [_row(domain, groups[key]) for key in sorted(groups)]


def _row(domain: str, trials: Sequence[Trial]) -> Row:
    broken = [trial for trial in trials if trial.broken]
    left = [trial for trial in broken if not trial.repaired]
    means = Counter(trial.means for trial in broken)
    lengths = [trial.length / trial.rest for trial in broken if trial.length is not None]
    milliseconds = sorted(1000 * trial.wall_seconds for trial in broken)
    printed = sum(trial.printed_valid for trial in trials)
    return Row(
        domain=domain,
        surprise=_surprise(trials[0]),
        episodes=len(trials),
        broken=len(broken),
        deletion=means[Means.DELETION.value],
        relinking=means[Means.RELINKING.value],
        rebinding=means[Means.REBINDING.value],
        bridge=means[Means.BRIDGE.value],
        left=len(left),
        why_left=_counted(trial.why for trial in left),
        no_plan=sum(trial.why == "unsolvable" or trial.solvable == "no" for trial in left),
        only_back=sum(trial.why == "only_back" and trial.solvable != "no" for trial in left),
        shorter=sum(trial.length is not None and trial.length < trial.rest for trial in trials),
        ratio=round(mean(lengths), 3) if lengths else 1.0,
        back=sum(trial.back is True for trial in trials),
        invalid=sum(trial.valid is False for trial in trials),
        printed_valid=printed,
        printed_invalid=len(trials) - printed,
        wall_ms_50=_percentile(milliseconds, 50),
        wall_ms_95=_percentile(milliseconds, 95),
        wall_ms_99=_percentile(milliseconds, 99),
    )


def _counted(words: Iterable[str]) -> str:
    """How often each word comes, the most frequent first."""
    return ", ".join(f"{count} {word.replace('_', ' ')}" for word, count in Counter(words).most_common())


def _surprise(trial: Trial) -> str:
    if trial.kind is Kind.FOREIGN:
        return f"{trial.size} action{'s' if trial.size > 1 else ''}"
    return {Kind.OWN: "own action", Kind.FLIP: "facts turn"}[trial.kind]


def _percentile(values: Sequence[float], percent: int) -> float:
    """The smallest value that so many per cent do not exceed; 0 without values."""
    return round(values[max(0, math.ceil(len(values) * percent / 100) - 1)], 3) if values else 0.0


def _repairs(found: Sequence[Row]) -> Table:
    table = _table("broken plans, and by what they were repaired")
    for name in ("episodes", "broken", *(means.value for means in Means), "left", "repaired"):
        _number(table, name)
    table.add_column("why left")
    for row, first in _marked(table, found):
        means = (row.deletion, row.relinking, row.rebinding, row.bridge)
        counts = map(str, (row.episodes, row.broken, *means, row.left))
        table.add_row(first, row.surprise, *counts, f"{row.repaired:.1%}", row.why_left)
    return table


def _quality(found: Sequence[Row]) -> Table:
    table = _table("the plans then (length, and time to decide: of broken ones)")
    for name in ("shorter", "length", "back", "invalid", "median ms", "95% ms", "99% ms"):
        _number(table, name)
    for name in ("printed valid", "printed invalid"):
        _number(table, name)
    for row, first in _marked(table, found):
        times = (f"{value:.2f}" for value in (row.wall_ms_50, row.wall_ms_95, row.wall_ms_99))
        printed = (str(row.printed_valid), str(row.printed_invalid))
        counts = (str(row.shorter), f"{row.ratio:.2f}", str(row.back), str(row.invalid))
        table.add_row(first, row.surprise, *counts, *times, *printed)
    return table


def _summary(found: Sequence[Row]) -> Iterable[str]:
    """What it comes to, a line for each surprise."""
    last = [row for row in found if row.domain == found[-1].domain]  # all domains, if there are several
    for row in last:
        yield (
            f"{row.surprise}: of {row.broken} broken plans {row.repaired:.1%} repaired without the planner, "
            f"{row.repaired_of_possible:.1%} of those that need not go back; median decision {row.wall_ms_50:.2f} ms"
        )
    yield f"plans called repaired that do not reach their goals: {sum(row.invalid for row in last)}"


def _marked(table: Table, found: Sequence[Row]) -> Iterable[tuple[Row, str]]:
    """The rows, with the domain's name at its first one, and a line between domains."""
    for domain, group in groupby(found, key=lambda row: row.domain):
        for place, row in enumerate(group):
            yield row, "" if place else domain
        table.add_section()


def _table(title: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("domain")
    table.add_column("surprise")
    return table


def _number(table: Table, name: str) -> None:
    table.add_column(name, justify="right", min_width=max(map(len, name.split())))


def _plain(trial: Trial) -> dict[str, object]:
    return asdict(trial) | {"kind": trial.kind.name.lower(), "wall_seconds": round(trial.wall_seconds, 6)}


def _write(path: Path, names: Sequence[str], values: Iterable[dict[str, object]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(values)
