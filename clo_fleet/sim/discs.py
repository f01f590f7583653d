"""Discs among walls, in one pymunk space with the building's coordinates: the physics of the rooms.

Theory of operation. Each tick is a few substeps; in each, ``motion.Drives`` says with what force every disc follows its
wish, and the engine does the rest. Every disc has a slot, which is its row in our arrays; those that steer come first.
Bodies are read and written in batches, in the engine's own order, which changes as bodies come and go; ``_order`` maps
its rows to our slots. A disc that hangs on another does so by two joints, and meets nothing. Nothing of pymunk leaves
this file.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import pymunk
import pymunk.batch
from pymunk.batch import BodyFields

from clo_fleet.sim.motion import Drives, Numbers, Slots
from clo_fleet.world.model import Point, Pose

__all__ = ["Disc", "Discs", "Touch"]

WALL_THICKNESS = 0.05  # [m]
FRICTION = 0.2  # between surfaces that touch: low, so that discs slide along walls and each other
SLOP = 0.001  # [m] overlap that the engine leaves between touching bodies (its default is made for pixels)

_STEERS, _SLIDES, _WALL = 1, 2, 3  # the engine's collision types
_SOLID = pymunk.ShapeFilter()
_AIRY = pymunk.ShapeFilter(categories=0, mask=0)  # a disc that hangs: meets nothing, and no query finds it


class Touch(IntEnum):
    """What touched what."""

    ROBOT_ROBOT = 0
    ROBOT_WALL = 1
    ROBOT_ITEM = 2


@dataclass(frozen=True, slots=True)
class Disc:
    """What a disc is.

    Attributes:
        radius: [m].
        mass: [kg].
        push: the largest acceleration of a robot, which steers itself [m/s2]; ``None``: an item, which only slides.
    """

    radius: float
    mass: float
    push: float | None = None


@dataclass(slots=True, eq=False)
class _Engaged:
    """A disc in the engine's terms, with the joints by which it hangs on another."""

    body: pymunk.Body
    shape: pymunk.Circle
    joints: tuple[pymunk.Constraint, ...] = ()


