"""Robots as vehicles: what SUMO is told of them, and what is kept beside what SUMO keeps."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import cos, hypot, isfinite, remainder, sin, tau
from typing import Any, Self

from clo_fleet.sim.corridor_errors import CorridorsMisuseError
from clo_fleet.sim.routes import Route
from clo_fleet.world.model import Point, Pose

__all__ = [
    "ENTRY",
    "ENTRY_ROOM",
    "LENGTH",
    "VEHICLE",
    "VEHICLE_TYPE",
    "Phase",
    "Vehicle",
    "check_speed",
    "off_vehicle",
    "vehicle_pose",
]

VEHICLE_TYPE = "robot"
VEHICLE = {  # SI units; nothing random in it
    "Length": 0.8,
    "Width": 0.6,
    "MinGap": 0.3,
    "MaxSpeed": 1.5,
    "Accel": 1.0,
    "Decel": 1.5,
    "ApparentDecel": 1.5,
    "Tau": 0.3,
    "Imperfection": 0.0,
    "SpeedDeviation": 0.0,
}
LENGTH = VEHICLE["Length"]
ENTRY = LENGTH + 0.1  # [m] along the first lane: where SUMO's departPos "base" puts the front bumper
ENTRY_ROOM = ENTRY + VEHICLE["MinGap"]  # [m] of the first lane that must be free


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


def vehicle_pose(front: Point, heading: float) -> Pose:
    """The pose of a robot whose front bumper is at a point."""
    x, y = front
    return Pose(x - LENGTH / 2 * cos(heading), y - LENGTH / 2 * sin(heading), remainder(heading, tau))


def check_speed(speed: float) -> None:
    """Raise ``CorridorsMisuseError`` if that is no speed limit [m/s]."""
    if not (isfinite(speed) and speed >= 0):
        raise CorridorsMisuseError(f"{speed} m/s is no speed limit")


def off_vehicle(pose: Pose, point: Point) -> float:
    """How far a point is from a vehicle's box [m]; 0 inside."""
    dx, dy = point[0] - pose.x, point[1] - pose.y
    x, y = cos(pose.heading), sin(pose.heading)
    along, across = abs(dx * x + dy * y) - VEHICLE["Length"] / 2, abs(dy * x - dx * y) - VEHICLE["Width"] / 2
    return hypot(max(0.0, along), max(0.0, across))
