"""What driving promises: doors of all widths are passed without a stop, and nobody blocks anybody for good."""

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Action
from clo_fleet.fleet.offers import Offers
from clo_fleet.robot.approach import Approach
from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.robot.drive import Drive, Phase
from clo_fleet.robot.skill import Body, Cancelled, Done, Under
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.sim.network import build_network
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.study.event_log import EventLog
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
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
MOVE = Action(schema="move", args=(), needs=(), adds=frozenset(), deletes=frozenset())
WEST, EAST = RoomId("west"), RoomId("east")
CONTACT = 0.05  # [m] by which two robots that push one another may overlap for a moment


@dataclass(slots=True)
class Traffic:
    """Robots that drive from room to room, and do nothing else."""

    site: Site
    truth: Truth
    specs: Sequence[RobotSpec]
    errands: dict[RobotId, list[Drive]]
    time: float = 0.0
    nearest: float = math.inf  # the smallest gap between the rims of two bodies so far [m]
    slowest: dict[str, float] = field(default_factory=dict)  # by robot: on the way out, once it had got going [m/s]
    standing: dict[RobotId, StandAside] = field(default_factory=dict)

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

    def want(self, spec: RobotSpec) -> Under:
        """What a robot wants in this tick."""
        errands = self.errands[spec.id]
        if not errands:
            return self.standing.setdefault(spec.id, StandAside()).step(self.site, spec, self.time)
        progress = errands[0].step(self.body(spec))
        if isinstance(progress, Under):
            return progress
        assert isinstance(progress, Done)
        errands.pop(0)
        return Under()

    def step(self) -> None:
        """One tick: skills, avoidance, physics, traffic."""
        self.time = round(self.time + TICK, 3)
        wanted = {spec.id: self.want(spec) for spec in self.specs}
        bodies = [spec for spec in self.specs if not self.site.in_corridor(spec.id)]
        agents = [
            Agent(
                id=spec.id,
                position=self.site.pose(spec.id).point,
                velocity=self.site.rooms.velocity(spec.id) or (0.0, 0.0),
                preferred=wanted[spec.id].velocity,
                group=str(self.site.floor(spec.id)),
            )
            for spec in bodies
        ]
        for spec, velocity in zip(bodies, Avoidance().velocities(agents), strict=True):
            under = wanted[spec.id]
            self.site.rooms.drive(spec.id, under.velocity if under.direct else velocity)
        self.site.step()
        self.measure()

    def measure(self) -> None:
        """Note how near the robots came to each other, and how slow they became before the door."""
        poses = self.site.rooms.poses()
        for (one, a), (other, b) in itertools.combinations(poses.items(), 2):
            rims = self.site.robot_radius(one) + self.site.robot_radius(other)
            self.nearest = min(self.nearest, math.dist(a.point, b.point) - rims)
        for robot, errands in self.errands.items():
            if self.time > 1.2 and errands and errands[0].phase in (Phase.APPROACH, Phase.QUEUE):
                self.slowest[robot] = min(self.slowest.get(robot, math.inf), self.site.speed(robot))

    def drive(self, limit: float = 300.0) -> bool:
        """Go on until all errands are done; whether they were, within ``limit`` [s]."""
        while any(self.errands.values()) and self.time < limit:
            self.step()
        return not any(self.errands.values())


def rooms(gap: float) -> tuple[Room, ...]:
    """Two rooms of 6 x 5 m."""
    return (
        Room(WEST, ((0, 0), (6, 0), (6, 5), (0, 5))),
        Room(EAST, ((6 + gap, 0), (12 + gap, 0), (12 + gap, 5), (6 + gap, 5))),
    )


def next_door(width: float) -> BuildingMap:
    """Two rooms with a door between them."""
    door = Door(id=DoorId("d"), rooms=(WEST, EAST), position=(6, 2.5), heading=0.0, width=width)
    return BuildingMap(name="next door", rooms=rooms(0.0), doors=(door,))


def along_a_hall(width: float, folder: Path) -> BuildingMap:
    """Two rooms with 8 m of corridor between them."""
    doors = (
        Door(id=DoorId("wd"), rooms=(WEST,), position=(6, 2.5), heading=0.0, width=width),
        Door(id=DoorId("ed"), rooms=(EAST,), position=(14, 2.5), heading=math.pi, width=width),
    )
    hall = Corridor(id=CorridorId("hall"), start="wd", end="ed", shape=((6, 2.5), (14, 2.5)))
    building = BuildingMap(name="hall", rooms=rooms(8.0), doors=doors, corridors=(hall,))
    build_network(building, folder / "hall.net.xml.gz")
    return replace(building, network=folder / "hall.net.xml.gz")


def robot(name: str, room: RoomId, at: Point) -> RobotSpec:
    """A robot."""
    return RobotSpec(id=RobotId(name), room=room, pose=Pose(*at), goals=())


