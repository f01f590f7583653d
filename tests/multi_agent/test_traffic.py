"""Traffic flows and never freezes, and no robot is ever where another is: judged from poses in every tick.

Robots have errands (rooms to visit in turn) and no planners. What is looked at is only where they are.
"""

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
import shapely

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Action
from clo_fleet.fleet.offers import Offers
from clo_fleet.robot.apart import keep_apart
from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.robot.drive import Drive
from clo_fleet.robot.skill import Body, Done, Progress, Under
from clo_fleet.sim.network import build_network
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.study.event_log import EventLog
from clo_fleet.world.buildings import Measures, grid, line, ring
from clo_fleet.world.model import (
    BuildingMap,
    PlaceId,
    Pose,
    RobotId,
    RobotSpec,
    RoomId,
    SkillSettings,
    World,
)
from clo_fleet.world.vocabulary import vocabulary

MOVE = Action(schema="move", args=(), needs=(), adds=frozenset(), deletes=frozenset())
TICK = 0.2
RADIUS = 0.3
JUMP = 1.0 * TICK + 0.06 + 0.03  # [m] in a tick: at top speed, from body to vehicle, pushed by others
PUSHED = 0.1  # [m] two bodies may get into one another before they are pushed apart: two ways of 0.05 s at 1 m/s


@dataclass(slots=True)
class Crowd:
    """Robots that drive from room to room in a building, looked at after every tick.

    Attributes:
        site: where they are.
        specs: who they are.
        errands: the rooms that each has still to visit, in turn.
        trips: how many have been made.
        skills: what each is doing.
        endings: how each of the trips that did not arrive has ended.
        nearest: of two robots' rims so far [m].
    """

    site: Site
    specs: Sequence[RobotSpec]
    errands: dict[RobotId, list[RoomId]]
    time: float = 0.0
    trips: int = 0
    skills: dict[RobotId, Drive] = field(default_factory=dict)
    endings: list[tuple[RobotId, Progress]] = field(default_factory=list)
    nearest: float = math.inf
    moved_at: float = 0.0
    poses: dict[RobotId, Pose] = field(default_factory=dict)
    wanted: dict[RobotId, Under] = field(default_factory=dict)
    aside: dict[RobotId, StandAside] = field(default_factory=dict)
    truth: Truth | None = None

    def want(self, spec: RobotSpec) -> Under:
        """What a robot wants in this tick."""
        skill = self.skills.get(spec.id)
        if skill is None:
            if not self.errands[spec.id]:
                return self.aside.setdefault(spec.id, StandAside()).step(self.site, spec, self.time)
            floor = self.site.floor(spec.id)
            assert floor is not None
            skill = self.skills[spec.id] = Drive(floor, self.errands[spec.id].pop(0))
        progress = skill.step(self.body(spec))
        if isinstance(progress, Under):
            return progress
        del self.skills[spec.id]
        if isinstance(progress, Done):
            assert self.site.place(spec.id) == PlaceId(skill.goal)
            self.trips += 1
        else:
            skill.release(self.body(spec))
            self.endings.append((spec.id, progress))
        return Under()

    def body(self, spec: RobotSpec) -> Body:
        """What a robot's skill works with."""
        world = World(name="", map=self.site.building, robots=tuple(self.specs), objects=())
        self.truth = self.truth or Truth(self.site, vocabulary(world))
        return Body(
            spec=spec,
            site=self.site,
            truth=self.truth,
            exchange=Offers(EventLog()),
            settings=SkillSettings(),
            time=self.time,
            action=MOVE,
            cause=Cause(spec.id, "move", 0),
        )

    def step(self) -> None:
        """One tick: skills, avoidance, physics, traffic; then a look."""
        self.time = round(self.time + TICK, 3)
        self.wanted = {spec.id: self.want(spec) for spec in self.specs}
        bodies = [spec for spec in self.specs if not self.site.in_corridor(spec.id)]
        agents = [
            Agent(
                id=spec.id,
                position=self.site.pose(spec.id).point,
                velocity=self.site.rooms.velocity(spec.id) or (0.0, 0.0),
                preferred=self.wanted[spec.id].velocity,
                group=str(self.site.floor(spec.id)),
            )
            for spec in bodies
        ]
        free = [
            self.wanted[agent.id].velocity if self.wanted[agent.id].direct else velocity
            for agent, velocity in zip(agents, Avoidance().velocities(agents), strict=True)
        ]
        for spec, velocity in zip(bodies, keep_apart(agents, free, TICK), strict=True):
            self.site.rooms.drive(spec.id, velocity)
        self.site.step()
        self.look()

    def look(self) -> None:
        """Nobody jumps, and nobody is where another is."""
        bodies, vehicles = self.site.rooms.poses(), self.site.corridors.poses()
        assert not bodies.keys() & vehicles.keys()
        poses = bodies | vehicles
        assert poses.keys() == self.errands.keys()
        for robot, pose in poses.items():
            if robot in self.poses:
                moved = math.dist(pose.point, self.poses[robot].point)
                assert moved <= JUMP, (robot, self.time, self.poses[robot], pose)
                if moved > 0.02:
                    self.moved_at = self.time
        self.poses = poses
        names, points = list(poses), [shapely.Point(pose.point) for pose in poses.values()]
        for one, other in shapely.STRtree(points).query(points, predicate="dwithin", distance=2 * RADIUS).T.tolist():
            if one < other:
                a, b = names[one], names[other]
                gap = math.dist(poses[a].point, poses[b].point) - 2 * RADIUS
                allowed = 0.0 if a in vehicles and b in vehicles else PUSHED
                assert gap >= -allowed, (a, b, self.time, gap, poses[a], poses[b])
                self.nearest = min(self.nearest, gap)

    def run(self, limit: float) -> None:
        """Go on until all errands are done; at the latest until the limit, or when nobody has moved for a minute."""
        while self.skills or any(self.errands.values()) or not self.time:
            self.step()
            stuck = {robot: under.standing_for for robot, under in self.wanted.items() if under.standing_for}
            assert self.time < limit, (self.trips, stuck)
            assert self.time - self.moved_at < 60.0, (self.trips, stuck)


