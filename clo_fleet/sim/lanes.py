"""What there is to share on the way: lanes that hold so many robots, single lanes used by turns, places in rooms.

A *chain* is a maximal row of single-lane corridors that meet end to end. Whoever is in it leaves it only at its ends
(or through a door within it), so that robots in opposite directions must not be in it together.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import shapely

from clo_fleet.sim.doors import WIDE
from clo_fleet.sim.network import network_edges
from clo_fleet.world.model import BuildingMap, Corridor, Door, Room, RoomId

__all__ = ["FLOOR", "SPACE", "ChainWay", "Ground", "ground", "lane_capacity", "passages", "single_lane_doors"]

SPACE = 1.1  # [m] of lane that a standing robot takes: its 0.8 m as a vehicle, and the gap of 0.3 m to the next
STOP_LINE = 0.2  # [m] before the end of a lane that robots may leave free
LEAST_PLACES = 2
FLOOR = 1.0  # [m2] of floor for each robot in a room: discs of 0.6 m that can still get round one another
NARROW = 0.01  # [m] narrower than a wide door
DOORSTEP = 3.0  # [m2] of floor in front of each door that stays free


@dataclass(frozen=True, slots=True)
class ChainWay:
    """One direction through a chain. ``chain``: the id of its first corridor."""

    chain: str
    forwards: bool


@dataclass(frozen=True, slots=True)
class Ground:
    """What the right of way is about.

    Attributes:
        capacity: of each lane, by edge: how many robots can stand on it.
        ways: of each lane that is single: the direction and chain that it is part of.
        places: of each room: how many robots it holds, so that all can still move.
    """

    capacity: Mapping[str, int]
    ways: Mapping[str, ChainWay]
    places: Mapping[RoomId, int]


def ground(building: BuildingMap, lengths: Mapping[str, float], crowd: Mapping[RoomId, int]) -> Ground:
    """The ground of a building.

    Args:
        building: its rooms and corridors.
        lengths: of the lanes, by edge [m].
        crowd: how many robots begin in each room; so many it holds in any case.
    """
    doors = [room for door in building.doors for room in door.rooms]
    places = {room.id: max(_places(room, doors.count(room.id)), crowd.get(room.id, 0)) for room in building.rooms}
    return Ground({edge: lane_capacity(length) for edge, length in lengths.items()}, _chain_ways(building), places)


def lane_capacity(length: float) -> int:
    """How many robots can stand on a lane of this length [m], one at least.

    >>> lane_capacity(1.2), lane_capacity(5.0)
    (1, 4)
    """
    return max(1, math.floor((length - STOP_LINE) / SPACE))


def single_lane_doors(building: BuildingMap) -> frozenset[str]:
    """The doors at which a single-lane corridor ends."""
    return frozenset(end for c in building.corridors if c.single_lane for end in (c.start, c.end)) & {
        str(door.id) for door in building.doors
    }


def passages(building: BuildingMap) -> list[Door]:
    """The doors as robots pass them: one at a time and in the middle where a single lane ends at a wide door."""
    single = single_lane_doors(building)
    return [replace(d, width=min(d.width, WIDE - NARROW)) if d.id in single else d for d in building.doors]


def _places(room: Room, doors: int) -> int:
    """Two at least: who is to hand something over has to come to where the other is."""
    blocked = sum(float(shapely.Polygon(obstacle).area) for obstacle in room.obstacles)
    return max(
        LEAST_PLACES, math.floor((float(shapely.Polygon(room.outline).area) - blocked - DOORSTEP * doors) / FLOOR)
    )


def _chain_ways(building: BuildingMap) -> dict[str, ChainWay]:
    """The way through its chain of each edge of a single-lane corridor."""
    single = {str(c.id): c for c in sorted(building.corridors, key=lambda c: c.id) if c.single_lane}
    meeting: dict[str, list[str]] = {}
    for corridor in building.corridors:
        for node in (corridor.start, corridor.end):
            meeting.setdefault(node, []).append(corridor.id)
    found: dict[str, ChainWay] = {}
    for first in single.values():
        if first.id not in found:
            _follow(first, first.id, True, single, meeting, found)
    return {edge.id: found[edge.id] for edge in network_edges(building) if edge.id in found}


def _follow(
    first: Corridor,
    chain: str,
    forwards: bool,
    single: Mapping[str, Corridor],
    meeting: Mapping[str, Iterable[str]],
    found: dict[str, ChainWay],
) -> None:
    """Note the ways of all corridors in the chain of ``first``."""
    left = [(first, forwards)]
    while left:
        corridor, along = left.pop()
        if corridor.id in found:
            continue
        found[corridor.id], found[f"-{corridor.id}"] = ChainWay(chain, along), ChainWay(chain, not along)
        for node in (corridor.start, corridor.end):
            others = [other for other in meeting[node] if other != corridor.id]
            if len(others) == 1 and others[0] in single:
                other = single[others[0]]
                onward = (node == corridor.end) == (node == other.start)  # both drawn the same way along the chain
                left.append((other, along if onward else not along))
