"""When a skill that has nothing to do has something to do again.

A skill that says so need not be stepped before: it would change nothing, and say the same again. Whoever leaves it
alone (``fleet/journeys.py``) looks into its rest in every tick in which the skill would have been stepped, which costs
no more than a look into a table or two. Besides, a rest is over as soon as a robot in a room moves, if only because
others push it, when anything is closed, and when the robot breaks down or is to stop.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.sim.doors import Way
from clo_fleet.sim.right_of_way import Hindrance
from clo_fleet.sim.site import Site
from clo_fleet.world.model import DoorId, Point, RobotId

__all__ = ["Arrival", "Grant", "Idle", "Rest", "Turn"]

SOON = 1e-9  # [s] times that differ by less are the same


class Rest(Protocol):
    """For how long there is nothing to do."""

    def over(self, site: Site, time: float) -> bool:
        """Whether there is something to do now [s]."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """Until the robot's vehicle has come to its far door: SUMO tells when, and nobody need look."""


@dataclass(frozen=True, slots=True)
class Turn:
    """In a queue at a door, until it moves on.

    Attributes:
        door, way: which queue.
        changes: how often it had changed.
        first: who is overtaken if it is as far from the door as ``late`` [m]; ``None``: nobody will be.
        at: the door [m].
        until: at the latest [s].
    """

    door: DoorId
    way: Way
    changes: int
    first: RobotId | None
    at: Point
    late: float
    until: float = math.inf

    def over(self, site: Site, time: float) -> bool:
        """Whether the queue has changed, the first one is late, or it is time."""
        if time >= self.until - SOON or site.doors.changes(self.door, self.way) != self.changes:
            return True
        return self.first is not None and math.dist(site.pose(self.first).point, self.at) > self.late


@dataclass(frozen=True, slots=True)
class Grant:
    """Until a robot has the right of way, lacks it for another reason, or it is time [s]."""

    robot: RobotId
    hindrance: Hindrance
    until: float

    def over(self, site: Site, time: float) -> bool:
        """Whether anything of that is so."""
        return time >= self.until - SOON or site.hindrance(self.robot) != self.hindrance


@dataclass(frozen=True, slots=True)
class Idle:
    """Until the executive has something to do, or is in another mode."""

    executive: Executive
    mode: Mode

    def over(self, _: Site, __: float) -> bool:
        """Whether that is so."""
        return self.executive.mode is not self.mode
