"""What the physics of the rooms promises."""

import gc
import json
import math
import os
import subprocess
import sys
import weakref
from collections.abc import Callable

import pytest

from clo_fleet.sim.rooms import CarrierError, Contacts, PresenceError, Rooms, RoomsError, UnknownBodyError
from clo_fleet.sim.walls import UnknownRoomError, in_front, in_room
from clo_fleet.world.model import (
    BuildingMap,
    Door,
    DoorId,
    ObjectId,
    ObjectSpec,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
)

L1 = RoomId("l1")
R1, R2, R3 = RobotId("r1"), RobotId("r2"), RobotId("r3")
O1, O2 = ObjectId("o1"), ObjectId("o2")
PILLAR = ((4.0, 2.0), (5.0, 2.0), (5.0, 3.0), (4.0, 3.0))
DOOR = Door(id=DoorId("d1"), rooms=(L1,), position=(8.0, 4.0), heading=0.0, width=1.6)
HALL = BuildingMap(
    name="hall", rooms=(Room(L1, ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)), (PILLAR,)),), doors=(DOOR,)
)


def robot(name: RobotId, x: float, y: float, heading: float = 0.0) -> RobotSpec:
    """A robot with everything else at its default."""
    return RobotSpec(id=name, room=L1, pose=Pose(x, y, heading), goals=())


def thing(name: ObjectId, x: float, y: float) -> ObjectSpec:
    """An object likewise."""
    return ObjectSpec(id=name, room=L1, position=(x, y))


def at(rooms: Rooms, name: RobotId) -> Pose:
    """Where a robot is that must be in the rooms."""
    pose = rooms.pose(name)
    assert pose is not None
    return pose


def lies(rooms: Rooms, name: ObjectId) -> Point:
    """Where an item is that must be in the rooms."""
    position = rooms.item_position(name)
    assert position is not None
    return position


def run(rooms: Rooms, ticks: int) -> None:
    """Let some ticks pass."""
    for _ in range(ticks):
        rooms.step()


def bustle(rooms: Rooms, ticks: int = 60) -> None:
    """Three robots run into each other, a pillar, walls and items, and carry."""
    for tick in range(ticks):
        for name, pose in rooms.poses().items():
            x, y = (2.5, 2.4) if tick < 30 else (6.0, 1.0)
            rooms.drive(name, (x - pose.x, y - pose.y))
        if tick == 10:
            rooms.grasp(R1, O1)
        if tick == 20:
            rooms.remove_robot(R1)
            rooms.push_item(O2, (1.0, 0.5))
        if tick == 30:
            rooms.add_robot(R1, Pose(6.0, 6.0, 1.0))
            rooms.hand_over(R1, R2, O1)
        rooms.step()


def busy() -> tuple[list[RobotSpec], list[ObjectSpec]]:
    """What ``bustle`` needs."""
    return [robot(R1, 2, 2), robot(R2, 3, 2), robot(R3, 2.5, 3)], [thing(O1, 2.5, 2.4), thing(O2, 3.5, 3.5)]


def test_a_robot_reaches_the_speed_it_wants_no_faster_than_its_acceleration() -> None:
    """From rest at 1 m/s2 it has 0.2 m/s after a tick and 1 m/s after five, and then keeps it."""
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [])
    rooms.drive(R1, (1.0, 0.0))
    rooms.step()
    assert rooms.velocity(R1) == pytest.approx((0.2, 0.0))
    run(rooms, 4)
    assert rooms.velocity(R1) == pytest.approx((1.0, 0.0))
    run(rooms, 5)
    assert rooms.velocity(R1) == pytest.approx((1.0, 0.0))


def test_a_robot_with_no_wish_brakes() -> None:
    """Told to stop, it stands after a second."""
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [])
    rooms.drive(R1, (1.0, 0.0))
    run(rooms, 10)
    rooms.drive(R1, (0.0, 0.0))
    run(rooms, 5)
    assert rooms.velocity(R1) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_top_speed_binds_and_can_be_changed() -> None:
    """However much is asked, a robot does not pass its top speed."""
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [])
    rooms.drive(R1, (3.0, 4.0))
    run(rooms, 10)
    assert rooms.velocity(R1) == pytest.approx((0.6, 0.8))
    rooms.set_max_speed(R1, 0.3)
    run(rooms, 10)
    assert rooms.velocity(R1) == pytest.approx((0.18, 0.24))


