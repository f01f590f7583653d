"""Free places on a room's floor, for robots to stand and objects to lie."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from clo_fleet.world.model import BuildingMap, Door, Point, Pose, Room, RoomId
from clo_fleet.world.outlines import clearance

__all__ = ["free_spots", "in_the_way"]

DOORWAY_DEPTH = 1.7  # [m] on both sides of a door that stay free
DOORWAY_SIDE = 0.4  # [m] beside a door that stays free
FEW = 4  # places in a room that are enough
MOST = 200  # points of a room that are tried, about


@dataclass(frozen=True, slots=True)
class _Fit:
    """How much space a place needs [m]: to walls, to others, before doors and beside them; and the step of a search."""

    roomy: float
    apart: float
    depth: float
    side: float
    step: float


WIDE = _Fit(roomy=0.4, apart=0.9, depth=DOORWAY_DEPTH, side=DOORWAY_SIDE, step=0.9)
NARROW = _Fit(roomy=0.35, apart=0.75, depth=0.8, side=0.0, step=0.2)


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


def in_the_way(door: Door, point: Point, depth: float = DOORWAY_DEPTH, side: float = DOORWAY_SIDE) -> bool:
    """Whether who stands at the point is in the way of a door."""
    dx, dy = point[0] - door.position[0], point[1] - door.position[1]
    cos, sin = math.cos(door.heading), math.sin(door.heading)
    return abs(dx * cos + dy * sin) < depth and abs(dy * cos - dx * sin) < door.width / 2 + side


def _spots(room: Room, doors: Sequence[Door], spawns: Sequence[Pose]) -> tuple[Pose, ...]:
    """A room's places; where there are few, narrower ones as well."""
    found: list[Pose] = []
    for fit in (WIDE, NARROW):
        for pose in (*spawns, *_lattice(room, fit)):
            if (
                clearance(room, pose.point) >= fit.roomy - 1e-9
                and all(math.dist(pose.point, other.point) >= fit.apart for other in found)
                and not any(in_the_way(door, pose.point, fit.depth, fit.side) for door in doors)
            ):
                found.append(pose)
        if len(found) >= FEW:
            break
    return tuple(found)


def _lattice(room: Room, fit: _Fit) -> list[Pose]:
    """Points all over a room's bounds."""
    left, bottom = (min(point[axis] for point in room.outline) + fit.roomy for axis in (0, 1))
    right, top = (max(point[axis] for point in room.outline) - fit.roomy for axis in (0, 1))
    step = max(fit.step, math.sqrt(max(0.0, (right - left) * (top - bottom)) / MOST))
    rows, columns = int((top - bottom) / step + 1e-9), int((right - left) / step + 1e-9)
    return [
        Pose(round(left + i * step, 3), round(bottom + j * step, 3))
        for j in range(rows + 1)
        for i in range(columns + 1)
    ]
