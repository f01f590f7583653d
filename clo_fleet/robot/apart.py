"""The last word on how fast robots drive: never faster towards another than it can still stop before it.

Avoidance assumes that velocities change at once, leaves those alone who pass a door, and lets robots that are stuck in
a crowd push. So what a robot is to do is looked at once more: if it would touch another within a moment, it keeps only
so much of its speed towards that one as it can brake away in the gap, and all of its speed past it. Two that drive
towards each other share the gap; behind one that drives away a robot may be as much faster.
"""

import math
from collections.abc import Sequence

from clo_fleet.robot.avoidance import Agent
from clo_fleet.robot.steering import braking
from clo_fleet.world.model import Point

__all__ = ["keep_apart"]

MARGIN = 0.02  # [m] between rims that counts as a touch: physics adds its own inaccuracy
AHEAD = 1.0  # [s] in which a touch is looked for; the time to stop from top speed
ROUNDS = 4  # over a robot's neighbours, as giving way to one may lead to another


def keep_apart(agents: Sequence[Agent], velocities: Sequence[Point], tick: float) -> list[Point]:
    """The velocities without what would bring two of the agents into touch [m/s], in the order given.

    They are those of the first agents; the others, if there are more, are only looked at.

    Agents of all groups count: two in a doorway are in different rooms. Of those of another group it counts only how
    they move, not what they are to do: so each room can be steered without the others.
    """
    found = list(velocities)
    for i, neighbours in enumerate(_neighbours(agents)[: len(found)]):
        if found[i] == (0.0, 0.0):
            continue
        limits = [limit for j in neighbours if (limit := _limit(agents, velocities, i, j, tick)) is not None]
        found[i] = _within(found[i], limits)
    return found


def _within(velocity: Point, limits: Sequence[tuple[Point, float]]) -> Point:
    """The velocity less what is too much in each direction; slower, if what one takes away another would bring back."""
    x, y = velocity
    for _ in range(ROUNDS):
        for (nx, ny), most in limits:
            excess = max(0.0, x * nx + y * ny - most)
            x, y = x - excess * nx, y - excess * ny
    share = min((most / towards for (nx, ny), most in limits if (towards := x * nx + y * ny) > most), default=1.0)
    return (share * x, share * y)


def _neighbours(agents: Sequence[Agent]) -> list[list[int]]:
    """Of each agent those that it could touch within ``AHEAD``; by a sweep along x."""
    found: list[list[int]] = [[] for _ in agents]
    order = sorted(range(len(agents)), key=lambda i: (agents[i].position[0], agents[i].id))
    widest = 2 * max((_reach(agent) for agent in agents), default=0.0)
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            if agents[j].position[0] - agents[i].position[0] > widest:
                break
            if math.dist(agents[i].position, agents[j].position) < _reach(agents[i]) + _reach(agents[j]):
                found[i].append(j)
                found[j].append(i)
    return [sorted(neighbours, key=lambda j: agents[j].id) for neighbours in found]


def _reach(agent: Agent) -> float:
    return agent.radius + MARGIN / 2 + agent.max_speed * AHEAD


def _limit(
    agents: Sequence[Agent], velocities: Sequence[Point], i: int, j: int, tick: float
) -> tuple[Point, float] | None:
    """The direction from one agent to another, and the most speed in it [m/s]; ``None``: they do not touch."""
    me, other = agents[i], agents[j]
    x, y = other.position[0] - me.position[0], other.position[1] - me.position[1]
    distance = math.hypot(x, y)
    if distance == 0.0:
        return None
    size = me.radius + other.radius + MARGIN
    they = (velocities[j] if me.group == other.group else other.velocity, other.velocity)
    if not any(
        _meet((x, y), (mine[0] - theirs[0], mine[1] - theirs[1]), size)
        for mine, theirs in zip((velocities[i], me.velocity), they, strict=True)
    ):
        return None
    nx, ny = x / distance, y / distance
    gap = max(0.0, distance - size)
    theirs = min(vx * nx + vy * ny for vx, vy in they)
    if theirs < 0.0:
        return (nx, ny), max(0.0, braking(gap / 2, me.max_acceleration, tick))
    return (nx, ny), theirs + max(0.0, braking(gap, me.max_acceleration, tick))


def _meet(way: Point, velocity: Point, size: float) -> bool:
    """Whether what is at the end of ``way``, at which one drives with ``velocity``, is soon nearer than ``size``."""
    closing, squared = way[0] * velocity[0] + way[1] * velocity[1], velocity[0] ** 2 + velocity[1] ** 2
    if closing <= 0.0 or squared == 0.0:  # squares of what is as good as zero are zero
        return False
    time = min(AHEAD, closing / squared)
    return math.hypot(way[0] - velocity[0] * time, way[1] - velocity[1] * time) < size
