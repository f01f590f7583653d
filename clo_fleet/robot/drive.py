"""The skill ``move``: out of one room, through the corridors, into the next.

Phases, in order; a door straight between two rooms skips those in brackets::

    approach -> queue -> pass out -> [insert -> travel -> wait to enter ->] pass in

The robot goes to a waiting point beside the door, asks for the doorway, drives out to the pose at which SUMO
will have its vehicle, travels, holds at the end of the lane until the far doorway is free, and drives in.
Inside a doorway it drives straight and is not steered aside, because the doorway is its own.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Self

from clo_fleet.robot.skill import Body, Cancelled, Done, Failed, Progress, Under
from clo_fleet.robot.steering import Steering, straight
from clo_fleet.sim.routes import Route
from clo_fleet.sim.doors import Way
from clo_fleet.sim.site import Site
from clo_fleet.sim.walls import inner_point, outward
from clo_fleet.world.model import Door, DoorId, PlaceId, Point, RoomId
from clo_fleet.world.places import doors_between

__all__ = ["Drive"]

WAIT_INSIDE = 1.0  # [m] the waiting point lies this far inside the door ...
WAIT_ASIDE = 0.8  # [m] ... and this far to the right, so that who comes in can pass
GATE_INSIDE = 0.5  # [m] from here the way out is straight
CLEAR_INSIDE = 1.2  # [m] who comes in is through when it is this far inside
CLEAR_RADIUS = 0.75  # [m] nobody may stand this near to where one comes in
HAND_OVER = 0.06  # [m] a body this near to the vehicle's pose may become the vehicle
SIDE_CLEARANCE = 0.08  # [m] between a robot's rim and the side of a doorway
GIVE_UP = 60.0  # [s] without any way through the room


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
    """Drive from room ``start`` to room ``goal``."""

    start: RoomId
    goal: RoomId
    phase: Phase = Phase.APPROACH
    out: DoorId | None = None
    into: DoorId | None = None
    legs: list[Point] = field(default_factory=list)
    cancelling: bool = False
    steering: Steering = field(default_factory=Steering)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        if self.out is None:
            chosen = _choose(body, self.start, self.goal)
            if chosen is None:
                return Failed("no way")
            self.out, self.into = chosen
        if self.cancelling and self.phase in (Phase.APPROACH, Phase.QUEUE):
            self.release(body)
            return Cancelled()
        return _STEPS[self.phase](self, body)

    def cancel(self) -> None:
        """Turn back if still in the room; once in the doorway, the drive goes on to its end."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """Leave the queues at both doors."""
        for door in (self.out, self.into):
            if door is not None:
                for way in Way:
                    body.site.doors.release(door, way, body.id)

    def state(self) -> dict[str, Any]:
        """Plain data; the path is found again."""
        return {
            "skill": "drive",
            "start": self.start,
            "goal": self.goal,
            "phase": self.phase.value,
            "out": self.out,
            "into": self.into,
            "legs": [list(point) for point in self.legs],
            "cancelling": self.cancelling,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        return cls(
            start=state["start"],
            goal=state["goal"],
            phase=Phase(state["phase"]),
            out=state["out"],
            into=state["into"],
            legs=[(x, y) for x, y in state["legs"]],
            cancelling=state["cancelling"],
        )

    # ---- phases --------------------------------------------------------------------------------------------

    def _approach(self, body: Body) -> Progress:
        door = self._door(body.site, self.out)
        target = _beside(door, self.start)
        here = body.site.pose(body.id).point
        if math.dist(here, target) < 0.3 or math.dist(here, inner_point(door, self.start, GATE_INSIDE)) < 0.5:
            self.phase = Phase.QUEUE
            return self._queue(body)
        velocity = self.steering.velocity(body.site, body.spec, self.start, target, body.time)
        since = self.steering.blocked_since
        if since >= 0.0 and body.time - since > GIVE_UP:
            return Failed("blocked")
        if velocity == (0.0, 0.0) and since < 0.0:
            self.phase = Phase.QUEUE  # as near as one can get
        return Under(velocity, "a way through the room" if since >= 0.0 else "")

    def _queue(self, body: Body) -> Progress:
        site = body.site
        door = self._door(site, self.out)
        way = Way.OUT if self.start == door.rooms[0] else Way.IN
        if not site.doors.request(door.id, way, body.id):
            return Under(standing_for=f"door {door.id}")
        if self.out != self.into:
            route = self._route(site)
            if not site.corridors.entry_clear(route):
                return Under(standing_for=f"room in the corridor behind door {door.id}")
            exit_point = site.corridors.entry_pose(route).point
            self.legs = [_gate(door, self.start, exit_point, body.spec.radius, GATE_INSIDE), exit_point]
        else:
            if not _clear(body, self.goal, inner_point(door, self.goal, GATE_INSIDE)):
                return Under(standing_for=f"room behind door {door.id}")
            self.legs = [
                inner_point(door, self.start, GATE_INSIDE),
                inner_point(door, self.goal, GATE_INSIDE),
                inner_point(door, self.goal, CLEAR_INSIDE),
            ]
        self.phase = Phase.PASS_OUT if self.out != self.into else Phase.PASS_IN
        return self._pass_out(body) if self.out != self.into else self._pass_in(body)

    def _pass_out(self, body: Body) -> Progress:
        here = body.site.pose(body.id).point
        if len(self.legs) == 1 and math.dist(here, self.legs[0]) < HAND_OVER:
            body.site.depart(body.id, self._route(body.site))
            self.phase = Phase.INSERT
            return Under(direct=True)
        return self._along(body, here)

    def _insert(self, body: Body) -> Progress:
        if not body.site.in_corridor(body.id):
            return Under(direct=True, standing_for="its turn in the corridor")
        door = self._door(body.site, self.out)
        body.site.doors.release(door.id, Way.OUT if self.start == door.rooms[0] else Way.IN, body.id)
        self.phase = Phase.TRAVEL
        return self._travel(body)

    def _travel(self, body: Body) -> Progress:
        if not body.site.arrived(body.id):
            return Under()
        self.phase = Phase.WAIT_TO_ENTER
        return self._wait_to_enter(body)

    def _wait_to_enter(self, body: Body) -> Progress:
        site = body.site
        door = self._door(site, self.into)
        way = Way.IN if self.goal == door.rooms[0] else Way.OUT
        if not site.doors.request(door.id, way, body.id):
            return Under(standing_for=f"door {door.id}")
        gate = _gate(door, self.goal, site.pose(body.id).point, body.spec.radius, GATE_INSIDE)
        if not _clear(body, self.goal, gate):
            return Under(standing_for=f"room behind door {door.id}")
        site.admit(body.id)
        self.legs = [gate, _gate(door, self.goal, gate, body.spec.radius, CLEAR_INSIDE)]
        self.phase = Phase.PASS_IN
        return self._pass_in(body)

    def _pass_in(self, body: Body) -> Progress:
        here = body.site.pose(body.id).point
        if len(self.legs) == 1 and math.dist(here, self.legs[0]) < 0.15 and body.site.place(body.id) == PlaceId(self.goal):
            self.release(body)
            return Done()
        return self._along(body, here)

    def _along(self, body: Body, here: Point) -> Under:
        """Straight to the next leg's end; corners are cut a little, the last end is met."""
        if len(self.legs) > 1 and math.dist(here, self.legs[0]) < 0.1:
            self.legs.pop(0)
        return Under(straight(here, self.legs[0], body.site.max_speed(body.id), 0.3), direct=True)

    def _door(self, site: Site, door: DoorId | None) -> Door:
        assert door is not None, "a drive chooses its doors before its first phase"
        return site.door(door)

    def _route(self, site: Site) -> Route:
        assert self.out is not None
        assert self.into is not None
        route = site.corridors.route(self.out, self.into)
        assert route is not None, "the doors were chosen for their route"
        return route


