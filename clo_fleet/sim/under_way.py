"""Robots under way: what is kept of each vehicle beside what SUMO keeps."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

from clo_fleet.sim.routes import Route

__all__ = ["Phase", "Vehicle"]


class Phase(Enum):
    """How far a robot has come."""

    ASKED = "asked"
    DRIVING = "driving"
    HOLDING = "holding"
    LEAVING = "leaving"


@dataclass(slots=True)
class Vehicle:
    """What is kept for each robot."""

    route: Route
    max_speed: float
    phase: Phase = Phase.ASKED

    def state(self) -> dict[str, object]:
        """Plain data."""
        return {"route": self.route.state(), "max_speed": self.max_speed, "phase": self.phase.value}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What ``state()`` was taken from."""
        return cls(Route.from_state(state["route"]), state["max_speed"], Phase(state["phase"]))
