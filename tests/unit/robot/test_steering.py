"""What steering promises: it arrives, stops where it should, and goes round what stands there."""

import math
from collections.abc import Callable

import pytest

from clo_fleet.robot.steering import Steering, braking
from clo_fleet.sim.site import Site
from clo_fleet.world.model import BuildingMap, ObjectId, ObjectSpec, Point, Pose, RobotId, RobotSpec, Room, RoomId

TICK = 0.2
HALL = RoomId("hall")
PILLAR = ((4.0, 2.0), (5.0, 2.0), (5.0, 4.0), (4.0, 4.0))
R1, R2 = RobotId("r1"), RobotId("r2")


def site(*robots: tuple[RobotId, Point], thing: Point | None = None) -> Site:
    """A room of 10 x 6 m with a pillar, and robots in it."""
    building = BuildingMap(name="hall", rooms=(Room(HALL, ((0, 0), (10, 0), (10, 6), (0, 6)), (PILLAR,)),), doors=())
    specs = [RobotSpec(id=name, room=HALL, pose=Pose(*at), goals=()) for name, at in robots]
    objects = [ObjectSpec(id=ObjectId("o1"), room=HALL, position=thing)] if thing else []
    return Site(building, specs, objects, seed=0, tick=TICK)


def spec(robot: RobotId, at: Point) -> RobotSpec:
    """The robot as it starts."""
    return RobotSpec(id=robot, room=HALL, pose=Pose(*at), goals=())


def drive(
    where: Site, start: Point, target: Point, near: float = 0.0, seen: Callable[[], None] = lambda: None
) -> float:
    """Drive robot r1 from ``start`` to ``target`` without avoidance; the time that it took to come to rest [s]."""
    steering, me = Steering(), spec(R1, start)
    for tick in range(300):
        velocity = steering.velocity(where, me, HALL, target, tick * TICK, near=near)
        where.rooms.drive(R1, velocity)
        where.step()
        seen()
        if math.hypot(*velocity) < 0.02 and where.speed(R1) < 0.02:
            return tick * TICK
    raise AssertionError("it never came to rest")


@pytest.mark.parametrize("distance", [0.02, 0.5, 3.0])
def test_braking_begins_in_time_and_not_before(distance: float) -> None:
    """From the speed that it gives, the distance is enough for a tick at that speed and the way to a stand."""
    speed = braking(distance, 1.0, TICK)
    assert speed * TICK + speed**2 / (2 * 0.8) == pytest.approx(distance)


def test_a_robot_comes_to_rest_at_its_target_and_not_beyond() -> None:
    """Straight ahead over 5 m it stops within 2 cm of the target, no second later than it must."""
    where = site((R1, (1, 1)))
    farthest = 0.0

    def note() -> None:
        nonlocal farthest
        farthest = max(farthest, where.pose(R1).x)

    took = drive(where, (1, 1), (6, 1), seen=note)
    assert math.dist(where.pose(R1).point, (6, 1)) < 0.02
    assert farthest < 6.02
    assert took < 5.0 + 1.0 + 1.0  # 5 m at 1 m/s, half a second each to start and to stop, and the last centimetres


def test_a_robot_goes_round_a_corner_without_touching_it() -> None:
    """Round the pillar, over a corner on either side of it, in hardly more than the way takes."""
    where = site((R1, (1, 3)))
    took = drive(where, (1, 3), (8.5, 3))
    assert math.dist(where.pose(R1).point, (8.5, 3)) < 0.02
    assert where.rooms.contacts().robot_wall == 0
    assert took < 12.0  # 8 m


def test_a_robot_stops_within_reach_of_what_it_goes_to() -> None:
    """Near is enough; it does not come closer than it needs to."""
    where = site((R1, (1, 1)))
    drive(where, (1, 1), (8, 1), near=0.8)
    assert 0.6 < math.dist(where.pose(R1).point, (8, 1)) <= 0.8


def test_a_target_that_is_taken_is_approached_as_far_as_can_be() -> None:
    """Where another robot stands, it stops beside it."""
    where = site((R1, (1, 1)), (R2, (8, 1)))
    drive(where, (1, 1), (8, 1))
    assert 0.6 < math.dist(where.pose(R1).point, where.pose(R2).point) < 1.0
    assert where.rooms.contacts().robot_robot == 0


def test_things_and_standing_robots_are_gone_round() -> None:
    """An object and a robot on the straight line are not touched."""
    where = site((R1, (1, 1)), (R2, (7, 1)), thing=(3, 1))
    drive(where, (1, 1), (9, 1))
    assert math.dist(where.pose(R1).point, (9, 1)) < 0.02
    assert where.rooms.contacts().robot_item == where.rooms.contacts().robot_robot == 0
