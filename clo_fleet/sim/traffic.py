"""Traffic: which way robots take from room to room, when they may set out, and what is closed.

Ways are chosen by the time that they take in empty corridors and by what is claimed on them now: a lane that many
claim, or a single lane that others claim in the other direction, counts as longer. A closed corridor or door is on no
way. Robots that are on their way drive off a closed corridor, take another way where one can still be claimed, and
wait before it otherwise.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.corridors import Corridors
from clo_fleet.sim.lanes import ground
from clo_fleet.sim.network import network_edges
from clo_fleet.sim.right_of_way import Claim, Hindrance, RightOfWay, Standing
from clo_fleet.sim.routes import Route, Routes
from clo_fleet.world.model import BuildingMap, CorridorId, Door, DoorId, RobotId, RobotSpec, RoomId
from clo_fleet.world.places import Way

__all__ = ["Course", "Traffic", "UnknownCorridorError"]

WORTH = 2.0  # [s] by which a way has to be quicker, or nobody who is on the way turns off for it
AGAINST = 4.0  # [s] that a claim in the other direction of a single lane counts for: it leaves in about that time


class UnknownCorridorError(CloFleetError):
    """The building has no such corridor or door.

    Attributes:
        name: as given.
    """

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no corridor or door {name!r} in this building")
        self.name = name


@dataclass(frozen=True, slots=True)
class Course:
    """Out of one door and in at another; ``route``: between them, ``None`` if they are the same."""

    out: DoorId
    into: DoorId
    route: Route | None

    @property
    def lanes(self) -> tuple[str, ...]:
        """The edges that it follows."""
        return self.route.edges if self.route is not None else ()

    def state(self) -> list[Any]:
        """Plain data."""
        return [self.out, self.into, self.route.state() if self.route else None]

    @classmethod
    def from_state(cls, state: Sequence[Any]) -> Self:
        """The course that ``state()`` was taken from."""
        return cls(state[0], state[1], Route.from_state(state[2]) if state[2] else None)


class Traffic:
    """The ways of a building and the right of way on them."""

    def __init__(self, building: BuildingMap, corridors: Corridors | None, robots: Iterable[RobotSpec]) -> None:
        self._corridors = corridors
        self._routes = Routes(building)
        self._edges: dict[str, list[str]] = {}
        for edge in network_edges(building):
            self._edges.setdefault(edge.corridor.id, []).append(edge.id)
        self._closed_doors: set[str] = set()
        self._doors = {door.id: door for door in building.doors}
        self._building = building
        self._crowd = Counter(spec.room for spec in robots)
        self._right: RightOfWay | None = None
        self._saved: Mapping[str, Any] | None = None

    @property
    def right_of_way(self) -> RightOfWay:
        """Who may set out; known once the corridors are open, as they know how long their lanes are."""
        if self._right is None:
            lengths = self._corridors.lengths() if self._corridors is not None else {}
            self._right = RightOfWay(ground(self._building, lengths, self._crowd))
            if self._saved is not None:
                self._right.restore(self._saved)
        return self._right

    def course(self, ways: Iterable[Way], away: Mapping[DoorId, float]) -> Course | None:
        """The quickest of some ways between two rooms, as corridors are claimed now; ``None``: no way is open.

        ``away``: how long it takes to get to each door [s].
        """
        best: tuple[float, DoorId, DoorId] | None = None
        course: Course | None = None
        for way in ways:
            if not self._closed_doors.isdisjoint((way.exit, way.entry)):
                continue
            route, time = None, away[way.exit]
            if way.zone is not None:
                route, more = self._routes.quickest(way.exit, way.entry, self._delay)
                if route is None:
                    continue
                time += more
            if best is None or (time, way.exit, way.entry) < best:
                best, course = (time, way.exit, way.entry), Course(way.exit, way.entry, route)
        return course

    def set_out(self, robot: RobotId, start: RoomId, goal: RoomId, course: Course, standing: Standing) -> bool:
        """Ask for the right of way; whether the robot has it. It then keeps the course for which it was granted."""
        if not self.right_of_way.ask(robot, Claim(start, goal, course.lanes)):
            self.right_of_way.decide(standing)
        return self.right_of_way.granted(robot)

    def still_open(
        self, robot: RobotId, start: RoomId, goal: RoomId, course: Course, other: Course | None
    ) -> Course | None:
        """The course for which the robot has the right of way, or the other if something on it was closed since then.

        The other has to begin with the same lane. ``None``: it cannot have that now.
        """
        if not any(map(self.right_of_way.closed, course.lanes)):
            return course
        if other is None or other.lanes[:1] != course.lanes[:1]:
            return None
        return other if self.right_of_way.exchange(robot, Claim(start, goal, other.lanes)) else None

    def hindrance(self, robot: RobotId) -> Hindrance | None:
        """Why the robot does not have the right of way for which it asked."""
        return self.right_of_way.hindrance(robot)

    def step(self, standing: Standing) -> None:
        """Take back the lanes that robots have left, and let those set out who now may."""
        for robot, lanes in self._corridors.moved_on().items() if self._corridors is not None else ():
            self.right_of_way.left(robot, lanes)
        self.right_of_way.decide(standing)

    def divert(
        self, robot: RobotId, route: Route, start: RoomId, doors: Iterable[Door], *, quicker: bool = False
    ) -> Route | None:
        """Send a robot that is on its way in at another door, if it can turn off and have the right of way at once.

        ``quicker``: only if that is clearly quicker than going on, as far as is open, were the corridors empty.

        Returns:
            Its route, from the door that it came from; ``None``: it goes on as it did.
        """
        assert self._corridors is not None, "who is on its way is in corridors"
        edge = self._corridors.turning_point(robot)
        if edge is None:
            return None
        before = route.edges[: route.edges.index(edge) + 1]
        ahead = route.edges[len(before) :]
        delay = self._closure if quicker else self._delay
        limit = sum(map(self._routes.time, ahead)) - WORTH if quicker else math.inf
        found: list[tuple[float, DoorId, tuple[str, ...], RoomId]] = []
        for door in doors:
            onward, time = self._routes.onward(edge, door.id, delay)
            if onward and onward != ahead and time < limit and door.id not in self._closed_doors:
                found.append((time, door.id, onward, door.rooms[0]))
        for _, door_id, onward, room in sorted(found):
            left = self._corridors.lanes_left(robot)
            lanes = (*left[: left.index(edge) + 1], *onward)
            if self.right_of_way.exchange(robot, Claim(start, room, lanes)):
                new = self._routes.route(route.start, door_id, (*before, *onward))
                self._corridors.divert(robot, new)
                return new
        return None

    def blocked(self, robot: RobotId, route: Route) -> str | None:
        """What is closed ahead of a robot that is on its way."""
        assert self._corridors is not None, "who is on its way is in corridors"
        ahead = self._corridors.lanes_left(robot)[1:]
        shut = next((lane.removeprefix("-") for lane in ahead if self.right_of_way.closed(lane)), None)
        return shut or (route.end if route.end in self._closed_doors else None)

    @property
    def shut(self) -> bool:
        """Whether anything is closed."""
        return bool(self._closed_doors) or self.right_of_way.shut

    def door_closed(self, door: DoorId) -> bool:
        """Whether the door is closed."""
        return door in self._closed_doors

    # ---- closing -------------------------------------------------------------------------------------------

    def close_corridor(self, corridor: CorridorId) -> None:
        """Let nobody into a corridor any more; who is in it drives on out of it.

        Raises:
            UnknownCorridorError: if there is no such corridor.
        """
        for edge in self._edges_of(corridor):
            self.right_of_way.close(edge)
            if self._corridors is not None:
                self._corridors.close_edge(edge)

    def open_corridor(self, corridor: CorridorId) -> None:
        """Open a corridor again (``UnknownCorridorError`` if there is none)."""
        for edge in self._edges_of(corridor):
            self.right_of_way.open(edge)
            if self._corridors is not None:
                self._corridors.open_edge(edge)

    def close_door(self, door: DoorId) -> None:
        """Plan no way through a door any more (``UnknownCorridorError`` if there is none)."""
        if door not in self._doors:
            raise UnknownCorridorError(door)
        self._closed_doors.add(door)

    def open_door(self, door: DoorId) -> None:
        """Open a door again (``UnknownCorridorError`` if there is none)."""
        if door not in self._doors:
            raise UnknownCorridorError(door)
        self._closed_doors.discard(door)

    def closed(self) -> tuple[str, ...]:
        """The corridors and doors that are closed, sorted."""
        if not self.shut:
            return ()
        shut = {name for name, edges in self._edges.items() if any(self.right_of_way.closed(edge) for edge in edges)}
        return tuple(sorted(shut | self._closed_doors))

    def state(self) -> dict[str, Any]:
        """Plain data; known once the corridors are open."""
        return {"right_of_way": self.right_of_way.state(), "closed_doors": sorted(self._closed_doors)}

    @classmethod
    def from_state(
        cls,
        building: BuildingMap,
        corridors: Corridors | None,
        robots: Iterable[RobotSpec],
        state: Mapping[str, Any],
    ) -> Self:
        """What ``state()`` was taken from; the corridors may still have to be opened, and know what is closed."""
        traffic = cls(building, corridors, robots)
        traffic._saved, traffic._closed_doors = state["right_of_way"], set(state["closed_doors"])
        return traffic

    def _edges_of(self, corridor: CorridorId) -> list[str]:
        if corridor not in self._edges:
            raise UnknownCorridorError(corridor)
        return self._edges[corridor]

    def _closure(self, edge: str) -> float:
        return math.inf if self.right_of_way.closed(edge) else 0.0

    def _delay(self, edge: str) -> float:
        """How much longer an edge takes than by free flow, as things are [s]."""
        right = self.right_of_way
        if right.closed(edge):
            return math.inf
        return right.load(edge) * self._routes.time(edge) + AGAINST * right.against(edge)
