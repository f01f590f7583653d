"""Free places on a room's floor, for robots to stand and objects to lie."""

import math
from collections.abc import Sequence

from clo_fleet.world.model import BuildingMap, Door, Point, Pose, Room, RoomId
from clo_fleet.world.outlines import clearance

__all__ = ["free_spots", "in_the_way"]

DOORWAY_DEPTH = 1.7  # [m] on both sides of a door that stay free
DOORWAY_SIDE = 0.4  # [m] beside a door that stay free
ROOMY = 0.4  # [m] from walls and obstacles: a robot's radius and some more
APART = 0.9  # [m] between spots: two robots of radius 0.3, or a robot and what it reaches for
MOST = 200  # a room


def free_spots(building: BuildingMap) -> dict[RoomId, tuple[Pose, ...]]:
    """For each room the places that are apart from each other and out of the way of doors, spawn points first."""
    doors: dict[RoomId, list[Door]] = {room.id: [] for room in building.rooms}
    for door in building.doors:
        for room in door.rooms:
            doors[room].append(door)
    spawns: dict[RoomId, list[Pose]] = {room.id: [] for room in building.rooms}
    for spawn in building.spawn_points:
        spawns[spawn.room].append(spawn.pose)
    return {room.id: _spots(room, doors[room.id], spawns[room.id]) for room in building.rooms}


def in_the_way(door: Door, point: Point) -> bool:
    """Whether who stands at the point is in the way of a door."""
    dx, dy = point[0] - door.position[0], point[1] - door.position[1]
    cos, sin = math.cos(door.heading), math.sin(door.heading)
    return abs(dx * cos + dy * sin) < DOORWAY_DEPTH and abs(dy * cos - dx * sin) < door.width / 2 + DOORWAY_SIDE


def _spots(room: Room, doors: Sequence[Door], spawns: Sequence[Pose]) -> tuple[Pose, ...]:
    left, bottom = (min(point[axis] for point in room.outline) for axis in (0, 1))
    right, top = (max(point[axis] for point in room.outline) for axis in (0, 1))
    step = max(APART, math.sqrt((right - left) * (top - bottom) / MOST))
    lattice = [
        Pose(round(left + ROOMY + i * step, 3), round(bottom + ROOMY + j * step, 3))
        for j in range(int((top - bottom - 2 * ROOMY) / step + 1e-9) + 1)
        for i in range(int((right - left - 2 * ROOMY) / step + 1e-9) + 1)
    ]
    found: list[Pose] = []
    for pose in (*spawns, *lattice):
        if (
            clearance(room, pose.point) >= ROOMY - 1e-9
            and all(math.dist(pose.point, other.point) >= APART for other in found)
            and not any(in_the_way(door, pose.point) for door in doors)
        ):
            found.append(pose)
    return tuple(found)
