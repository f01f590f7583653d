"""The study in words and tables (Markdown). What did not come out as in the paper stands first."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean

from clo_fleet.paper.reference import Reported
from clo_fleet.paper.rows import Row
from clo_fleet.paper.runs import ARMS, THROUGH_UP
from clo_fleet.paper.settings import problem_name
from clo_fleet.paper.summary import Cell, Figure, Key, Spread, Where, later_time, paired, ratios, spread_at, total_time

__all__ = ["report"]

EXECUTED = """\
Means over the seeds, with the 2.5th and 97.5th percentiles. In brackets the number of the paper's Table V; `!`: it lies
outside ours. `n`: the number of seeds, where others have more. A dash: most runs met a limit."""
TIME = """\
Of a whole run: planning, and deciding (links, repairs, the choice of the next step). *Later* leaves out the first plan,
which every strategy needs. REPLAN is called in the cheapest way; its three costs stand below."""
DECIDING = """\
`clo-improve` and `replan` on the same seeds: executed actions, and the time after the first plan that the one spends on
deciding and the other on planning (of that, on the search alone)."""
COSTS = """\
Planning time of a whole run. *Search*: Fast Downward's search alone, as it reports it. *In-process*: PDDL text, the
translator in our process, the search. *Unified-planning*: as the fleet plans, on fewer seeds."""
EFFORT = "Planner calls, expanded states, and facts looked at for each executed action."
FEW = 10  # seeds below which percentiles tell little
ORDERS = 100.0  # the paper: REPLAN's effort "can be up to two orders of magnitude bigger"


def report(found: Mapping[Key, Cell], made: Sequence[str]) -> str:
    """The whole text. ``made``: lines that say with what, on what and when it was made."""
    tables = _Tables(found)
    parts = [
        "# The study of Borrajo and Veloso 2024, run again",
        _list(made),
        "## What did not come out as in the paper",
        _list(tables.differences()),
        "## Executed actions",
        EXECUTED,
        *tables.executed(),
        "## Time [s]",
        TIME,
        *tables.time(),
        "## Deciding against planning again",
        DECIDING,
        *tables.improvement(),
        "## REPLAN's three costs [s]",
        COSTS,
        *tables.costs(),
        "## Effort and perception",
        EFFORT,
        *tables.effort(),
        "## Runs that were not done",
        _list(tables.dashes()) or "None.",
    ]
    return "\n\n".join(parts) + "\n"


@dataclass(frozen=True, slots=True)
class _Tables:
    """The parts of the report."""

    found: Mapping[Key, Cell]

    @property
    def places(self) -> tuple[Where, ...]:
        """All domains, sizes and probabilities that there are rows of."""
        return tuple(dict.fromkeys(key[:3] for key in self.found))

    def cell(self, where: Where, arm: str) -> Cell | None:
        """The cell of an arm."""
        return self.found.get((*where, ARMS[arm].strategy, ARMS[arm].route.value))

    def spread(self, where: Where, arm: str, figure: Figure) -> Spread | None:
        """The spread of a figure for an arm."""
        return spread_at(self.found, where, ARMS[arm].strategy, figure, ARMS[arm].route)

    def differences(self) -> Iterator[str]:
        """Where the paper's numbers lie outside ours, and what became of its claims."""
        compared = [cell for cell in self.found.values() if cell.key[3] in ("clo", "replan") and cell.paper is not None]
        outside = [cell for cell in compared if not cell.inside]
        yield f"{len(compared) - len(outside)} of {len(compared)} of the paper's numbers of actions lie inside ours."
        few = [cell for cell in compared if len(cell.rows) < FEW]
        if few:
            lost = sum(not cell.inside for cell in few)
            yield f"{len(few)} are of cells with fewer than {FEW} seeds, which say little; {lost} of these lie outside."
        for cell in outside:
            assert cell.paper is not None
            ours = "-" if cell.dash else _spread(cell.executed) + self._seeds(cell)
            yield f"{cell.paper.cell}: the paper has {_paper(cell.paper)}, we have {ours}."
        found = ratios(self.found, total_time)
        if found and max(found.values()) < ORDERS:
            yield f"REPLAN takes at most {max(found.values()):.0f} times CLO's total time, not a hundred times."
        for where in self.places:
            clo, replan = (_mean(_executed, rows) for rows in paired(self.found, where, "clo", "replan"))
            if clo < replan:
                yield f"{_name(where)}: REPLAN executes more actions than CLO ({replan:.1f} and {clo:.1f}, same seeds)."

    def executed(self) -> Iterator[str]:
        """One table a domain."""
        arms = [arm for arm in ARMS if arm != THROUGH_UP and any(self.cell(where, arm) for where in self.places)]
        for domain, places in self._domains():
            rows = (
                [problem_name(size), f"{p:g}", *(self._executed((domain, size, p), arm) for arm in arms)]
                for _, size, p in places
            )
            yield _table([domain.upper(), "p", *arms], rows)

    def _executed(self, where: Where, arm: str) -> str:
        cell = self.cell(where, arm)
        if cell is None:
            return ""
        text = "-" if cell.dash else _spread(cell.executed) + self._seeds(cell)
        if cell.paper is not None and cell.key[3] in ("clo", "replan"):
            text += f" ({_paper(cell.paper)}){'' if cell.inside else '!'}"
        return text

    def _seeds(self, cell: Cell) -> str:
        """How many seeds a cell has, if others have more."""
        most = max(len(other.rows) for other in self.found.values())
        return f" n={len(cell.rows)}" if len(cell.rows) < most else ""

    def time(self) -> Iterator[str]:
        """One table a domain."""
        header = ["p", "clo", "replan", "ratio", "later: clo", "later: replan", "ratio"]
        for domain, places in self._domains():
            rows = (
                [
                    problem_name(where[1]),
                    f"{where[2]:g}",
                    *self._against(where, total_time),
                    *self._against(where, later_time),
                ]
                for where in places
            )
            yield _table([domain.upper(), *header], rows)

    def _against(self, where: Where, figure: Figure) -> tuple[str, str, str]:
        clo, replan = (self.spread(where, arm, figure) for arm in ("clo", "replan"))
        ratio = ratios(self.found, figure).get(where)
        return _seconds(clo), _seconds(replan), "" if ratio is None else f"{ratio:.0f}"

    def improvement(self) -> Iterator[str]:
        """What improving costs and brings, on the seeds that both have done."""
        rows = []
        for where in self.places:
            ours, theirs = paired(self.found, where, "clo-improve", "replan")
            if not ours:
                continue
            deciding, planning, search = (
                _mean(_later_deciding, ours),
                _mean(_later_planning, theirs),
                _mean(_later_search, theirs),
            )
            row = [_name(where), str(len(ours)), f"{_mean(_executed, ours):.2f}", f"{_mean(_executed, theirs):.2f}"]
            row += [f"{deciding:.4f}", f"{search:.3f}", f"{planning:.3f}"]
            rows.append([*row, f"{deciding / planning:.2%}" if planning > 0 else ""])
        header = [
            "",
            "seeds",
            "clo-improve",
            "replan",
            "deciding [s]",
            "search [s]",
            "planning [s]",
            "deciding / planning",
        ]
        yield _table(header, rows)

    def costs(self) -> Iterator[str]:
        """REPLAN's planning time, measured in three ways."""
        rows = []
        for where in self.places:
            search = self.spread(where, "replan", lambda row: row.wall_search)
            texts = [_seconds(self.spread(where, arm, lambda row: row.wall_planning)) for arm in ("replan", THROUGH_UP)]
            through = self.cell(where, THROUGH_UP)
            if search is not None:
                rows.append([_name(where), _seconds(search), *texts, str(len(through.rows)) if through else ""])
        yield _table(["", "search", "in-process", "unified-planning", "seeds"], rows)

    def effort(self) -> Iterator[str]:
        """Calls, expansions and facts looked at."""
        rows = []
        for where in self.places:
            row = [_name(where)]
            for figure in (_calls, _expansions, _attention):
                row += [_number(self.spread(where, arm, figure)) for arm in ("clo", "replan")]
            rows.append(row)
        header = ["", "calls: clo", "replan", "states: clo", "replan", "facts an action: clo", "replan"]
        yield _table(header, rows)

    def dashes(self) -> Iterator[str]:
        """Every cell with runs that were not done."""
        for (domain, size, p, strategy, route), cell in self.found.items():
            if cell.why:
                yield f"{_name((domain, size, p))} {strategy} ({route}): {cell.why}."

    def _domains(self) -> Iterator[tuple[str, list[Where]]]:
        for domain in dict.fromkeys(where[0] for where in self.places):
            yield domain, [where for where in self.places if where[0] == domain]


