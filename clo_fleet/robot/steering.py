"""Driving to a point inside a room: along a shortest path, round what lies there, slower near the end."""

import math
from dataclasses import dataclass, field

from clo_fleet.sim.site import Site
from clo_fleet.world.model import ObjectId, Point, RobotId, RobotSpec, RoomId

__all__ = ["Steering", "straight"]

RENEW = 1.0  # [s] a path is looked for anew this often, as others move
SLOW_WITHIN = 0.5  # [m] from here on speed falls with the distance
CREEP = 0.08  # [m/s] never slower than this until there
WAYPOINT = 0.15  # [m] a corner of the path counts as passed from here
STANDING = 0.05  # [m/s] a robot slower than this is gone round, a faster one is avoided


def straight(here: Point, target: Point, speed: float, within: float = SLOW_WITHIN) -> tuple[float, float]:
    """The velocity straight to ``target`` [m/s], slowing down over the last ``within`` metres."""
    dx, dy = target[0] - here[0], target[1] - here[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-9:
        return (0.0, 0.0)
    wanted = min(speed, max(CREEP, speed * distance / within))
    return (wanted * dx / distance, wanted * dy / distance)


@dataclass(slots=True)
class Steering:
    """The way to one target in one room. Plain data.

    Attributes:
        blocked_since: since when there has been no path [s]; negative if there is one.
    """

    path: list[Point] = field(default_factory=list)
    target: Point = (math.inf, math.inf)
    found_at: float = -math.inf
    blocked_since: float = -1.0

    def velocity(
        self, site: Site, spec: RobotSpec, room: RoomId, target: Point, time: float, *,
        near: float = 0.0, ignoring: tuple[str, ...] = (),
    ) -> tuple[float, float]:  # fmt: skip
        """The wanted velocity toward ``target`` [m/s]; zero when within ``near`` of it, or while there is no way.

        Args:
            site: the space.
            spec: the robot that drives.
            room: the room it drives in.
            target: where to [m].
            time: now [s].
            near: how close is close enough [m].
            ignoring: objects and robots that are not to be gone round (the one that is the target).
        """
        here = site.pose(spec.id).point
        if math.dist(here, target) <= near:
            return (0.0, 0.0)
        if math.dist(target, self.target) > 0.05 or time - self.found_at >= RENEW - 1e-9:
            self._look(site, spec, room, here, target, time, near, ignoring)
        while len(self.path) > 1 and math.dist(here, self.path[0]) < WAYPOINT:
            self.path.pop(0)
        if not self.path:
            return (0.0, 0.0)
        speed = site.max_speed(spec.id)
        last = len(self.path) == 1
        return straight(here, self.path[0], speed, SLOW_WITHIN if last else WAYPOINT)

    def _look(
        self, site: Site, spec: RobotSpec, room: RoomId, here: Point, target: Point, time: float,
        near: float, ignoring: tuple[str, ...],
    ) -> None:  # fmt: skip
        self.target, self.found_at = target, time
        paths, discs = site.paths(room), _in_the_way(site, spec.id, room, ignoring)
        way = paths.path(here, target, spec.radius, discs, within=near)
        if way is None and near == 0.0 and (free := paths.nearest_free(target, spec.radius, discs)) is not None:
            way = paths.path(here, free, spec.radius, discs)
        if way is None:
            self.path = []
            self.blocked_since = time if self.blocked_since < 0.0 else self.blocked_since
            return
        self.blocked_since = -1.0
        self.path = [point for point in way if math.dist(point, here) > 1e-6] or [target]


def _in_the_way(
    site: Site, robot: RobotId, room: RoomId, ignoring: tuple[str, ...]
) -> tuple[tuple[Point, float], ...]:
    """The discs to go round: objects on the floor, and robots that stand."""
    discs: list[tuple[Point, float]] = []
    for item in site.items_in(room):
        position = site.item_position(item)
        if item not in ignoring and position is not None:
            discs.append((position, site.item_radius(ObjectId(item))))
    for other in site.bodies_in(room):
        if other != robot and other not in ignoring and site.speed(other) < STANDING:
            discs.append((site.pose(other).point, site.robot_radius(other)))
    return tuple(discs)