def sides(count: int, far: float) -> list[RobotSpec]:
    """As many robots in each of the two rooms."""
    at = [(1.0 + k % 2, 1.5 + k // 2) for k in range(count)]
    return [robot(f"w{k}", WEST, (x, y)) for k, (x, y) in enumerate(at)] + [
        robot(f"x{k}", EAST, (far - x, y)) for k, (x, y) in enumerate(at)
    ]


def traffic(building: BuildingMap, specs: Sequence[RobotSpec], *, back: bool = False) -> Traffic:
    """All robots into the other room, and back again if so asked. To be closed by its site."""
    site = Site(building, specs, (), seed=0, tick=TICK)
    errands = {}
    for spec in sorted(specs, key=lambda spec: spec.id):
        other = EAST if spec.room == WEST else WEST
        errands[spec.id] = [Drive(spec.room, other), *([Drive(other, spec.room)] if back else [])]
    return Traffic(
        site,
        Truth(site, vocabulary(World(name="", map=building, robots=tuple(specs), objects=()))),
        sorted(specs, key=lambda spec: spec.id),
        errands,
    )


@pytest.mark.parametrize("width", [0.8, 1.0, 1.2, 1.8])
def test_a_robot_drives_through_a_free_door_between_rooms_without_slowing_down(width: float) -> None:
    """Once it has got going, it never falls below 0.8 m/s, and touches neither side."""
    run = traffic(next_door(width), [robot("r1", WEST, (2, 2.5))])
    assert run.drive()
    assert run.slowest["r1"] > 0.8
    assert run.time < 6.0  # 4.8 m from rest, at 1 m/s
    assert run.site.rooms.contacts().robot_wall == 0


@pytest.mark.parametrize("width", [0.8, 1.0, 1.4, 1.8])
def test_a_robot_leaves_through_a_free_door_onto_a_corridor_without_waiting(width: float, tmp_path: Path) -> None:
    """Also where the door is narrower than the lanes are apart: it does not slow down before the gate."""
    run = traffic(along_a_hall(width, tmp_path), [robot("r1", WEST, (2, 2.5))])
    with run.site:
        assert run.drive()
        assert run.slowest["r1"] > 0.6
        assert run.site.place(RobotId("r1")) == PlaceId(EAST)
        assert run.site.rooms.contacts().robot_wall <= (2 if width < 1.0 else 0)  # 0.1 m of play at either side


@pytest.mark.parametrize("width", [0.8, 1.2, 1.8])
def test_robots_that_meet_at_a_door_between_rooms_let_each_other_pass(width: float) -> None:
    """Four against four exchange their rooms, whether two fit through the door at once or only one."""
    run = traffic(next_door(width), sides(4, 12.0))
    assert run.drive()
    assert run.nearest > -CONTACT


@pytest.mark.parametrize("width", [1.0, 1.8])
def test_robots_that_meet_at_doors_onto_a_corridor_let_each_other_pass(width: float, tmp_path: Path) -> None:
    """Three against three, there and back: who waits inside leaves the doorway to those who come."""
    run = traffic(along_a_hall(width, tmp_path), sides(3, 20.0), back=True)
    with run.site:
        assert run.drive()
        assert run.nearest > -CONTACT


def test_a_robot_turns_back_until_it_is_in_the_doorway_but_not_after() -> None:
    """Cancelled on its way to the door it stops and gives back its turn; once it passes, it goes on."""
    spec = robot("r1", WEST, (2, 2.5))
    for phase in (Phase.QUEUE, Phase.PASS_IN):
        run = traffic(next_door(1.2), [spec])
        (drive,) = run.errands[spec.id]
        while drive.phase is not phase:
            run.step()
        drive.cancel()
        progress = drive.step(run.body(spec))
        assert isinstance(progress, Cancelled) is (phase is Phase.QUEUE)
        assert bool(run.site.doors.state()["queues"]) is (phase is Phase.PASS_IN)


def test_a_drive_survives_json_in_every_tick() -> None:
    """Saved and read again after each tick, it gets where it was going."""
    run = traffic(next_door(1.2), sides(1, 12.0))
    phases = set()
    while any(run.errands.values()) and run.time < 60.0:
        run.step()
        for errands in run.errands.values():
            phases |= {drive.phase for drive in errands}
            errands[:] = [Drive.from_state(json.loads(json.dumps(drive.state()))) for drive in errands]
    assert not any(run.errands.values())
    assert phases == {Phase.APPROACH, Phase.QUEUE, Phase.PASS_IN}


@pytest.mark.parametrize(("at", "moves"), [((3.0, 4.4), True), ((5.4, 2.5), True), ((1.5, 2.0), False)])
def test_a_robot_far_back_in_a_queue_stands_where_it_is_unless_that_is_in_the_way_at_any_door(
    at: Point, moves: bool
) -> None:
    """Else others would push it out through a door that it has no business at."""
    north = RoomId("north")
    building = next_door(1.2)
    other = Door(id=DoorId("n"), rooms=(WEST, north), position=(3, 5), heading=math.pi / 2, width=1.2)
    building = replace(
        building,
        rooms=(*building.rooms, Room(north, ((0, 5), (6, 5), (6, 10), (0, 10)))),
        doors=(*building.doors, other),
    )
    spec = robot("r1", WEST, at)
    run = traffic(building, [spec])
    waits = Wait(WaitCause.DOOR, "d", (RobotId("r2"),))
    under = Approach().wait(run.body(spec), WEST, building.doors[0], 2, waits)
    assert isinstance(under, Under)
    assert (math.hypot(*under.velocity) > 0.0) is moves