def _mean(figure: Figure, rows: Sequence[Row]) -> float:
    return mean(map(figure, rows)) if rows else 0.0


def _executed(row: Row) -> float:
    return row.executed


def _later_deciding(row: Row) -> float:
    return row.wall_deciding - row.wall_first_deciding


def _later_planning(row: Row) -> float:
    return row.wall_planning - row.wall_first_planning


def _later_search(row: Row) -> float:
    return row.wall_search - row.wall_first_search


def _calls(row: Row) -> float:
    return row.planner_calls


def _expansions(row: Row) -> float:
    return row.expansions


def _attention(row: Row) -> float:
    return row.looked_at / max(1, row.executed + row.failed)


def _name(where: Where) -> str:
    return f"{where[0].upper()} {problem_name(where[1])} {where[2]:g}"


def _paper(reported: Reported) -> str:
    return "-" if reported.executed is None else f"{reported.executed:g}"


def _spread(spread: Spread | None) -> str:
    return "-" if spread is None else f"{spread.mean:.1f} [{spread.low:.0f}, {spread.high:.0f}]"


def _seconds(spread: Spread | None) -> str:
    return "-" if spread is None else f"{spread.mean:.3g}"


def _number(spread: Spread | None) -> str:
    return "-" if spread is None else f"{spread.mean:,.0f}" if spread.mean >= 100 else f"{spread.mean:.1f}"


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _list(lines: Iterable[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)