_STEPS = {
    Phase.APPROACH: Drive._approach,
    Phase.QUEUE: Drive._queue,
    Phase.PASS_OUT: Drive._pass_out,
    Phase.INSERT: Drive._insert,
    Phase.TRAVEL: Drive._travel,
    Phase.WAIT_TO_ENTER: Drive._wait_to_enter,
    Phase.PASS_IN: Drive._pass_in,
}


def _choose(body: Body, start: RoomId, goal: RoomId) -> tuple[DoorId, DoorId] | None:
    """The doors of the quickest way, by free flow: to the door, and from door to door."""
    here = body.site.pose(body.id).point
    best: tuple[float, DoorId, DoorId] | None = None
    for out, into, _zone in doors_between(body.site.building, start, goal):
        time = math.dist(here, body.site.door(out).position) / body.site.max_speed(body.id)
        if out != into:
            route = body.site.corridors.route(out, into)
            if route is None:
                continue
            time += route.time
        if best is None or (time, out, into) < best:
            best = (time, out, into)
    return None if best is None else best[1:]


def _beside(door: Door, room: RoomId) -> Point:
    """The waiting point: inside the door, to the right as one looks out."""
    x, y = outward(door, room)
    inside = inner_point(door, room, WAIT_INSIDE)
    return (inside[0] + WAIT_ASIDE * y, inside[1] - WAIT_ASIDE * x)


def _gate(door: Door, room: RoomId, line: Point, radius: float, inside: float) -> Point:
    """The point ``inside`` the door, as far to the side as ``line`` is, but clear of the door's sides."""
    x, y = outward(door, room)
    side = (line[0] - door.position[0]) * -y + (line[1] - door.position[1]) * x
    most = max(0.0, door.width / 2 - radius - SIDE_CLEARANCE)
    side = max(-most, min(most, side))
    middle = inner_point(door, room, inside)
    return (middle[0] - side * y, middle[1] + side * x)


def _clear(body: Body, room: RoomId, point: Point) -> bool:
    """Whether nobody stands where the robot is about to come in."""
    return all(
        math.dist(body.site.pose(other).point, point) > CLEAR_RADIUS
        for other in body.site.bodies_in(room)
        if other != body.id
    )
