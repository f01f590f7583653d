"""A world in a few lines: who is where and wants what. Positions that do not matter are found, faults are told."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

from clo_fleet.clo.task import parse_fact
from clo_fleet.errors import CloFleetError
from clo_fleet.sim.walls import in_front
from clo_fleet.world.disturbance_checks import Befallen, disturbance_findings
from clo_fleet.world.disturbances import Disturbance
from clo_fleet.world.faults import Finding, key_text
from clo_fleet.world.goal_checks import goal_findings, known_in, reach_findings
from clo_fleet.world.model import (
    BuildingMap,
    ObjectId,
    ObjectSpec,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    World,
)
from clo_fleet.world.outlines import clearance
from clo_fleet.world.vocabulary import vocabulary
from clo_fleet.world.world_checks import Cast, cast_findings

__all__ = ["NoSpotError", "UnsoundWorldError", "WorldBuilder"]

STEP = 0.5  # [m] between the places that are tried
APART = 0.3  # [m] kept free round everything that is placed
UNPLACED = (math.nan, math.nan)


class UnsoundWorldError(CloFleetError):
    """A world that was put together does not make sense.

    Attributes:
        findings: everything that is wrong with it.
    """

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__(self.findings)

    def __str__(self) -> str:
        return "\n".join(
            f"{key_text(finding.key)}: {f'got {finding.value}, ' if finding.value else ''}expected {finding.expected}"
            for finding in self.findings
        )


class NoSpotError(CloFleetError):
    """A room has no free place left for a robot or an object; say where it is with ``at``.

    Attributes:
        name: which robot or object.
        room: the room.
    """

    def __init__(self, name: str, room: str) -> None:
        super().__init__(f"no free place for {name} in room {room}: say where it is with at=(x, y), or take fewer")
        self.name, self.room = name, room


@dataclass(frozen=True, slots=True)
class _Placed:
    """A disc on a floor."""

    point: Point
    radius: float


class WorldBuilder:
    """A world on a building, put together line by line; ``build`` checks it.

    Robots and objects for which no place is given stand apart from one another, from walls and from doors, always at
    the same places.

    >>> from clo_fleet.testing.buildings import rooms_in_a_row
    >>> world = WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-robot r1 b)").build()
    >>> world.robots[0].goals
    (('at-robot', 'r1', 'b'),)
    """

    def __init__(self, building: BuildingMap, name: str = "test") -> None:
        self._world = World(name=name, map=building, robots=(), objects=(), until=300.0)

    def robot(
        self,
        name: str,
        room: str,
        *,
        wants: str | Sequence[str] = (),
        at: Point | None = None,
        heading: float = 0.0,
        max_speed: float = 1.0,
    ) -> Self:
        """One more robot.

        Args:
            name: its id.
            room: where it starts.
            wants: a goal or several, as ``(holding r1 cup)``.
            at: its position [m]; a free place of the room if not given.
            heading: where it looks [rad].
            max_speed: its top speed [m/s].

        Raises:
            FactSyntaxError: if a goal is not one fact.
        """
        goals = tuple(map(parse_fact, (wants,) if isinstance(wants, str) else wants))
        pose = Pose(*(at or UNPLACED), heading)
        spec = RobotSpec(id=RobotId(name), room=RoomId(room), pose=pose, goals=goals, max_speed=max_speed)
        self._world = replace(self._world, robots=(*self._world.robots, spec))
        return self

    def thing(self, name: str, room: str, *, at: Point | None = None, prepared: bool = False) -> Self:
        """One more object, lying at ``at`` [m] or at a free place of the room."""
        spec = ObjectSpec(id=ObjectId(name), room=RoomId(room), position=at or UNPLACED, prepared=prepared)
        self._world = replace(self._world, objects=(*self._world.objects, spec))
        return self

    def happens(self, *disturbances: Disturbance) -> Self:
        """What else happens, such as ``ObjectMoved(12.0, "cup", (4, 4))``."""
        self._world = replace(self._world, disturbances=(*self._world.disturbances, *disturbances))
        return self

    def like(self, world: World) -> Self:
        """Take all other settings (seed, time limit, skills, perception, radio, planning) from ``world``."""
        mine = self._world
        self._world = replace(
            world,
            name=mine.name,
            map=mine.map,
            robots=mine.robots,
            objects=mine.objects,
            disturbances=mine.disturbances,
            expected=(),
        )
        return self

    def build(self) -> World:
        """The world.

        Raises:
            NoSpotError: if a room is full.
            UnsoundWorldError: with everything else that is wrong with it, as ``clo-fleet validate`` would say.
        """
        world = self._world
        known = {room.id for room in world.map.rooms}
        if known.issuperset([*(robot.room for robot in world.robots), *(thing.room for thing in world.objects)]):
            world = _placed(world)
        cast = Cast(
            robots=world.robots,
            objects=world.objects,
            goals={spec.id: spec.goals for spec in world.robots},
            object_ids=tuple(spec.id for spec in world.objects),
            unsound=frozenset(),
        )
        befallen = Befallen(
            robots=tuple(cast.goals),
            objects=cast.object_ids,
            known=known_in(world),
            building=world.map,
            unsound=(),
            until=world.until,
        )
        disturbed = disturbance_findings(tuple(enumerate(world.disturbances)), world.faults, befallen)
        words = vocabulary(world)
        wanted = goal_findings(cast.goals, known_in(world), words)
        findings = (*cast_findings(cast, world.map), *disturbed, *wanted)
        findings = findings or tuple(reach_findings(world.robots, world.objects, world.map, words))
        if findings:
            raise UnsoundWorldError(findings)
        return world


def _placed(world: World) -> World:
    """The world with a place for everything that has none."""
    rooms = {room.id: room for room in world.map.rooms}
    taken = [_Placed(spec.pose.point, spec.radius) for spec in world.robots]
    taken += [_Placed(spec.position, spec.radius) for spec in world.objects]
    taken = [disc for disc in taken if not math.isnan(disc.point[0])]

    def place(name: str, room: RoomId, radius: float) -> Point:
        free = next(_spots(world.map, rooms[room], radius, taken), None)
        if free is None:
            raise NoSpotError(name, room)
        taken.append(_Placed(free, radius))
        return free

    robots = []
    for robot in world.robots:
        if math.isnan(robot.pose.x):
            point = place(robot.id, robot.room, robot.radius)
            robot = replace(robot, pose=Pose(*point, robot.pose.heading))
        robots.append(robot)
    objects = []
    for thing in world.objects:
        if math.isnan(thing.position[0]):
            thing = replace(thing, position=place(thing.id, thing.room, thing.radius))
        objects.append(thing)
    return replace(world, robots=tuple(robots), objects=tuple(objects))


def _spots(building: BuildingMap, room: Room, radius: float, taken: Sequence[_Placed]) -> Iterator[Point]:
    """Free places in a room, row by row."""
    xs, ys = zip(*room.outline, strict=True)
    doors = [door for door in building.doors if room.id in door.rooms]
    for j in range(1, int((max(ys) - min(ys)) / STEP)):
        for i in range(1, int((max(xs) - min(xs)) / STEP)):
            point = (min(xs) + i * STEP, min(ys) + j * STEP)
            if (
                clearance(room, point) >= radius + APART
                and not any(in_front(door, room.id, point, radius + APART) for door in doors)
                and all(math.dist(point, disc.point) >= radius + disc.radius + APART for disc in taken)
            ):
                yield point
