"""An explanation as tables for a terminal: the plan, why it holds, what would help it, what would break it."""

from collections.abc import Sequence

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from clo_fleet.study.explanation import Explanation, FateRow, GuardRow, OpportunityRow, Place, RepairRow

__all__ = ["explanation_text"]

Titled = tuple[Text, Table]
"""A table with its title: one of its own would be broken to the table's width."""


def explanation_text(explanation: Explanation) -> RenderableType:
    """All that is said of the plan."""
    parts: list[RenderableType] = [Text(_headline(explanation)), *_plan(explanation)]
    parts += _links(explanation) if explanation.links else [Text("\ncausal links: none")]
    if explanation.opportunities:
        parts += _opportunities(explanation.opportunities)
    if explanation.guards:
        parts += _guards(explanation.guards, explanation)
    if explanation.repair is not None:
        parts += _repair(explanation.repair, explanation)
    return Group(*parts)


def _headline(explanation: Explanation) -> str:
    steps, done = len(explanation.steps), explanation.executed
    what = f"{explanation.task}: a plan of {_counted(steps, 'step')}, cost {explanation.cost}, {explanation.source}"
    if not done:
        return what
    which = "step 1 has" if done == 1 else f"steps 1-{done} have"
    return f"{what};\n{which} been done, {_counted(steps - done, 'step')} left, cost {explanation.cost_left}"


def _plan(explanation: Explanation) -> Titled:
    table = _table()
    _number(table, "step")
    table.add_column("action")
    _number(table, "cost")
    table.add_column("supports")
    for row in explanation.steps:
        table.add_row(
            str(row.step), Text(row.action), str(row.cost), "done" if row.done else _places(row.supports) or "nothing"
        )
    return Text("\nthe plan"), table


def _links(explanation: Explanation) -> Titled:
    """As in the paper: the producer's step is named once."""
    table = _table()
    _number(table, "step")
    for name in ("producer", "fact", "consumer"):
        table.add_column(name)
    last = 0
    for row in explanation.links:
        step = "" if row.producer == last else str(row.producer)
        producer = explanation.steps[row.producer - 1].action
        table.add_row(step, Text(producer), Text(row.fact), Text(_named(row.consumer, explanation)))
        last = row.producer
    return Text("\ncausal links: who makes what true for whom"), table


def _opportunities(rows: Sequence[OpportunityRow]) -> Titled:
    table = _table()
    table.add_column("fact")
    _number(table, "cost saved now")
    _number(table, "steps saved now")
    table.add_column("helps before steps")
    for row in rows:
        windows = ", ".join(_window(window.first, window.last) for window in row.windows)
        table.add_row(Text(row.fact), str(row.saves), str(row.saves_steps), windows or "not on its own")
    return Text("\nopportunities: what would help if it turned true by itself"), table


def _guards(rows: Sequence[GuardRow], explanation: Explanation) -> Titled:
    table = _table()
    table.add_column("fact")
    table.add_column("needed by")
    for row in rows:
        table.add_row(Text(row.fact), Text("; ".join(_named(place, explanation) for place in row.needed_by)))
    return Text("\nguards: what holds now and has to stay so"), table


def _repair(repair: RepairRow, explanation: Explanation) -> list[RenderableType]:
    happened = Text("\n" + "\n".join(map(str, repair.changes)))
    if repair.refused:
        missing = [
            f"nothing brings about {row.fact} for {'; '.join(_named(place, explanation) for place in row.needed_by)}"
            for row in repair.missing
        ]
        return [happened, Text("\n".join([f"\nno repair: {repair.refused}", *missing]))]
    if all(row.fate == "kept" for row in repair.steps):
        return [happened, Text("\nthe plan stays as it is")]
    table = _table()
    _number(table, "step")
    table.add_column("action")
    _number(table, "cost")
    table.add_column("what becomes of it")
    for row in repair.steps:
        style = {"kept": "", "dropped": "strike", "added": "bold"}[row.fate]
        table.add_row(str(row.step), Text(row.action, style), str(row.cost), Text(_fate(row)))
    summary = f"\ncost left: {repair.cost_before} before, {repair.cost_after} after; means: {repair.means}"
    return [happened, Text("\nthe repaired plan"), table, Text(summary)]


def _fate(row: FateRow) -> str:
    because = f", because {' and '.join(row.because)} {'is' if len(row.because) == 1 else 'are'} true"
    return row.fate + (f": {row.reason}" if row.reason else "") + (because if row.because else "")


def _named(place: Place, explanation: Explanation) -> str:
    if isinstance(place, str):
        return place
    return f"{place} {explanation.steps[place - 1].action}"


def _places(places: Sequence[Place]) -> str:
    return ", ".join(map(str, places))


def _window(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}-{last}"


def _table() -> Table:
    """An empty table with few lines: it has to fit a terminal."""
    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False, show_edge=False)


def _number(table: Table, name: str) -> None:
    """A column of numbers, at least as wide as the longest word of its name."""
    table.add_column(name, justify="right", min_width=max(map(len, name.split())))


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
