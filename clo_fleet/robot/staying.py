"""The skill ``work`` without an object: be in a room for a while, out of the others' way."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.skill import Body, Cancelled, Done, Failed, Progress, lacks
from clo_fleet.world.model import PlaceId, RoomId

__all__ = ["Stay"]


@dataclass(slots=True)
class Stay:
    """Work anywhere in ``room``. ``worked``: for how long so far [s]."""

    room: RoomId
    worked: float = 0.0
    cancelling: bool = False
    aside: StandAside = field(default_factory=StandAside)

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""
        if self.cancelling:
            return Cancelled()
        if body.site.place(body.id) != PlaceId(self.room):
            return Failed("not there")
        self.worked += body.site.tick
        if self.worked < body.takes - 1e-9:
            return self.aside.step(body.site, body.spec, body.time)
        if (lack := body.truth.lacking(body.action)) is not None:
            return Failed(lacks(lack), (body.truth.look(lack.fact),))
        return Done()

    def cancel(self) -> None:
        """Stop: the work leaves nothing half done."""
        self.cancelling = True

    def release(self, body: Body) -> None:
        """It holds nothing shared."""

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "skill": "stay",
            "room": self.room,
            "worked": self.worked,
            "cancelling": self.cancelling,
            "aside": self.aside.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The skill that ``state()`` was taken from."""
        return cls(
            room=state["room"],
            worked=state["worked"],
            cancelling=state["cancelling"],
            aside=StandAside.from_state(state["aside"]),
        )
