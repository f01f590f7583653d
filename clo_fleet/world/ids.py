"""The names of things, one type a kind, and points."""

from typing import NewType

__all__ = ["CorridorId", "DoorId", "ObjectId", "PlaceId", "Point", "RobotId", "RoomId"]

Point = tuple[float, float]  # [m]
PlaceId = NewType("PlaceId", str)
RoomId = NewType("RoomId", str)
DoorId = NewType("DoorId", str)
CorridorId = NewType("CorridorId", str)
ObjectId = NewType("ObjectId", str)
RobotId = NewType("RobotId", str)