def test_a_robot_turns_to_face_where_it_goes() -> None:
    """It turns at most 3 rad/s, the short way round, and keeps its heading at rest."""
    rooms = Rooms(HALL, [robot(R1, 4, 6, heading=3.0)], [])
    rooms.drive(R1, (-0.5, -0.5))
    rooms.step()
    assert at(rooms, R1).heading == pytest.approx(3.0 + 0.6 - math.tau)
    run(rooms, 10)
    rooms.drive(R1, (0.0, 0.0))
    run(rooms, 5)
    assert at(rooms, R1).heading == pytest.approx(-3 * math.pi / 4)


@pytest.mark.parametrize("direction", range(8))
def test_nothing_drives_through_walls(direction: int) -> None:
    """At full speed in any direction, a robot stays in the room or its doorway, outside the pillar."""
    rooms = Rooms(HALL, [robot(R1, 3, 2.5)], [])
    for _ in range(150):
        rooms.drive(R1, (3 * math.cos(direction * math.pi / 4), 3 * math.sin(direction * math.pi / 4)))
        rooms.step()
        assert in_room(HALL.rooms[0], at(rooms, R1).point)
    assert rooms.contacts().robot_wall > 0


def test_a_doorway_leads_out_between_its_side_walls() -> None:
    """A robot drives out through the door, and the side walls keep it in the doorway's width."""
    rooms = Rooms(HALL, [robot(R1, 7, 4)], [])
    for tick in range(20):
        rooms.drive(R1, (1.0, 0.0) if tick < 8 else (0.0, 1.0))
        rooms.step()
    pose = at(rooms, R1)
    assert 8.0 < pose.x < 9.2
    assert pose.y == pytest.approx(4.8 - 0.3 - 0.025, abs=0.01)


def test_robots_do_not_pass_through_one_another() -> None:
    """Head-on at full power, two robots stop each other, and the touch is counted once.

    At the impact they overlap for a moment, less than they approach in a substep.
    """
    rooms = Rooms(HALL, [robot(R1, 1, 1), robot(R2, 4, 1)], [])
    for _ in range(50):
        rooms.drive(R1, (1.0, 0.0))
        rooms.drive(R2, (-1.0, 0.0))
        rooms.step()
        assert at(rooms, R2).x - at(rooms, R1).x > 0.5
    assert at(rooms, R2).x - at(rooms, R1).x == pytest.approx(0.6, abs=0.005)
    assert rooms.contacts() == Contacts(robot_robot=1)


def test_a_robot_pushes_an_item_and_is_known_for_it() -> None:
    """An item in the way is pushed ahead; who touched it last is its pusher until it is shifted."""
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [thing(O1, 2, 1)])
    assert rooms.pusher(O1) is None
    rooms.drive(R1, (1.0, 0.0))
    run(rooms, 15)
    assert lies(rooms, O1)[0] > 2.5
    assert rooms.pusher(O1) == R1
    assert rooms.contacts().robot_item >= 1
    rooms.move_item(O1, (6, 6))
    assert rooms.pusher(O1) is None
    assert rooms.item_position(O1) == (6, 6)


def test_a_pushed_item_comes_to_rest_within_a_second() -> None:
    """An item given 1.5 m/s slides less than a metre and lies still after a second."""
    rooms = Rooms(HALL, [], [thing(O1, 1, 1)])
    rooms.push_item(O1, (1.5, 0.0))
    run(rooms, 5)
    rest = lies(rooms, O1)
    run(rooms, 5)
    assert lies(rooms, O1) == rest
    assert 1.2 < rest[0] < 2.0


def test_a_carried_item_travels_on_its_robot() -> None:
    """Through starts, turns and stops it stays at its seat within 5 mm, and the load slows nobody."""
    rooms = Rooms(HALL, [robot(R1, 1, 1), robot(R2, 1, 6)], [thing(O1, 1.5, 1), thing(O2, 1.5, 1.4)])
    rooms.grasp(R1, O1)
    rooms.grasp(R1, O2)
    seats = [math.dist(lies(rooms, obj), at(rooms, R1).point) for obj in (O1, O2)]
    for tick in range(40):
        for name in (R1, R2):
            rooms.drive(name, (1.0, 0.0) if tick < 10 else (0.0, 1.0) if tick < 20 else (0.0, 0.0))
        rooms.step()
        for obj, seat in zip((O1, O2), seats, strict=True):
            assert math.dist(lies(rooms, obj), at(rooms, R1).point) == pytest.approx(seat, abs=5e-3)
        loaded, free = rooms.velocity(R1), rooms.velocity(R2)
        assert tick >= 10 or loaded == pytest.approx(free, abs=0.01)
    assert rooms.carried(R1) == (O1, O2)
    assert rooms.contacts().robot_item == 0


