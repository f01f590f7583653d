"""No robot drives faster towards another than it can still stop before it."""

import math
import random

import pytest

from clo_fleet.robot.apart import keep_apart
from clo_fleet.robot.avoidance import Agent
from clo_fleet.world.model import Point, RobotId

TICK = 0.2
SUBSTEPS = 4
SIZE = 0.6  # [m] two radii


def agent(name: str, at: Point, velocity: Point = (0.0, 0.0), group: str = "") -> Agent:
    """A robot of radius 0.3 m that brakes with 1 m/s2."""
    return Agent(id=RobotId(name), position=at, velocity=velocity, preferred=velocity, group=group)


def test_who_drives_alone_or_past_another_is_left_alone() -> None:
    """Also side by side in the lanes of a wide door, 0.7 m apart, and behind one that is as fast."""
    oncoming = [agent("a", (0.0, 0.0), (1.0, 0.0)), agent("b", (1.5, 0.7), (-1.0, 0.0))]
    following = [agent("c", (0.0, 5.0), (1.0, 0.0)), agent("d", (0.7, 5.0), (1.0, 0.0))]
    away = [agent("e", (0.0, 9.0), (-1.0, 0.0)), agent("f", (0.61, 9.0), (1.0, 0.0))]
    agents = [*oncoming, *following, *away]
    wanted = [one.velocity for one in agents]
    assert keep_apart(agents, wanted, TICK) == wanted


def test_a_velocity_that_is_as_good_as_zero_is_none() -> None:
    """Whose square is zero in floating point: bodies that come to rest have such."""
    agents = [agent("a", (0.0, 0.0), (1e-170, 0.0)), agent("b", (1.0, 0.0))]
    assert keep_apart(agents, [(1e-170, 0.0), (0.0, 0.0)], TICK) == [(1e-170, 0.0), (0.0, 0.0)]


def test_two_head_on_in_different_rooms_share_the_gap() -> None:
    """Both slow down alike; only what leads to the other is taken from them."""
    agents = [agent("a", (0.0, 0.0), (0.8, 0.3), "hall"), agent("b", (1.0, 0.0), (-0.8, 0.3), "lobby")]
    (ax, ay), (bx, by) = keep_apart(agents, [(0.8, 0.3), (-0.8, 0.3)], TICK)
    assert 0.0 < ax == pytest.approx(-bx)
    assert ax < 0.5
    assert (ay, by) == (0.3, 0.3)


def test_momentum_counts_as_well_as_wishes() -> None:
    """Who wants to pass another but is still driving towards it has to slow down."""
    still = agent("b", (0.9, 0.0))
    (kept, _) = keep_apart([agent("a", (0.0, 0.0), (0.6, 0.0)), still], [(0.3, -0.9), (0.0, 0.0)], TICK)
    assert kept[0] < 0.3 or kept[1] == pytest.approx(-0.9)
    (slowed, _) = keep_apart([agent("a", (0.2, 0.0), (0.9, 0.0)), still], [(0.9, -0.5), (0.0, 0.0)], TICK)
    assert slowed[0] < 0.4


def test_pressed_between_others_a_robot_stands() -> None:
    """What giving way to one brings back towards another is taken away as well."""
    agents = [agent("a", (0.0, 0.0)), agent("b", (0.6, 0.1)), agent("c", (0.6, -0.1)), agent("d", (0.0, 0.62))]
    (x, y), *_ = keep_apart(agents, [(1.0, 0.2), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)], TICK)
    assert math.hypot(x, y) < 0.1


def test_the_order_of_agents_does_not_matter() -> None:
    """Each gets the same velocity wherever it stands in the list."""
    draw = random.Random(3)
    agents = [agent(f"r{n}", (draw.uniform(0, 4), draw.uniform(0, 4))) for n in range(20)]
    wanted = {one.id: (draw.uniform(-1, 1), draw.uniform(-1, 1)) for one in agents}
    found = dict(zip((a.id for a in agents), keep_apart(agents, [wanted[a.id] for a in agents], TICK), strict=True))
    draw.shuffle(agents)
    again = dict(zip((a.id for a in agents), keep_apart(agents, [wanted[a.id] for a in agents], TICK), strict=True))
    assert again == found


@pytest.mark.parametrize("seed", range(40))
def test_two_whose_ways_cross_do_not_touch(seed: int) -> None:
    """With nothing else that keeps them apart, and velocities that change by 1 m/s2 at most."""
    draw = random.Random(seed)
    places: list[Point] = [(-2.0, draw.uniform(-1, 1)), (draw.uniform(-0.5, 2.0), draw.uniform(1, 2))]
    wanted: list[Point] = [(1.0, draw.uniform(-0.2, 0.2)), (-places[1][0] / 3, -draw.uniform(0.5, 0.8))]
    speeds = list(wanted)
    for _ in range(50):
        agents = [agent(f"r{n}", places[n], speeds[n]) for n in (0, 1)]
        goals = keep_apart(agents, wanted, TICK)
        for _ in range(SUBSTEPS):
            for n, (gx, gy) in enumerate(goals):
                (vx, vy), step = speeds[n], TICK / SUBSTEPS
                share = min(1.0, step / max(1e-12, math.hypot(gx - vx, gy - vy)))
                speeds[n] = (vx + share * (gx - vx), vy + share * (gy - vy))
                places[n] = (places[n][0] + speeds[n][0] * step, places[n][1] + speeds[n][1] * step)
            assert math.dist(*places) > SIZE
