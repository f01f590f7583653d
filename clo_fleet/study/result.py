"""The result of a run: one value with named fields, written as ``result.json``.

The schema is versioned by ``RESULT_FORMAT``; ``result_schema()`` gives it as JSON schema. Simulated times are in
seconds and end in ``_s``; readings of the clock on the wall begin with ``wall_`` and are the only values that may
differ between two runs of the same world, strategy and seed.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from clo_fleet.study.atomic import write_whole

__all__ = ["RESULT_FORMAT", "DisturbanceResult", "Help", "RobotResult", "RunResult", "result_schema", "write_result"]

RESULT_FORMAT = "clo-fleet/result/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Help:
    """One robot's action made steps of another's plan needless.

    Attributes:
        by: who helped.
        robot: whom.
        fact: by which fact, as ``(holding r1 o2)``.
        kind: ``prepared``, ``delivered``, ``handed_over`` or ``other``.
        action: the helper's action that made the fact true.
        dropped: the names of the steps that became needless; one that was under way and could be stopped comes first.
        time_s: when.
    """

    by: str
    robot: str
    fact: str
    kind: str
    action: str
    dropped: tuple[str, ...]
    time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotResult:
    """What became of one robot.

    ``planned + planned_again + added = executed + dropped + cancelled + failed + superseded + pending``: the first
    plan's steps, those of later plans, steps tried again; carried out, made needless, stopped under way, tried in
    vain, replaced by a new plan, not done by the end.

    Attributes:
        repairs: how often a repair changed the plan.
        repairs_refused: how often a repair was not possible.
        opportunities_seen: helpful facts, brought about by others, that the robot learnt of.
        opportunities_used: those of them that made steps needless.
        opportunities_by: how many were seen, by whose action.
        facts_looked_at: how many its senses have looked at; ``facts_seen``: those of them that were news and heeded.
        facts_heard: news by radio that it heeded.
        waiting_for_s: how long it stood for what, in rooms and in corridors: a door, a single lane, ...
        planning_s: simulated time that its planner took.
        expansions: states that its planner expanded.
        wall_planning_s: real time that its planner took.
        wall_deciding_s: real time that its executive took, repairs included.
    """

    goals: tuple[str, ...]
    goals_reached: bool
    planned: int
    planned_again: int
    added: int
    executed: int
    dropped: int
    cancelled: int
    failed: int
    superseded: int
    pending: int
    planner_calls: int
    repairs: int
    repairs_refused: int
    opportunities_seen: int
    opportunities_used: int
    opportunities_by: dict[str, int]
    facts_looked_at: int
    facts_seen: int
    facts_heard: int
    expansions: int
    planning_s: float
    travelling_s: float
    working_s: float
    waiting_s: float
    waiting_for_s: dict[str, float]
    distance_m: float
    wall_planning_s: float
    wall_deciding_s: float


@dataclass(frozen=True, slots=True)
class DisturbanceResult:
    """One kind of disturbance in a run.

    Attributes:
        happened: how often.
        without_effect: how often it could not happen at its moment.
        repairs: how often a robot repaired its plan because of one.
        replans: how often a robot asked its planner because of one.
    """

    happened: int
    without_effect: int
    repairs: int
    replans: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What became of a run.

    Attributes:
        format: the version of this schema.
        outcome: one of the named outcomes; ``why`` in words.
        makespan_s: simulated time until the run ended.
        disturbances: what befell the fleet, by kind.
        contacts: how often bodies touched: robots each other, robots a wall, robots an object.
        wall_limited: whether a planner met its limit of real time, so that the run depends on the machine.
        wall_run_s: real time; as all such times, of a resumed run the sum over its parts without what was lost.
    """

    format: str
    version: str
    world: str
    map: str
    strategy: str
    seed: int
    outcome: str
    why: str
    makespan_s: float
    robots: dict[str, RobotResult]
    helps: tuple[Help, ...]
    disturbances: dict[str, DisturbanceResult]
    contacts: dict[str, int]
    events: int
    wall_limited: bool
    wall_run_s: float

    @property
    def executed(self) -> int:
        """The actions carried out by all robots."""
        return sum(robot.executed for robot in self.robots.values())

    @property
    def planner_calls(self) -> int:
        """The calls of the planner by all robots."""
        return sum(robot.planner_calls for robot in self.robots.values())

    def to_json(self) -> str:
        """The result as JSON text."""
        return json.dumps(asdict(self), ensure_ascii=False, indent=2) + "\n"


def result_schema() -> dict[str, Any]:
    """The JSON schema of ``result.json``."""
    from pydantic import TypeAdapter

    return TypeAdapter(RunResult).json_schema()


def write_result(result: RunResult, path: Path) -> None:
    """Write ``result.json``, whole or not at all."""
    write_whole(path, result.to_json().encode())
