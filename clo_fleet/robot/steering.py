"""Driving along a line: as fast as one can, but so that one can still stop where it ends.

A robot aims at a point of its line a little ahead of it. That cuts corners softly and brings it back when others
have pushed it aside. In a room the line is a shortest path round what lies and stands there, looked for anew now and
then; in a doorway it is given.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.sim.paths import Disc
from clo_fleet.sim.site import Site
from clo_fleet.world.model import Point, RobotId, RobotSpec, RoomId

__all__ = ["Steering", "along_walls", "braking", "follow", "off_line"]

RENEW = 1.0  # [s] a path is looked for anew this often, as others move
LOOK_AHEAD = 0.35  # [m] along the line, about a robot's radius: it then cuts corners by less than its margins
BRAKES = 0.8  # share of its acceleration on which a robot counts to stop; the rest is for what goes wrong
TURNING = 0.3  # share of its speed that a robot keeps at least while it turns off
SIGHT = 1.5  # [m] ahead turns are looked for: more than the way to slow down for one
STANDING = 0.05  # [m/s] a robot slower than this is gone round, a faster one is avoided
BERTH = 0.16  # [m] more round robots than round objects, so that avoidance lets one follow the path
PROGRESS = 0.3  # [m] who has come this far gets on
PATIENCE = 4.0  # [s] who has not got on for this long begins to push
PUSHING = 3.0  # [s] for so long
PUSH = 0.25  # [m/s] so fast
MOVED = 0.05  # [m] a target that moves by more than this is a new one
WALLS_AHEAD = 0.6  # [s] ahead avoidance is kept off walls: half of it is the time to stop
OVERSHOOT = 0.05  # [m] paths end this far inside the distance that counts as near


def braking(distance: float, acceleration: float, tick: float) -> float:
    """The speed from which one still stops within ``distance`` if one begins to brake a tick later [m/s]."""
    lag = BRAKES * acceleration * tick
    return math.sqrt(lag * lag + 2.0 * BRAKES * acceleration * max(0.0, distance)) - lag


def follow(
    site: Site, spec: RobotSpec, line: list[Point], *, stop: bool = True, ahead: float = LOOK_AHEAD
) -> tuple[float, float]:
    """The velocity along ``line`` [m/s]. What lies behind is taken off the line, but for two last points.

    Args:
        site: the space.
        spec: the robot that drives, a body in a room.
        line: two points at least: what the robot comes from, and what it drives to in turn.
        stop: whether it is to stand at the end; else it only comes by there.
        ahead: how far ahead to aim [m].
    """
    here, now = site.pose(spec.id).point, site.rooms.velocity(spec.id) or (0.0, 0.0)
    while len(line) > 2 and off_line(here, line[1], line[2]) <= off_line(here, line[0], line[1]):
        line.pop(0)
    aim, left = _ahead(here, line, ahead)
    dx, dy = aim[0] - here[0], aim[1] - here[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-9:
        return (0.0, 0.0)
    speed = site.max_speed(spec.id)
    speed = min(speed, _corner_speed(here, line, speed, spec.max_acceleration))
    going = math.hypot(*now)
    if going > STANDING:
        speed *= max(TURNING, (now[0] * dx + now[1] * dy) / (going * distance))
    if stop:
        speed = min(speed, braking(distance + left, spec.max_acceleration, site.tick))
    return (speed * dx / distance, speed * dy / distance)


def along_walls(site: Site, spec: RobotSpec, velocity: tuple[float, float]) -> tuple[float, float]:
    """The velocity with which a robot that is to avoid others does not run into a wall: avoidance knows of none."""
    room = site.floor(spec.id)
    if room is None or velocity == (0.0, 0.0):
        return velocity
    return site.premises.paths(room).along_walls(site.pose(spec.id).point, velocity, spec.radius, WALLS_AHEAD)


@dataclass(slots=True)
class Steering:
    """The way to one target in one room.

    Attributes:
        line: where the robot was when it looked, and the way from there; empty: none.
        blocked_since: since when there has been no path [s]; negative if there is one.
        anchor, anchored_at: where it was when it last got on, and when that was [s].
        pushes: whether it has been stuck for so long that it now drives on without avoiding anybody. Among robots
            that stand close together avoidance finds no way at all; but they yield to one that comes nearer.
    """

    line: list[Point] = field(default_factory=list)
    target: Point = (math.inf, math.inf)
    onward: Point | None = None
    found_at: float = -math.inf
    blocked_since: float = -1.0
    anchor: Point = (math.inf, math.inf)
    anchored_at: float = 0.0
    pushes: bool = False

    def velocity(
        self, site: Site, spec: RobotSpec, room: RoomId, target: Point, time: float, *,
        near: float = 0.0, ignoring: Sequence[str] = (), onward: Point | None = None,
    ) -> tuple[float, float]:  # fmt: skip
        """The wanted velocity toward ``target`` [m/s]; zero when within ``near`` of it, or while there is no way.

        If the target is taken, the way leads to the nearest free place; if robots close all ways, through them.

        Args:
            site: the space.
            spec: the robot that drives.
            room: the room it drives in.
            target: where to [m].
            time: now [s].
            near: how close is close enough [m].
            ignoring: objects and robots that are not to be gone round (the one that is the target).
            onward: where it goes from there without a stop, if it does [m].
        """
        here = site.pose(spec.id).point
        if math.dist(here, target) <= near:
            return (0.0, 0.0)
        moved = math.dist(target, self.target) > MOVED or onward != self.onward
        if moved or time - self.found_at >= RENEW - 1e-9:
            self.onward = onward
            self._look(site, spec, room, here, target, time, near, ignoring)
        if not self.line:
            return (0.0, 0.0)
        velocity = follow(site, spec, self.line, stop=onward is None)
        self._heed(here, math.hypot(*velocity), time)
        if self.pushes:
            slower = min(1.0, PUSH / math.hypot(*velocity))
            velocity = (slower * velocity[0], slower * velocity[1])
        return velocity

    def state(self) -> dict[str, Any]:
        """Plain data; ``None`` stands for what is endless."""
        return {
            "line": [list(point) for point in self.line],
            "target": list(self.target) if math.isfinite(self.target[0]) else None,
            "onward": list(self.onward) if self.onward else None,
            "found_at": self.found_at if math.isfinite(self.found_at) else None,
            "blocked_since": self.blocked_since,
            "anchor": list(self.anchor) if math.isfinite(self.anchor[0]) else None,
            "anchored_at": self.anchored_at,
            "pushes": self.pushes,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The way that ``state()`` was taken from."""
        return cls(
            line=[(x, y) for x, y in state["line"]],
            target=_point(state["target"]) or (math.inf, math.inf),
            onward=_point(state["onward"]),
            found_at=-math.inf if state["found_at"] is None else state["found_at"],
            blocked_since=state["blocked_since"],
            anchor=_point(state["anchor"]) or (math.inf, math.inf),
            anchored_at=state["anchored_at"],
            pushes=state["pushes"],
        )

    def _look(
        self, site: Site, spec: RobotSpec, room: RoomId, here: Point, target: Point, time: float,
        near: float, ignoring: Sequence[str],
    ) -> None:  # fmt: skip
        self.target, self.found_at = target, time
        paths, within = site.premises.paths(room), max(0.0, near - OVERSHOOT)
        things, robots = _things(site, room, ignoring), _standing(site, spec.id, room, ignoring)
        for discs in ([*things, *((at, size + BERTH) for at, size in robots)], [*things, *robots], things):
            way = paths.path(here, target, spec.radius, discs, within=within)
            if way is None and (free := paths.nearest_free(target, spec.radius, discs)) is not None:
                way = paths.path(here, free, spec.radius, discs)
            if way is not None:
                self.blocked_since = -1.0
                self.line = [here, *(way or (here,)), *([] if self.onward is None else [self.onward])]
                return
        self.line = []
        self.blocked_since = time if self.blocked_since < 0.0 else self.blocked_since

    def _heed(self, here: Point, wanted: float, time: float) -> None:
        """Note whether the robot gets on; begin to push when it has not for a while, and end a little later."""
        if wanted < PUSH / 2 or math.dist(here, self.anchor) > PROGRESS or time - self.anchored_at > PATIENCE + PUSHING:
            self.anchor, self.anchored_at = here, time
        self.pushes = time - self.anchored_at > PATIENCE


