"""Who waits for whom, and why: a graph over the robots that stand still.

An edge leads from a robot to another one without which it cannot go on. A circle in that graph is a gridlock unless
somebody in it will give up by itself. Where any of several robots could clear the way there is no edge.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.world.model import RobotId

__all__ = ["Waits"]

GIVES_UP = frozenset({WaitCause.PARTNER, WaitCause.PATH})  # skills fail after waiting so for a while


@dataclass(slots=True)
class Waits:
    """Follows who waits, tick by tick.

    Attributes:
        now: why each of those who wait does so, in the order of ids.
        seconds: how long each robot has waited in all, by cause [s].
        circle: robots each of which waits for the next and the last for the first; empty: there is none.
        circle_since: since when there has been that circle [s].
    """

    now: dict[RobotId, Wait] = field(default_factory=dict)
    seconds: dict[RobotId, dict[str, float]] = field(default_factory=dict)
    circle: tuple[RobotId, ...] = ()
    circle_since: float = 0.0

    def note(self, time: float, tick: float, waits: Mapping[RobotId, Wait]) -> tuple[RobotId, ...]:
        """Take down who waits now; those whose reason is new, in the order of ids.

        Args:
            time: now [s].
            tick: for how long they have waited since they were last noted [s].
            waits: why each of those who wait does so.
        """
        before, self.now = self.now, dict(sorted(waits.items()))
        for robot, wait in self.now.items():
            spent = self.seconds.setdefault(robot, {})
            spent[wait.cause.value] = round(spent.get(wait.cause.value, 0.0) + tick, 3)
        if before != self.now:
            circle = _circle((robot, wait) for robot, wait in self.now.items() if wait.cause not in GIVES_UP)
            if circle != self.circle:
                self.circle, self.circle_since = circle, time
        return tuple(robot for robot, wait in self.now.items() if before.get(robot) != wait)

    def circle_text(self) -> str:
        """The circle in words."""
        after = (*self.circle[1:], *self.circle[:1])
        pairs = zip(self.circle, after, strict=True)
        return ", ".join(f"{robot} waits for {other} ({self.now[robot].what})" for robot, other in pairs)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "now": {robot: wait.state() for robot, wait in self.now.items()},
            "seconds": {robot: dict(spent) for robot, spent in self.seconds.items()},
            "circle": list(self.circle),
            "circle_since": self.circle_since,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What ``state()`` was taken from."""
        return cls(
            {robot: Wait.from_state(wait) for robot, wait in state["now"].items()},
            {robot: dict(spent) for robot, spent in state["seconds"].items()},
            tuple(state["circle"]),
            state["circle_since"],
        )


def _circle(waits: Iterable[tuple[RobotId, Wait]]) -> tuple[RobotId, ...]:
    """A circle among those who wait, from its smallest robot on; the same one for the same waits."""
    on = {robot: wait.on for robot, wait in waits}
    cleared: set[RobotId] = set()  # no circle can be reached from them
    for start in on:
        path, ahead = [start], [iter(on[start])]
        while path and start not in cleared:
            other = next(ahead[-1], None)
            if other is None:
                cleared.add(path.pop())
                ahead.pop()
            elif other in path:
                circle = path[path.index(other) :]
                first = circle.index(min(circle))
                return tuple(circle[first:] + circle[:first])
            elif other in on and other not in cleared:
                path.append(other)
                ahead.append(iter(on[other]))
    return ()
