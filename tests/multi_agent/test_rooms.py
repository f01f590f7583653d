"""Rooms full of robots: all arrive in good time, and what they touch is counted by physics and told."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import pytest

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Action
from clo_fleet.fleet.offers import Offers
from clo_fleet.robot.apart import keep_apart
from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.robot.drive import Drive
from clo_fleet.robot.skill import Body, Done, Under
from clo_fleet.robot.steering import Steering, along_walls
from clo_fleet.sim.doors import is_wide
from clo_fleet.sim.rooms import Contacts
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.study.event_log import EventLog
from clo_fleet.world.model import (
    BuildingMap,
    Door,
    DoorId,
    ObjectId,
    ObjectSpec,
    PlaceId,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    SkillSettings,
    World,
)
from clo_fleet.world.vocabulary import vocabulary

TICK = 0.2
NEAR = 0.3  # [m] so near to its target a robot has arrived
HALL, OTHER = RoomId("hall"), RoomId("other")
MOVE = Action(schema="move", args=(), needs=(), adds=frozenset(), deletes=frozenset())


def rectangle(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    """A rectangle's corners from its lower left one."""
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))


def hall(width: float, height: float, *obstacles: tuple[Point, ...]) -> BuildingMap:
    """One room."""
    return BuildingMap(name="hall", rooms=(Room(HALL, rectangle(0, 0, width, height), obstacles),), doors=())


def two_halls(door: float) -> BuildingMap:
    """Two rooms of 8 m x 8 m with one door between them."""
    rooms = (Room(HALL, rectangle(0, 0, 8, 8)), Room(OTHER, rectangle(8, 0, 8, 8)))
    between = Door(id=DoorId("between"), rooms=(HALL, OTHER), position=(8, 4), heading=0.0, width=door)
    return BuildingMap(name="two halls", rooms=rooms, doors=(between,))


@dataclass(slots=True)
class Crowd:
    """Robots in rooms, each with a place to go to, or a room; who has arrived stands aside."""

    building: BuildingMap
    starts: Sequence[tuple[RoomId, Point]]
    targets: Mapping[int, Point] = field(default_factory=dict)
    rooms: Mapping[int, RoomId] = field(default_factory=dict)
    things: Sequence[Point] = ()
    time: float = 0.0

    site: Site = field(init=False)
    truth: Truth = field(init=False)
    specs: list[RobotSpec] = field(init=False)
    arrived: dict[RobotId, float] = field(default_factory=dict)
    steering: dict[RobotId, Steering] = field(default_factory=dict)
    drives: dict[RobotId, Drive] = field(default_factory=dict)
    aside: dict[RobotId, StandAside] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.specs = [
            RobotSpec(id=RobotId(f"r{n:02}"), room=room, pose=Pose(*at), goals=())
            for n, (room, at) in enumerate(self.starts)
        ]
        things = [ObjectSpec(id=ObjectId(f"o{n:02}"), room=HALL, position=at) for n, at in enumerate(self.things)]
        self.site = Site(self.building, self.specs, things, seed=0, tick=TICK)
        world = World(name="crowd", map=self.building, robots=tuple(self.specs), objects=tuple(things))
        self.truth = Truth(self.site, vocabulary(world))
        self.drives = {self.specs[n].id: Drive(self.specs[n].room, room) for n, room in self.rooms.items()}

    def want(self, number: int, spec: RobotSpec) -> Under:
        """What a robot wants in this tick."""
        if spec.id in self.drives and spec.id not in self.arrived:
            progress = self.drives[spec.id].step(self.body(spec))
            if isinstance(progress, Under):
                return progress
            assert isinstance(progress, Done)
            self.arrived[spec.id] = self.time
        if number in self.targets:
            steering = self.steering.setdefault(spec.id, Steering())
            velocity = steering.velocity(self.site, spec, spec.room, self.targets[number], self.time)
            if math.dist(self.site.pose(spec.id).point, self.targets[number]) < NEAR:
                self.arrived.setdefault(spec.id, self.time)
            return Under(velocity, direct=steering.pushes)
        return self.aside.setdefault(spec.id, StandAside()).step(self.site, spec, self.time)

    def body(self, spec: RobotSpec) -> Body:
        """What a robot's skill works with."""
        return Body(
            spec=spec,
            site=self.site,
            truth=self.truth,
            exchange=Offers(EventLog()),
            settings=SkillSettings(),
            time=self.time,
            cause=Cause(spec.id, "move", 0),
            action=MOVE,
        )

    def step(self) -> None:
        """One tick: wishes, avoidance, physics."""
        self.time = round(self.time + TICK, 3)
        wanted = [self.want(number, spec) for number, spec in enumerate(self.specs)]
        agents = [
            Agent(
                id=spec.id,
                position=self.site.pose(spec.id).point,
                velocity=self.site.rooms.velocity(spec.id) or (0.0, 0.0),
                preferred=under.velocity,
                group=str(self.site.floor(spec.id)),
            )
            for spec, under in zip(self.specs, wanted, strict=True)
        ]
        steered = Avoidance().velocities(agents)
        free = [under.velocity if under.direct else velocity for under, velocity in zip(wanted, steered, strict=True)]
        for spec, under, velocity in zip(self.specs, wanted, keep_apart(agents, free, TICK), strict=True):
            self.site.rooms.drive(spec.id, velocity if under.direct else along_walls(self.site, spec, velocity))
        self.site.step()

    def until_arrived(self, limit: float) -> float:
        """Go on until all have arrived [s]; fails after ``limit``."""
        busy = {*(self.specs[n].id for n in self.targets), *self.drives}
        while not busy <= self.arrived.keys():
            assert self.time < limit, f"{sorted(busy - self.arrived.keys())} have not arrived after {limit} s"
            self.step()
        return self.time

    @property
    def contacts(self) -> Contacts:
        """What has touched so far."""
        return self.site.rooms.contacts()


