"""The skill ``give``: wait for the other robot, offer, come near, and pass the object from hand to hand.

The giver waits at the place for a limited time. The taker answers the offer through its executive; it need not
stop what it does there, but it does not leave while the handover is under way.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from clo_fleet.clo.messages import Flip
from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.skill import Body, Cancelled, Done, Failed, OfferStatus, Progress, Under, lacks, looks
from clo_fleet.robot.steering import Steering
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, PlaceId, RobotId, RoomId

__all__ = ["Give"]

ASK_AGAIN = 5.0  # [s] after a refusal
ARM = 0.45  # [m] between the rims of two robots that pass an object on


@dataclass(slots=True)
class Give:
    """Give ``item`` to robot ``taker`` in ``room``. ``offer``: the open offer's id, negative if none."""

    item: ObjectId
    taker: RobotId
    room: RoomId
    began: float = -1.0
    offer: int = -1
    offered_at: float = -math.inf
    worked: float = 0.0
    cancelling: bool = False
    steering: Steering = field(default_factory=Steering)
    aside: StandAside = field(default_factory=StandAside)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        self.began = body.time if self.began < 0.0 else self.began
        if self.cancelling:
            self.release(body)
            return Cancelled()
        if body.site.rooms.carrier(self.item) != body.id:
            return Failed("not in hand", looks(body, self.item))
        if body.time - self.began > body.settings.partner_wait:
            meets = body.truth.words.facts(SensorKind.MEETS, self.taker, self.room)
            return Failed(f"{self.taker} did not take it", tuple(Flip(fact, False) for fact in meets))
        if body.site.place(self.taker) != PlaceId(self.room) or body.site.in_corridor(self.taker):
            self._call_off(body)
            return self._wait(body, f"robot {self.taker}")
        if self.offer < 0:
            if body.time - self.offered_at < ASK_AGAIN:
                return self._wait(body, f"robot {self.taker} to accept")
            self.offer = body.exchange.offer(body.id, self.taker, self.item, PlaceId(self.room))
            self.offered_at = body.time
            return self._wait(body, f"the answer of robot {self.taker}")
        status = body.exchange.status(self.offer)
        if status is OfferStatus.REFUSED:
            self._call_off(body)
            return self._wait(body, f"robot {self.taker} to accept")
        if status is OfferStatus.OPEN:
            return self._wait(body, f"the answer of robot {self.taker}")
        return self._pass_on(body)

    def cancel(self) -> None:
        """Stop: the object stays in hand."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """Call the offer off."""
        self._call_off(body)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "skill": "give",
            "item": self.item,
            "taker": self.taker,
            "room": self.room,
            "began": self.began,
            "offer": self.offer,
            "offered_at": self.offered_at if math.isfinite(self.offered_at) else None,
            "worked": self.worked,
            "cancelling": self.cancelling,
            "steering": self.steering.state(),
            "aside": self.aside.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        return cls(
            item=state["item"],
            taker=state["taker"],
            room=state["room"],
            began=state["began"],
            offer=state["offer"],
            offered_at=-math.inf if state["offered_at"] is None else state["offered_at"],
            worked=state["worked"],
            cancelling=state["cancelling"],
            steering=Steering.from_state(state["steering"]),
            aside=StandAside.from_state(state["aside"]),
        )

    def _pass_on(self, body: Body) -> Progress:
        """The offer stands: come near, hold out for the time it takes, and let go."""
        here, there = body.site.pose(body.id).point, body.site.pose(self.taker).point
        rims = body.spec.radius + body.site.robot_radius(self.taker)
        if math.dist(here, there) - rims > ARM:
            self.worked = 0.0
            velocity = self.steering.velocity(
                body.site, body.spec, self.room, there, body.time, near=rims + ARM / 2, ignoring=(self.taker,)
            )
            return Under(velocity, direct=self.steering.pushes)
        self.worked += body.site.tick
        if self.worked < body.takes - 1e-9:
            return Under(direct=True)
        if (lack := body.truth.lacking(body.action)) is not None:
            return Failed(lacks(lack), (body.truth.look(lack.fact),))
        body.site.rooms.hand_over(body.id, self.taker, self.item)
        body.truth.handle(self.item, body.cause)
        body.exchange.close(self.offer, kept=True)
        self.offer = -1
        return Done()

    def _wait(self, body: Body, why: str) -> Under:
        """Stand out of the way meanwhile."""
        wait = Wait(WaitCause.PARTNER, self.taker, (self.taker,))
        return replace(self.aside.step(body.site, body.spec, body.time), standing_for=why, wait=wait)

    def _call_off(self, body: Body) -> None:
        if self.offer >= 0:
            body.exchange.close(self.offer, kept=False)
        self.offer, self.worked = -1, 0.0
