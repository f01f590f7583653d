"""How a robot passes a door: where it aims, where it waits, and when the floor behind is clear.

Through a wide door robots keep to the right, through a narrow one they take the middle. All points are seen from
one room of the door; "right" is as one looks out of it.
"""

import math
from collections.abc import Iterator
from functools import lru_cache

from clo_fleet.robot.steering import off_line
from clo_fleet.sim.doors import is_wide
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import in_front, inner_point, outward
from clo_fleet.world.model import Door, Point, RobotId, RobotSpec, RoomId

__all__ = [
    "GATE",
    "INSIDE",
    "RIM",
    "clear",
    "depth",
    "gate",
    "in_the_way",
    "inward",
    "lane",
    "throat",
    "waiting_point",
    "way_in",
]

GATE = 0.5  # [m] inside the door: from here on the way out is straight
RUN_UP = 0.9  # [m] the same before a wide door: who comes from the side has to be in line before it meets another
INSIDE = 0.9  # [m] inside the door: who came in is through
THROAT = 0.15  # [m] outside a narrow door: only from here on does the way turn off to the lane
LANE = 0.35  # [m] from the middle of a wide door to the middle of what is kept to, as in the corridors
SIDE = 0.08  # [m] at least, between a robot's rim and the side of a door
BESIDE = 0.05  # [m] at least, between who comes in and those who stand about
WAITING = tuple(
    (inside, right) for right in (0.95, -1.15, 1.7, -1.9) for inside in (1.0, 1.8, 2.6)
)  # [m] to the right of who passes on that side
NUDGED = 0.15  # [m] by which who comes in may push others aside, if it must
BERTH = 0.2  # [m] at least, between those who pass and who stands out of their way
DEPTH = 1.5  # [m] inside the door: so far those who pass need the floor to themselves
RIM = 0.1  # [m] at least, between the rim of who has no right of way and the line of a door
BACK = 0.4  # [m/s] at which it backs off from there
AROUND = 4.0  # [m] in which it waits if all places beside the door are taken
KEPT = 4096  # points at doors that are remembered: robots in a queue ask for the same ones in every tick
FREE = 0.1  # [m] a waiting point may be this far off where it should be, because of walls


def lane(door: Door, radius: float, *, out: bool) -> float:
    """How far to the right of the middle a robot passes, out of the room or into it [m]."""
    if not is_wide(door):
        return 0.0
    side = max(0.0, min(LANE, door.width / 2 - radius - SIDE))
    return side if out else -side


@lru_cache(maxsize=KEPT)
def gate(door: Door, room: RoomId, radius: float, *, out: bool, inside: float | None = None) -> Point:
    """The point ``inside`` the room from the door's line on the way that robots keep to."""
    if inside is None:
        inside = RUN_UP if is_wide(door) else GATE
    return _inner(door, room, inside, lane(door, radius, out=out))


@lru_cache(maxsize=KEPT)
def throat(door: Door, room: RoomId, radius: float, *, out: bool) -> Point:
    """Where the way through the door meets the way to or from the lane behind it."""
    return _inner(door, room, 0.0 if is_wide(door) else -THROAT, lane(door, radius, out=out))


def clear(site: Site, robot: RobotId, door: Door, room: RoomId, *, nudge: bool = False) -> bool:
    """Whether nobody stands where the robot is about to come in. ``nudge``: whether those at the side do not count."""
    radius = site.robot_radius(robot)
    margin = -NUDGED if nudge else BESIDE
    begin, end = way_in(door, room, radius)
    return all(
        off_line(site.pose(other).point, begin, end) > radius + site.robot_radius(other) + margin
        for other in site.bodies_in(room)
        if other != robot
    )


def way_in(door: Door, room: RoomId, radius: float) -> tuple[Point, Point]:
    """The line on which robots come in, from the door's line to where they are through."""
    return gate(door, room, radius, out=False, inside=0.0), gate(door, room, radius, out=False, inside=INSIDE)


def depth(door: Door, room: RoomId, point: Point) -> float:
    """How far inside the room a point is, square to the door's line [m]."""
    x, y = inner_point(door, room, 1.0)
    (dx, dy), (px, py) = door.position, point
    return (px - dx) * (x - dx) + (py - dy) * (y - dy)


def waiting_point(site: Site, spec: RobotSpec, door: Door, room: RoomId) -> Point:
    """Where the robot waits for the door: the first place beside it at which nobody stands."""
    for point in _waiting_points(site, spec, door, room):
        if all(
            math.dist(site.pose(other).point, point) > spec.radius + site.robot_radius(other)
            for other in site.bodies_in(room)
            if other != spec.id
        ):
            return point
    here = site.pose(spec.id).point
    return site.rooms.free_spot(here, spec.radius, room, within=AROUND) or inner_point(door, room, WAITING[-1][0])


def _waiting_points(site: Site, spec: RobotSpec, door: Door, room: RoomId) -> Iterator[Point]:
    """The places to wait beside a door that walls, obstacles and other doors leave, the nearest on the right first."""
    others = [other for other in site.premises.doors_of(room) if other.id != door.id]
    side = lane(door, spec.radius, out=True)
    for inside, right in WAITING:
        point = _inner(door, room, inside, right + math.copysign(side, right))
        free = site.premises.paths(room).nearest_free(point, spec.radius)
        if free is None or math.dist(point, free) > FREE:
            continue
        if not any(in_front(other, room, free, spec.radius) for other in others):
            yield free


def inward(site: Site, spec: RobotSpec, room: RoomId) -> Point | None:
    """The velocity at which a robot backs into the room that was pushed into a doorway without the right of way."""
    here = site.pose(spec.id).point
    for door in site.premises.doors_of(room):
        x, y = outward(door, room)
        dx, dy = here[0] - door.position[0], here[1] - door.position[1]
        if dx * x + dy * y > -spec.radius - RIM and abs(dy * x - dx * y) < door.width / 2:
            return (-BACK * x, -BACK * y)
    return None


def in_the_way(site: Site, robot: RobotId, door: Door, room: RoomId) -> bool:
    """Whether the robot stands where others pass through the door."""
    radius, here = site.robot_radius(robot), site.pose(robot).point
    lines = ([gate(door, room, radius, out=out, inside=inside) for inside in (0.0, DEPTH)] for out in (True, False))
    return any(off_line(here, begin, end) < 2 * radius + BERTH for begin, end in lines)


def _inner(door: Door, room: RoomId, inside: float, right: float) -> Point:
    x, y = outward(door, room)
    middle = inner_point(door, room, inside)
    return (middle[0] + right * y, middle[1] - right * x)
