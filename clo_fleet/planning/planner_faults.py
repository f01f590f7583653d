"""What befalls planners: whose dies over its next question, and whose answers come later."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from clo_fleet.world.model import RobotId

__all__ = ["PlannerFaults"]


@dataclass(slots=True)
class PlannerFaults:
    """Plain data. ``doomed``: die over the next question; ``slower``: by how much later answers come [s]."""

    doomed: set[RobotId] = field(default_factory=set)
    slower: dict[RobotId, float] = field(default_factory=dict)

    def strikes(self, robot: RobotId) -> bool:
        """Whether the planner dies over the question that the robot asks now; a fault strikes once."""
        struck = robot in self.doomed
        self.doomed.discard(robot)
        return struck

    def delay(self, robot: RobotId) -> float:
        """How much later an answer to the robot comes [s]."""
        return self.slower.get(robot, 0.0)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {"doomed": sorted(self.doomed), "slower": dict(sorted(self.slower.items()))}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.doomed, self.slower = set(state["doomed"]), dict(state["slower"])
