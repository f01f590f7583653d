"""Small buildings for tests: rooms in a row need no corridors, so neither SUMO nor the extra ``maps``."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from clo_fleet.sim.network import build_network
from clo_fleet.study.shipped import shipped
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    Point,
    Room,
    RoomId,
)

__all__ = ["corridor_with_rooms", "rooms_in_a_row", "rooms_on_a_corridor", "shipped_map"]

WIDTH, DEPTH = 6.0, 5.0  # [m] of a room in a row
GAP = 1.2  # [m] a door between two rooms
DOOR = 1.8  # [m] a door onto the corridor


def shipped_map(name: str) -> BuildingMap:
    """A map that comes with the package: ``hello``, ``row``, ``three_rooms``, ``office``.

    Raises:
        FileFaultsError: if there is none of that name.
    """
    return read_map(shipped("maps") / f"{name}.yaml")


def rooms_in_a_row(*names: str) -> BuildingMap:
    """Rooms of 6 m x 5 m side by side, from (0, 0) to the right, each with a door to the next.

    >>> [door.rooms for door in rooms_in_a_row("a", "b", "c").doors]
    [('a', 'b'), ('b', 'c')]
    """
    rooms = tuple(Room(RoomId(name), rectangle(number * WIDTH, 0.0, WIDTH, DEPTH)) for number, name in enumerate(names))
    doors = tuple(
        Door(
            id=DoorId(f"{one.id}-{other.id}"),
            rooms=(one.id, other.id),
            position=(other.outline[0][0], DEPTH / 2),
            heading=0.0,
            width=GAP,
        )
        for one, other in pairwise(rooms)
    )
    return BuildingMap(name="row", rooms=rooms, doors=doors)


def rooms_on_a_corridor(names: Sequence[str], folder: Path, *, closet: str = "") -> BuildingMap:
    """Rooms of 8 m x 6 m on both sides of a corridor, a pillar in each; its network is written to ``folder``.

    The ways to the doors of two rooms that face each other meet the corridor 4.6 m apart, so that no four ways cross
    and no lane is shorter than 1.2 m (``sim.network``): in shorter ones robots get into one another.
    ``closet``: the name of one more room, behind a narrow door of the first.

    Raises:
        NetconvertMissingError: without the extra ``maps``.
    """
    building = corridor_with_rooms(names, closet=closet)
    path = folder / f"{building.name}.net.xml.gz"
    build_network(building, path)
    return replace(building, network=path)


def corridor_with_rooms(names: Sequence[str], *, closet: str = "") -> BuildingMap:
    """The same building, its network not yet built."""
    rooms, doors, corridors, junctions = [], [], [], []
    for number, name in enumerate(names):
        x, up = 10.0 * (number // 2), number % 2 == 0
        bottom = 4.0 if up else -10.0
        rooms.append(Room(RoomId(name), rectangle(x, bottom, 8, 6), (rectangle(x + 5.5, bottom + 2.5, 1, 1),)))
        at = (x + (1.7 if up else 6.3), 4.0 if up else -4.0)
        door = Door(
            id=DoorId(f"{name}-door"),
            rooms=(RoomId(name),),
            position=at,
            heading=-math.pi / 2 if up else math.pi / 2,
            width=DOOR,
        )
        doors.append(door)
        junction = Junction(f"j{number}", (at[0], 0.0))
        junctions.append(junction)
        way = Corridor(id=CorridorId(f"to-{name}"), start=door.id, end=junction.id, shape=(at, junction.position))
        corridors.append(way)
    for begin, end in pairwise(junctions):
        shape = (begin.position, end.position)
        corridors.append(Corridor(id=CorridorId(f"c-{begin.id}"), start=begin.id, end=end.id, shape=shape))
    if closet:
        rooms.append(Room(RoomId(closet), rectangle(-4, 4, 4, 6)))
        both = (rooms[0].id, rooms[-1].id)
        doors.append(Door(id=DoorId(f"{closet}-door"), rooms=both, position=(0, 7), heading=math.pi, width=GAP))
    return BuildingMap(
        name=f"corridor-{len(rooms)}",
        rooms=tuple(rooms),
        doors=tuple(doors),
        junctions=tuple(junctions),
        corridors=tuple(corridors),
    )


def rectangle(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    """A rectangle's corners from its lower left one."""
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
