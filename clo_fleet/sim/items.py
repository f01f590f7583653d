"""The objects of a building: in which room each lies, and how it leaves and comes back otherwise than in a hand.

A doorway belongs to its room for whatever lies there: an object is never in the corridors but in a hand. What lies in
which room is noted once a tick, for the many who ask.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from clo_fleet.sim.premises import Premises
from clo_fleet.sim.rooms import Rooms
from clo_fleet.world.model import ObjectId, ObjectSpec, PlaceId, Point, RobotId, RoomId

__all__ = ["Items"]


class Items:
    """Where the objects are; their bodies are in ``rooms``.

    Attributes:
        ids: of all objects, sorted.
        lying: those that lay in each room when that was last noted, sorted.
    """

    def __init__(self, rooms: Rooms, premises: Premises, specs: Iterable[ObjectSpec]) -> None:
        self._rooms, self._premises = rooms, premises
        specs = sorted(specs, key=lambda spec: spec.id)
        self.ids = tuple(spec.id for spec in specs)
        self._radius = {spec.id: spec.radius for spec in specs}
        self._place = {spec.id: (spec.position, spec.room) for spec in specs}  # where it lay, last time somebody asked
        self.lying: dict[RoomId, list[ObjectId]] = {}
        self._noted: dict[ObjectId, PlaceId | None] = {}
        self._stirred = rooms.watch()

    def radius(self, item: ObjectId) -> float:
        """The object's radius [m]."""
        return self._radius[item]

    def place(self, item: ObjectId) -> PlaceId | None:
        """The room in which an object lies, at this moment; ``None`` while it is carried, or gone."""
        if self._rooms.carrier(item) is not None or self._rooms.gone(item):
            return None
        position = self._rooms.item_position(item)
        assert position is not None, "what nobody carries is in a room"
        noted, room = self._place[item]
        if position != noted:
            room = self._premises.room_around(position, room)
            self._place[item] = (position, room)
        return PlaceId(room)

    def lying_in(self, room: RoomId) -> tuple[ObjectId, ...]:
        """The objects that lie in the room since the last step, sorted."""
        here, rooms = self.lying.get(room, ()), self._rooms
        return tuple(item for item in here if rooms.carrier(item) is None and not rooms.gone(item))

    def note(self) -> None:
        """Note what lies where, after a step; linear in the objects only if one has come into another room."""
        now = {item: self.place(item) for item in self._stirred}
        self._stirred.clear()
        if all(item in self._noted and self._noted[item] == place for item, place in now.items()):
            return
        self._noted |= now
        self.lying = {}
        for item in self.ids:
            if (place := self._noted[item]) is not None:
                self.lying.setdefault(RoomId(place), []).append(item)

    def take_away(self, item: ObjectId) -> None:
        """Take an object that lies free out of the building."""
        self.place(item)  # notes where it lay
        self._rooms.take_away(item)

    def bring_back(self, item: ObjectId, position: Point | None) -> Point:
        """Put an object that is gone where it is free about ``position`` [m], or where it lay; returns the place."""
        lay, room = self._place[item]
        if position is None:
            position = self._rooms.free_spot(lay, self._radius[item], room) or lay
        self._rooms.bring_back(item, position)
        return position

    def drop(self, item: ObjectId, carrier: RobotId, room: RoomId) -> Point | None:
        """Let an object slip out of its carrier's hand, beside it on that room's floor; ``None``: there is no space."""
        pose = self._rooms.pose(carrier)
        assert pose is not None, "who stands on a floor is in the rooms"
        spot = self._rooms.free_spot(pose.point, self._radius[item], room)
        if spot is not None:
            self._rooms.release(carrier, item, spot)
        return spot

    def state(self) -> dict[str, Any]:
        """Where each object lay, as plain data."""
        return {item: [list(at), room] for item, (at, room) in self._place.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._place = {ObjectId(item): ((at[0], at[1]), room) for item, (at, room) in state.items()}
