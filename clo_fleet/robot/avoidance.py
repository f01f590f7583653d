"""Velocities with which robots near one another do not collide: ORCA (van den Berg, Guy, Lin and Manocha 2011).

Each robot takes half of the turn that keeps every pair apart for the next ``HORIZON`` seconds. ORCA
alone deadlocks where robots meet head-on or on a circle; so whoever it holds up asks again, for a
velocity to the right of the one it prefers (right-hand traffic, as in the corridors).

A simulator is built for each call, so the answer depends on the agents alone and there is no state to
save: with one simulator for all calls, its search tree would remember in which order it once split the
agents, and clearing it leaves dangling pointers in pyrvo 0.4.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pyrvo

from clo_fleet.world.model import Point, RobotId

__all__ = ["Agent", "Avoidance"]

NEIGHBOUR_RANGE = 5.0  # [m] who is farther away does not matter yet
NEIGHBOURS = 10  # the nearest that count
# The rest was measured on discs of 0.3 m and 1 m/s2 that change places: 20 in two rows or on a circle, in 12 x 12 m.
HORIZON = 1.5  # [s] a longer one starts more evasions and ends in more contacts, as robots follow late
CLEARANCE = 0.1  # [m] added to each radius: ORCA assumes that velocities change at once, robots need time
HELD_UP = 0.5  # a robot that gets less than this share of the speed it prefers is held up
VEER = math.radians(70)  # how far to the right it then prefers to go; up to 50 degrees some circles stay stuck


@dataclass(frozen=True, slots=True, kw_only=True)
class Agent:
    """A robot as the others avoid it.

    Attributes:
        id: its name; fixes the order of computation.
        position: [m].
        velocity: how it moves now [m/s].
        preferred: how it would move if it were alone [m/s]; zero: it stands, but steps aside if it must.
        radius: [m].
        max_speed: [m/s].
        max_acceleration: [m/s2].
        group: only agents of the same group see each other, such as those of one room.
    """

    id: RobotId
    position: Point
    velocity: tuple[float, float]
    preferred: tuple[float, float]
    radius: float = 0.3
    max_speed: float = 1.0
    max_acceleration: float = 1.0
    group: str = ""


@dataclass(frozen=True, slots=True)
class Avoidance:
    """Collision avoidance among robots that are asked again every ``time_step`` [s]."""

    time_step: float = 0.2

    def velocities(self, agents: Sequence[Agent]) -> list[tuple[float, float]]:
        """The velocity that each agent should strive for now [m/s], in the order given; O(n log n)."""
        groups: dict[str, list[Agent]] = {}
        for agent in sorted(agents, key=lambda agent: agent.id):
            groups.setdefault(agent.group, []).append(agent)
        found: dict[RobotId, tuple[float, float]] = {}
        for group in groups.values():
            found.update(zip((agent.id for agent in group), self._group(group), strict=True))
        return [found[agent.id] for agent in agents]

    def _group(self, agents: list[Agent]) -> list[tuple[float, float]]:
        preferred = [agent.preferred for agent in agents]
        free = self._orca(agents, preferred)
        veered = [_veered(want) if _held_up(want, got) else want for want, got in zip(preferred, free, strict=True)]
        return free if veered == preferred else self._orca(agents, veered)

    def _orca(self, agents: list[Agent], preferred: list[tuple[float, float]]) -> list[tuple[float, float]]:
        simulator = pyrvo.RVOSimulator()
        simulator.set_time_step(self.time_step)
        for number, (agent, want) in enumerate(zip(agents, preferred, strict=True)):
            size = agent.radius + CLEARANCE
            limits = (NEIGHBOUR_RANGE, NEIGHBOURS, HORIZON, HORIZON, size, agent.max_speed)
            simulator.add_agent(agent.position, *limits, agent.velocity)
            simulator.set_agent_pref_velocity(number, want)
        simulator.do_step()
        return [simulator.get_agent_velocity(number).to_tuple() for number in range(len(agents))]


def _held_up(want: tuple[float, float], got: tuple[float, float]) -> bool:
    squared = want[0] * want[0] + want[1] * want[1]
    return squared > 0.0 and want[0] * got[0] + want[1] * got[1] < HELD_UP * squared


def _veered(want: tuple[float, float]) -> tuple[float, float]:
    cos, sin = math.cos(VEER), -math.sin(VEER)
    return (want[0] * cos - want[1] * sin, want[0] * sin + want[1] * cos)
