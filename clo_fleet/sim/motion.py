"""How discs strive to move: the force with which each follows its wish, never more than it can.

Every disc has a velocity that it wants and a largest acceleration, and the force that brings it there is
laid on anew in each substep; contacts change what comes of it. So robots push, are pushed, and never
pass through one another, as they would if a velocity were written into the body. A robot wants what it
was last told, and turns to face it; an item wants to rest, which is friction.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clo_fleet.world.model import ObjectSpec, RobotSpec

__all__ = ["SLIDING", "Drives", "Numbers", "Slots", "starting_state"]

SLIDING = 2.5  # [m/s2] how fast a sliding item slows down: a friction of 0.25, at rest within a second
TURNING = 3.0  # [rad/s] how fast a robot turns to face where it goes
LEAST_SPEED = 0.05  # [m/s] below it a robot keeps the direction in which it looks
TINY = 1e-12  # stands for zero in divisions

Numbers = npt.NDArray[np.float64]
Slots = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Drives:
    """The wishes and powers of n discs; each array has a row for each.

    Attributes:
        wanted: velocity to strive for, ``(n, 2)`` [m/s].
        facing: heading to strive for [rad].
        top: largest speed to strive for [m/s].
        push: largest acceleration of its own [m/s2].
        mass: what its force must move: the disc with its load [kg].
        steers: whether it turns to ``facing``.
        hangs: whether others move it by joints; then it keeps the spin that they give it.
    """

    wanted: Numbers
    facing: Numbers
    top: Numbers
    push: Numbers
    mass: Numbers
    steers: npt.NDArray[np.bool_]
    hangs: npt.NDArray[np.bool_]

    @classmethod
    def at_rest(cls, n: int) -> "Drives":
        """Discs that want nothing but rest."""
        no = np.zeros(n, dtype=np.bool_)
        return cls(np.zeros((n, 2)), np.zeros(n), np.zeros(n), np.full(n, SLIDING), np.zeros(n), no, no.copy())

    def tell(self, slot: int, velocity: tuple[float, float]) -> None:
        """Give one disc a velocity to strive for, and its direction to face."""
        self.wanted[slot] = velocity
        if math.hypot(*velocity) > LEAST_SPEED:
            self.facing[slot] = math.atan2(velocity[1], velocity[0])

    def commands(self, slots: Slots, now: Numbers, duration: float) -> Numbers:
        """The spin [rad/s] and the force [N] of some discs for a substep, ``(k, 3)``.

        Args:
            slots: the rows of the discs, ``(k,)``.
            now: their headings [rad], velocities [m/s] and spins [rad/s], ``(k, 4)``.
            duration: of the substep [s].
        """
        wanted = self.wanted[slots]
        wanted *= np.minimum(1.0, self.top[slots] / np.maximum(_length(wanted), TINY))[:, None]
        change = (wanted - now[:, 1:3]) / duration
        power = np.minimum(1.0, np.where(self.hangs, 0.0, self.push)[slots] / np.maximum(_length(change), TINY))
        turn = (self.facing[slots] - now[:, 0] + math.pi) % math.tau - math.pi
        spin = np.where(self.hangs[slots], now[:, 3], 0.0)
        spin = np.where(self.steers[slots], np.clip(turn / duration, -TURNING, TURNING), spin)
        return np.column_stack((spin, change * (power * self.mass[slots])[:, None]))


def starting_state(robots: Sequence[RobotSpec], objects: Sequence[ObjectSpec]) -> dict[str, Any]:
    """The state in which everything is where its spec says."""
    rest = {"velocity": [0.0, 0.0], "wanted": [0.0, 0.0]}
    poses = {r.id: {"pose": [r.pose.x, r.pose.y, r.pose.heading], "facing": r.pose.heading} for r in robots}
    return {
        "robots": {r.id: rest | poses[r.id] | {"max_speed": r.max_speed} for r in robots},
        "items": {o.id: {"pose": [*o.position, 0.0], "velocity": [0.0, 0.0], "pusher": None} for o in objects},
        "custody": {"present": list(poses), "cargo": {}, "gone": []},
        "contacts": [0, 0, 0],
    }


def _length(vectors: Numbers) -> Numbers:
    x, y = vectors.T
    length: Numbers = np.sqrt(x * x + y * y)
    return length
