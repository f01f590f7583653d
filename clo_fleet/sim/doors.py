"""Right of way at doors: who may pass, first come first served.

A door is a shared resource. A wide one is passed in both directions at once, a narrow one by one robot at a
time. A robot asks before it passes, and gives back when it is through; nobody stands in a doorway waiting.
"""

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any

from clo_fleet.world.model import Door, DoorId, RobotId

__all__ = ["Doors", "Way"]

WIDE = 1.6  # [m] two robots of 0.6 m in lanes 0.7 m apart pass with 0.1 m between them and 0.15 m at the sides


class Way(Enum):
    """The direction through a door."""

    OUT = "out"  # from rooms[0]
    IN = "in"  # into rooms[0]


class Doors:
    """The queues at all doors. The head of a queue has the right of way."""

    def __init__(self, doors: Iterable[Door]) -> None:
        self._wide = {door.id: door.width >= WIDE for door in doors}
        self._queues: dict[str, list[RobotId]] = {}

    def request(self, door: DoorId, way: Way, robot: RobotId) -> bool:
        """Join the queue if not in it yet; whether the robot may pass now."""
        queue = self._queues.setdefault(self._lane(door, way), [])
        if robot not in queue:
            queue.append(robot)
        return queue[0] == robot

    def release(self, door: DoorId, way: Way, robot: RobotId) -> None:
        """Leave the queue: through, or no longer interested."""
        queue = self._queues.get(self._lane(door, way), [])
        if robot in queue:
            queue.remove(robot)

    def ahead(self, door: DoorId, way: Way, robot: RobotId) -> RobotId | None:
        """The robot that ``robot`` waits for at the door, if it is in the queue and not first."""
        queue = self._queues.get(self._lane(door, way), [])
        return queue[queue.index(robot) - 1] if robot in queue[1:] else None

    def state(self) -> dict[str, list[str]]:
        """The queues as plain data."""
        return {lane: [str(robot) for robot in queue] for lane, queue in self._queues.items() if queue}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up the queues that ``state()`` gave."""
        self._queues = {lane: list(queue) for lane, queue in state.items()}

    def _lane(self, door: DoorId, way: Way) -> str:
        return f"{door} {way.value}" if self._wide[door] else door