def test_carried_items_lie_within_the_rim_and_meet_nothing() -> None:
    """A carrier passes close to a robot, an item and a wall as if it carried nothing."""
    rooms = Rooms(HALL, [robot(R1, 1, 1), robot(R2, 3, 1.62)], [thing(O1, 1.5, 1), thing(O2, 3, 0.56)])
    rooms.grasp(R1, O1)
    assert math.dist(lies(rooms, O1), at(rooms, R1).point) + 0.12 < 0.3
    rooms.drive(R1, (1.0, 0.0))
    run(rooms, 20)
    assert at(rooms, R1).x > 3.5
    assert rooms.contacts() == Contacts()


def test_an_item_goes_with_its_carrier_into_a_corridor_and_back() -> None:
    """While its carrier is away an item is nowhere in the rooms, and still carried."""
    rooms = Rooms(HALL, [robot(R1, 1, 1, heading=0.5)], [thing(O1, 1.5, 1)])
    rooms.grasp(R1, O1)
    assert rooms.remove_robot(R1) == Pose(1, 1, 0.5)
    assert rooms.pose(R1) is None
    assert rooms.velocity(R1) is None
    assert not rooms.poses()
    assert not rooms.velocities()
    assert rooms.item_position(O1) is None
    assert rooms.carrier(O1) == R1
    run(rooms, 2)
    rooms.add_robot(R1, Pose(7, 4, math.pi))
    run(rooms, 2)
    assert at(rooms, R1) == Pose(7, 4, math.pi)
    assert math.dist(lies(rooms, O1), (7, 4)) < 0.3
    rooms.release(R1, O1, (6, 6))
    assert rooms.item_position(O1) == (6, 6)
    assert rooms.carrier(O1) is None


def test_a_handover_changes_the_carrier() -> None:
    """After it the item hangs on the taker."""
    rooms = Rooms(HALL, [robot(R1, 1, 1), robot(R2, 2, 1)], [thing(O1, 1.5, 1.4)])
    rooms.grasp(R1, O1)
    rooms.hand_over(R1, R2, O1)
    assert rooms.carrier(O1) == R2
    assert rooms.carried(R1) == ()
    rooms.drive(R2, (1.0, 0.0))
    run(rooms, 10)
    assert math.dist(lies(rooms, O1), at(rooms, R2).point) < 0.3


def test_seats_are_reused_and_never_run_out() -> None:
    """Twelve items on one robot travel along; a released one frees its seat."""
    names = [ObjectId(f"o{k:02}") for k in range(12)]
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [thing(name, 6, 1 + 0.4 * k) for k, name in enumerate(names)])
    for name in names:
        rooms.grasp(R1, name)
    seat = lies(rooms, names[3])
    rooms.release(R1, names[3], (6, 6))
    rooms.grasp(R1, names[3])
    assert lies(rooms, names[3]) == pytest.approx(seat)
    rooms.drive(R1, (1.0, 0.0))
    run(rooms, 10)
    assert all(math.dist(lies(rooms, name), at(rooms, R1).point) < 0.2 for name in names)


def test_a_free_spot_is_clear_of_everything_and_near() -> None:
    """It is on the floor, not before a door, clear of robots and items; ``None`` where all is taken."""
    rooms = Rooms(HALL, [robot(R1, 1, 1)], [thing(O1, 1.5, 1)])
    spot = rooms.free_spot((1, 1), 0.12, L1)
    assert spot is not None
    assert in_room(HALL.rooms[0], spot)
    assert 0.47 <= math.dist(spot, (1, 1)) < 0.7
    assert math.dist(spot, (1.5, 1)) > 0.29
    assert rooms.free_spot((6, 6), 0.12, L1) == (6, 6)
    beside = rooms.free_spot((7.5, 4), 0.12, L1)
    assert beside is not None
    assert not in_front(DOOR, L1, beside, 0.12)
    assert rooms.free_spot((4.5, 2.5), 0.12, L1, within=0.5) is None
    rooms.move_item(O1, spot)
    assert rooms.free_spot((1, 1), 0.12, L1) not in (None, spot)
    with pytest.raises(UnknownRoomError):
        rooms.free_spot((1, 1), 0.12, RoomId("attic"))


