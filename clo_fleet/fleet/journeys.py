"""Robots at rest: nobody need look at those that drive through the corridors undisturbed, or stand and wait.

A skill says in its progress when it has something to do again (``robot/rest.py``); until then it is asleep. Whoever
sleeps in a room stands there to the last bit: it is woken when it has moved. In corridors SUMO drives it, counts the
way and tells who has arrived: nobody looks at the others. What the meters have missed is made good when it wakes.
Everybody has its turn in the order of ids, so that all is as if nobody ever slept; and who is asleep need not be saved,
because whoever is awake without need falls asleep again in the next tick.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from clo_fleet.robot.rest import Arrival, Rest
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.skill import Under
from clo_fleet.sim.site import Site
from clo_fleet.world.model import RobotId

__all__ = ["Journeys"]


@dataclass(frozen=True, slots=True)
class _Sleep:
    """Since which tick, how far the robot had come in the corridors by then [m], and what it does meanwhile."""

    tick: int
    odometer: float | None
    under: Under
    rest: Rest | Arrival


class Journeys:
    """Who is asleep, and since when."""

    def __init__(self, site: Site, robots: Mapping[RobotId, Robot]) -> None:
        self._site = site
        self._robots = robots
        self._asleep: dict[RobotId, _Sleep] = {}
        self._driving: set[RobotId] = set()  # of those the ones in corridors

    def begin(self, robot: Robot, tick: int, under: Under) -> None:
        """The robot's skill has made its step of this tick, and may have said that it has nothing to do for a while."""
        if under.rest is not None and not robot.disturbed:
            odometer = self._site.odometer(robot.id) if self._site.in_corridor(robot.id) else None
            self._asleep[robot.id] = _Sleep(tick, odometer, under, under.rest)
            if isinstance(under.rest, Arrival):
                self._driving.add(robot.id)

    def turns(self, tick: int, time: float) -> Iterator[tuple[Robot, Under | None]]:
        """The robots in the order of ids, each woken if it has something to do; with what it does if it sleeps on.

        Those that sleep on in corridors are left out.
        """
        shut, moving, arrived = self._site.traffic.shut, self._site.rooms.moving, self._site.arrivals()
        for name in sorted(self._driving):
            if shut or name in arrived or self._robots[name].disturbed:
                self._wake(name, tick - 1)
        for name, robot in self._robots.items():
            if name in self._driving:
                continue
            sleep = self._asleep.get(name)
            if sleep is None:
                yield robot, None
                continue
            assert not isinstance(sleep.rest, Arrival), "who drives is left out"
            over = shut or robot.disturbed or name in moving or sleep.rest.over(self._site, time)
            if over:
                self._wake(name, tick - 1)
            yield robot, None if over else sleep.under

    def settle(self, tick: int) -> None:
        """Wake everybody at the end of this tick, so that all meters are up to date."""
        for robot in sorted(self._asleep):
            self._wake(robot, tick)

    def _wake(self, robot: RobotId, last: int) -> None:
        """``last``: the last tick that it has slept through."""
        if (sleep := self._asleep.pop(robot, None)) is None:
            return
        self._driving.discard(robot)
        self._robots[robot].measure_rest((last - sleep.tick) * self._site.tick)
        if sleep.odometer is not None:  # SUMO loads its last digits a little differently
            way = round(self._site.odometer(robot) - sleep.odometer, 6)
            self._robots[robot].measure_journey(self._site, way)
