"""Results as tables for a terminal: one run, or several strategies side by side."""

from collections import Counter
from collections.abc import Sequence

from rich import box
from rich.console import Console, Group, RenderableType
from rich.table import Table

from clo_fleet.fleet.outcome import ADVICE
from clo_fleet.study.result import RunResult

__all__ = ["comparison", "plain_table", "show", "summary"]


def show(content: RenderableType) -> None:
    """Print to standard output; plain text, at most as wide as it needs to be, where that is no terminal."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=200)
    console.print(content)


def summary(result: RunResult) -> RenderableType:
    """What a run came to: a row a robot, who helped whom, and the outcome."""
    parts: list[RenderableType] = [_steps(result), _times(result)]
    if result.helps:
        parts.append(_helps(result))
    if result.disturbances:
        parts.append(_disturbances(result))
    parts.append(_outcome(result))
    return Group(*parts)


def comparison(results: Sequence[RunResult]) -> RenderableType:
    """Strategies side by side, all robots together. The real times are this machine's."""
    table = Table(
        title=f"{results[0].world}, seed {results[0].seed}",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("strategy", no_wrap=True)
    table.add_column("outcome", no_wrap=True)
    for name in ("makespan s", "actions executed", "steps dropped", "planner calls", "states expanded", "repairs"):
        _number(table, name)
    for name in ("opportunities used of seen", "waiting s", "real ms planning", "real ms deciding"):
        _number(table, name)
    for result in results:
        robots = result.robots.values()
        table.add_row(
            result.strategy,
            result.outcome,
            f"{result.makespan_s:.1f}",
            str(result.executed),
            str(sum(robot.dropped for robot in robots)),
            str(result.planner_calls),
            str(sum(robot.expansions for robot in robots)),
            str(sum(robot.repairs for robot in robots)),
            f"{sum(r.opportunities_used for r in robots)} of {sum(r.opportunities_seen for r in robots)}",
            f"{sum(robot.waiting_s for robot in robots):.1f}",
            f"{1000 * sum(robot.wall_planning_s for robot in robots):.0f}",
            f"{1000 * sum(robot.wall_deciding_s for robot in robots):.1f}",
        )
    return table


def plain_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> RenderableType:
    """Any values under any names; numbers to the right."""
    table = _table("")
    numeric = [all(isinstance(row[index], int | float) for row in rows) for index in range(len(columns))]
    for name, number in zip(columns, numeric, strict=True):
        table.add_column(name, justify="right" if number else "left")
    for row in rows:
        table.add_row(*(f"{value:g}" if isinstance(value, float) else str(value) for value in row))
    return table


def _table(title: str) -> Table:
    """An empty table with few lines: it has to fit a terminal."""
    return Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)


def _number(table: Table, name: str) -> None:
    """A column of numbers, at least as wide as the longest word of its name."""
    table.add_column(name, justify="right", min_width=max(map(len, name.split())))


def _steps(result: RunResult) -> Table:
    table = _table(f"{result.world} with {result.strategy}, seed {result.seed}")
    table.add_column("robot")
    for name in ("planned", "executed", "dropped", "failed", "planner calls", "replans", "repairs"):
        _number(table, name)
    table.add_column("help by", min_width=7)
    table.add_column("goals", min_width=7)
    for name, robot in result.robots.items():
        more = robot.planned_again + robot.added
        table.add_row(
            name,
            f"{robot.planned}+{more}" if more else str(robot.planned),
            str(robot.executed),
            str(robot.dropped + robot.cancelled),
            str(robot.failed),
            str(robot.planner_calls),
            str(max(0, robot.planner_calls - 1)),
            str(robot.repairs),
            ", ".join(f"{count} by {helper}" for helper, count in robot.opportunities_by.items()) or "none",
            "reached" if robot.goals_reached else "missed",
        )
    return table


def _times(result: RunResult) -> Table:
    table = _table("where the time went (planning and repair: real time)")
    table.add_column("robot")
    for name in ("planning s", "repair ms", "travel s", "work s", "waiting s", "way m"):
        _number(table, name)
    for name, robot in result.robots.items():
        table.add_row(
            name,
            f"{robot.wall_planning_s:.2f}",
            f"{1000 * robot.wall_deciding_s:.1f}",
            f"{robot.travelling_s:.1f}",
            f"{robot.working_s:.1f}",
            f"{robot.waiting_s:.1f}",
            f"{robot.distance_m:.1f}",
        )
    return table


def _helps(result: RunResult) -> Table:
    table = _table("who helped whom")
    for name in ("time s", "by", "robot", "fact", "steps that were not needed any more"):
        table.add_column(name)
    for given in result.helps:
        table.add_row(f"{given.time_s:.1f}", given.by, given.robot, given.fact, ", ".join(given.dropped))
    return table


def _disturbances(result: RunResult) -> Table:
    table = _table("what befell the fleet")
    table.add_column("disturbance")
    for name in ("times", "no effect", "repairs", "replans"):
        _number(table, name)
    for kind, found in result.disturbances.items():
        counts = (found.happened, found.without_effect, found.repairs, found.replans)
        table.add_row(kind, *map(str, counts))
    return table


def _outcome(result: RunResult) -> str:
    kinds = Counter(given.kind for given in result.helps)
    helped = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in sorted(kinds.items()))
    lines = [f"outcome: {result.outcome} after {result.makespan_s:.1f} s ({result.why})"]
    if helped:
        lines.append(f"objects of others used: {helped}")
    if result.wall_limited:
        lines.append("wall_limited: a planner met its limit of real time; this run depends on the machine's speed")
    advice = {outcome.value: text for outcome, text in ADVICE.items()}.get(result.outcome)
    if advice:
        lines.append(f"what to do: {advice}")
    return "\n".join(lines)