@pytest.mark.parametrize(
    ("misuse", "error"),
    [
        (lambda rooms: rooms.drive(RobotId("r9"), (1, 0)), UnknownBodyError),
        (lambda rooms: rooms.grasp(R1, ObjectId("o9")), UnknownBodyError),
        (lambda rooms: rooms.pusher(ObjectId("o9")), UnknownBodyError),
        (lambda rooms: rooms.set_max_speed(RobotId("r9"), 1), UnknownBodyError),
        (lambda rooms: rooms.hand_over(R1, RobotId("r9"), O1), UnknownBodyError),
        (lambda rooms: rooms.grasp(R2, O1), CarrierError),
        (lambda rooms: rooms.grasp(R1, O1), CarrierError),
        (lambda rooms: rooms.release(R2, O1, (1, 1)), CarrierError),
        (lambda rooms: rooms.release(R1, O2, (1, 1)), CarrierError),
        (lambda rooms: rooms.hand_over(R2, R1, O1), CarrierError),
        (lambda rooms: rooms.move_item(O1, (1, 1)), CarrierError),
        (lambda rooms: rooms.push_item(O1, (1, 1)), CarrierError),
        (lambda rooms: rooms.add_robot(R1, Pose(1, 1)), PresenceError),
        (lambda rooms: rooms.remove_robot(R3), PresenceError),
        (lambda rooms: rooms.drive(R3, (1, 0)), PresenceError),
        (lambda rooms: rooms.grasp(R3, O2), PresenceError),
        (lambda rooms: rooms.hand_over(R1, R3, O1), PresenceError),
    ],
)
def test_misuse_raises_and_changes_nothing(misuse: Callable[[Rooms], object], error: type[RoomsError]) -> None:
    """Unknown ids, absent robots and wrong carriers are refused, and the state stays as it was."""
    rooms = Rooms(HALL, [robot(R1, 1, 1), robot(R2, 2, 1), robot(R3, 3, 1)], [thing(O1, 1, 2), thing(O2, 2, 2)])
    rooms.grasp(R1, O1)
    rooms.remove_robot(R3)
    before = rooms.state()
    with pytest.raises(error):
        misuse(rooms)
    assert rooms.state() == before


def test_rooms_rebuilt_from_a_state_agree_to_the_last_bit() -> None:
    """The state survives JSON, and two rebuilt rooms do the same from there, also while someone is away."""
    for ticks in (15, 25):
        rooms = Rooms(HALL, *busy())
        bustle(rooms, ticks)
        state = json.loads(json.dumps(rooms.state()))
        twins = [Rooms.from_state(HALL, *busy(), state) for _ in range(2)]
        assert [twin.poses() for twin in twins] == [rooms.poses()] * 2
        for twin in twins:
            assert twin.carried(R1) == (O1,)
            for _ in range(30):
                twin.drive(R2, (0.5, -0.5))
                twin.step()
        assert twins[0].state() == twins[1].state()


def test_a_rebuilt_state_is_the_state() -> None:
    """``from_state`` then ``state`` gives the same data, to the last bit, seats included."""
    rooms = Rooms(HALL, *busy())
    bustle(rooms)
    assert Rooms.from_state(HALL, *busy(), rooms.state()).state() == rooms.state()


def test_equal_calls_give_equal_poses_whatever_the_hash_seed() -> None:
    """The same bustle in other processes, with other hash seeds, ends in the same bits."""
    rooms = Rooms(HALL, *busy())
    bustle(rooms)
    here = json.dumps(rooms.state())
    assert rooms.contacts().robot_robot > 0
    code = (
        "import importlib.util, json, sys\n"
        "spec = importlib.util.spec_from_file_location('bustling', sys.argv[1])\n"
        "tests = importlib.util.module_from_spec(spec)\n"
        "spec.loader.exec_module(tests)\n"
        "rooms = tests.Rooms(tests.HALL, *tests.busy())\n"
        "tests.bustle(rooms)\n"
        "print(json.dumps(rooms.state()))\n"
    )
    for seed in ("0", "4242"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-c", code, __file__], env=environment, capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == here


def test_the_order_of_specs_does_not_matter() -> None:
    """Robots and objects given in another order move the same."""
    rooms, turned = Rooms(HALL, *busy()), Rooms(HALL, busy()[0][::-1], busy()[1][::-1])
    bustle(rooms)
    bustle(turned)
    assert rooms.state() == turned.state()


def test_rooms_that_are_dropped_are_freed() -> None:
    """The engine's callbacks do not keep rooms alive."""
    rooms = Rooms(HALL, *busy())
    bustle(rooms, 5)
    gone = weakref.ref(rooms)
    del rooms
    gc.collect()
    assert gone() is None
