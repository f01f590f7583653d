"""The site: rooms and corridors as one space, in which every robot is in exactly one of the two.

Theory of operation
-------------------
In a room a robot is a pymunk body, in the corridors a SUMO vehicle. It changes over in a door's doorway, at
the exact pose of the other form, so that nothing jumps: a body drives out to where SUMO will put the vehicle,
``depart`` asks SUMO to insert it, and in the step in which SUMO did so the body goes. A vehicle that arrived
holds at the end of its lane until ``admit``; then it goes and the body stands where it stood. The place of a
robot changes when its centre crosses the door's line, whatever its form.
"""

import math
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.corridors import Corridors
from clo_fleet.sim.routes import Route
from clo_fleet.sim.doors import Doors
from clo_fleet.sim.paths import RoomPaths
from clo_fleet.sim.rooms import Rooms
from clo_fleet.sim.walls import free_space, in_room
from clo_fleet.world.model import (
    BuildingMap,
    Door,
    DoorId,
    ObjectId,
    ObjectSpec,
    PlaceId,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
)
from clo_fleet.world.places import zones

__all__ = ["NoCorridorsError", "Site"]

class NoCorridorsError(CloFleetError):
    """A robot was sent into the corridors of a building that has none."""


class Site:
    """All space of one building; a context manager, because SUMO has to be closed."""

    def __init__(
        self, building: BuildingMap, robots: Sequence[RobotSpec], objects: Sequence[ObjectSpec], *, seed: int, tick: float
    ) -> None:
        self.building = building
        self.tick = tick
        self.rooms = Rooms(building, robots, objects, tick=tick)
        self.doors = Doors(building.doors)
        self._corridors = Corridors(building, seed=seed, tick=tick) if building.corridors else None
        self._room: dict[RoomId, Room] = {room.id: room for room in building.rooms}
        self._door: dict[DoorId, Door] = {door.id: door for door in building.doors}
        self._objects = {spec.id: spec for spec in sorted(objects, key=lambda spec: spec.id)}
        self._robots = {spec.id: spec for spec in sorted(robots, key=lambda spec: spec.id)}
        self._zone_of_door = _zones_of_doors(building)
        self._paths: dict[RoomId, RoomPaths] = {}
        self._max_speed = {spec.id: spec.max_speed for spec in robots}
        self._vehicle: dict[RobotId, Route] = {}  # robots that are vehicles
        self._inserting: dict[RobotId, Route] = {}  # bodies for whom SUMO has a vehicle pending
        self._place: dict[RobotId, PlaceId] = {}
        for spec in robots:
            self._place[spec.id] = PlaceId(spec.room)
        self._object_place: dict[ObjectId, PlaceId] = {spec.id: PlaceId(spec.room) for spec in objects}

    def __enter__(self) -> Self:
        if self._corridors:
            self._corridors.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of SUMO."""
        if self._corridors:
            self._corridors.close()

    # ---- where things are ----------------------------------------------------------------------------------

    @property
    def corridors(self) -> Corridors:
        """The corridors.

        Raises:
            NoCorridorsError: if the building has none.
        """
        if self._corridors is None:
            raise NoCorridorsError(f"building {self.building.name} has no corridors")
        return self._corridors

    def room(self, room: RoomId) -> Room:
        """The room of that id."""
        return self._room[room]

    def door(self, door: DoorId) -> Door:
        """The door of that id."""
        return self._door[door]

    def is_room(self, place: PlaceId) -> bool:
        """Whether the place is a room, not a zone."""
        return RoomId(place) in self._room

    def paths(self, room: RoomId) -> RoomPaths:
        """The paths of a room; made when first asked for."""
        if room not in self._paths:
            self._paths[room] = RoomPaths(free_space(self.building, room))
        return self._paths[room]

    def in_corridor(self, robot: RobotId) -> bool:
        """Whether the robot is a vehicle."""
        return robot in self._vehicle

    def pose(self, robot: RobotId) -> Pose:
        """The robot's pose, whatever its form."""
        pose = self.rooms.pose(robot)
        return pose if pose is not None else self.corridors.pose(robot)

    def speed(self, robot: RobotId) -> float:
        """The robot's speed [m/s]."""
        if self.in_corridor(robot):
            return self.corridors.speed(robot)
        return math.hypot(*(self.rooms.velocity(robot) or (0.0, 0.0)))

    def place(self, robot: RobotId) -> PlaceId:
        """The room or zone in which the robot's centre is."""
        return self._place[robot]

    def item_position(self, item: ObjectId) -> Point | None:
        """Where an object lies or is carried in a room; ``None`` while it is carried through corridors."""
        return self.rooms.item_position(item)

    def item_place(self, item: ObjectId) -> PlaceId | None:
        """The place where an object lies; ``None`` while it is carried."""
        return None if self.rooms.carrier(item) is not None else self._object_place[item]

    def items_in(self, room: RoomId) -> tuple[ObjectId, ...]:
        """The objects that lie in the room, sorted."""
        return tuple(item for item in self._objects if self.item_place(item) == PlaceId(room))

    def bodies_in(self, room: RoomId) -> tuple[RobotId, ...]:
        """The robots that are bodies and whose place is the room, sorted."""
        return tuple(robot for robot in self._robots if self._place[robot] == PlaceId(room) and robot not in self._vehicle)

    def item_radius(self, item: ObjectId) -> float:
        """The object's radius [m]."""
        return self._objects[item].radius

    def robot_radius(self, robot: RobotId) -> float:
        """The robot's radius [m]."""
        return self._robots[robot].radius

    def max_speed(self, robot: RobotId) -> float:
        """The robot's top speed at present [m/s]."""
        return self._max_speed[robot]

    # ---- acting --------------------------------------------------------------------------------------------

    def slow(self, robot: RobotId, max_speed: float) -> None:
        """Set the robot's top speed [m/s]."""
        self._max_speed[robot] = max_speed
        self.rooms.set_max_speed(robot, max_speed)
        if robot in self._vehicle or robot in self._inserting:
            self.corridors.set_max_speed(robot, max_speed)

    def depart(self, robot: RobotId, route: Route) -> None:
        """Ask SUMO to take the robot over where it stands, at the beginning of ``route``."""
        self.corridors.enter(robot, route, self._max_speed[robot])
        self._inserting[robot] = route

    def arrived(self, robot: RobotId) -> bool:
        """Whether the robot's vehicle holds at its far door."""
        return robot in self._vehicle and robot in self.corridors.arrived()

    def admit(self, robot: RobotId) -> None:
        """Turn a vehicle that arrived into a body at the same pose."""
        self._vehicle.pop(robot)
        self.rooms.add_robot(robot, self.corridors.remove(robot))
        self.rooms.set_max_speed(robot, self._max_speed[robot])

    def step(self) -> tuple[RobotId, ...]:
        """One tick of physics, then of traffic, then the change-overs; the robots that became vehicles."""
        self.rooms.step()
        entered: tuple[RobotId, ...] = ()
        if self._corridors:
            self._corridors.step()
            entered = self._corridors.entered()
        for robot in entered:
            self.rooms.remove_robot(robot)
            self._vehicle[robot] = self._inserting.pop(robot)
        for robot in self._place:
            if robot not in self._vehicle:
                pose = self.rooms.pose(robot)
                if pose is not None:
                    self._place[robot] = self._place_at(pose.point, self._place[robot])
        for item in self._objects:
            position = self.rooms.item_position(item)
            if position is not None:
                self._object_place[item] = self._place_at(position, self._object_place[item])
        return entered

    def state(self) -> dict[str, Any]:
        """Who is where, as plain data; the engines' own state comes with theirs."""
        return {
            "rooms": self.rooms.state(),
            "doors": self.doors.state(),
            "corridors": self._corridors.state() if self._corridors else None,
            "place": dict(self._place),
            "object_place": dict(self._object_place),
            "max_speed": dict(self._max_speed),
        }

    def restore_doors(self, state: Mapping[str, Any]) -> None:
        """Take up the queues at doors."""
        self.doors.restore(state)

    # ---- private -------------------------------------------------------------------------------------------

    def _place_at(self, point: Point, last: PlaceId) -> PlaceId:
        """The place of a point that was in ``last`` a tick ago: out of the room's outline is through its door."""
        if RoomId(last) in self._room:
            room = self._room[RoomId(last)]
            if in_room(room, point):
                return last
            door = min(
                (door for door in self.building.doors if room.id in door.rooms),
                key=lambda door: math.dist(door.position, point),
            )
            other = next((other for other in door.rooms if other != room.id), None)
            return PlaceId(other) if other is not None else self._zone_of_door[door.id]
        for door in self.building.doors:
            if self._zone_of_door.get(door.id) == last and in_room(self._room[door.rooms[0]], point):
                return PlaceId(door.rooms[0])
        return last


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