class Discs:
    """Discs that move, push and touch; each is in the space from ``enter`` to ``leave``.

    Attributes:
        at: where they are, ``(n + 1, 3)`` [m, m, rad]; the last row is the walls', which the engine lists as well.
        velocity: how fast they move, ``(n + 1, 2)`` [m/s].
        drives: what they want and can do, to be changed by whoever steers them.
    """

    def __init__(
        self,
        discs: Sequence[Disc],
        walls: Iterable[tuple[Point, Point]],
        touched: Callable[[Touch, int, int], None],
        *,
        tick: float,
        substeps: int,
    ) -> None:
        """A space in which there are only walls as yet.

        Args:
            discs: by slot.
            walls: from point to point [m].
            touched: is told of each touch that begins, with the slots of a robot and of whatever it touched.
            tick: how long a step lasts [s].
            substeps: in how many equal parts the engine takes it.
        """
        self._substeps, self._substep = substeps, tick / substeps
        self._out, self._in = pymunk.batch.Buffer(), pymunk.batch.Buffer()
        self._order: Slots | None = None  # the slot of each row of the engine; None: bodies have come or gone
        size = len(discs) + 1
        self.at, self.velocity, self.drives = np.zeros((size, 3)), np.zeros((size, 2)), Drives.at_rest(size)
        self._discs = [_engaged(disc) for disc in discs]
        for slot, disc in enumerate(discs):
            self.drives.mass[slot] = disc.mass
            if disc.push is not None:
                self.drives.steers[slot], self.drives.push[slot] = True, disc.push
        self._slot_of = {disc.body.id: slot for slot, disc in enumerate(self._discs)}
        self._space = self._empty_space(walls, touched)

    def step(self) -> list[int]:
        """Let one tick pass; returns the slots of those that moved or turned, or go on moving."""
        order = self._rows()
        for _ in range(self._substeps):
            now = self._read(BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY, 4)
            self._in.set_float_buf(self.drives.commands(order, now, self._substep))
            pymunk.batch.set_space_bodies(self._space, BodyFields.ANGULAR_VELOCITY | BodyFields.FORCE, self._in)
            self._space.step(self._substep)
        now = self._read(BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY, 5)
        stirs = (now[:, 3:] != 0.0).any(axis=1) | (now[:, :3] != self.at[order]).any(axis=1)
        self.at[order], self.velocity[order] = now[:, :3], now[:, 3:]
        stirred: list[int] = order[stirs & (order >= 0)].tolist()
        return stirred

    def enter(self, slot: int, pose: Pose, velocity: Sequence[float] = (0.0, 0.0)) -> None:
        """Put a disc into the space."""
        disc = self._discs[slot]
        self._space.add(disc.body, disc.shape)
        self._order = None
        self.put(slot, pose, velocity)

    def leave(self, slot: int) -> None:
        """Take a disc out of the space."""
        disc = self._discs[slot]
        self._space.remove(disc.shape, disc.body)
        self._order = None

    def put(self, slot: int, pose: Pose, velocity: Sequence[float] = (0.0, 0.0)) -> None:
        """Shift a disc that is in the space."""
        disc = self._discs[slot]
        disc.body.position, disc.body.angle = pose.point, pose.heading
        disc.body.velocity, disc.body.angular_velocity = (velocity[0], velocity[1]), 0.0
        self._space.reindex_shapes_for_body(disc.body)
        self.at[slot] = (pose.x, pose.y, pose.heading)
        self.velocity[slot] = velocity

    def push(self, slot: int, velocity: tuple[float, float]) -> None:
        """Give a disc a velocity [m/s]."""
        self._discs[slot].body.velocity = velocity
        self.velocity[slot] = velocity

    def hang(self, slot: int, on: int, seat: Point) -> None:
        """Bring a disc, in the space or not, to a place on another [m] that turns with that, and hang it there."""
        disc, carrier = self._discs[slot], self._discs[on].body
        x, y = carrier.local_to_world(seat)
        if disc.body.space is None:
            self.enter(slot, Pose(x, y))
        self.put(slot, Pose(x, y, carrier.angle), carrier.velocity)
        disc.shape.filter = _AIRY
        hold = pymunk.PivotJoint(carrier, disc.body, seat, (0.0, 0.0))
        disc.joints = (hold, pymunk.GearJoint(carrier, disc.body, 0.0, 1.0))
        self._space.add(*disc.joints)
        self.drives.hangs[slot] = True

    def unhang(self, slot: int) -> None:
        """Let go of a disc that hangs on another."""
        disc = self._discs[slot]
        self._space.remove(*disc.joints)
        disc.joints, self.drives.hangs[slot] = (), False
        disc.shape.filter = _SOLID

    def clear(self, point: Point, within: float) -> bool:
        """Whether nothing solid is this near to a point [m]."""
        return self._space.point_query_nearest(point, within, _SOLID) is None

    def _empty_space(
        self, walls: Iterable[tuple[Point, Point]], touched: Callable[[Touch, int, int], None]
    ) -> pymunk.Space:
        """A space with walls, in which touches are noted."""
        space = pymunk.Space()
        space.collision_slop = SLOP
        for begin, end in walls:
            wall = pymunk.Segment(space.static_body, begin, end, WALL_THICKNESS / 2)
            wall.collision_type, wall.friction = _WALL, FRICTION
            space.add(wall)

        def begins(touch: Touch) -> Callable[[pymunk.Arbiter, pymunk.Space, object], None]:
            def begin(arbiter: pymunk.Arbiter, *_: object) -> None:
                robot, other = (self._slot_of.get(body.id, -1) for body in arbiter.bodies)  # -1: the walls
                touched(touch, robot, other)

            return begin

        space.on_collision(_STEERS, _STEERS, begin=begins(Touch.ROBOT_ROBOT))
        space.on_collision(_STEERS, _WALL, begin=begins(Touch.ROBOT_WALL))
        space.on_collision(_STEERS, _SLIDES, begin=begins(Touch.ROBOT_ITEM))
        return space

    def _rows(self) -> Slots:
        """The slot of each body, in the engine's present order."""
        if self._order is None:
            self._out.clear()
            pymunk.batch.get_space_bodies(self._space, BodyFields.BODY_ID, self._out)
            ids = np.frombuffer(self._out.int_buf(), dtype=np.uintp).tolist()
            self._order = np.asarray([self._slot_of.get(body, -1) for body in ids], dtype=np.intp)  # -1: the walls
        return self._order

    def _read(self, fields: BodyFields, width: int) -> Numbers:
        self._out.clear()
        pymunk.batch.get_space_bodies(self._space, fields, self._out)
        return np.frombuffer(self._out.float_buf(), dtype=np.float64).reshape(-1, width).copy()


def _engaged(disc: Disc) -> _Engaged:
    """A disc that is not yet in the space; nothing turns a robot but itself."""
    if disc.push is not None:
        body, kind = pymunk.Body(disc.mass, math.inf), _STEERS
    else:
        body, kind = pymunk.Body(disc.mass, pymunk.moment_for_circle(disc.mass, 0.0, disc.radius)), _SLIDES
    shape = pymunk.Circle(body, disc.radius)
    shape.collision_type, shape.friction = kind, FRICTION
    return _Engaged(body, shape)