def rows(n: int) -> tuple[list[tuple[RoomId, Point]], dict[int, Point]]:
    """Robots in two rows along opposite walls of a hall of 12 m, each to the place opposite."""
    starts = [(1.0 if k % 2 == 0 else 11.0, 12.0 * (k // 2 + 0.5) / (n // 2)) for k in range(n)]
    return [(HALL, start) for start in starts], {k: (12.0 - x, y) for k, (x, y) in enumerate(starts)}


def circle(n: int) -> tuple[list[tuple[RoomId, Point]], dict[int, Point]]:
    """Robots on a circle in a hall of 12 m, each to the place opposite: where plain ORCA comes to a standstill."""
    turns = [math.tau * k / n for k in range(n)]
    starts = [(6.0 + 5.0 * math.cos(turn), 6.0 + 5.0 * math.sin(turn)) for turn in turns]
    return [(HALL, start) for start in starts], {k: (12.0 - x, 12.0 - y) for k, (x, y) in enumerate(starts)}


def streams(n: int) -> tuple[list[tuple[RoomId, Point]], dict[int, RoomId]]:
    """Robots in two rooms, half in each, all to the other room."""
    starts: list[tuple[RoomId, Point]] = []
    for k in range(n):
        x, y = 1.0 + 1.3 * (k // 2 % 4), 1.0 + 1.5 * (k // 8)
        starts.append((OTHER, (16.0 - x, 8.0 - y)) if k % 2 else (HALL, (x, y)))
    return starts, {k: HALL if k % 2 else OTHER for k in range(n)}


def test_twenty_robots_swap_sides_of_a_room_without_a_touch() -> None:
    """With paths, avoidance and physics: all are across in half a minute, and touch neither each other nor a wall."""
    starts, targets = rows(20)
    crowd = Crowd(hall(12, 12), starts, targets)
    assert crowd.until_arrived(30.0) > 10.0
    assert crowd.contacts == Contacts()


@pytest.mark.parametrize("n", [8, 12, 16])
def test_a_circle_changes_sides_without_a_touch(n: int) -> None:
    """Who is held up goes to the right, as in a roundabout; 10 m take under half a minute."""
    starts, targets = circle(n)
    crowd = Crowd(hall(12, 12), starts, targets)
    crowd.until_arrived(30.0)
    assert crowd.contacts == Contacts()


FURNITURE = (rectangle(4, 2, 1, 2), rectangle(7, 7, 1, 3), rectangle(5, 5, 2, 1))


@pytest.mark.parametrize(
    ("starts", "furniture"),
    [(circle(12), (rectangle(5.5, 5.5, 1, 1),)), (rows(12), FURNITURE)],
    ids=["a pillar in the middle of a circle", "tables between two rows"],
)
def test_furniture_is_gone_round(
    starts: tuple[list[tuple[RoomId, Point]], dict[int, Point]], furniture: tuple[tuple[Point, ...], ...]
) -> None:
    """No robot touches another; pressed against furniture by others, one robot in two touches it once at most."""
    crowd = Crowd(hall(12, 12, *furniture), *starts)
    crowd.until_arrived(40.0)
    assert crowd.contacts.robot_robot == 0
    assert crowd.contacts.robot_wall <= 8


def test_standing_robots_and_things_are_gone_round() -> None:
    """Through a room with ten robots that do not stir and six things on the floor, two find ways, and touch nothing."""
    idle: list[Point] = [(4, 2), (4, 4), (4, 6.5), (4, 10), (6, 3), (6, 8.5), (8, 1.5), (8, 4.5), (8, 7), (8, 10)]
    movers: list[Point] = [(1, 6), (11, 5)]
    things: list[Point] = [(5, 5), (7, 6), (6, 6.5), (3, 8), (9, 3), (9.5, 8.5)]
    crowd = Crowd(hall(12, 12), [(HALL, at) for at in (*movers, *idle)], {0: (11, 6), 1: (1, 5)}, things=things)
    crowd.until_arrived(40.0)
    assert crowd.contacts == Contacts()


def test_a_thing_in_the_only_gap_is_pushed_and_the_robot_comes_through() -> None:
    """Before the gate of a door things are pushed, not gone round: physics counts that, and the thing moves."""
    crowd = Crowd(two_halls(1.2), [(HALL, (4, 4))], rooms={0: OTHER}, things=[(7.4, 4.0)])
    crowd.until_arrived(30.0)
    assert crowd.contacts.robot_item >= 1
    moved = crowd.site.rooms.item_position(ObjectId("o00"))
    assert moved is not None
    assert math.dist(moved, (7.4, 4.0)) > 0.2


@pytest.mark.parametrize(("door", "n", "limit"), [(1.8, 8, 40.0), (1.8, 16, 90.0), (1.2, 8, 60.0), (1.2, 16, 200.0)])
def test_two_streams_pass_a_door_in_both_directions(door: float, n: int, limit: float) -> None:
    """All come through, keeping right in a wide door without a touch, by turns in a narrow one with two at most."""
    starts, rooms = streams(n)
    crowd = Crowd(two_halls(door), starts, rooms=rooms)
    crowd.until_arrived(limit)
    assert crowd.contacts.robot_robot <= (0 if is_wide(crowd.building.doors[0]) else 2)
    assert crowd.contacts.robot_wall <= n // 2


BAY = Room(OTHER, rectangle(8, 2.8, 1.3, 2.4))  # so shallow that two fit in it side by side only


def bay() -> BuildingMap:
    """A hall with a wide door to a bay."""
    halls = two_halls(1.6)
    return replace(halls, rooms=(halls.rooms[0], BAY))


def test_who_has_nothing_to_do_in_a_bay_stands_off_the_way_in() -> None:
    """In the corner on the side on which robots go out: so the next one comes in at once."""
    crowd = Crowd(bay(), [(HALL, (6, 4)), (OTHER, (9, 4))], rooms={0: OTHER})
    assert crowd.until_arrived(10.0) < 5.0
    assert crowd.contacts.robot_robot == 0


@pytest.mark.parametrize("y", [4.12, 4.2])
def test_who_finds_a_bay_occupied_comes_in_as_far_as_it_gets(y: float) -> None:
    """The other stays where it is: after a while one squeezes in beside it, and is through once it is off the door."""
    crowd = Crowd(bay(), [(HALL, (6, 4)), (OTHER, (8.95, y))], {1: (8.95, y)}, {0: OTHER})
    crowd.until_arrived(20.0)
    assert crowd.site.place(crowd.specs[0].id) == PlaceId(OTHER)
    assert crowd.contacts.robot_robot == 0
