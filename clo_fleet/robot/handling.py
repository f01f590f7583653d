"""The skills ``work``, ``grasp`` and ``place``: go within reach, work for a while, and the world has changed.

The work counts only while the object stays within reach. An object that was shoved away makes the skill fail,
and so does one that is gone or in another robot's hand; what the robot saw of it is what it has learnt.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.clo.messages import Flip
from clo_fleet.robot.skill import Body, Cancelled, Done, Failed, Progress, Under, lacks, looks
from clo_fleet.robot.steering import Steering
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, PlaceId, Point, RoomId

__all__ = ["Handle", "Place"]

GIVE_UP = 30.0  # [s] without getting nearer
LOST = 0.15  # [m] beyond reach by this much, work is lost
MARGIN = 0.1  # [m] stop this much inside reach


@dataclass(slots=True)
class Handle:
    """Work on ``item`` in ``room``, or take it up (``grasp``). ``worked``: how long it has been worked on [s]."""

    item: ObjectId
    room: RoomId
    grasp: bool
    worked: float = -1.0
    nearest: float = math.inf
    nearer_at: float = 0.0
    cancelling: bool = False
    steering: Steering = field(default_factory=Steering)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        if self.cancelling:
            return Cancelled()
        if (gone := self._gone(body)) is not None:
            return gone
        position = body.site.rooms.item_position(self.item)
        assert position is not None, "an object that lies in a room has a position"
        distance = math.dist(position, body.site.pose(body.id).point) - body.spec.radius
        if self.worked < 0.0:
            if distance > body.settings.reach - MARGIN:
                return self._go(body, position, distance)
            self.worked = 0.0
        if distance > body.settings.reach + LOST:
            return Failed("out of reach", self._seen(body))
        self.worked += body.site.tick
        if self.worked < body.takes - 1e-9:
            return Under(direct=True)
        if (lack := body.truth.lacking(body.action)) is not None:
            return Failed(lacks(lack), self._seen(body))
        if self.grasp:
            body.site.rooms.grasp(body.id, self.item)
        body.truth.handle(self.item, body.cause)
        return Done()

    def cancel(self) -> None:
        """Stop: neither preparing nor reaching out leaves anything half done."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """It holds nothing shared."""

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "skill": "handle",
            "item": self.item,
            "room": self.room,
            "grasp": self.grasp,
            "worked": self.worked,
            "nearest": self.nearest if math.isfinite(self.nearest) else None,
            "nearer_at": self.nearer_at,
            "cancelling": self.cancelling,
            "steering": self.steering.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        return cls(
            item=state["item"],
            room=state["room"],
            grasp=state["grasp"],
            worked=state["worked"],
            nearest=math.inf if state["nearest"] is None else state["nearest"],
            nearer_at=state["nearer_at"],
            cancelling=state["cancelling"],
            steering=Steering.from_state(state["steering"]),
        )

    def _gone(self, body: Body) -> Failed | None:
        """The failure, if the object does not lie in the room any more."""
        carrier = body.site.rooms.carrier(self.item)
        if carrier is not None:
            return Failed(f"taken by {carrier}", self._seen(body))
        if body.site.items.place(self.item) != PlaceId(self.room):
            return Failed("not there", self._seen(body))
        return None

    def _seen(self, body: Body) -> tuple[Flip, ...]:
        """What the robot, standing there, sees of the object at this moment, as far as the action is about it."""
        words, action = body.truth.words, body.action
        about = {need.fact for need in action.needs} | action.adds | action.deletes
        facts = {fact for fact in about if words.seen_at(fact) == self.item}
        facts.update(words.facts(SensorKind.POSITION, self.item, self.room))
        return tuple(map(body.truth.look, sorted(facts)))

    def _go(self, body: Body, position: Point, distance: float) -> Progress:
        if distance < self.nearest - 0.02:  # always so at first
            self.nearest, self.nearer_at = distance, body.time
        if body.time - self.nearer_at > GIVE_UP:
            lies = body.truth.words.facts(SensorKind.POSITION, self.item, self.room)
            return Failed("cannot get near", tuple(Flip(fact, False) for fact in lies))
        reach = body.settings.reach - MARGIN + body.spec.radius
        velocity = self.steering.velocity(
            body.site, body.spec, self.room, position, body.time, near=reach, ignoring=(self.item,)
        )
        return Under(velocity, direct=self.steering.pushes)


@dataclass(slots=True)
class Place:
    """Put ``item`` down in ``room``, away from doors and from what lies there."""

    item: ObjectId
    room: RoomId
    spot: Point | None = None
    worked: float = -1.0
    began: float = -1.0
    cancelling: bool = False
    steering: Steering = field(default_factory=Steering)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        if self.cancelling:
            return Cancelled()
        if body.site.rooms.carrier(self.item) != body.id:
            return Failed("not in hand", looks(body, self.item))
        self.began = body.time if self.began < 0.0 else self.began
        if self.spot is None:
            self.spot = body.site.rooms.free_spot(
                body.site.pose(body.id).point, body.site.items.radius(self.item), self.room
            )
            if self.spot is None:
                if body.time - self.began > GIVE_UP:
                    return Failed("no free spot")
                return Under(standing_for="a free spot")
        here = body.site.pose(body.id).point
        within = body.spec.radius + body.settings.reach
        if self.worked < 0.0:
            if math.dist(here, self.spot) > within:
                if body.time - self.began > GIVE_UP:
                    self.spot, self.began = None, body.time
                    return Under()
                velocity = self.steering.velocity(
                    body.site, body.spec, self.room, self.spot, body.time, near=within - MARGIN
                )
                return Under(velocity, direct=self.steering.pushes)
            self.worked = 0.0
        self.worked += body.site.tick
        if self.worked < body.takes - 1e-9:
            return Under(direct=True)
        spot = body.site.rooms.free_spot(self.spot, body.site.items.radius(self.item), self.room)
        if spot is None or math.dist(here, spot) > within + LOST:
            self.spot, self.worked = None, -1.0
            return Under(standing_for="a free spot")
        if (lack := body.truth.lacking(body.action)) is not None:
            return Failed(lacks(lack), (body.truth.look(lack.fact),))
        body.site.rooms.release(body.id, self.item, spot)
        body.truth.handle(self.item, body.cause)
        return Done()

    def cancel(self) -> None:
        """Stop: the object stays in hand."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """It holds nothing shared."""

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "skill": "place",
            "item": self.item,
            "room": self.room,
            "spot": list(self.spot) if self.spot else None,
            "worked": self.worked,
            "began": self.began,
            "cancelling": self.cancelling,
            "steering": self.steering.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        spot = state["spot"]
        return cls(
            item=state["item"],
            room=state["room"],
            spot=(spot[0], spot[1]) if spot else None,
            worked=state["worked"],
            began=state["began"],
            cancelling=state["cancelling"],
            steering=Steering.from_state(state["steering"]),
        )
