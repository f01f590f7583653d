"""Crowds: the robots in each room, steered as they want and as they let one another.

A room in which nobody moves, nobody wants anything new and nobody has come or gone since the last tick goes on as it
was told then: everything that it could be told follows from that.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, islice

from clo_fleet.robot.apart import keep_apart
from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.robot.indoors import at_doors, indoors
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.skill import Under
from clo_fleet.robot.steering import along_walls
from clo_fleet.sim.site import Site
from clo_fleet.world.model import Point, RobotId, RoomId

__all__ = ["Crowds"]

Wish = tuple[RobotId, Under, float]  # who wants what, and how fast it may go at most [m/s]


class Crowds:
    """All robots that are bodies. What it remembers of the last tick need not be saved: it saves work only."""

    def __init__(self, site: Site, robots: Mapping[RobotId, Robot]) -> None:
        self._site = site
        self._robots = robots
        self._avoidance = Avoidance()
        self._last: dict[RoomId | None, tuple[list[Wish], list[Agent]]] = {}

    def steer(self, wanted: Mapping[RobotId, Under]) -> None:
        """Let robots in rooms avoid one another, and who holds at a door; who owns a doorway drives as it wants."""
        holding: dict[str, list[Agent]] = {}
        for agent in at_doors(self._site):
            holding.setdefault(agent.group, []).append(agent)
        crowds: dict[RoomId | None, list[Wish]] = {}
        for robot, under in wanted.items():
            if not self._site.in_corridor(robot):
                wish = (robot, under, self._site.max_speed(robot))
                crowds.setdefault(self._site.floor(robot), []).append(wish)
        last, self._last = self._last, {room: (crowd, holding.get(str(room), [])) for room, crowd in crowds.items()}
        stirred = [room for room, now in self._last.items() if room not in last or self._stirs(last[room], now)]
        agents = {room: [*self._agents(room), *self._last[room][1]] for room in stirred}
        steered = iter(self._avoidance.velocities(list(chain.from_iterable(agents.values()))))
        for room, here in agents.items():
            self._drive(room, here, list(islice(steered, len(here))))

    def _drive(self, room: RoomId | None, agents: Sequence[Agent], steered: list[Point]) -> None:
        """Tell the robots of a room how to go on, of what avoidance leaves them as much as keeps them apart."""
        crowd = self._last[room][0]
        for number, (_, under, _) in enumerate(crowd):
            steered[number] = under.velocity if under.direct else steered[number]
        beyond = [agent for other in self._beyond(room) for agent in self._agents(other)]
        kept = keep_apart([*agents, *beyond], steered, self._site.tick)
        for (robot, under, _), velocity in zip(crowd, kept, strict=False):
            self._site.rooms.drive(robot, self._free(self._robots[robot], under, velocity))

    def _beyond(self, room: RoomId | None) -> list[RoomId]:
        """The rooms with robots straight behind the doors of a room, sorted."""
        doors = self._site.premises.doors_of(room) if room is not None else ()
        return sorted({other for door in doors for other in door.rooms if other in self._last} - {room})

    def _stirs(self, last: tuple[list[Wish], list[Agent]], now: tuple[list[Wish], list[Agent]]) -> bool:
        """Whether anything in a room is other than it was; the wishes of those at rest are the very same."""
        (before, held), (crowd, holds) = last, now
        if len(before) != len(crowd) or held != holds:
            return True
        moving = self._site.rooms.moving
        return any(
            a[0] != b[0] or a[1] is not b[1] or a[2] != b[2] or b[0] in moving
            for a, b in zip(before, crowd, strict=True)
        )

    def _agents(self, room: RoomId | None) -> Iterator[Agent]:
        site = self._site
        for robot, under, max_speed in self._last[room][0]:
            yield Agent(
                id=robot,
                position=site.pose(robot).point,
                velocity=site.rooms.velocity(robot) or (0.0, 0.0),
                preferred=under.velocity,
                radius=site.robot_radius(robot),
                max_speed=max_speed,
                max_acceleration=self._robots[robot].spec.max_acceleration,
                group=str(room),
            )

    def _free(self, robot: Robot, under: Under, velocity: tuple[float, float]) -> tuple[float, float]:
        """What the robot is to strive for, of what the others leave it."""
        if under.direct:
            return velocity
        free = along_walls(self._site, robot.spec, velocity)
        return indoors(self._site, robot.id, free, robot.out)  # nobody is to be crowded out of a room by another door
