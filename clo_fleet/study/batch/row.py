"""A run's row: one flat line of numbers, in its folder as ``row.json`` once the run has ended, whatever its end.

A row in its folder is what makes a run done: it is written last, and whole or not at all.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self

from clo_fleet.study.atomic import write_whole
from clo_fleet.study.batch.definition import Definition

__all__ = ["ENDED", "Row", "read_row", "row_of", "write_row"]

ENDED = "ended"
SUMMED = (
    "planned", "planned_again", "added", "executed", "dropped", "cancelled", "failed", "superseded", "pending",
    "planner_calls", "repairs", "repairs_refused", "opportunities_seen", "opportunities_used", "facts_seen",
    "facts_heard", "expansions", "planning_s", "travelling_s", "working_s", "waiting_s", "distance_m",
    "wall_planning_s", "wall_deciding_s",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """How a run went. The sums are over all robots, as in ``result.json``; zero where there is no result.

    Attributes:
        run_id: of its definition.
        world: the world's name; the file's name where it could not be read.
        changes: as JSON.
        ending: ``ended``, or how the process was lost: ``out of time``, ``out of memory``, ``crashed``, ``refused``.
        outcome: the run's own, or empty. ``why``: in words.
        helps: how often a robot's action made steps of another's plan needless.
        wall_s: real time of the whole process. ``peak_memory``: of the run's process [bytes].
    """

    run_id: str
    world: str
    strategy: str
    seed: int
    changes: str
    ending: str
    outcome: str = ""
    why: str = ""
    makespan_s: float = 0.0
    robots: int = 0
    helps: int = 0
    contacts: int = 0
    events: int = 0
    planned: int = 0
    planned_again: int = 0
    added: int = 0
    executed: int = 0
    dropped: int = 0
    cancelled: int = 0
    failed: int = 0
    superseded: int = 0
    pending: int = 0
    planner_calls: int = 0
    repairs: int = 0
    repairs_refused: int = 0
    opportunities_seen: int = 0
    opportunities_used: int = 0
    facts_seen: int = 0
    facts_heard: int = 0
    expansions: int = 0
    planning_s: float = 0.0
    travelling_s: float = 0.0
    working_s: float = 0.0
    waiting_s: float = 0.0
    distance_m: float = 0.0
    wall_planning_s: float = 0.0
    wall_deciding_s: float = 0.0
    wall_limited: bool = False
    wall_run_s: float = 0.0
    wall_s: float = 0.0
    peak_memory: int = 0

    @property
    def lost(self) -> bool:
        """Whether the process ended before the run did."""
        return self.ending != ENDED

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, line: str) -> Self:
        """The row that ``to_json`` wrote; what a later version added is left out."""
        values = json.loads(line)
        known = {field.name for field in fields(cls)}
        return cls(**{key: value for key, value in values.items() if key in known})


def row_of(definition: Definition, folder: Path, *, ending: str, why: str, wall: float) -> Row:
    """The row of a run that has left what it could in its folder."""
    result, child = _read(folder / "result.json"), _read(folder / "child.json")
    own = {
        "run_id": definition.id,
        "world": result.get("world", definition.world.stem),
        "strategy": definition.strategy,
        "seed": definition.seed,
        "changes": json.dumps(dict(definition.changes)),
        "ending": ending,
        "wall_s": round(wall, 3),
        "peak_memory": child.get("peak_memory", 0),
    }
    if ending != ENDED or not result:
        return Row(**own, why=why)
    robots: list[Mapping[str, Any]] = list(result["robots"].values())
    sums = {name: round(sum(robot[name] for robot in robots), 6) for name in SUMMED}
    return Row(
        **own,
        **sums,
        outcome=result["outcome"],
        why=result["why"],
        makespan_s=result["makespan_s"],
        robots=len(robots),
        helps=len(result["helps"]),
        contacts=sum(result["contacts"].values()),
        events=result["events"],
        wall_limited=result["wall_limited"],
        wall_run_s=result["wall_run_s"],
    )


def read_row(folder: Path) -> Row | None:
    """The row in a run's folder; ``None`` where the run has not ended yet."""
    path = folder / "row.json"
    return Row.from_json(path.read_text(encoding="utf-8")) if path.exists() else None


def write_row(row: Row, folder: Path) -> None:
    """Write ``row.json``, whole or not at all, and for good."""
    write_whole(folder / "row.json", (row.to_json() + "\n").encode())


def _read(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return value if isinstance(value, dict) else {}
