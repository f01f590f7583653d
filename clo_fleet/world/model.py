"""The setting: what a building, its objects and its robots are. Values only; SI units and radians.

A *place* is a room or a zone. A *zone* is a maximal network of corridors between doors; a robot plans
from room to room, and is at a zone only while it travels. Coordinates are metres in the building's
frame, x to the right, y up; headings are counter-clockwise from the x axis.
"""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from clo_fleet.clo.task import Fact
from clo_fleet.world.binding import DomainBinding
from clo_fleet.world.disturbances import NO_FAULTS, Disturbance, RandomFaults
from clo_fleet.world.ids import CorridorId, DoorId, ObjectId, PlaceId, Point, RobotId, RoomId

__all__ = [
    "BuildingMap",
    "Corridor",
    "CorridorId",
    "Door",
    "DoorId",
    "Junction",
    "ObjectId",
    "ObjectSpec",
    "Perception",
    "PerceptionMode",
    "PlaceId",
    "PlanningTime",
    "Point",
    "Pose",
    "Radio",
    "RobotId",
    "RobotSpec",
    "Room",
    "RoomId",
    "SkillSettings",
    "SpawnPoint",
    "World",
]


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a body's centre is [m] and where it looks [rad]."""

    x: float
    y: float
    heading: float = 0.0

    @property
    def point(self) -> Point:
        """The position alone [m]."""
        return (self.x, self.y)


@dataclass(frozen=True, slots=True)
class Room:
    """A room: a simple polygon, counter-clockwise [m], with polygonal obstacles inside [m]."""

    id: RoomId
    outline: tuple[Point, ...]
    obstacles: tuple[tuple[Point, ...], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """An opening in a room's wall, onto a corridor network or into a second room.

    Attributes:
        id: its name; also the id of its node in the corridor network.
        rooms: one room (the other side is corridors) or two.
        position: the middle of the opening, on the wall [m].
        heading: the direction through the door out of ``rooms[0]`` [rad], square to the wall.
        width: clear width [m].
    """

    id: DoorId
    rooms: tuple[RoomId, ...]
    position: Point
    heading: float
    width: float


@dataclass(frozen=True, slots=True)
class Junction:
    """A point where corridors meet, or where one ends [m]."""

    id: str
    position: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class Corridor:
    """A piece of corridor from one node (a junction's or a door's id) to another.

    Attributes:
        shape: its centre line, both ends included [m].
        max_speed: [m/s].
        one_way: only from ``start`` to ``end``; otherwise a lane for each direction, side by side.
        single_lane: one lane for both directions, by turns; never together with ``one_way``.
    """

    id: CorridorId
    start: str
    end: str
    shape: tuple[Point, ...]
    max_speed: float = 1.5
    one_way: bool = False
    single_lane: bool = False


@dataclass(frozen=True, slots=True)
class SpawnPoint:
    """A named place in a room where a robot may start or an object may lie."""

    id: str
    room: RoomId
    pose: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildingMap:
    """A building. ``network`` is the SUMO network built from its corridors, ``None`` without corridors."""

    name: str
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    junctions: tuple[Junction, ...] = ()
    corridors: tuple[Corridor, ...] = ()
    spawn_points: tuple[SpawnPoint, ...] = ()
    network: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSpec:
    """A robot: a disc with a limit on speed and acceleration, and what it is to bring about."""

    id: RobotId
    room: RoomId
    pose: Pose
    goals: tuple[Fact, ...]
    radius: float = 0.3
    max_speed: float = 1.0
    max_acceleration: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectSpec:
    """An object to handle: a small disc that can be pushed, prepared, carried and put down."""

    id: ObjectId
    room: RoomId
    position: Point
    prepared: bool = False
    radius: float = 0.12
    mass: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillSettings:
    """How long the skills take and how far they reach.

    Attributes:
        prepare, grasp, place, give: durations [s].
        reach: largest distance from the robot's rim to the object's centre [m].
        partner_wait: how long a giver waits for its partner [s].
        spread: each duration is drawn within +-``spread`` of its value, as a fraction.
        speed_spread: each robot's top speed is drawn so, once a run.
    """

    prepare: float = 4.0
    grasp: float = 2.0
    place: float = 2.0
    give: float = 2.0
    reach: float = 0.6
    partner_wait: float = 60.0
    spread: float = 0.0
    speed_spread: float = 0.0


class PerceptionMode(Enum):
    """What a robot's senses reach."""

    WATCH = "watch"  # of what is in sight, only what its plan hangs on
    SIGHT = "sight"  # its own room, within range and line of sight
    FULL = "full"  # everything, everywhere


@dataclass(frozen=True, slots=True)
class Perception:
    """How robots sense: the mode, the range of sight [m], and what it takes to look at one fact [s]."""

    mode: PerceptionMode = PerceptionMode.SIGHT
    range: float = 20.0
    look: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Radio:
    """What robots tell each other: facts, and what they mean to do.

    Their first plans all robots know; from then on announcements are messages like others. Where messages can be
    lost, a robot says again now and then what it means to do, has in hand and has done.

    Attributes:
        facts: whether seen facts are passed on to robots that watch them.
        range: how far a message reaches [m]; ``None``: everywhere.
        delay: time from telling to hearing [s].
        loss: chance that a message is lost, from 0 to 1.
        repeat: how often a robot repeats itself where messages can be lost [s].
        promise: what was promised and not heard of again for so long counts no more [s].
    """

    facts: bool = True
    range: float | None = None
    delay: float = 0.0
    loss: float = 0.0
    repeat: float = 5.0
    promise: float = 20.0

    @property
    def reliable(self) -> bool:
        """Whether every message arrives."""
        return self.range is None and self.loss == 0.0

    @property
    def perfect(self) -> bool:
        """Whether every message arrives at once."""
        return self.reliable and self.delay == 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningTime:
    """How much simulated time a call of the planner takes, the planner's own limits, and what to do without a plan.

    Attributes:
        fixed: [s] for each call.
        per_expansion: [s] for each node that the planner expands.
        wall_limit: real seconds after which the call counts as out of time (a safety net).
        memory_limit: bytes that the planner may use.
        partly: whether a robot works for those goals that are within reach while there is no plan to all of them.
    """

    fixed: float = 0.0
    per_expansion: float = 0.0
    wall_limit: float = 60.0
    memory_limit: int = 2 << 30
    partly: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A map with everything that happens on it.

    Attributes:
        until: the longest a run may last [s].
        domain: the world's own domain, bound to skills and sensors; ``None``: the fleet's.
    """

    name: str
    map: BuildingMap
    robots: tuple[RobotSpec, ...]
    objects: tuple[ObjectSpec, ...]
    domain: DomainBinding | None = None
    seed: int = 0
    until: float = 900.0
    skills: SkillSettings = SkillSettings()
    perception: Perception = Perception()
    radio: Radio = Radio()
    planning: PlanningTime = PlanningTime()
    disturbances: tuple[Disturbance, ...] = ()
    faults: RandomFaults = NO_FAULTS
    expected: tuple[tuple[str, str], ...] = ()
