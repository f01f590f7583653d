"""What collision avoidance promises, with the physics of the rooms in the loop."""

import math
import random

import pytest

from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.sim.rooms import Contacts, Rooms
from clo_fleet.world.model import BuildingMap, Point, Pose, RobotId, RobotSpec, Room, RoomId

SIDE = 12.0
HALL = BuildingMap(name="hall", rooms=(Room(RoomId("l1"), ((0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE))),), doors=())


def across(start: Point) -> Point:
    """The point on the other side of the hall's middle."""
    return (SIDE - start[0], SIDE - start[1])


def rows(n: int) -> list[tuple[Point, Point]]:
    """Half of the robots along one wall, half along the other, each to the place opposite."""
    heights = [SIDE * (k // 2 + 0.5) / (n // 2) for k in range(n)]
    starts = [(1.0 if k % 2 == 0 else SIDE - 1.0, y) for k, y in enumerate(heights)]
    return [((x, y), (SIDE - x, y)) for x, y in starts]


def circle(n: int) -> list[tuple[Point, Point]]:
    """Robots on a circle, each to the place opposite: the worst case of ORCA."""
    turns = [math.tau * k / n for k in range(n)]
    starts = [(SIDE / 2 + 5 * math.cos(a), SIDE / 2 + 5 * math.sin(a)) for a in turns]
    return [(start, across(start)) for start in starts]


def jittered(errands: list[tuple[Point, Point]], seed: int) -> list[tuple[Point, Point]]:
    """The same errands, each start a little off."""
    rng = random.Random(seed)
    shift = [(rng.uniform(-0.25, 0.25), rng.uniform(-0.25, 0.25)) for _ in errands]
    return [((x + dx, y + dy), goal) for ((x, y), goal), (dx, dy) in zip(errands, shift, strict=True)]


def drive_all(errands: list[tuple[Point, Point]], ticks: int = 300, standing: int = 0) -> tuple[bool, Rooms]:
    """Drive all robots to their goals; the first ``standing`` ones do not stir. Returns whether all arrived."""
    names = [RobotId(f"r{k:02}") for k in range(len(errands))]
    specs = [
        RobotSpec(id=name, room=RoomId("l1"), pose=Pose(*start), goals=())
        for name, (start, _) in zip(names, errands, strict=True)
    ]
    rooms, avoidance = Rooms(HALL, specs, ()), Avoidance()
    for _ in range(ticks):
        poses, velocities = rooms.poses(), rooms.velocities()
        agents, farthest = [], 0.0
        for name, (_, goal) in zip(names, errands, strict=True):
            here = poses[name].point
            dx, dy = goal[0] - here[0], goal[1] - here[1]
            farthest = max(farthest, math.hypot(dx, dy))
            slow = 1.0 / max(1.0, math.hypot(dx, dy))
            agents.append(Agent(id=name, position=here, velocity=velocities[name], preferred=(dx * slow, dy * slow)))
        if farthest < 0.2:
            return True, rooms
        for name, velocity in list(zip(names, avoidance.velocities(agents), strict=True))[standing:]:
            rooms.drive(name, velocity)
        rooms.step()
    return False, rooms


def agent(name: str, x: float, y: float, preferred: tuple[float, float], group: str = "") -> Agent:
    """An agent that already moves as it prefers to."""
    return Agent(id=RobotId(name), position=(x, y), velocity=preferred, preferred=preferred, group=group)


def test_alone_a_robot_goes_as_it_prefers() -> None:
    """With nobody near, the answer is the wish, also from rest; and no agents give no answers."""
    alone = Agent(id=RobotId("r1"), position=(3.0, 3.0), velocity=(0.0, 0.0), preferred=(0.6, -0.3))
    assert Avoidance().velocities([alone]) == [pytest.approx((0.6, -0.3))]
    assert Avoidance().velocities([]) == []


def test_twenty_robots_swap_sides_without_touching() -> None:
    """All arrive within a minute, with no contact among robots."""
    arrived, rooms = drive_all(rows(20))
    assert arrived
    assert rooms.contacts().robot_robot == 0


@pytest.mark.parametrize("n", [2, 3, 4, 5, 8, 10, 16, 20])
def test_robots_on_a_circle_cross_over(n: int) -> None:
    """Where plain ORCA comes to a standstill, all arrive, with no contact among robots."""
    arrived, rooms = drive_all(circle(n))
    assert arrived
    assert rooms.contacts().robot_robot == 0


@pytest.mark.parametrize("seed", range(4))
def test_untidy_crowds_arrive_too(seed: int) -> None:
    """From places a little off, all arrive; limited acceleration costs a few light touches at most."""
    for errands in (rows(20), circle(20)):
        arrived, rooms = drive_all(jittered(errands, seed))
        assert arrived
        assert rooms.contacts().robot_robot <= 4


def test_two_head_on_pass_on_the_right() -> None:
    """Each moves to its own right, as in the corridors, and neither stops."""
    left, right = agent("r1", 4.0, 6.0, (1.0, 0.0)), agent("r2", 6.0, 6.0, (-1.0, 0.0))
    for _ in range(5):
        (ax, ay), (bx, by) = Avoidance().velocities([left, right])
        assert ax > 0.1
        assert bx < -0.1
        assert ay <= 0.0 <= by
    assert drive_all([((3.0, 6.0), (9.0, 6.0)), ((9.0, 6.0), (3.0, 6.0))], ticks=80)[0]


def test_a_robot_that_stands_is_driven_round() -> None:
    """One that does not stir at all is passed without a touch."""
    arrived, rooms = drive_all([((6.0, 6.0), (6.0, 6.0)), ((2.0, 6.02), (10.0, 6.0))], ticks=100, standing=1)
    assert arrived
    assert rooms.contacts() == Contacts()


def test_answers_come_in_the_order_asked_and_do_not_depend_on_it() -> None:
    """Agents in another order get the same velocities, to the last bit; so do repeated questions."""
    rng = random.Random(3)
    agents = [
        agent(f"r{k:02}", rng.uniform(0, 6), rng.uniform(0, 6), (rng.uniform(-1, 1), rng.uniform(-1, 1)))
        for k in range(25)
    ]
    avoidance = Avoidance()
    first = avoidance.velocities(agents)
    assert avoidance.velocities(agents[::-1]) == first[::-1]
    assert Avoidance().velocities(agents) == first


def test_groups_do_not_see_each_other() -> None:
    """A robot on the other side of a wall changes nothing."""
    one, other = agent("r1", 3.0, 3.0, (1.0, 0.0), group="l1"), agent("r2", 4.0, 3.0, (-1.0, 0.0), group="l2")
    assert Avoidance().velocities([one, other]) == [(1.0, 0.0), (-1.0, 0.0)]
    assert Avoidance().velocities([one, agent("r2", 4.0, 3.0, (-1.0, 0.0), group="l1")])[0] != (1.0, 0.0)
