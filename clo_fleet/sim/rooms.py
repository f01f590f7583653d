"""The rooms: robots and items as discs among walls.

``discs.Discs`` lets them move, and ``custody.Custody`` knows who is present and who carries what. A carried item hangs
on its robot, on a seat within the robot's rim; while its robot is in a corridor, neither is in the space. Slots are
those of robots, then of objects, each sorted by id.

The engine keeps contacts from step to step, so a space rebuilt from ``state()`` goes on a little differently from the
one that it was taken from (and notes a touch that lasts anew), while two that are rebuilt agree to the last bit: a run
that is to be resumed exactly must itself continue on the rebuilt one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from clo_fleet.sim.custody import CarrierError, Custody, PresenceError, RoomsError, UnknownBodyError
from clo_fleet.sim.discs import Disc, Discs, Touch
from clo_fleet.sim.motion import starting_state
from clo_fleet.sim.spots import spots
from clo_fleet.sim.walls import walls
from clo_fleet.world.model import BuildingMap, ObjectId, ObjectSpec, Point, Pose, RobotId, RobotSpec, RoomId

__all__ = ["CarrierError", "Contacts", "PresenceError", "Rooms", "RoomsError", "UnknownBodyError"]

ROBOT_MASS = 20.0  # [kg] a small delivery robot
SEATS = 8  # places on a robot's ring; the ninth item lies on the first
GAP = 0.05  # [m] between a seated item and the rim, and round an item that is put down


@dataclass(frozen=True, slots=True)
class Contacts:
    """How many touches have begun so far, by who touched what."""

    robot_robot: int = 0
    robot_wall: int = 0
    robot_item: int = 0


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
        robots, objects = sorted(robots, key=lambda spec: spec.id), sorted(objects, key=lambda spec: spec.id)
        self._discs = [Disc(robot.radius, ROBOT_MASS, robot.max_acceleration) for robot in robots]
        self._discs += [Disc(thing.radius, thing.mass) for thing in objects]
        self._physics = Discs(self._discs, walls(building), self._touched, tick=tick, substeps=substeps)
        self._at, self._velocity = self._physics.at, self._physics.velocity
        self._drives = self._physics.drives
        self._robots = {robot.id: slot for slot, robot in enumerate(robots)}
        self._items = {thing.id: slot for slot, thing in enumerate(objects, len(robots))}
        self._names, self._item_names = list(self._robots), list(self._items)  # by slot
        self.moving: set[RobotId] = set()  # the robots that moved or turned in the last step, or go on moving
        self._known: dict[RobotId, Pose] = {}  # the poses that somebody has asked for since they changed
        self._lies: dict[ObjectId, Point] = {}  # the same of the items that lie free
        self._watches: list[set[ObjectId]] = []
        self._pusher: dict[ObjectId, RobotId | None] = dict.fromkeys(self._items)
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
            for robot, n in self._robots.items()
        }  # fmt: skip
        items = {
            obj: {"pose": at[n], "velocity": velocity[n], "pusher": self._pusher[obj]} for obj, n in self._items.items()
        }
        return {"robots": robots, "items": items, "custody": self._custody.state(), "contacts": [*self._contacts]}

    def step(self) -> None:
        """Let one tick pass."""
        moved, robots = self._physics.step(), len(self._names)
        self.moving = {self._names[slot] for slot in moved if slot < robots}
        for robot in self.moving:
            self._known.pop(robot, None)
        for slot in moved:
            if slot >= robots:
                self._stir(self._item_names[slot - robots])

    def add_robot(self, robot: RobotId, pose: Pose) -> None:
        """Let a robot back into the rooms, at rest, with what it carries."""
        self._custody.enter(robot)
        slot = self._robots[robot]
        self._drives.wanted[slot], self._drives.facing[slot] = 0.0, pose.heading
        self._known.pop(robot, None)
        self._physics.enter(slot, pose)
        for obj in self.carried(robot):
            self._hook(robot, obj)

    def remove_robot(self, robot: RobotId) -> Pose:
        """Take a robot out of the rooms with what it carries; returns where it was."""
        self._custody.leave(robot)
        for obj in self.carried(robot):
            self._physics.unhang(self._items[obj])
            self._physics.leave(self._items[obj])
        self._physics.leave(self._robots[robot])
        return _pose(self._at[self._robots[robot]].tolist())

    def drive(self, robot: RobotId, velocity: tuple[float, float]) -> None:
        """Have a robot strive for a velocity [m/s] until told otherwise; ``(0, 0)`` brakes."""
        self._custody.check_present(robot)
        self._drives.tell(self._robots[robot], velocity)

    def set_max_speed(self, robot: RobotId, max_speed: float) -> None:
        """Change a robot's top speed [m/s]."""
        self._custody.check_robot(robot)
        self._drives.top[self._robots[robot]] = max_speed

    def pose(self, robot: RobotId) -> Pose | None:
        """Where a robot is; ``None`` while it is in a corridor."""
        if not self._custody.present(robot):
            return None
        if robot not in self._known:
            self._known[robot] = _pose(self._at[self._robots[robot]].tolist())
        return self._known[robot]

    def poses(self) -> dict[RobotId, Pose]:
        """Where each robot in the rooms is, in the order of their ids."""
        at = self._at.tolist()
        return {robot: _pose(at[self._robots[robot]]) for robot in self._custody.here()}

    def present(self) -> list[RobotId]:
        """The robots in the rooms, in the order of their ids."""
        return self._custody.here()

    def velocity(self, robot: RobotId) -> tuple[float, float] | None:
        """How fast a robot moves [m/s]; ``None`` while it is in a corridor."""
        return _pair(self._velocity[self._robots[robot]].tolist()) if self._custody.present(robot) else None

    def velocities(self) -> dict[RobotId, tuple[float, float]]:
        """How fast each robot in the rooms moves [m/s], in the order of their ids."""
        velocity = self._velocity.tolist()
        return {robot: _pair(velocity[self._robots[robot]]) for robot in self._custody.here()}

    def contacts(self) -> Contacts:
        """How many touches have begun so far."""
        return Contacts(*self._contacts)

    def item_position(self, obj: ObjectId) -> Point | None:
        """Where an item is [m]; ``None`` while its carrier is in a corridor, and while it is gone."""
        if obj in self._lies:
            return self._lies[obj]
        carrier = self._custody.carrier(obj)
        if self._custody.gone(obj) or (carrier is not None and not self._custody.present(carrier)):
            return None
        position = _pair(self._at[self._items[obj]].tolist())
        if carrier is None:
            self._lies[obj] = position
        return position

    def watch(self) -> set[ObjectId]:
        """A set of one's own of all items, to be emptied; what moves or changes hands from then on is put into it."""
        self._watches.append(set(self._items))
        return self._watches[-1]

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
        self._stir(obj)
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
        self._stir(obj)
        self._physics.put(self._items[obj], Pose(*position))

    def take_away(self, obj: ObjectId) -> None:
        """Take an item that lies free out of the building."""
        self._custody.take_away(obj)
        self._stir(obj)
        self._pusher[obj] = None
        self._physics.leave(self._items[obj])

    def bring_back(self, obj: ObjectId, position: Point) -> None:
        """Put an item that is gone down at ``position`` [m]."""
        self._custody.bring_back(obj)
        self._stir(obj)
        self._physics.enter(self._items[obj], Pose(*position))

    def push_item(self, obj: ObjectId, velocity: tuple[float, float]) -> None:
        """Give an item a velocity [m/s]; friction stops it."""
        self._custody.check_carrier(obj, None)
        self._pusher[obj] = None
        self._physics.push(self._items[obj], velocity)

    def free_spot(self, near: Point, radius: float, room: RoomId, *, within: float = 2.0) -> Point | None:
        """A clear place for an item, about the nearest to ``near``; ``None`` if there is none within reach.

        Clear of walls, obstacles, robots and other items, and not in front of a door.

        Raises:
            UnknownRoomError: if there is no such room.
        """
        candidates = spots(self._building, room, near, radius, within)
        return next((spot for spot in candidates if self._physics.clear(spot, radius + GAP)), None)

    def _stir(self, obj: ObjectId) -> None:
        """An item has moved, changed hands, gone or come back."""
        self._lies.pop(obj, None)
        for watch in self._watches:
            watch.add(obj)

    def _touched(self, touch: Touch, robot: int, other: int) -> None:
        self._contacts[touch] += 1
        if touch is Touch.ROBOT_ITEM:
            self._pusher[self._item_names[other - len(self._names)]] = self._names[robot]

    def _place(self, robots: Mapping[str, Any], items: Mapping[str, Any]) -> None:
        """Bring the discs to where a state has them."""
        drives = self._drives
        for robot, n in self._robots.items():
            saved = robots[robot]
            drives.top[n], drives.wanted[n], drives.facing[n] = saved["max_speed"], saved["wanted"], saved["facing"]
            self._at[n], self._velocity[n] = saved["pose"], saved["velocity"]
            if self._custody.present(robot):
                self._physics.enter(n, Pose(*saved["pose"]), saved["velocity"])
        for obj, n in self._items.items():
            carrier, saved = self._custody.carrier(obj), items[obj]
            self._pusher[obj], self._at[n], self._velocity[n] = saved["pusher"], saved["pose"], saved["velocity"]
            if carrier is None and not self._custody.gone(obj):
                self._physics.enter(n, Pose(*saved["pose"]), saved["velocity"])
            elif carrier is not None and self._custody.present(carrier):
                self._hook(carrier, obj)
                self._physics.put(n, Pose(*saved["pose"]), saved["velocity"])

    def _hook(self, robot: RobotId, obj: ObjectId) -> None:
        """Bring an item to its seat on its robot and hang it there."""
        slot, on = self._items[obj], self._robots[robot]
        angle = math.tau * (self._custody.seat(robot, obj) % SEATS) / SEATS
        ring = max(0.0, self._discs[on].radius - self._discs[slot].radius - GAP)
        self._physics.hang(slot, on, (ring * math.cos(angle), ring * math.sin(angle)))
        self._weigh(robot)

    def _free(self, robot: RobotId, obj: ObjectId) -> None:
        self._custody.check_present(robot)
        self._custody.free(robot, obj)
        self._physics.unhang(self._items[obj])
        self._weigh(robot)

    def _weigh(self, robot: RobotId) -> None:
        """Give a robot the force to move its load as fast as itself: journeys take what the map says."""
        load = sum(self._discs[self._items[obj]].mass for obj in self.carried(robot))
        self._drives.mass[self._robots[robot]] = ROBOT_MASS + load


def _pose(row: Sequence[float]) -> Pose:
    return Pose(row[0], row[1], math.remainder(row[2], math.tau))


def _pair(row: Sequence[float]) -> tuple[float, float]:
    return (row[0], row[1])
