"""Robots as vehicles: how large and how fast they are for SUMO, and where their middle is."""

from math import cos, hypot, isfinite, remainder, sin, tau

from clo_fleet.sim.corridor_errors import CorridorsMisuseError
from clo_fleet.world.model import Point, Pose

__all__ = [
    "ENTRY",
    "ENTRY_ROOM",
    "LENGTH",
    "VEHICLE",
    "VEHICLE_TYPE",
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