def _point(plain: Sequence[float] | None) -> Point | None:
    return None if plain is None else (plain[0], plain[1])


def _things(site: Site, room: RoomId, ignoring: Sequence[str]) -> list[Disc]:
    """The objects on the floor."""
    lying = (
        (site.rooms.item_position(item), site.items.radius(item))
        for item in site.items.lying_in(room)
        if item not in ignoring
    )
    return [(position, radius) for position, radius in lying if position is not None]


def _standing(site: Site, robot: RobotId, room: RoomId, ignoring: Sequence[str]) -> list[Disc]:
    """The other robots that do not move. All of them: who sees only those near by runs to and fro between them."""
    return [
        (site.pose(other).point, site.robot_radius(other))
        for other in site.bodies_in(room)
        if other != robot and other not in ignoring and site.speed(other) < STANDING
    ]


def _ahead(here: Point, line: Sequence[Point], ahead: float) -> tuple[Point, float]:
    """The point of the line ``ahead`` beyond the nearest to ``here``, and how much of the line is left from it [m]."""
    begin, end = line[0], line[1]
    share = _share(here, begin, end)
    last = (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
    for number in range(1, len(line)):
        piece = math.dist(last, line[number])
        if piece >= ahead:
            t = ahead / piece
            aim = (last[0] + t * (line[number][0] - last[0]), last[1] + t * (line[number][1] - last[1]))
            rest = sum(math.dist(*pair) for pair in zip(line[number:], line[number + 1 :], strict=False))
            return aim, piece - ahead + rest
        last, ahead = line[number], ahead - piece
    return last, 0.0


def _corner_speed(here: Point, line: Sequence[Point], top: float, acceleration: float) -> float:
    """The speed that leaves time to slow down for the turns ahead [m/s]: the sharper, the slower they are taken."""
    speed, way, i = top, math.dist(here, line[1]), 1
    while i < len(line) - 1 and way < SIGHT:
        (ax, ay), (bx, by), (cx, cy) = line[i - 1 : i + 2]
        inward, outward = math.dist(line[i - 1], line[i]), math.dist(line[i], line[i + 1])
        dot = (bx - ax) * (cx - bx) + (by - ay) * (cy - by)
        corner = top * max(TURNING, dot / max(inward * outward, 1e-9))
        speed = min(speed, math.sqrt(corner * corner + 2.0 * BRAKES * acceleration * way))
        way, i = way + outward, i + 1
    return speed


def off_line(point: Point, begin: Point, end: Point) -> float:
    """How far a point is from the line between two others [m]."""
    share = _share(point, begin, end)
    return math.dist(point, (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1])))


def _share(here: Point, begin: Point, end: Point) -> float:
    """How far along the line between two points the nearest to ``here`` lies, from 0 to 1."""
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    squared = dx * dx + dy * dy
    if squared == 0.0:
        return 1.0
    return min(1.0, max(0.0, ((here[0] - begin[0]) * dx + (here[1] - begin[1]) * dy) / squared))
