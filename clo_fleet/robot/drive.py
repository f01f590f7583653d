"""The skill ``move``: out of one room, through the corridors, into the next.

Phases, in order; a door straight between two rooms skips those in brackets::

    approach -> queue -> [pass out -> insert -> travel -> wait to enter ->] pass in

The robot drives towards the door's gate, a little inside, and on its way asks for the right of way to the other room,
then for the doorway. If it may go, it does not stop there; who has to wait, stands beside the door. Inside a doorway
it drives along a line of its own and is not steered aside, because the doorway is its own: out to the pose at which
SUMO will have its vehicle, or from where its vehicle held, to the gate of the other room.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Self

from clo_fleet.robot.approach import Approach
from clo_fleet.robot.doorway import INSIDE, RIM, clear, depth, gate, throat
from clo_fleet.robot.rest import Arrival, Grant, Turn
from clo_fleet.robot.skill import Body, Cancelled, Done, Progress, Under, standing
from clo_fleet.robot.steering import follow, off_line
from clo_fleet.robot.wait import Wait, WaitCause, hindered
from clo_fleet.robot.wayfinding import Wayfinding
from clo_fleet.sim.doors import Way, is_wide
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import beyond
from clo_fleet.world.model import Door, DoorId, PlaceId, Point, RobotId, RoomId

__all__ = ["Drive"]

ASK = 2.5  # [m] before the gate a robot asks for the doorway: far enough not to slow down if nobody is ahead
READY = 2.0  # [m] from the door a robot may go before the first in the queue ...
LATE = 3.0  # [m] ... if that one is still this far away: it may not get through the crowd
AT_GATE = 0.25  # [m] so near to the gate, or to the line from there on, the way out begins
AHEAD = 0.2  # [m] ahead on its line a robot aims in a doorway: less than in a room, it keeps to the line
CROWDED = 3.0  # [s] after which who is off the door's line has come in as far as the others let it
NUDGE_AFTER = 10.0  # [s] who has held before a door for so long comes in if it only has to nudge others aside
HAND_OVER = 0.06  # [m] a body this near to the vehicle's pose may become the vehicle
OFF_DOOR = 1.1  # [m] from a narrow door a vehicle is out of the way of who comes next
COMING = 6.0  # [m] before a narrow door vehicles come first: this far they get while one passes out
RECHOOSE = 5.0  # [s] after which who waits for the right of way looks for a better way, or any if it cannot go on


class Phase(Enum):
    """How far a drive is."""

    APPROACH = "approach"
    QUEUE = "queue"
    PASS_OUT = "pass out"
    INSERT = "insert"
    TRAVEL = "travel"
    WAIT_TO_ENTER = "wait to enter"
    PASS_IN = "pass in"


@dataclass(slots=True)
class Drive:
    """Drive from room ``start`` to room ``goal``.

    Attributes:
        way: out of which door, in at which, and the route between them.
        turned: whether it was cancelled on its way and is coming back.
        line: in a doorway, the points that it comes from and drives to.
        held_since: since when it holds before the door and could pass if there were room, or comes in [s]; negative:
            neither.
        approach: how it gets to the door in its room.
    """

    start: RoomId
    goal: RoomId
    phase: Phase = Phase.APPROACH
    way: Wayfinding = field(default_factory=Wayfinding)
    turned: bool = False
    line: list[Point] = field(default_factory=list)
    held_since: float = -1.0
    cancelling: bool = False
    approach: Approach = field(default_factory=Approach)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        if self.cancelling and self.phase in (Phase.APPROACH, Phase.QUEUE):
            self.release(body)
            return Cancelled()
        if self.way.course is None and not self._choose(body):
            return self._no_way(body)
        return _STEPS[self.phase](self, body)

    def cancel(self) -> None:
        """Stay if still in the room; on the way come back where one can turn; else the drive goes on to its end."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """Give back the right of way, and leave the queues at both doors."""
        body.site.traffic.right_of_way.withdraw(body.id)
        self._leave_doors(body)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "skill": "drive",
            "start": self.start,
            "goal": self.goal,
            "phase": self.phase.value,
            "turned": self.turned,
            "line": [list(point) for point in self.line],
            "held_since": self.held_since,
            "cancelling": self.cancelling,
            **self.way.state(),
            **self.approach.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        return cls(
            start=state["start"],
            goal=state["goal"],
            phase=Phase(state["phase"]),
            way=Wayfinding.from_state(state),
            turned=state["turned"],
            line=[(x, y) for x, y in state["line"]],
            held_since=state["held_since"],
            cancelling=state["cancelling"],
            approach=Approach.from_state(state),
        )

    # ---- phases --------------------------------------------------------------------------------------------

    def _approach(self, body: Body) -> Progress:
        """Towards the gate, until it is time to ask for the doorway."""
        if (free := self.way.opened(body)) and self._choose_anew(body):
            return Under(rerouted=f"open again: {', '.join(free)}")
        door = _door(body.site, self.way.out)
        target = gate(door, self.start, body.spec.radius, out=True)
        if math.dist(body.site.pose(body.id).point, target) < ASK:
            self.phase = Phase.QUEUE
            return self._queue(body)
        return self.approach.steer(body, self.start, target, None, onward=self._onward(body, door))

    def _queue(self, body: Body) -> Progress:
        """On through the gate if it may; else to a place beside the door, to wait there."""
        site, spec = body.site, body.spec
        if (why := self._set_out(body)) is not None:
            return why
        door = _door(site, self.way.out)
        way = _way(door, self.start)
        here, target = site.pose(body.id).point, gate(door, self.start, spec.radius, out=True)
        first = site.doors.request(door.id, way, body.id)
        queue = site.doors.queue(door.id, way)
        ready = not first and _away(site, door, body.id) < READY
        if ready and _away(site, door, queue[0]) > LATE:
            site.doors.overtake(door.id, way, body.id)  # changes nothing if the first one passes already
            queue = site.doors.queue(door.id, way)
        if place := queue.index(body.id):
            turn = Turn(
                door.id, way, site.doors.changes(door.id, way), queue[0] if ready else None, door.position, LATE
            )
            return self.approach.wait(
                body, self.start, door, place, Wait(WaitCause.DOOR, door.id, (queue[place - 1],)), turn
            )
        obstacle = self._obstacle(body, door)
        on_line = off_line(here, target, throat(door, self.start, spec.radius, out=True)) < AT_GATE
        near = on_line or beyond(door, self.start, here)
        if obstacle and not is_wide(door) and (self.way.out == self.way.into or site.coming(door.id, COMING)):
            return self.approach.wait(body, self.start, door, 0, obstacle)
        if obstacle or not near:
            onward = None if obstacle else self._onward(body, door)
            return self.approach.steer(body, self.start, target, obstacle, onward=onward)
        site.doors.request(door.id, way, body.id, urgent=True)
        self.line = [target, self._onward(body, door)]
        if self.way.out == self.way.into:
            return self._come_in(body)
        self.line.append(site.corridors.entry_pose(self.way.route).point)
        self.phase = Phase.PASS_OUT
        return self._pass_out(body)

    def _pass_out(self, body: Body) -> Progress:
        here = body.site.pose(body.id).point
        if math.dist(here, self.line[-1]) < HAND_OVER:
            assert self.way.course is not None
            other = body.site.course(body.id, self.start, self.goal, self.way.out) if body.site.traffic.shut else None
            course = body.site.traffic.still_open(body.id, self.start, self.goal, self.way.course, other)
            if course is None:  # closed in the last moment: here it can wait, but not turn round
                shut = Wait(WaitCause.CLOSED, ", ".join(body.site.traffic.closed()))
                return standing(shut, follow(body.site, body.spec, self.line, ahead=AHEAD), direct=True)
            self.way.course = course
            body.site.depart(body.id, self.way.route)
            door = _door(body.site, self.way.out)
            if is_wide(door):
                body.site.doors.release(door.id, _way(door, self.start), body.id)
            self.phase = Phase.INSERT
        return Under(follow(body.site, body.spec, self.line, ahead=AHEAD), direct=True)

    def _insert(self, body: Body) -> Progress:
        if not body.site.in_corridor(body.id):
            velocity = follow(body.site, body.spec, self.line, ahead=AHEAD)
            return standing(Wait(WaitCause.ENTRY, str(self.way.out)), velocity, direct=True)
        self.phase = Phase.TRAVEL
        return self._travel(body)

    def _travel(self, body: Body) -> Progress:
        door = _door(body.site, self.way.out)
        off = math.dist(body.site.pose(body.id).point, door.position) > OFF_DOOR
        if off:
            body.site.doors.release(door.id, _way(door, self.start), body.id)
        if not body.site.arrived(body.id):
            return self._go_another_way(body, off)
        self._leave_doors(body)
        self.phase = Phase.WAIT_TO_ENTER
        return self._wait_to_enter(body)

    def _wait_to_enter(self, body: Body) -> Progress:
        site, radius = body.site, body.spec.radius
        door = _door(site, self.way.into)
        way = Way.IN if self.goal == door.rooms[0] else Way.OUT
        if site.traffic.door_closed(door.id):
            return standing(Wait(WaitCause.CLOSED, f"door {door.id}"))
        if not site.doors.request(door.id, way, body.id, urgent=True):
            return standing(Wait(WaitCause.DOOR, door.id, site.doors.queue(door.id, way)[:1]))
        if not self._room_inside(body, door):
            return standing(Wait(WaitCause.DOORWAY, door.id))
        held = site.pose(body.id).point
        site.admit(body.id)
        self.line = [held, throat(door, self.goal, radius, out=False), self._inside(door, radius)]
        return self._come_in(body)

    def _come_in(self, body: Body) -> Progress:
        self.held_since, self.phase = body.time, Phase.PASS_IN
        return self._pass_in(body)

    def _pass_in(self, body: Body) -> Progress:
        """Through the door, and then on as others let one."""
        site = body.site
        door = _door(site, self.way.into)
        here = site.pose(body.id).point
        inside = depth(door, self.goal, here)
        crowded = body.time - self.held_since > CROWDED and inside > body.spec.radius + RIM
        if (inside > INSIDE - 0.1 or crowded) and site.place(body.id) == PlaceId(self.goal):
            self.release(body)
            return Cancelled() if self.turned else Done()
        return Under(follow(site, body.spec, self.line, stop=False, ahead=AHEAD), direct=inside < body.spec.radius)

    # ---- the way -------------------------------------------------------------------------------------------

    def _choose(self, body: Body) -> bool:
        """Look for the quickest way, if there is none out of its door out of any; whether there is one."""
        if self.way.find(body, (self.start, self.goal), self.way.out):
            return True
        if self.way.course is None:
            return False
        self._start_over(body)
        self.way.course = None
        return self.way.find(body, (self.start, self.goal))

    def _choose_anew(self, body: Body) -> bool:
        """Look for the quickest way out of any door, before it has asked for one; whether that is another way."""
        before = self.way.course
        return self.way.find(body, (self.start, self.goal)) and self.way.course != before

    def _start_over(self, body: Body) -> None:
        self.release(body)
        self.phase, self.approach.spot = Phase.APPROACH, None

    def _no_way(self, body: Body) -> Progress:
        self._start_over(body)
        return self.way.no_way(body)

    def _set_out(self, body: Body) -> Progress | None:
        """Ask for the right of way; what to do while it does not have it, ``None`` once it has."""
        site = body.site
        course = self.way.course
        assert course is not None
        if site.set_out(body.id, self.start, self.goal, course) and not site.traffic.door_closed(course.out):
            return None
        if body.time - self.way.chosen_at >= RECHOOSE and not site.traffic.right_of_way.granted(body.id):
            if not self._choose(body):
                return self._no_way(body)
            if self.phase is Phase.APPROACH:
                return self._approach(body)
            return self._set_out(body)  # at once: what is granted has to be what it wants
        hindrance = site.traffic.hindrance(body.id)
        why = hindered(hindrance) if hindrance else Wait(WaitCause.CLOSED, f"door {course.out}")
        grant = Grant(body.id, hindrance, self.way.chosen_at + RECHOOSE) if hindrance else None
        return self.approach.wait(body, self.start, _door(site, self.way.out), 2, why, grant)

    def _go_another_way(self, body: Body, off: bool) -> Progress:
        """On, but back if it is to come back, and round what is closed, as soon as one can turn off for it."""
        if off and not (self.cancelling or body.site.traffic.shut or self.way.avoided):
            return Under(rest=Arrival())
        detour = None if self.turned else self.way.turn_off(body, (self.start, self.goal), back=self.cancelling)
        if detour is None:
            return Under()
        if detour.back:
            self.goal, self.turned = self.start, True
        return Under(rerouted=detour.why)

    def _leave_doors(self, body: Body) -> None:
        """Leave the queues at both doors."""
        for door in (self.way.out, self.way.into):
            if door is not None:
                for way in Way:
                    body.site.doors.release(door, way, body.id)

    # ---- their parts ---------------------------------------------------------------------------------------

    def _obstacle(self, body: Body, door: Door) -> Wait | None:
        """What keeps the robot whose turn it is from passing."""
        if self.way.out == self.way.into:
            return None if self._room_inside(body, door) else Wait(WaitCause.DOORWAY, door.id)
        if not is_wide(door) and (other := body.site.coming(door.id, COMING)):
            return Wait(WaitCause.DOOR, door.id, (other,))
        free = body.site.entry_clear(self.way.route, body.spec.radius)
        return None if free else Wait(WaitCause.ENTRY, door.id)

    def _room_inside(self, body: Body, door: Door) -> bool:
        """Whether there is room to come in; who has held for long nudges others aside."""
        self.held_since = body.time if self.held_since < 0.0 else self.held_since
        return clear(body.site, body.id, door, self.goal, nudge=body.time - self.held_since > NUDGE_AFTER)

    def _onward(self, body: Body, door: Door) -> Point:
        """Where it goes from the gate."""
        if self.way.out == self.way.into:
            return self._inside(door, body.spec.radius)
        return throat(door, self.start, body.spec.radius, out=True)

    def _inside(self, door: Door, radius: float) -> Point:
        """The end of the way in, a look ahead beyond where it counts as through."""
        return gate(door, self.goal, radius, out=False, inside=INSIDE + AHEAD)


_STEPS = {
    Phase.APPROACH: Drive._approach,
    Phase.QUEUE: Drive._queue,
    Phase.PASS_OUT: Drive._pass_out,
    Phase.INSERT: Drive._insert,
    Phase.TRAVEL: Drive._travel,
    Phase.WAIT_TO_ENTER: Drive._wait_to_enter,
    Phase.PASS_IN: Drive._pass_in,
}


def _door(site: Site, door: DoorId | None) -> Door:
    assert door is not None, "a drive chooses its doors before its first phase"
    return site.premises.doors[door]


def _away(site: Site, door: Door, robot: RobotId) -> float:
    return math.dist(site.pose(robot).point, door.position)


def _way(door: Door, start: RoomId) -> Way:
    return Way.OUT if start == door.rooms[0] else Way.IN
