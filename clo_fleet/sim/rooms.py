"""The rooms: robots and items as discs among walls, in one pymunk space with the building's coordinates.

Theory of operation. Each tick is a few substeps; in each, ``motion.Drives`` says with what force every disc follows its
wish, and the engine does the rest. ``custody.Custody`` knows who is present and who carries what. A carried item hangs
on its robot by two joints, on a seat within the robot's rim, and meets nothing; while its robot is in a corridor,
neither is in the space. Bodies are read and written in batches, in the engine's own order, which changes as bodies come
and go; ``_order`` maps its rows to our slots: robots, then objects, each sorted by id.

The engine keeps contacts from step to step, so a space rebuilt from ``state()`` goes on a little differently from the
one that it was taken from (and notes a touch that lasts anew), while two that are rebuilt agree to the last bit: a run
that is to be resumed exactly must itself continue on the rebuilt one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pymunk
import pymunk.batch
from pymunk.batch import BodyFields

from clo_fleet.sim.custody import CarrierError, Custody, PresenceError, RoomsError, UnknownBodyError
from clo_fleet.sim.motion import Drives, Numbers, Slots, starting_state
from clo_fleet.sim.walls import spots, walls
from clo_fleet.world.model import BuildingMap, ObjectId, ObjectSpec, Point, Pose, RobotId, RobotSpec, RoomId

__all__ = ["CarrierError", "Contacts", "PresenceError", "Rooms", "RoomsError", "UnknownBodyError"]

ROBOT_MASS = 20.0  # [kg] a small delivery robot
WALL_THICKNESS = 0.05  # [m]
FRICTION = 0.2  # between surfaces that touch: low, so that discs slide along walls and each other
SLOP = 0.001  # [m] overlap that the engine leaves between touching bodies (its default is made for pixels)
SEATS = 8  # places on a robot's ring; the ninth item lies on the first
GAP = 0.05  # [m] between a seated item and the rim, and round an item that is put down

_ROBOT, _ITEM, _WALL = 1, 2, 3  # the engine's collision types
_SOLID = pymunk.ShapeFilter()
_AIRY = pymunk.ShapeFilter(categories=0, mask=0)  # a carried item: meets nothing, and no query finds it


@dataclass(frozen=True, slots=True)
class Contacts:
    """How many touches have begun so far, by who touched what."""

    robot_robot: int = 0
    robot_wall: int = 0
    robot_item: int = 0


@dataclass(slots=True, eq=False)
class _Disc:
    """A robot or an item: its slot in the arrays, its body, and the joints by which it hangs on a robot."""

    slot: int
    radius: float
    body: pymunk.Body
    shape: pymunk.Circle
    joints: tuple[pymunk.Constraint, ...] = ()


class Rooms:
    """Robots and items in the rooms of a building.

    Misuse raises a ``RoomsError`` and changes nothing: ``UnknownBodyError`` for an id that there is not,
    ``PresenceError`` for what a robot in a corridor cannot do, ``CarrierError`` for an item that is in other hands.

    Args:
        building: its rooms and doors.
        robots: all robots; each starts where its spec says.
        objects: all objects, likewise.
        tick: how long a step lasts [s].
        substeps: in how many equal parts the engine takes it.
        state: where to go on instead, as ``state()`` returned it.
    """

    def __init__(
        self,
        building: BuildingMap,
        robots: Sequence[RobotSpec],
        objects: Sequence[ObjectSpec],
        *,
        tick: float = 0.2,
        substeps: int = 4,
        state: Mapping[str, Any] | None = None,
    ) -> None:
        self._building = building
        self._substeps, self._substep = substeps, tick / substeps
        self._out, self._in = pymunk.batch.Buffer(), pymunk.batch.Buffer()
        self._order: Slots | None = None  # the slot of each row of the engine; None: bodies have come or gone
        size = len(robots) + len(objects) + 1  # the last is the walls', which the engine lists as a body too
        self._at, self._velocity, self._drives = np.zeros((size, 3)), np.zeros((size, 2)), Drives.at_rest(size)
        self._robots: dict[RobotId, _Disc] = {}
        for slot, robot in enumerate(sorted(robots, key=lambda spec: spec.id)):
            self._robots[robot.id] = _disc(slot, robot.radius)
            self._drives.steers[slot], self._drives.push[slot] = True, robot.max_acceleration
            self._drives.mass[slot] = ROBOT_MASS
        self._names = list(self._robots)  # by slot
        self.moving: set[RobotId] = set()  # the robots that moved or turned in the last step, or go on moving
        self._known: dict[RobotId, Pose] = {}  # the poses that somebody has asked for since they changed
        self._items: dict[ObjectId, _Disc] = {}
        for slot, thing in enumerate(sorted(objects, key=lambda spec: spec.id), len(robots)):
            self._items[thing.id] = _disc(slot, thing.radius, thing.mass)
            self._drives.mass[slot] = thing.mass
        self._pusher: dict[ObjectId, RobotId | None] = dict.fromkeys(self._items)
        self._slot_of = {disc.body.id: disc.slot for disc in (*self._robots.values(), *self._items.values())}
        self._space = self._empty_space()
        state = starting_state(robots, objects) if state is None else state
        self._custody = Custody.from_state(self._robots, self._items, state["custody"])
        self._contacts: list[int] = list(state["contacts"])
        self._place(state["robots"], state["items"])

    @classmethod
    def from_state(
        cls, building: BuildingMap, robots: Sequence[RobotSpec], objects: Sequence[ObjectSpec],
        state: Mapping[str, Any], *, tick: float = 0.2, substeps: int = 4,
    ) -> "Rooms":  # fmt: skip
        """The rooms rebuilt from what ``state()`` returned; any two rebuilt from it behave alike."""
        return cls(building, robots, objects, tick=tick, substeps=substeps, state=state)

    def state(self) -> dict[str, Any]:
        """Everything that changes, as plain data; poses of those who are absent mean nothing."""
        at, velocity, drives = self._at.tolist(), self._velocity.tolist(), self._drives
        wanted, facing, top = drives.wanted.tolist(), drives.facing.tolist(), drives.top.tolist()
        robots = {
            robot: {
                "pose": at[n], "velocity": velocity[n], "wanted": wanted[n], "facing": facing[n], "max_speed": top[n],
            }
            for robot, n in ((robot, disc.slot) for robot, disc in self._robots.items())
        }  # fmt: skip
        items = {
            obj: {"pose": at[item.slot], "velocity": velocity[item.slot], "pusher": self._pusher[obj]}
            for obj, item in self._items.items()
        }
        return {"robots": robots, "items": items, "custody": self._custody.state(), "contacts": [*self._contacts]}

    def step(self) -> None:
        """Let one tick pass."""
        order = self._rows()
        for _ in range(self._substeps):
            now = self._read(BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY, 4)
            self._in.set_float_buf(self._drives.commands(order, now, self._substep))
            pymunk.batch.set_space_bodies(self._space, BodyFields.ANGULAR_VELOCITY | BodyFields.FORCE, self._in)
            self._space.step(self._substep)
        now = self._read(BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY, 5)
        stirs = (now[:, 3:] != 0.0).any(axis=1) | (now[:, :3] != self._at[order]).any(axis=1)
        self._at[order], self._velocity[order] = now[:, :3], now[:, 3:]
        self.moving = {self._names[slot] for slot in order[stirs].tolist() if 0 <= slot < len(self._names)}
        for robot in self.moving:
            self._known.pop(robot, None)

    def add_robot(self, robot: RobotId, pose: Pose) -> None:
        """Let a robot back into the rooms, at rest, with what it carries."""
        self._custody.enter(robot)
        body = self._robots[robot]
        self._drives.wanted[body.slot], self._drives.facing[body.slot] = 0.0, pose.heading
        self._enter(body, pose)
        for obj in self.carried(robot):
            self._hook(robot, obj)

    def remove_robot(self, robot: RobotId) -> Pose:
        """Take a robot out of the rooms with what it carries; returns where it was."""
        self._custody.leave(robot)
        for obj in self.carried(robot):
            self._unhook(self._items[obj])
            self._leave(self._items[obj])
        self._leave(self._robots[robot])
        return _pose(self._at[self._robots[robot].slot].tolist())

    def drive(self, robot: RobotId, velocity: tuple[float, float]) -> None:
        """Have a robot strive for a velocity [m/s] until told otherwise; ``(0, 0)`` brakes."""
        self._custody.check_present(robot)
        self._drives.tell(self._robots[robot].slot, velocity)

    def set_max_speed(self, robot: RobotId, max_speed: float) -> None:
        """Change a robot's top speed [m/s]."""
        self._custody.check_robot(robot)
        self._drives.top[self._robots[robot].slot] = max_speed

    def pose(self, robot: RobotId) -> Pose | None:
        """Where a robot is; ``None`` while it is in a corridor."""
        if not self._custody.present(robot):
            return None
        if robot not in self._known:
            self._known[robot] = _pose(self._at[self._robots[robot].slot].tolist())
        return self._known[robot]

    def poses(self) -> dict[RobotId, Pose]:
        """Where each robot in the rooms is, in the order of their ids."""
        at = self._at.tolist()
        return {robot: _pose(at[self._robots[robot].slot]) for robot in self._custody.here()}

    def present(self) -> list[RobotId]:
        """The robots in the rooms, in the order of their ids."""
        return self._custody.here()

    def velocity(self, robot: RobotId) -> tuple[float, float] | None:
        """How fast a robot moves [m/s]; ``None`` while it is in a corridor."""
        return _pair(self._velocity[self._robots[robot].slot].tolist()) if self._custody.present(robot) else None

    def velocities(self) -> dict[RobotId, tuple[float, float]]:
        """How fast each robot in the rooms moves [m/s], in the order of their ids."""
        velocity = self._velocity.tolist()
        return {robot: _pair(velocity[self._robots[robot].slot]) for robot in self._custody.here()}

    def contacts(self) -> Contacts:
        """How many touches have begun so far."""
        return Contacts(*self._contacts)

    def item_position(self, obj: ObjectId) -> Point | None:
        """Where an item is [m]; ``None`` while its carrier is in a corridor, and while it is gone."""
        carrier = self._custody.carrier(obj)
        away = self._custody.gone(obj) or (carrier is not None and not self._custody.present(carrier))
        return None if away else _pair(self._at[self._items[obj].slot].tolist())

    def carrier(self, obj: ObjectId) -> RobotId | None:
        """The robot that carries an item; ``None``: nobody does."""
        return self._custody.carrier(obj)

    def gone(self, obj: ObjectId) -> bool:
        """Whether an item has been taken out of the building."""
        return self._custody.gone(obj)

    def carried(self, robot: RobotId) -> tuple[ObjectId, ...]:
        """What a robot carries, in the order of ids."""
        return self._custody.carried(robot)

    def pusher(self, obj: ObjectId) -> RobotId | None:
        """The robot that last ran into an item since anybody put it down, shifted it or pushed it."""
        self._custody.carrier(obj)  # raises if there is no such object
        return self._pusher[obj]

    def grasp(self, robot: RobotId, obj: ObjectId) -> None:
        """Take an item up onto a robot's first free seat."""
        self._custody.check_present(robot)
        self._custody.take(robot, obj)
        self._hook(robot, obj)

    def release(self, robot: RobotId, obj: ObjectId, position: Point) -> None:
        """Put an item that a robot carries down at ``position`` [m]."""
        self._free(robot, obj)
        self.move_item(obj, position)

    def hand_over(self, giver: RobotId, taker: RobotId, obj: ObjectId) -> None:
        """Move an item from one robot's seat to another's."""
        self._custody.check_present(taker)
        self._free(giver, obj)
        self.grasp(taker, obj)

    def move_item(self, obj: ObjectId, position: Point) -> None:
        """Shift an item to ``position`` [m], at rest."""
        self._custody.check_carrier(obj, None)
        self._pusher[obj] = None
        self._put(self._items[obj], Pose(*position))

    def take_away(self, obj: ObjectId) -> None:
        """Take an item that lies free out of the building."""
        self._custody.take_away(obj)
        self._pusher[obj] = None
        self._leave(self._items[obj])

    def bring_back(self, obj: ObjectId, position: Point) -> None:
        """Put an item that is gone down at ``position`` [m]."""
        self._custody.bring_back(obj)
        self._enter(self._items[obj], Pose(*position))

    def push_item(self, obj: ObjectId, velocity: tuple[float, float]) -> None:
        """Give an item a velocity [m/s]; friction stops it."""
        self._custody.check_carrier(obj, None)
        self._pusher[obj] = None
        self._items[obj].body.velocity = velocity
        self._velocity[self._items[obj].slot] = velocity

    def free_spot(self, near: Point, radius: float, room: RoomId, *, within: float = 2.0) -> Point | None:
        """A clear place for an item, about the nearest to ``near``; ``None`` if there is none within reach.

        Clear of walls, obstacles, robots and other items, and not in front of a door.

        Raises:
            UnknownRoomError: if there is no such room.
        """
        candidates = spots(self._building, room, near, radius, within)
        clear = (s for s in candidates if self._space.point_query_nearest(s, radius + GAP, _SOLID) is None)
        return next(clear, None)

    def _empty_space(self) -> pymunk.Space:
        """A space with the building's walls, in which touches are noted."""
        space = pymunk.Space()
        space.collision_slop = SLOP
        for begin, end in walls(self._building):
            wall = pymunk.Segment(space.static_body, begin, end, WALL_THICKNESS / 2)
            wall.collision_type, wall.friction = _WALL, FRICTION
            space.add(wall)
        robots = {body.body: robot for robot, body in self._robots.items()}
        items = {item.body: obj for obj, item in self._items.items()}

        def count(kind: int) -> None:
            self._contacts[kind] += 1

        def push(arbiter: pymunk.Arbiter) -> None:
            robot, item = arbiter.bodies
            self._pusher[items[item]] = robots[robot]
            count(2)

        space.on_collision(_ROBOT, _ROBOT, begin=lambda *_: count(0))
        space.on_collision(_ROBOT, _WALL, begin=lambda *_: count(1))
        space.on_collision(_ROBOT, _ITEM, begin=lambda arbiter, *_: push(arbiter))
        return space

    def _place(self, robots: Mapping[str, Any], items: Mapping[str, Any]) -> None:
        """Bring the discs to where a state has them."""
        drives = self._drives
        for robot, body in self._robots.items():
            saved, n = robots[robot], body.slot
            drives.top[n], drives.wanted[n], drives.facing[n] = saved["max_speed"], saved["wanted"], saved["facing"]
            self._at[n], self._velocity[n] = saved["pose"], saved["velocity"]
            if self._custody.present(robot):
                self._enter(body, Pose(*saved["pose"]), saved["velocity"])
        for obj, item in self._items.items():
            carrier, saved, n = self._custody.carrier(obj), items[obj], item.slot
            self._pusher[obj], self._at[n], self._velocity[n] = saved["pusher"], saved["pose"], saved["velocity"]
            if carrier is None and not self._custody.gone(obj):
                self._enter(item, Pose(*saved["pose"]), saved["velocity"])
            elif carrier is not None and self._custody.present(carrier):
                self._hook(carrier, obj)
                self._put(item, Pose(*saved["pose"]), saved["velocity"])

    def _enter(self, disc: _Disc, pose: Pose, velocity: Sequence[float] = (0.0, 0.0)) -> None:
        self._space.add(disc.body, disc.shape)
        self._order = None
        self._put(disc, pose, velocity)

    def _leave(self, disc: _Disc) -> None:
        self._space.remove(disc.shape, disc.body)
        self._order = None

    def _put(self, disc: _Disc, pose: Pose, velocity: Sequence[float] = (0.0, 0.0)) -> None:
        if disc.slot < len(self._names):
            self._known.pop(self._names[disc.slot], None)
        disc.body.position, disc.body.angle = pose.point, pose.heading
        disc.body.velocity, disc.body.angular_velocity = (velocity[0], velocity[1]), 0.0
        self._space.reindex_shapes_for_body(disc.body)
        self._at[disc.slot] = (pose.x, pose.y, pose.heading)
        self._velocity[disc.slot] = velocity

    def _hook(self, robot: RobotId, obj: ObjectId) -> None:
        """Bring an item to its seat on its robot and hang it there."""
        body, item = self._robots[robot], self._items[obj]
        angle = math.tau * (self._custody.seat(robot, obj) % SEATS) / SEATS
        ring = max(0.0, body.radius - item.radius - GAP)
        anchor = (ring * math.cos(angle), ring * math.sin(angle))
        x, y = body.body.local_to_world(anchor)
        if item.body.space is None:
            self._enter(item, Pose(x, y))
        self._put(item, Pose(x, y, body.body.angle), body.body.velocity)
        item.shape.filter = _AIRY
        hold = pymunk.PivotJoint(body.body, item.body, anchor, (0.0, 0.0))
        item.joints = (hold, pymunk.GearJoint(body.body, item.body, 0.0, 1.0))
        self._space.add(*item.joints)
        self._drives.hangs[item.slot] = True
        self._weigh(robot)

    def _unhook(self, item: _Disc) -> None:
        self._space.remove(*item.joints)
        item.joints, self._drives.hangs[item.slot] = (), False

    def _free(self, robot: RobotId, obj: ObjectId) -> None:
        self._custody.check_present(robot)
        self._custody.free(robot, obj)
        self._unhook(self._items[obj])
        self._items[obj].shape.filter = _SOLID
        self._weigh(robot)

    def _weigh(self, robot: RobotId) -> None:
        """Give a robot the force to move its load as fast as itself: journeys take what the map says."""
        load = sum(self._items[obj].body.mass for obj in self.carried(robot))
        self._drives.mass[self._robots[robot].slot] = ROBOT_MASS + load

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


def _disc(slot: int, radius: float, mass: float | None = None) -> _Disc:
    """A disc that is not yet in the space; without a mass a robot, which nothing turns but itself."""
    if mass is None:
        body, kind = pymunk.Body(ROBOT_MASS, math.inf), _ROBOT
    else:
        body, kind = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0.0, radius)), _ITEM
    shape = pymunk.Circle(body, radius)
    shape.collision_type, shape.friction = kind, FRICTION
    return _Disc(slot, radius, body, shape)


def _pose(row: Sequence[float]) -> Pose:
    return Pose(row[0], row[1], math.remainder(row[2], math.tau))


def _pair(row: Sequence[float]) -> tuple[float, float]:
    return (row[0], row[1])
