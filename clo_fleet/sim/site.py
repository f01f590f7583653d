"""The site: rooms and corridors as one space, in which every robot is in exactly one of the two.

Theory of operation
-------------------
In a room a robot is a pymunk body, in the corridors a SUMO vehicle. It changes over in a door's doorway, at
the exact pose of the other form, so that nothing jumps: a body drives out to where SUMO will put the vehicle,
``depart`` asks SUMO to insert it, and in the step in which SUMO did so the body goes. A vehicle that arrived
holds at the end of its lane until ``admit``; then it goes and the body stands where it stood. The place of a
robot changes when its centre crosses the door's line, whatever its form. Who is in which room is noted once a
tick, for the many who ask.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.corridors import Corridors
from clo_fleet.sim.doors import Doors
from clo_fleet.sim.items import Items
from clo_fleet.sim.premises import Premises
from clo_fleet.sim.right_of_way import Hindrance
from clo_fleet.sim.rooms import Rooms
from clo_fleet.sim.routes import Route
from clo_fleet.sim.traffic import Course, Traffic
from clo_fleet.sim.vehicle import LENGTH, off_vehicle
from clo_fleet.world.model import BuildingMap, DoorId, ObjectSpec, PlaceId, Point, Pose, RobotId, RobotSpec, RoomId
from clo_fleet.world.places import Ways

__all__ = ["NoCorridorsError", "Site"]

SLOWEST = 0.05  # [m/s] at which a robot counts on getting to a door
LEFT = 0.65  # [m] from its place at a door a robot is out of the way of whoever comes up to that: its width, and a bit
BESIDE = 0.05  # [m] a vehicle this near to where another is to enter is in the way; on the other lane it is not


class NoCorridorsError(CloFleetError):
    """A robot was sent into the corridors of a building that has none."""


class Site:
    """All space of one building; a context manager, because SUMO has to be closed."""

    def __init__(
        self,
        building: BuildingMap,
        robots: Sequence[RobotSpec],
        objects: Sequence[ObjectSpec],
        *,
        seed: int,
        tick: float,
    ) -> None:
        self.building = building
        self.tick = tick
        self.premises = Premises(building)
        self.rooms = Rooms(building, robots, objects, tick=tick)
        self.items = Items(self.rooms, self.premises, objects)
        self._corridors = Corridors(building, seed=seed, tick=tick) if building.corridors else None
        self.traffic = Traffic(building, self._corridors, robots)
        self.doors = Doors(self.premises.doors.values())
        self._robots = {spec.id: spec for spec in sorted(robots, key=lambda spec: spec.id)}
        self._ways = Ways(building)
        self._max_speed = {spec.id: spec.max_speed for spec in robots}
        self._vehicle: dict[RobotId, Route] = {}  # robots that are vehicles
        self._inserting: dict[RobotId, Route] = {}  # bodies for whom SUMO has a vehicle pending
        self._leaving: dict[RobotId, Point] = {}  # bodies whose vehicle still keeps the place at the door for them
        self._place: dict[RobotId, PlaceId] = {}
        self._settled: set[RobotId] = set()  # who was in the same place in the last two steps
        for spec in robots:
            self._place[spec.id] = PlaceId(spec.room)
        self._standing: dict[RoomId, list[RobotId]] = {}
        self.stirred: set[RoomId] = set()  # the rooms to which something came, or from which it went, in the last step
        self._note_who_is_where()

    def __enter__(self) -> Self:
        if self._corridors:
            self._corridors.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
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

    def bodies_in(self, room: RoomId) -> tuple[RobotId, ...]:
        """The robots that were bodies on the floor of the room or of its doorways at the last step, sorted."""
        return tuple(robot for robot in self._standing.get(room, ()) if robot not in self._vehicle)

    def floor(self, robot: RobotId) -> RoomId | None:
        """The room on whose floor, its doorways' included, the robot stands; ``None`` while it is a vehicle."""
        if robot in self._vehicle:
            return None
        place = self._place[robot]
        if (room := RoomId(place)) in self.premises.rooms:
            return room
        return self.premises.nearest_door(place, self.pose(robot).point).rooms[0]

    def robot_radius(self, robot: RobotId) -> float:
        """The robot's radius [m]."""
        return self._robots[robot].radius

    def max_speed(self, robot: RobotId) -> float:
        """The robot's top speed at present [m/s]."""
        return self._max_speed[robot]

    def entry_clear(self, route: Route, radius: float) -> bool:
        """Whether a robot can stand where the route begins, and will be let in there before others."""
        if not self.corridors.entry_clear(route):
            return False
        entry = self.corridors.entry_pose(route).point
        reach = radius + BESIDE
        return all(off_vehicle(pose, entry) > reach for pose in self.corridors.near(entry, reach + LENGTH))

    def holding(self) -> dict[RobotId, RoomId]:
        """The vehicles that have arrived and wait to be let in, sorted, with the room at whose door each one holds."""
        if self._corridors is None:
            return {}
        return {robot: self.premises.doors[self._vehicle[robot].end].rooms[0] for robot in self._corridors.arrived()}

    def coming(self, door: DoorId, within: float) -> RobotId | None:
        """The first vehicle by id that is to arrive at the door and is this near to it [m], or holds there."""
        near = (
            robot
            for robot in sorted(robot for robot, route in self._vehicle.items() if route.end == door)
            if math.dist(self.pose(robot).point, self.premises.doors[door].position) < within
        )
        return next(near, None)

    def course(self, robot: RobotId, start: RoomId, goal: RoomId, out: DoorId | None = None) -> Course | None:
        """The quickest way from room to room as things are, to the door included; ``None``: none is open.

        ``out``: only out of this door, if given.
        """
        here, speed = self.pose(robot).point, self._max_speed[robot]
        away = {door.id: math.dist(here, door.position) / max(speed, SLOWEST) for door in self.premises.doors_of(start)}
        ways = (way for way in self._ways.between(start, goal) if out in (None, way.exit))
        return self.traffic.course(ways, away)

    def waiting(self) -> dict[RobotId, RobotId | None]:
        """The robots that stand on their way in corridors, and whom each stands behind, if that is what holds it."""
        return self._corridors.waiting() if self._corridors is not None and self._vehicle else {}

    # ---- acting --------------------------------------------------------------------------------------------

    def set_out(self, robot: RobotId, start: RoomId, goal: RoomId, course: Course) -> bool:
        """Ask for the right of way along a course; whether the robot has it."""
        return self.traffic.set_out(robot, start, goal, course, self._standing)

    def hindrance(self, robot: RobotId) -> Hindrance | None:
        """Why the robot that asked for the right of way does not have it, as things are now."""
        self.traffic.right_of_way.decide(self._standing)
        return self.traffic.hindrance(robot)

    def divert(self, robot: RobotId, start: RoomId, goal: RoomId, *, quicker: bool = False) -> Course | None:
        """Send a vehicle that came from ``start`` another way, into ``goal``; ``None``: that cannot be, now."""
        doors = (door for door in self.premises.doors_of(goal) if len(door.rooms) == 1)
        route = self.traffic.divert(robot, self._vehicle[robot], start, doors, quicker=quicker)
        if route is None:
            return None
        self._vehicle[robot] = route
        return Course(route.start, route.end, route)

    def slow(self, robot: RobotId, max_speed: float) -> None:
        """Set the robot's top speed [m/s]."""
        self._max_speed[robot] = max_speed
        self.rooms.set_max_speed(robot, max_speed)
        if robot in self._vehicle or robot in self._inserting:
            self.corridors.set_max_speed(robot, max_speed)

    def depart(self, robot: RobotId, route: Route) -> None:
        """Ask SUMO to take the robot over where it stands, at the beginning of ``route``."""
        assert self.traffic.right_of_way.claim(robot) == route.edges, "a robot drives where it has the right of way"
        self.corridors.enter(robot, route, self._max_speed[robot])
        self._inserting[robot] = route

    def arrived(self, robot: RobotId) -> bool:
        """Whether the robot's vehicle holds at its far door."""
        return robot in self._vehicle and self.corridors.has_arrived(robot)

    def arrivals(self) -> tuple[RobotId, ...]:
        """The robots whose vehicles have come to their far doors in the last step, sorted."""
        return self._corridors.stopped() if self._corridors else ()

    def odometer(self, robot: RobotId) -> float:
        """How far a robot has come on its way through the corridors [m]."""
        return self.corridors.odometer(robot)

    def admit(self, robot: RobotId) -> None:
        """Turn a vehicle that arrived into a body at the same pose; nobody comes up to that before it has left it."""
        pose = self.corridors.let_out(robot)
        del self._vehicle[robot]
        self._leaving[robot] = pose.point
        self.rooms.add_robot(robot, pose)
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
        for robot in [r for r, held in self._leaving.items() if math.dist(self.pose(r).point, held) >= LEFT]:
            self._give_up_place(robot)
        for robot in self.rooms.present():
            if robot not in self._settled or robot in self.rooms.moving:
                place, last = self.premises.place_at(self.pose(robot).point, self._place[robot]), self._place[robot]
                self._place[robot] = place
                (self._settled.add if place == last else self._settled.discard)(robot)
        self._note_who_is_where()
        self.traffic.step(self._standing)
        return entered

    def state(self) -> dict[str, Any]:
        """Who is where, as plain data; SUMO's half of the traffic is for the corridors to save."""
        return {
            "rooms": self.rooms.state(),
            "doors": self.doors.state(),
            "corridors": self._corridors.state() if self._corridors else None,
            "traffic": self.traffic.state(),
            "place": dict(self._place),
            "object_place": self.items.state(),
            "max_speed": dict(self._max_speed),
            "vehicle": {robot: route.state() for robot, route in self._vehicle.items()},
            "inserting": {robot: route.state() for robot, route in self._inserting.items()},
            "leaving": {robot: list(held) for robot, held in self._leaving.items()},
        }

    @classmethod
    def from_state(
        cls,
        building: BuildingMap,
        robots: Sequence[RobotSpec],
        objects: Sequence[ObjectSpec],
        state: Mapping[str, Any],
        traffic: Path | None,
        *,
        seed: int,
        tick: float,
    ) -> Self:
        """The site, not yet entered, that ``state()`` was taken from. ``traffic``: what the corridors saved."""
        site = cls(building, robots, objects, seed=seed, tick=tick)
        site.rooms = Rooms.from_state(building, robots, objects, state["rooms"], tick=tick)
        site.items = Items(site.rooms, site.premises, objects)
        site.items.restore(state["object_place"])
        site.doors.restore(state["doors"])
        if traffic is not None:
            site._corridors = Corridors.from_state(building, state["corridors"], traffic)
        site.traffic = Traffic.from_state(building, site._corridors, robots, state["traffic"])
        site._place = dict(state["place"])
        site._max_speed = dict(state["max_speed"])
        site._vehicle = {robot: Route.from_state(route) for robot, route in state["vehicle"].items()}
        site._inserting = {robot: Route.from_state(route) for robot, route in state["inserting"].items()}
        site._leaving = {robot: (held[0], held[1]) for robot, held in state["leaving"].items()}
        site._note_who_is_where()
        return site

    # ---- private -------------------------------------------------------------------------------------------

    def _give_up_place(self, robot: RobotId) -> None:
        """Take the vehicle of a robot that was let in at its door out of the corridors."""
        del self._leaving[robot]
        self.corridors.remove(robot)
        self.traffic.right_of_way.withdraw(robot)

    def _note_who_is_where(self) -> None:
        lay, stood = self.items.lying, self._standing
        self.items.note()
        self._standing = {}
        for robot in self.rooms.present():
            if (room := self.floor(robot)) is not None:
                self._standing.setdefault(room, []).append(robot)
        self.stirred = _differing(lay, self.items.lying) | _differing(stood, self._standing)


def _differing(before: Mapping[RoomId, object], now: Mapping[RoomId, object]) -> set[RoomId]:
    return {room for room in before.keys() | now.keys() if before.get(room) != now.get(room)}
