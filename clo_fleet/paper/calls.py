"""A call of the planner: on which route it is made, and what it answers and costs. Plain values.

| route                    | what it measures                                                                   |
|--------------------------|------------------------------------------------------------------------------------|
| `Route.IN_PROCESS`       | PDDL text, the translator in this process, the search: the least a call can cost   |
| `Route.UNIFIED_PLANNING` | a unified-planning problem and Fast Downward's own driver, as the fleet plans      |
| `Called.wall_search`     | on either route: the search alone, as Fast Downward itself reports it              |
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from clo_fleet.clo.messages import PlanFailure
from clo_fleet.clo.task import Action
from clo_fleet.planning.problem import PlanningTask

__all__ = ["Called", "PaperPlanner", "Route"]


class Route(Enum):
    """How Fast Downward is called."""

    IN_PROCESS = "in-process"
    UNIFIED_PLANNING = "unified-planning"


@dataclass(frozen=True, slots=True, kw_only=True)
class Called:
    """What came of a call: a plan or a failure, and what it cost.

    Attributes:
        actions: the plan; ``None`` if there is none.
        failure: why there is none.
        expansions: states expanded.
        wall: how long the call took [s].
        wall_search: how long the search alone took [s].
    """

    actions: tuple[Action, ...] | None
    failure: PlanFailure | None = None
    expansions: int = 0
    wall: float = 0.0
    wall_search: float = 0.0


class PaperPlanner(Protocol):
    """Plans for an episode."""

    def call(self, task: PlanningTask, seconds: float) -> Called:
        """The answer to the task, within so many seconds."""
