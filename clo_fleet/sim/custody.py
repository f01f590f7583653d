"""Who is in the rooms and who carries what: the books that the physics of the rooms keeps to.

An item lies free, is carried, each on a numbered seat of one robot, or is gone, taken out of the building; a robot is
present in the rooms or away in a corridor, and what it carries is where it is. Every question and change checks its ids
first, so that misuse raises before anything has changed.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from clo_fleet.errors import CloFleetError
from clo_fleet.world.model import ObjectId, RobotId

__all__ = ["CarrierError", "Custody", "PresenceError", "RoomsError", "UnknownBodyError"]


class RoomsError(CloFleetError):
    """Something that cannot be done in the rooms."""


class UnknownBodyError(RoomsError):
    """No robot, or no object, has this id.

    Attributes:
        body: the id as given.
    """

    def __init__(self, kind: str, body: str) -> None:
        super().__init__(f"there is no {kind} {body!r}")
        self.body = body


class PresenceError(RoomsError):
    """A robot is in the rooms where it should be in a corridor, or the other way round.

    Attributes:
        robot: its id.
        present: whether it is in the rooms.
    """

    def __init__(self, robot: RobotId, present: bool) -> None:
        super().__init__(f"robot {robot!r} is {'already' if present else 'not'} in the rooms")
        self.robot = robot
        self.present = present


class CarrierError(RoomsError):
    """An object is carried or gone that should lie free, or is not carried by the robot that was named.

    Attributes:
        obj: its id.
        carrier: who has it; ``None``: nobody.
    """

    def __init__(self, obj: ObjectId, carrier: RobotId | None) -> None:
        super().__init__(f"object {obj!r} is carried by {'nobody' if carrier is None else repr(carrier)}")
        self.obj = obj
        self.carrier = carrier


class Custody:
    """Presence of robots and custody of objects; at first all robots are away and all objects free."""

    def __init__(self, robots: Iterable[RobotId], objects: Iterable[ObjectId]) -> None:
        self._cargo: dict[RobotId, dict[ObjectId, int]] = {robot: {} for robot in robots}  # object -> seat
        self._carrier: dict[ObjectId, RobotId | None] = dict.fromkeys(objects)
        self._present: set[RobotId] = set()
        self._gone: set[ObjectId] = set()

    def check_robot(self, robot: RobotId) -> None:
        """Raise ``UnknownBodyError`` unless there is such a robot."""
        if robot not in self._cargo:
            raise UnknownBodyError("robot", robot)

    def check_present(self, robot: RobotId, present: bool = True) -> None:
        """Raise ``PresenceError`` unless the robot is in the rooms, or away."""
        if self.present(robot) is not present:
            raise PresenceError(robot, not present)

    def check_carrier(self, obj: ObjectId, carrier: RobotId | None) -> None:
        """Raise ``CarrierError`` unless this robot has the object, or nobody."""
        if self.carrier(obj) != carrier or self.gone(obj):
            raise CarrierError(obj, self.carrier(obj))

    def present(self, robot: RobotId) -> bool:
        """Whether a robot is in the rooms."""
        self.check_robot(robot)
        return robot in self._present

    def here(self) -> list[RobotId]:
        """Who is in the rooms, in the order in which the books were opened."""
        return [robot for robot in self._cargo if robot in self._present]

    def carrier(self, obj: ObjectId) -> RobotId | None:
        """Who has an object; ``None``: nobody."""
        if obj not in self._carrier:
            raise UnknownBodyError("object", obj)
        return self._carrier[obj]

    def gone(self, obj: ObjectId) -> bool:
        """Whether an object has been taken out of the building."""
        return obj in self._gone

    def take_away(self, obj: ObjectId) -> None:
        """Book a free object as gone."""
        self.check_carrier(obj, None)
        self._gone.add(obj)

    def bring_back(self, obj: ObjectId) -> None:
        """Book an object that is gone as free again."""
        if not self.gone(obj):
            raise CarrierError(obj, self.carrier(obj))
        self._gone.remove(obj)

    def carried(self, robot: RobotId) -> tuple[ObjectId, ...]:
        """What a robot has, in the order of ids."""
        self.check_robot(robot)
        return tuple(sorted(self._cargo[robot]))

    def seat(self, robot: RobotId, obj: ObjectId) -> int:
        """The seat of an object that the robot has."""
        return self._cargo[robot][obj]

    def enter(self, robot: RobotId) -> None:
        """Book a robot as present."""
        self.check_present(robot, False)
        self._present.add(robot)

    def leave(self, robot: RobotId) -> None:
        """Book a robot as away."""
        self.check_present(robot)
        self._present.remove(robot)

    def take(self, robot: RobotId, obj: ObjectId) -> None:
        """Book a free object onto the first free seat of a robot."""
        self.check_robot(robot)
        self.check_carrier(obj, None)
        cargo = self._cargo[robot]
        used = set(cargo.values())
        cargo[obj] = next(seat for seat in range(len(used) + 1) if seat not in used)
        self._carrier[obj] = robot

    def free(self, robot: RobotId, obj: ObjectId) -> None:
        """Book an object off the robot that has it."""
        self.check_robot(robot)
        self.check_carrier(obj, robot)
        del self._cargo[robot][obj]
        self._carrier[obj] = None

    def state(self) -> dict[str, Any]:
        """The books as plain data."""
        cargo = {robot: dict(sorted(cargo.items())) for robot, cargo in self._cargo.items() if cargo}
        return {"present": sorted(self._present), "cargo": cargo, "gone": sorted(self._gone)}

    @classmethod
    def from_state(cls, robots: Iterable[RobotId], objects: Iterable[ObjectId], state: Mapping[str, Any]) -> "Custody":
        """The books as ``state()`` returned them."""
        custody = cls(robots, objects)
        custody._present.update(state["present"])
        custody._gone.update(state["gone"])
        for robot, cargo in state["cargo"].items():
            custody._cargo[robot].update(cargo)
            custody._carrier.update(dict.fromkeys(cargo, robot))
        return custody
