"""Right of way at doors: who may pass, first come first served, as long as who came first is there.

A door is a shared resource. A wide one is passed in both directions at once, keeping to the right; a narrow one by one
robot at a time, through the middle. A robot asks before it passes, and gives back when it is through; nobody
stands in a doorway waiting. Who holds in the corridor before a door cannot step aside, so it goes before all
who have not begun to pass.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any

from clo_fleet.world.model import Door, DoorId, RobotId

__all__ = ["WIDE", "Doors", "Way", "is_wide"]

WIDE = 1.6  # [m] two robots of 0.6 m in lanes 0.7 m apart pass with 0.1 m between them and 0.15 m at the sides


class Way(Enum):
    """The direction through a door."""

    OUT = "out"  # from rooms[0]
    IN = "in"  # into rooms[0]


def is_wide(door: Door) -> bool:
    """Whether robots pass the door in both directions at once."""
    return door.width >= WIDE


class Doors:
    """The queues at all doors. The head of a queue has the right of way."""

    def __init__(self, doors: Iterable[Door]) -> None:
        self._wide = {door.id: is_wide(door) for door in doors}
        self._queues: dict[str, list[RobotId]] = {}
        self._changes: Counter[str] = Counter()  # of the queues
        self._urgent: set[RobotId] = set()  # who holds before a door, and who has begun to pass one

    def request(self, door: DoorId, way: Way, robot: RobotId, *, urgent: bool = False) -> bool:
        """Join the queue if not in it yet; whether the robot may pass now.

        Args:
            door: which.
            way: in which direction through it.
            robot: who.
            urgent: it goes before those who only wait, or has begun to pass: from now on nobody goes before it.
        """
        queue = self._queues.setdefault(self._lane(door, way), [])
        if robot not in queue:
            queue.append(robot)
            self._changes[self._lane(door, way)] += 1
        if urgent and robot not in self._urgent:
            self.overtake(door, way, robot)
            self._urgent.add(robot)
        return queue[0] == robot

    def overtake(self, door: DoorId, way: Way, robot: RobotId) -> None:
        """Let a robot that has asked go before all who are not urgent."""
        queue = self._queues[self._lane(door, way)]
        self._changes[self._lane(door, way)] += 1
        queue.remove(robot)
        queue.insert(sum(other in self._urgent for other in queue), robot)

    def release(self, door: DoorId, way: Way, robot: RobotId) -> None:
        """Leave the queue: through, or no longer interested."""
        queue = self._queues.get(self._lane(door, way), [])
        if robot in queue:
            queue.remove(robot)
            self._changes[self._lane(door, way)] += 1
            self._urgent.discard(robot)

    def queue(self, door: DoorId, way: Way) -> tuple[RobotId, ...]:
        """Who may pass and who waits, in turn."""
        return tuple(self._queues.get(self._lane(door, way), ()))

    def changes(self, door: DoorId, way: Way) -> int:
        """How often that queue has changed so far."""
        return self._changes[self._lane(door, way)]

    def state(self) -> dict[str, Any]:
        """The queues as plain data."""
        queues = {lane: list(queue) for lane, queue in self._queues.items() if queue}
        return {"queues": queues, "urgent": sorted(self._urgent)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up the queues that ``state()`` gave."""
        self._queues = {lane: list(queue) for lane, queue in state["queues"].items()}
        self._urgent = set(state["urgent"])

    def _lane(self, door: DoorId, way: Way) -> str:
        return f"{door} {way.value}" if self._wide[door] else door
