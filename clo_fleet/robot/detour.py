"""Another way for a robot that is on its way: back, round what is closed, or the short way once that is open again.

What was closed when a robot chose its way it has avoided. When some of that is open again, it takes a quicker way if
there is one and it can still turn off for it; how quick ways are counts as in empty corridors, because a way that the
robot has claimed for itself would always seem the slower one.
"""

from dataclasses import dataclass

from clo_fleet.robot.skill import Body
from clo_fleet.sim.routes import Route
from clo_fleet.sim.traffic import Course
from clo_fleet.world.model import RoomId

__all__ = ["Detour", "opened", "turn_off"]


@dataclass(frozen=True, slots=True)
class Detour:
    """Another way from where a robot is: ``why``, and whether it leads back to where it came from."""

    course: Course
    why: str
    back: bool = False


def opened(body: Body, avoided: tuple[str, ...]) -> tuple[str, ...]:
    """What of the corridors and doors that were avoided is open again."""
    return tuple(sorted({*avoided}.difference(body.site.traffic.closed()))) if avoided else ()


def turn_off(
    body: Body, route: Route, ends: tuple[RoomId, RoomId], avoided: tuple[str, ...], *, back: bool
) -> Detour | None:
    """Send the robot another way, if there is a reason for that and it can turn off.

    Args:
        body: its body, in the corridors.
        route: the way that it is on.
        ends: the rooms that it comes from and goes to.
        avoided: what was closed when it chose its way.
        back: whether it is to come back.
    """
    site, (start, goal) = body.site, ends
    if back and (course := site.divert(body.id, start, start)) is not None:
        return Detour(course, "it is called back", back=True)
    if (shut := site.traffic.blocked(body.id, route)) is not None:
        course = site.divert(body.id, start, goal)
        return Detour(course, f"{shut} is closed") if course is not None else None
    free = opened(body, avoided)
    if free and not back and (course := site.divert(body.id, start, goal, quicker=True)) is not None:
        return Detour(course, f"open again: {', '.join(free)}")
    return None
