"""Up to a door through the room, and beside it while one waits: not yet through it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from clo_fleet.robot.doorway import in_the_way, inward, waiting_point
from clo_fleet.robot.rest import Grant, Turn
from clo_fleet.robot.skill import Body, Failed, Progress, Under, standing
from clo_fleet.robot.steering import Steering
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.world.model import Door, Point, RoomId

__all__ = ["Approach"]

LOOK = 2.0  # [s] after which it looks anew where to wait
WAITS = 0.2  # [m] so near to its waiting point a robot stands still
STILL = 0.05  # [m/s] who wants to go no faster waits
GIVE_UP = 60.0  # [s] without any way through the room
PUSHED = 0.6  # [m] round the gate objects are pushed, not gone round: who stands in the way of the door moves


@dataclass(slots=True)
class Approach:
    """How one robot gets to a door.

    Attributes:
        spot: where it waits beside the door, and since when that is so [s].
    """

    spot: tuple[float, Point] | None = None
    steering: Steering = field(default_factory=Steering)

    def steer(
        self,
        body: Body,
        room: RoomId,
        target: Point,
        why: Wait | None,
        *,
        near: float = 0.0,
        onward: Point | None = None,
    ) -> Progress:
        """To ``target`` through the room. ``why``: what it waits for there; ``near``, ``onward``: as for steering."""
        site = body.site
        if (back := inward(site, body.spec, room)) is not None:
            return Under(back, direct=True)
        pushed = [
            item
            for item in site.items.lying_in(room)
            if (lies := site.rooms.item_position(item)) is not None and math.dist(lies, target) < PUSHED
        ]
        velocity = self.steering.velocity(
            site, body.spec, room, target, body.time, near=near, ignoring=pushed, onward=onward
        )
        since = self.steering.blocked_since
        if since >= 0.0 and body.time - since > GIVE_UP:
            return Failed("blocked")
        if since >= 0.0:
            return standing(Wait(WaitCause.PATH, room), velocity)
        if why is not None and math.hypot(*velocity) < STILL:
            return standing(why, velocity, direct=self.steering.pushes)
        return Under(velocity, direct=self.steering.pushes)

    def wait(
        self, body: Body, room: RoomId, door: Door, place: int, why: Wait, rest: Turn | Grant | None = None
    ) -> Progress:
        """Stand beside the door; who is not next may stand anywhere off all doors. ``rest``: until when."""
        if place > 1 and not any(in_the_way(body.site, body.id, d, room) for d in body.site.premises.doors_of(room)):
            return standing(why, rest=rest)
        if self.spot is None or body.time - self.spot[0] >= LOOK:
            self.spot = (body.time, waiting_point(body.site, body.spec, door, room))
        under = self.steer(body, room, self.spot[1], why, near=WAITS)
        there = math.dist(body.site.pose(body.id).point, self.spot[1]) <= WAITS
        if rest is None or not there or not isinstance(under, Under) or under.wait is not why:
            return under
        return replace(under, rest=replace(rest, until=min(rest.until, self.spot[0] + LOOK)))

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "spot": [self.spot[0], list(self.spot[1])] if self.spot else None,
            "steering": self.steering.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What ``state()`` was taken from."""
        return cls(
            (state["spot"][0], tuple(state["spot"][1])) if state["spot"] else None,
            Steering.from_state(state["steering"]),
        )
