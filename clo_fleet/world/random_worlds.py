"""Random worlds: robots and objects somewhere in a building, with goals in which robots can help each other.

Every object has a fate: to be delivered to a room, to be held by a robot, or to be prepared. Whoever wants the fate has
it as a goal, and often a second robot wants the same, or wants the object prepared on the way there: so what one does
spares the other some steps. Some robots also want to be in a room in the end. No goal undoes another.

The same building, numbers and seed always give the same world.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from clo_fleet.clo.task import Fact
from clo_fleet.errors import CloFleetError
from clo_fleet.world.chance import uniform
from clo_fleet.world.free_spots import free_spots
from clo_fleet.world.model import BuildingMap, ObjectId, ObjectSpec, Pose, RobotId, RobotSpec, RoomId, World
from clo_fleet.world.places import round_trips

__all__ = ["CrowdedError", "random_world"]

T = TypeVar("T")

SHARED = 0.6  # the chance that a second robot wants what one wants
SOMEWHERE = 0.25  # the chance that a robot also wants to be in some room
FULL = 0.8  # the share of a room's places that are taken at most, so that robots can get through; but always one
UNTIL = 1800.0  # [s]


class CrowdedError(CloFleetError):
    """A building has no place for so many, or they cannot be so few.

    Attributes:
        what: robots, or robots and objects.
        number: as asked for.
        lowest, highest: how many there may be.
    """

    def __init__(self, what: str, number: int, lowest: int, highest: int) -> None:
        super().__init__(what, number, lowest, highest)
        self.what, self.number, self.lowest, self.highest = what, number, lowest, highest

    def __str__(self) -> str:
        return f"{self.what}: got {self.number}, expected {self.lowest} to {self.highest} in this building"


def random_world(building: BuildingMap, *, robots: int, objects: int, seed: int, name: str | None = None) -> World:
    """A sound world on the building, in which every goal can be reached.

    Robots ``r1``, ``r2``, ... and objects ``o1``, ``o2``, ... are in rooms between which robots can go to and fro.

    Args:
        building: the map; its spawn points are taken first.
        robots: at least 1.
        objects: at least 0.
        seed: also the world's own.
        name: by default the building's with the numbers.

    Raises:
        CrowdedError: if the building has no place for so many.
    """
    spots = free_spots(building)
    rooms = max(round_trips(building), key=lambda part: (sum(len(spots[room]) for room in part), sorted(part)))
    lot = _Lot(seed, sorted(rooms), {room: list(spots[room]) for room in sorted(rooms)})
    room_for = sum(lot.room_for.values())
    if not 1 <= robots <= room_for:
        raise CrowdedError("robots", robots, 1, room_for)
    if not 0 <= objects <= room_for - robots:
        raise CrowdedError("objects", objects, 0, room_for - robots)
    stands = {RobotId(f"r{number}"): lot.place(f"r{number}") for number in range(1, robots + 1)}
    lies = {ObjectId(f"o{number}"): lot.place(f"o{number}") for number in range(1, objects + 1)}
    goals = _goals(lot, list(stands), {item: room for item, (room, _) in lies.items()})
    return World(
        name=name or f"{building.name}-{robots}-{objects}-{seed}",
        map=building,
        robots=tuple(
            RobotSpec(id=robot, room=room, pose=pose, goals=tuple(goals[robot]))
            for robot, (room, pose) in stands.items()
        ),
        objects=tuple(ObjectSpec(id=item, room=room, position=pose.point) for item, (room, pose) in lies.items()),
        seed=seed,
        until=UNTIL,
    )


@dataclass(slots=True)
class _Lot:
    """Draws: rooms, places that are still free, and whatever else there is to choose from."""

    seed: int
    rooms: list[RoomId]
    free: dict[RoomId, list[Pose]]
    room_for: dict[RoomId, int] = field(init=False)

    def __post_init__(self) -> None:
        self.room_for = {room: min(len(poses), max(1, int(len(poses) * FULL))) for room, poses in self.free.items()}

    def one(self, what: str, choices: Sequence[T]) -> T:
        """One of the choices."""
        return choices[int(uniform(self.seed, f"world/{what}") * len(choices))]

    def chance(self, what: str, share: float) -> bool:
        """Whether something happens that happens in such a share of worlds."""
        return uniform(self.seed, f"world/{what}") < share

    def place(self, name: str) -> tuple[RoomId, Pose]:
        """A free place in a room that is not full, which it no longer is then."""
        room = self.one(f"{name}/room", [room for room in self.rooms if self.room_for[room]])
        self.room_for[room] -= 1
        pose = self.one(f"{name}/pose", self.free[room])
        self.free[room].remove(pose)
        return room, pose


def _goals(lot: _Lot, robots: list[RobotId], lies: dict[ObjectId, RoomId]) -> dict[RobotId, list[Fact]]:
    """What each robot wants: the fates of the objects dealt out in turn, and places to be in the end."""
    goals: dict[RobotId, list[Fact]] = defaultdict(list)
    for number, (item, home) in enumerate(lies.items()):
        owner = robots[number % len(robots)]
        others = [robot for robot in robots if robot != owner]
        elsewhere = [room for room in lot.rooms if room != home] or [home]
        fates: list[Fact] = [
            ("at-object", item, lot.one(f"{item}/to", elsewhere)),
            ("holding", owner, item),
            ("prepared", item),
        ]
        fate = lot.one(f"{item}/fate", fates)
        goals[owner].append(fate)
        if others and lot.chance(f"{item}/shared", SHARED):
            wish = lot.one(f"{item}/wish", [fate, ("prepared", item)])
            goals[lot.one(f"{item}/partner", others)].append(wish)
    for robot in robots:
        if not goals[robot] or lot.chance(f"{robot}/somewhere", SOMEWHERE):
            goals[robot].append(("at-robot", robot, lot.one(f"{robot}/in", lot.rooms)))
    return goals
