"""Why a robot waits: the cause, where, and the robots without which it cannot go on."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

from clo_fleet.sim.right_of_way import Hindrance, Obstacle
from clo_fleet.world.model import RobotId

__all__ = ["Wait", "WaitCause", "hindered"]


class WaitCause(Enum):
    """What a robot waits for."""

    DOOR = "door"  # others go first through it
    DOORWAY = "doorway"  # somebody stands behind the door
    ENTRY = "corridor entry"  # the lane behind the door is occupied
    SINGLE_LANE = "single lane"  # others come towards it
    LANES = "full lanes"  # those on its way could all fill up
    TURN = "turn"  # who has waited for longer goes first
    ROOM = "room"  # every place where it goes is taken
    CLOSED = "closed"  # a corridor or a door
    VEHICLE = "vehicle ahead"
    CROSSING = "crossing"  # and whatever else holds up the first in a lane
    PATH = "path"  # through its room
    PARTNER = "partner"  # of a handover
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Wait:
    """Why a robot waits.

    Attributes:
        cause: what for.
        where: a door, corridor, room or object.
        on: the robots that all have to go on before it can; nobody: any one of several could clear its way.
    """

    cause: WaitCause
    where: str = ""
    on: tuple[RobotId, ...] = ()

    @property
    def text(self) -> str:
        """In words, after "waits for"."""
        after = f", after robot {self.on[0]}" if self.on else ""
        return _TEXTS[self.cause].format(where=self.where) + after

    @property
    def what(self) -> str:
        """Cause and place in words."""
        return f"{self.cause.value} {self.where}".rstrip()

    def state(self) -> list[Any]:
        """Plain data."""
        return [self.cause.value, self.where, list(self.on)]

    @classmethod
    def from_state(cls, state: Any) -> Self:
        """What ``state()`` was taken from."""
        return cls(WaitCause(state[0]), state[1], tuple(state[2]))


def hindered(hindrance: Hindrance) -> Wait:
    """Why a robot waits that has no right of way."""
    cause = _CAUSES[hindrance.obstacle]
    return Wait(cause, hindrance.where, hindrance.by if cause in (WaitCause.SINGLE_LANE, WaitCause.TURN) else ())


_CAUSES: Mapping[Obstacle, WaitCause] = {
    Obstacle.CLOSED: WaitCause.CLOSED,
    Obstacle.ROOM: WaitCause.ROOM,
    Obstacle.SINGLE_LANE: WaitCause.SINGLE_LANE,
    Obstacle.FULL_LANES: WaitCause.LANES,
    Obstacle.TURN: WaitCause.TURN,
}
_TEXTS: Mapping[WaitCause, str] = {
    WaitCause.DOOR: "door {where}",
    WaitCause.DOORWAY: "room behind door {where}",
    WaitCause.ENTRY: "room in the corridor behind door {where}",
    WaitCause.SINGLE_LANE: "corridor {where}",
    WaitCause.LANES: "space in corridor {where}",
    WaitCause.TURN: "its turn on the way to room {where}",
    WaitCause.ROOM: "a place in room {where}",
    WaitCause.CLOSED: "{where}, which is closed",
    WaitCause.VEHICLE: "the way ahead",
    WaitCause.CROSSING: "its turn at a crossing",
    WaitCause.PATH: "a way through the room",
    WaitCause.PARTNER: "robot {where}",
    WaitCause.OTHER: "{where}",
}
