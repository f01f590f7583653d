"""The rooms and doors of a building: what belongs to which, the paths of a room and the lines of sight in it.

The place of a robot, a room or a zone of the corridors, changes when its centre crosses a door's line. A doorway
belongs to its room for whatever lies there.
"""

import math
from collections.abc import Mapping

from clo_fleet.sim.lanes import passages
from clo_fleet.sim.paths import RoomPaths
from clo_fleet.sim.sightlines import Sightlines
from clo_fleet.sim.walls import free_space, in_room
from clo_fleet.world.model import BuildingMap, Door, DoorId, PlaceId, Point, Room, RoomId
from clo_fleet.world.places import zones

__all__ = ["Premises"]


class Premises:
    """The rooms and doors of one building; nothing of it changes.

    Attributes:
        rooms: by id.
        doors: by id, as robots pass them.
    """

    def __init__(self, building: BuildingMap) -> None:
        self._building = building
        self.rooms: Mapping[RoomId, Room] = {room.id: room for room in building.rooms}
        self.doors: Mapping[DoorId, Door] = {door.id: door for door in passages(building)}
        self._doors_of = {room: tuple(d for d in self.doors.values() if room in d.rooms) for room in self.rooms}
        self._zone_of_door = _zones_of_doors(building)
        self._paths: dict[RoomId, RoomPaths] = {}
        self._sightlines: dict[RoomId, Sightlines] = {}

    def doors_of(self, room: RoomId) -> tuple[Door, ...]:
        """The doors of a room."""
        return self._doors_of[room]

    def is_room(self, place: PlaceId) -> bool:
        """Whether the place is a room, not a zone."""
        return RoomId(place) in self.rooms

    def paths(self, room: RoomId) -> RoomPaths:
        """The paths of a room; made when first asked for."""
        if room not in self._paths:
            self._paths[room] = RoomPaths(free_space(self._building, room))
        return self._paths[room]

    def sightlines(self, room: RoomId) -> Sightlines:
        """The lines of sight of a room; made when first asked for."""
        if room not in self._sightlines:
            self._sightlines[room] = Sightlines(self.rooms[room], free_space(self._building, room))
        return self._sightlines[room]

    def nearest_door(self, zone: PlaceId, point: Point) -> Door:
        """The door onto a zone that is nearest to a point."""
        doors = (self.doors[door] for door, beyond in self._zone_of_door.items() if beyond == zone)
        return min(doors, key=lambda door: math.dist(door.position, point))

    def place_at(self, point: Point, last: PlaceId) -> PlaceId:
        """The place of a robot's centre that was in ``last`` a tick ago: out of a room is through its door."""
        if RoomId(last) in self.rooms:
            room = self.rooms[RoomId(last)]
            if in_room(room, point):
                return last
            door = min(
                self._doors_of[room.id],
                key=lambda door: math.dist(door.position, point),
                default=None,
            )
            if door is None:
                return last
            other = next((other for other in door.rooms if other != room.id), None)
            return PlaceId(other) if other is not None else self._zone_of_door[door.id]
        room = self.rooms[self.nearest_door(last, point).rooms[0]]
        return PlaceId(room.id) if in_room(room, point) else last

    def room_around(self, point: Point, last: RoomId) -> RoomId:
        """The room of a point: the one whose floor it is on; in a doorway, or under a wall, the last one."""
        if in_room(self.rooms[last], point):
            return last
        return next((room.id for room in self._building.rooms if in_room(room, point)), last)


def _zones_of_doors(building: BuildingMap) -> dict[DoorId, PlaceId]:
    """The zone behind each door that opens on corridors."""
    ends = {corridor.id: (corridor.start, corridor.end) for corridor in building.corridors}
    doors = {door.id for door in building.doors}
    return {
        DoorId(end): zone
        for zone, corridors in zones(building).items()
        for corridor in sorted(corridors)
        for end in ends[corridor]
        if end in doors
    }
