"""Tracks: where everything is, written into the event log now and then, for whoever replays a run."""

from collections.abc import Mapping
from typing import Any

from clo_fleet.sim.site import Site
from clo_fleet.world.events import Body, Poses
from clo_fleet.world.model import ObjectId, RobotId

__all__ = ["Tracks"]


class Tracks:
    """What was last written down of each robot and each object."""

    def __init__(self, site: Site, robots: tuple[RobotId, ...], objects: tuple[ObjectId, ...]) -> None:
        self._site = site
        self._robots = robots
        self._objects = objects
        self._last: dict[str, Body] = {}

    def moved(self) -> Poses | None:
        """Where everything is that moved since the last call, to the millimetre; ``None`` if nothing did."""
        robots = [self._robot(robot) for robot in self._robots]
        objects = [body for item in self._objects if (body := self._object(item)) is not None]
        fresh = Poses(
            tuple(body for body in robots if self._last.get(body[0]) != body),
            tuple(body for body in objects if self._last.get(body[0]) != body),
        )
        self._last.update((body[0], body) for body in (*fresh.robots, *fresh.objects))
        return fresh if fresh.robots or fresh.objects else None

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {"last": [list(body) for body in self._last.values()]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._last = {name: (name, x, y, heading) for name, x, y, heading in state["last"]}

    def _robot(self, robot: RobotId) -> Body:
        pose = self._site.pose(robot)
        return (robot, round(pose.x, 3), round(pose.y, 3), round(pose.heading, 3))

    def _object(self, item: ObjectId) -> Body | None:
        position = self._site.rooms.item_position(item)
        return None if position is None else (item, round(position[0], 3), round(position[1], 3), 0.0)
