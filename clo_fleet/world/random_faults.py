"""Random faults: drawn before a run from its seed, so that what happens is a list, the same for every strategy.

Times come as in a Poisson process. What lasts does not befall twice at the same time whom it has befallen already: such
a draw is left out. Whether an object can be moved at that moment only the run can tell.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from clo_fleet.world import disturbances as made
from clo_fleet.world.chance import uniform
from clo_fleet.world.disturbances import Disturbance, FaultRate, subject_of
from clo_fleet.world.ids import CorridorId, DoorId, ObjectId, Point, RobotId
from clo_fleet.world.model import Room, World
from clo_fleet.world.outlines import clearance

__all__ = ["schedule"]

SHORTEST_GAP = 1e-6  # [s] between two faults of a kind: the logarithm of 1 is 0
TRIES = 100  # points drawn in the square round a room until one is free
FREE = 0.1  # [m] between the rim of an object that was moved and a wall, at least

_OF_ROBOT: Mapping[str, Callable[[float, RobotId], Disturbance]] = MappingProxyType(
    {
        "robot_broken": made.RobotBroken,
        "sensor_blinded": made.SensorBlinded,
        "radio_lost": made.RadioLost,
        "planner_killed": made.PlannerKilled,
    }
)
_END_OF_ROBOT: Mapping[str, Callable[[float, RobotId], Disturbance]] = MappingProxyType(
    {
        "robot_slowed": made.RobotRecovered,
        "robot_broken": made.RobotRepaired,
        "sensor_blinded": made.SensorRestored,
        "radio_lost": made.RadioRestored,
    }
)


def schedule(world: World) -> tuple[Disturbance, ...]:
    """All that is to befall the fleet, the random faults drawn, in the order of time."""
    drawn = [fault for rate in world.faults.rates for fault in _drawn(world, rate)]
    return tuple(sorted((*world.disturbances, *drawn), key=lambda disturbance: disturbance.time))


def _drawn(world: World, rate: FaultRate) -> Iterator[Disturbance]:
    """The faults of one kind, with what ends them."""
    seed = world.seed if world.faults.seed is None else world.faults.seed
    time, number = 0.0, 0
    busy: dict[str, float] = {}
    while True:
        number += 1
        dice = _Dice(seed, f"faults/{rate.kind}/{number}")
        time += max(SHORTEST_GAP, -math.log(1.0 - dice("gap")) * 3600.0 / rate.per_hour)
        if time >= world.until:
            return
        begins = round(time, 3)
        ends = math.inf if rate.lasts is None else round(begins + dice.between("lasts", *rate.lasts), 3)
        pair = _fault(world, rate, begins, ends, dice)
        if pair is None or busy.get(subject_of(pair[0]), -1.0) >= begins:
            continue
        if rate.lasts is not None:
            busy[subject_of(pair[0])] = ends
        yield from pair


class _Dice:
    """Numbers for one fault."""

    def __init__(self, seed: int, what: str) -> None:
        self._seed, self._what = seed, what

    def __call__(self, part: str) -> float:
        return uniform(self._seed, f"{self._what}/{part}")

    def between(self, part: str, low: float, high: float) -> float:
        return low + (high - low) * self(part)

    def one_of(self, part: str, names: list[str]) -> str | None:
        return sorted(names)[int(self(part) * len(names))] if names else None


def _fault(world: World, rate: FaultRate, begins: float, ends: float, dice: _Dice) -> tuple[Disturbance, ...] | None:
    """One fault, and its end if it lasts; ``None`` if there is nothing that it could befall."""
    kind = rate.kind
    if kind.startswith("door"):
        name = dice.one_of("door", [door.id for door in world.map.doors])
        return None if name is None else (made.DoorClosed(begins, DoorId(name)), made.DoorOpened(ends, DoorId(name)))
    if kind.startswith("corridor"):
        name = dice.one_of("corridor", [corridor.id for corridor in world.map.corridors])
        if name is None:
            return None
        corridor = CorridorId(name)
        return made.CorridorClosed(begins, corridor), made.CorridorOpened(ends, corridor)
    if kind.startswith("object"):
        name = dice.one_of("object", [spec.id for spec in world.objects])
        return None if name is None else _of_object(world, kind, begins, ends, ObjectId(name), dice)
    name = dice.one_of("robot", [spec.id for spec in world.robots])
    return None if name is None else _of_robot(world, rate, begins, ends, RobotId(name))


def _of_object(
    world: World, kind: str, begins: float, ends: float, item: ObjectId, dice: _Dice
) -> tuple[Disturbance, ...] | None:
    if kind == "object_prepared":
        return (made.ObjectPrepared(begins, item),)
    if kind == "object_dropped":
        return (made.ObjectDropped(begins, item),)
    if kind == "object_taken":
        return made.ObjectTaken(begins, item), made.ObjectReturned(ends, item)
    name = dice.one_of("room", [room.id for room in world.map.rooms])
    room = next(room for room in world.map.rooms if room.id == name)
    radius = next(spec.radius for spec in world.objects if spec.id == item)
    point = _point(room, radius + FREE, dice)
    return None if point is None else (made.ObjectMoved(begins, item, point),)


def _of_robot(world: World, rate: FaultRate, begins: float, ends: float, robot: RobotId) -> tuple[Disturbance, ...]:
    match rate.kind:
        case "skill_fails":
            return (made.SkillFails(time=begins, skill=rate.skill, robot=robot),)
        case "planner_slowed":
            return made.PlannerSlowed(begins, robot, rate.amount), made.PlannerRecovered(ends, robot)
        case "robot_slowed":
            top = next(spec.max_speed for spec in world.robots if spec.id == robot)
            first: Disturbance = made.RobotSlowed(begins, robot, round(rate.amount * top, 3))
        case kind:
            first = _OF_ROBOT[kind](begins, robot)
    over = _END_OF_ROBOT.get(rate.kind)
    return (first,) if over is None else (first, over(ends, robot))


def _point(room: Room, margin: float, dice: _Dice) -> Point | None:
    """A point of the room, so far from its walls and obstacles [m]; ``None`` if the room is too narrow to find one."""
    xs, ys = zip(*room.outline, strict=True)
    for number in range(TRIES):
        x = round(dice.between(f"x{number}", min(xs), max(xs)), 2)
        y = round(dice.between(f"y{number}", min(ys), max(ys)), 2)
        if clearance(room, (x, y)) >= margin:
            return (x, y)
    return None
