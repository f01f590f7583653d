"""Robots on their way through the corridors: nobody need look at them before they arrive.

SUMO drives them and counts the way; their skill is asleep until the vehicle has come to its far door, or something
befalls the robot. What its meters have missed is made good when it wakes. Who is asleep need not be saved: whoever is
awake without need falls asleep again in the next tick.
"""

from collections.abc import Mapping

from clo_fleet.robot.robot import Robot
from clo_fleet.sim.site import Site
from clo_fleet.world.model import RobotId

__all__ = ["Journeys"]


class Journeys:
    """Who is on a journey, and since when."""

    def __init__(self, site: Site, robots: Mapping[RobotId, Robot]) -> None:
        self._site = site
        self._robots = robots
        self._since: dict[RobotId, tuple[int, float]] = {}  # the tick of its last step, and the odometer then [m]

    def begin(self, robot: Robot, tick: int) -> None:
        """The robot's skill has made its step of this tick, and is not to be stepped before it arrives."""
        if not robot.disturbed:
            self._since[robot.id] = (tick, self._site.odometer(robot.id))

    def awake(self, tick: int) -> list[Robot]:
        """The robots whose skills have something to do in this tick, in the order of ids; those that arrived are woken.

        Cost: linear in the robots, but for those asleep no more than a look into a table.
        """
        shut = self._site.traffic.shut
        called = [robot for robot in self._since if shut or self._robots[robot].disturbed]
        for robot in (*self._site.arrivals(), *called):
            self._wake(robot, tick - 1)
        return [robot for robot in self._robots.values() if robot.id not in self._since]

    def settle(self, tick: int) -> None:
        """Wake everybody at the end of this tick, so that all meters are up to date."""
        for robot in sorted(self._since):
            self._wake(robot, tick)

    def _wake(self, robot: RobotId, last: int) -> None:
        """``last``: the last tick that it has slept through."""
        if robot in self._since:
            tick, odometer = self._since.pop(robot)
            way = round(self._site.odometer(robot) - odometer, 6)  # SUMO loads its last digits a little differently
            self._robots[robot].measure_journey(self._site, (last - tick) * self._site.tick, way)
