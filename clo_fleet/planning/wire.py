"""The lines of JSON between the planner pool and its workers.

| line                                                                | says                            |
|---------------------------------------------------------------------|---------------------------------|
| `{"domain", "exogenous", "costs", "wall_limit", ..., "directory"}`   | to a worker, once: the setting  |
| `{"ready": true}`                                                   | from a worker, once             |
| `{"robot", "objects", "facts", "goals", "costs"}`                   | to a worker: a job              |
| `{"verdict", "steps", "expansions", "reason", "wall_seconds"}`      | from a worker: the answer to it |
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clo_fleet.planning.planner import Answer, Verdict
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.pddl import read_domain
from clo_fleet.world.schemas import Domain

__all__ = [
    "READY",
    "Setting",
    "answer_line",
    "answer_of",
    "jobs_of",
    "setting_line",
    "setting_of",
    "task_json",
    "task_line",
    "task_of",
]

READY = b'{"ready": true}\n'


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What a worker must know before its first job.

    Attributes:
        domain: the domain of all jobs.
        wall_limit: [s] for each job.
        memory_limit: bytes for the planner.
        directory: a directory of the worker's own.
    """

    domain: Domain
    wall_limit: float
    memory_limit: int
    directory: Path


def setting_line(setting: Setting) -> bytes:
    """The line that tells the setting."""
    return _line(
        {
            "domain": setting.domain.text,
            "exogenous": sorted(setting.domain.exogenous),
            "costs": {
                schema.name: schema.cost for schema in setting.domain.schemas if not isinstance(schema.cost, int)
            },
            "wall_limit": setting.wall_limit,
            "memory_limit": setting.memory_limit,
            "directory": str(setting.directory),
        }
    )


def setting_of(line: bytes) -> Setting:
    """The setting that the line tells."""
    value = json.loads(line)
    return Setting(
        domain=read_domain(value["domain"], value["exogenous"]).with_costs(
            {schema: tuple(cost) for schema, cost in value["costs"].items()}
        ),
        wall_limit=value["wall_limit"],
        memory_limit=value["memory_limit"],
        directory=Path(value["directory"]),
    )


def task_json(task: PlanningTask) -> dict[str, object]:
    """The task as JSON can hold it; equal tasks give equal JSON."""
    return {
        "robot": task.robot,
        "objects": [[type_, list(names)] for type_, names in task.objects],
        "facts": [list(fact) for fact in sorted(task.facts)],
        "goals": [list(goal) for goal in task.goals],
        "costs": [[list(term), cost] for term, cost in task.costs],
    }


def task_line(task: PlanningTask) -> bytes:
    """The line that asks for a plan."""
    return _line(task_json(task))


def task_of(value: Any) -> PlanningTask:
    """The task that ``task_json`` wrote."""
    return PlanningTask(
        robot=value["robot"],
        objects=tuple((type_, tuple(names)) for type_, names in value["objects"]),
        facts=frozenset(tuple(fact) for fact in value["facts"]),
        goals=tuple(tuple(goal) for goal in value["goals"]),
        costs=tuple((tuple(term), cost) for term, cost in value["costs"]),
    )


def jobs_of(state: Any) -> tuple[tuple[str, PlanningTask], ...]:
    """The keys and tasks that a pool's ``state`` lists."""
    return tuple((key, task_of(task)) for key, task in state["jobs"])


def answer_line(answer: Answer) -> bytes:
    """The line that reports how a job ended."""
    return _line(
        {
            "verdict": answer.verdict.value,
            "steps": answer.steps,
            "expansions": answer.expansions,
            "reason": answer.reason,
            "wall_seconds": answer.wall_seconds,
        }
    )


def answer_of(line: bytes) -> Answer:
    """The answer that the line reports."""
    value = json.loads(line)
    return Answer(
        verdict=Verdict(value["verdict"]),
        steps=tuple(tuple(step) for step in value["steps"]),
        expansions=value["expansions"],
        reason=value["reason"],
        wall_seconds=value["wall_seconds"],
    )


def _line(value: dict[str, object]) -> bytes:
    return json.dumps(value).encode() + b"\n"
