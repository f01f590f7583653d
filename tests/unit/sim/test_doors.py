"""What the right of way at doors promises."""

import json
import math

from clo_fleet.sim.doors import Doors, Way
from clo_fleet.world.model import Door, DoorId, RobotId, RoomId

WIDE = Door(id=DoorId("wide"), rooms=(RoomId("a"),), position=(0, 0), heading=0.0, width=1.8)
NARROW = Door(id=DoorId("narrow"), rooms=(RoomId("a"), RoomId("b")), position=(0, 5), heading=math.pi, width=1.0)
R1, R2, R3 = map(RobotId, ("r1", "r2", "r3"))


def test_who_comes_first_passes_first() -> None:
    """The second may pass once the first has given back, also if a third asked more often."""
    doors = Doors([WIDE])
    assert doors.request(WIDE.id, Way.OUT, R2)
    assert not doors.request(WIDE.id, Way.OUT, R1)
    assert not doors.request(WIDE.id, Way.OUT, R3)
    assert doors.queue(WIDE.id, Way.OUT) == (R2, R1, R3)
    doors.release(WIDE.id, Way.OUT, R2)
    assert not doors.request(WIDE.id, Way.OUT, R3)
    assert doors.request(WIDE.id, Way.OUT, R1)


def test_a_wide_door_is_passed_in_both_directions_at_once_and_a_narrow_one_is_not() -> None:
    """Each direction of a wide door has a queue of its own."""
    doors = Doors([WIDE, NARROW])
    assert doors.request(WIDE.id, Way.OUT, R1)
    assert doors.request(WIDE.id, Way.IN, R2)
    assert doors.request(NARROW.id, Way.OUT, R1)
    assert not doors.request(NARROW.id, Way.IN, R2)


def test_who_cannot_step_aside_goes_before_all_who_have_not_begun_to_pass() -> None:
    """A robot that holds in the corridor overtakes who waits inside, but not who is passing."""
    doors = Doors([NARROW])
    assert doors.request(NARROW.id, Way.OUT, R1)
    assert doors.request(NARROW.id, Way.IN, R2, urgent=True)
    assert doors.queue(NARROW.id, Way.OUT) == (R2, R1)
    assert not doors.request(NARROW.id, Way.IN, R3, urgent=True)
    assert doors.queue(NARROW.id, Way.OUT) == (R2, R3, R1)


def test_who_is_ready_overtakes_who_is_not_there_but_nobody_who_cannot_wait() -> None:
    """It goes before those who only asked, and after who holds before the door."""
    doors = Doors([NARROW])
    for robot in (R1, R2):
        doors.request(NARROW.id, Way.OUT, robot)
    doors.overtake(NARROW.id, Way.OUT, R2)
    assert doors.queue(NARROW.id, Way.OUT) == (R2, R1)
    doors.request(NARROW.id, Way.IN, R3, urgent=True)
    doors.overtake(NARROW.id, Way.OUT, R1)
    assert doors.queue(NARROW.id, Way.OUT) == (R3, R1, R2)


def test_a_queue_tells_when_it_has_changed() -> None:
    """Whoever comes, goes or overtakes changes it; who only asks again does not, nor does another queue."""
    doors, seen = Doors([WIDE]), set[int]()
    for change in (
        lambda: doors.request(WIDE.id, Way.OUT, R1),
        lambda: doors.request(WIDE.id, Way.OUT, R2),
        lambda: doors.overtake(WIDE.id, Way.OUT, R2),
        lambda: doors.release(WIDE.id, Way.OUT, R1),
    ):
        change()
        changes = doors.changes(WIDE.id, Way.OUT)
        assert changes not in seen
        seen.add(changes)
        doors.request(WIDE.id, Way.OUT, R1 if len(seen) == 1 else R2)
        doors.request(WIDE.id, Way.IN, R3)
        assert doors.changes(WIDE.id, Way.OUT) == changes
    assert doors.changes(WIDE.id, Way.IN) == 1


def test_the_queues_survive_json() -> None:
    """Doors that take up a saved state answer as the old ones."""
    doors, again = Doors([NARROW]), Doors([NARROW])
    doors.request(NARROW.id, Way.OUT, R1)
    doors.request(NARROW.id, Way.OUT, R2)
    doors.request(NARROW.id, Way.IN, R3, urgent=True)
    again.restore(json.loads(json.dumps(doors.state())))
    assert again.queue(NARROW.id, Way.IN) == doors.queue(NARROW.id, Way.IN) == (R3, R1, R2)
    assert again.state() == doors.state()
