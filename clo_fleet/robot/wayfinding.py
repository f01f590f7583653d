"""Which way a robot takes from room to room: out of which door, in at which, and between them.

It looks for the quickest way as things are, and looks again while it waits. Once it is on its way it turns off where it
can: back, if it is called back, round what is closed, or into the short way once that is open again. What was closed
when it chose its way it has avoided; when some of that is open again, it takes a quicker way if there is one. How quick
ways are then counts as in empty corridors, because a way that the robot has claimed for itself would always seem the
slower one.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from clo_fleet.robot.skill import Body, Failed, Progress, standing
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.sim.routes import Route
from clo_fleet.sim.traffic import Course
from clo_fleet.world.model import DoorId, RoomId

__all__ = ["Detour", "Wayfinding"]

GIVE_UP = 60.0  # [s] while everything that leads on is closed
TURN_AGAIN = 1.0  # [s] after which who is on its way and should turn off tries again


@dataclass(frozen=True, slots=True)
class Detour:
    """Another way from where a robot is: ``why``, and whether it leads back to where it came from."""

    course: Course
    why: str
    back: bool = False


@dataclass(slots=True)
class Wayfinding:
    """The way of one drive.

    Attributes:
        course: out of which door, in at which, and the route between them; ``None``: there is none, or not yet.
        chosen_at: when it last looked for a way [s].
        avoided: what was closed then.
        shut_since: since when no way is open [s]; negative if one is.
    """

    course: Course | None = None
    chosen_at: float = -math.inf
    avoided: tuple[str, ...] = ()
    shut_since: float = -1.0

    @property
    def out(self) -> DoorId | None:
        """The door through which it leaves."""
        return self.course.out if self.course else None

    @property
    def into(self) -> DoorId | None:
        """The door through which it comes in."""
        return self.course.into if self.course else None

    @property
    def route(self) -> Route:
        """The route through the corridors."""
        assert self.course is not None
        assert self.course.route is not None, "a door straight between two rooms needs no route"
        return self.course.route

    def find(self, body: Body, ends: tuple[RoomId, RoomId], out: DoorId | None = None) -> bool:
        """Look for the quickest way; whether there is one. If not, it keeps the course that it had.

        Args:
            body: still in its room.
            ends: the rooms that it comes from and goes to.
            out: only out of this door, if given.
        """
        self.chosen_at, self.avoided = body.time, body.site.traffic.closed()
        course = body.site.course(body.id, *ends, out)
        if course is not None:
            self.course, self.shut_since = course, -1.0
        return course is not None

    def no_way(self, body: Body) -> Progress:
        """What it does without a way: hopeless, unless something is closed that may be opened again."""
        shut = body.site.traffic.closed()
        if not shut:
            return Failed("no way")
        self.shut_since = body.time if self.shut_since < 0.0 else self.shut_since
        if body.time - self.shut_since > GIVE_UP:
            return Failed(f"closed: {', '.join(shut)}")
        return standing(Wait(WaitCause.CLOSED, ", ".join(shut)))

    def opened(self, body: Body) -> tuple[str, ...]:
        """What of the corridors and doors that were avoided is open again."""
        return tuple(sorted({*self.avoided}.difference(body.site.traffic.closed()))) if self.avoided else ()

    def turn_off(self, body: Body, ends: tuple[RoomId, RoomId], *, back: bool) -> Detour | None:
        """Go another way in the corridors, now and then, if there is a reason for that and it can turn off.

        ``back``: whether it is to come back.
        """
        if body.time - self.chosen_at < TURN_AGAIN:
            return None
        self.chosen_at = body.time
        detour = self._detour(body, ends, back)
        if detour is not None:
            self.course, self.avoided = detour.course, body.site.traffic.closed()
        return detour

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "course": self.course.state() if self.course else None,
            "chosen_at": self.chosen_at if self.course else None,
            "avoided": list(self.avoided),
            "shut_since": self.shut_since,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What ``state()`` was taken from."""
        return cls(
            course=Course.from_state(state["course"]) if state["course"] else None,
            chosen_at=state["chosen_at"] if state["course"] else -math.inf,
            avoided=tuple(state["avoided"]),
            shut_since=state["shut_since"],
        )

    def _detour(self, body: Body, ends: tuple[RoomId, RoomId], back: bool) -> Detour | None:
        site, (start, goal) = body.site, ends
        if back and (course := site.divert(body.id, start, start)) is not None:
            return Detour(course, "it is called back", back=True)
        if (shut := site.traffic.blocked(body.id, self.route)) is not None:
            course = site.divert(body.id, start, goal)
            return Detour(course, f"{shut} is closed") if course is not None else None
        free = self.opened(body)
        if free and not back and (course := site.divert(body.id, start, goal, quicker=True)) is not None:
            return Detour(course, f"open again: {', '.join(free)}")
        return None