def robots(building: BuildingMap, count: int) -> list[RobotSpec]:
    """So many robots at the spawn points, room by room in turn."""
    points: dict[RoomId, list[Pose]] = {}
    for spawn in building.spawn_points:
        points.setdefault(spawn.room, []).append(spawn.pose)
    rooms = list(points)
    return [
        RobotSpec(
            id=RobotId(f"r{number:03}"),
            room=rooms[number % len(rooms)],
            pose=points[rooms[number % len(rooms)]][number // len(rooms)],
            goals=(),
        )
        for number in range(count)
    ]


def crowd(
    building: BuildingMap, specs: Sequence[RobotSpec], errands: Mapping[RobotId, Sequence[RoomId]], folder: Path
) -> Iterator[Crowd]:
    """The crowd in the building."""
    network = folder / f"{building.name}.net.xml.gz"
    build_network(building, network)
    with Site(replace(building, network=network), specs, (), seed=1, tick=TICK) as site:
        yield Crowd(site, specs, {spec.id: list(errands[spec.id]) for spec in specs})


def to_and_fro(building: BuildingMap, count: int, rounds: int) -> tuple[list[RobotSpec], dict[RobotId, list[RoomId]]]:
    """Robots at both ends that change places, again and again."""
    rooms = [room.id for room in building.rooms]
    ends = (rooms[0], rooms[-1])
    specs = [spec for spec in robots(building, len(rooms) * count) if spec.room in ends]
    return specs, {
        s.id: [ends[s.room == ends[0]], s.room] * (rounds // 2) + [ends[s.room == ends[0]]] * (rounds % 2)
        for s in specs
    }


@pytest.mark.parametrize("two_lane", [False, True])
def test_from_both_ends_of_a_line_all_arrive(tmp_path: Path, two_lane: bool) -> None:
    """Five robots at each end change places, through one lane as well as through two."""
    building = line(3, Measures(two_lane=two_lane))
    for it in crowd(building, *to_and_fro(building, 5, 2), tmp_path):
        it.run(600.0)
        assert it.trips == 20


def across(building: BuildingMap, count: int) -> tuple[list[RobotSpec], dict[RobotId, list[RoomId]]]:
    """Every second robot goes to the room furthest round, the others to a room three on."""
    rooms = [room.id for room in building.rooms]
    specs = robots(building, count)
    far, near = len(rooms) // 2, min(3, len(rooms) - 1)
    return specs, {
        spec.id: [rooms[(rooms.index(spec.room) + (far if (number // len(rooms)) % 2 else near)) % len(rooms)]]
        for number, spec in enumerate(specs)
    }


@pytest.mark.parametrize("two_lane", [False, True])
def test_round_a_ring_all_arrive(tmp_path: Path, two_lane: bool) -> None:
    """Twenty-four robots of six rooms."""
    building = ring(6, Measures(two_lane=two_lane))
    for it in crowd(building, *across(building, 24), tmp_path):
        it.run(900.0)
        assert it.trips == 24


def anywhere(building: BuildingMap, count: int, trips: int) -> tuple[list[RobotSpec], dict[RobotId, list[RoomId]]]:
    """Trips to rooms drawn by chance, never to the room where the robot is."""
    draw, rooms = random.Random(7), [room.id for room in building.rooms]
    specs = robots(building, count)
    errands: dict[RobotId, list[RoomId]] = {spec.id: [] for spec in specs}
    at = {spec.id: spec.room for spec in specs}
    for number in range(trips):
        robot = specs[number % count].id
        at[robot] = draw.choice([room for room in rooms if room != at[robot]])
        errands[robot].append(at[robot])
    return specs, errands


@pytest.mark.parametrize("two_lane", [False, True])
def test_in_a_grid_all_arrive(tmp_path: Path, two_lane: bool) -> None:
    """Twelve robots make thirty trips among four rooms."""
    building = grid(2, 2, Measures(two_lane=two_lane))
    for it in crowd(building, *anywhere(building, 12, 30), tmp_path):
        it.run(900.0)
        assert it.trips == 30


def test_on_crossings_where_five_ways_meet_nobody_touches_another(tmp_path: Path) -> None:
    """Forty robots in a grid of three by three with two lanes: its spurs leave the crossings at 45 degrees."""
    building = grid(3, 3, Measures(two_lane=True))
    for it in crowd(building, *anywhere(building, 40, 80), tmp_path):
        it.run(900.0)
        assert it.trips == 80


@pytest.mark.study
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("two_lane", [False, True])
def test_a_hundred_and_sixty_robots_round_a_ring_all_arrive(tmp_path: Path, two_lane: bool) -> None:
    """Ten in each of sixteen rooms, one trip each, half of them to the far side."""
    building = ring(16, Measures(two_lane=two_lane))
    for it in crowd(building, *across(building, 160), tmp_path):
        it.run(3600.0)
        assert it.trips == 160


@pytest.mark.study
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("two_lane", [False, True])
def test_sixty_robots_in_a_grid_make_two_hundred_trips(tmp_path: Path, two_lane: bool) -> None:
    """In a grid of three by three, to rooms drawn by chance."""
    building = grid(3, 3, Measures(two_lane=two_lane))
    for it in crowd(building, *anywhere(building, 60, 200), tmp_path):
        it.run(3600.0)
        assert it.trips == 200
