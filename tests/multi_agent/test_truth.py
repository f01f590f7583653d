"""What holds in every tick of every run, judged from poses and not by what the simulation says of itself."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import shapely

from clo_fleet.clo.task import Fact
from clo_fleet.fleet.mission import TICK
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.sim.network import build_network
from clo_fleet.sim.walls import walls
from clo_fleet.study.run import Run
from clo_fleet.world.events import ActionEnded
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    ObjectId,
    ObjectSpec,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    SkillSettings,
    World,
)

# Contacts are solved every 0.05 s, and each of two robots comes at most 1 m/s: so far may they get into each other
# before they are pushed apart, and one of them into a wall.
SUBSTEP = 0.05
INTO_ANOTHER = 2 * 1.0 * SUBSTEP  # [m]
INTO_WALL = 1.0 * SUBSTEP  # [m]
HAND_OVER = 0.06  # [m] a body this near to where its vehicle will be may become the vehicle
PUSHED = 0.03  # [m] in a tick, by others, beyond the way that a robot makes by itself
SHOVED = 0.3  # [m] an object moved by more than this has to be prepared again
WALL = 0.025  # [m] half of a wall's thickness
VEHICLE = (0.8, 0.6)  # [m]
TURNING = 0.02  # [m] SUMO knows its vehicles' places on their lanes, and which lanes cross, but not their outlines
SLANTED = 0.1  # sine of the angle between two vehicles that are not on straight ways beside one another
ZONE = "zone-1"


class Witness:
    """Looks at a run after every tick, from outside, and holds it against what must be true."""

    def __init__(self, run: Run, world: World) -> None:
        self.world, self.run, self.mission = world, run, run.mission
        self.specs = {spec.id: spec for spec in world.robots}
        self.poses: dict[RobotId, Pose] = {}
        self.reach: dict[RobotId, float] = {spec.id: spec.max_speed for spec in world.robots}
        self.solid = shapely.STRtree([shapely.LineString(wall) for wall in walls(world.map)])
        self.rooms = {room.id: shapely.Polygon(room.outline) for room in world.map.rooms}
        self.blocks = [shapely.Polygon(block) for room in world.map.rooms for block in room.obstacles]
        for polygon in (*self.rooms.values(), *self.blocks):
            shapely.prepare(polygon)
        self.lies: dict[ObjectId, RoomId] = {spec.id: spec.room for spec in world.objects}
        self.prepared: dict[ObjectId, Point | None] = {s.id: s.position for s in world.objects if s.prepared}
        self.read = 0
        self.bodies: dict[RobotId, Pose] = {}
        self.vehicles: dict[RobotId, Pose] = {}

    def look(self) -> None:
        """Check everything that holds in every tick."""
        site = self.mission.site
        self.bodies = site.rooms.poses()
        self.vehicles = site.corridors.poses() if self.world.map.corridors else {}
        self.one_form()
        self.no_jumps()
        self.nothing_solid()
        self.nobody_overlaps()
        self.facts()
        assert all(self.mission.robot(robot).executive.tally.adds_up for robot in self.specs)

    def one_form(self) -> None:
        """Every robot is either a body or a vehicle, and every object in one hand or on one floor."""
        assert not self.bodies.keys() & self.vehicles.keys()
        assert self.bodies.keys() | self.vehicles.keys() == self.specs.keys()
        for spec in self.world.objects:
            hands = [robot for robot in self.specs if spec.id in self.mission.site.rooms.carried(robot)]
            assert len(hands) == (self.mission.site.rooms.carrier(spec.id) is not None)
            position = self.mission.site.item_position(spec.id)
            assert (position is None) is (bool(hands) and hands[0] in self.vehicles)
            if hands and position is not None:
                assert math.dist(position, self.bodies[hands[0]].point) < self.specs[hands[0]].radius

    def no_jumps(self) -> None:
        """Nobody is further from where it was than it can drive in a tick, not even when it changes its form."""
        for robot, pose in (self.bodies | self.vehicles).items():
            speed = self.mission.site.max_speed(robot)
            before = self.poses.get(robot, self.specs[robot].pose)
            limit = max(speed, self.reach[robot]) * TICK + HAND_OVER + PUSHED
            assert math.dist(before.point, pose.point) <= limit, (robot, self.run.time, before, pose)
            self.poses[robot], self.reach[robot] = pose, speed

    def nothing_solid(self) -> None:
        """No robot is in a wall or an obstacle, and no vehicle is in a room."""
        robots, points = list(self.bodies), [shapely.Point(pose.point) for pose in self.bodies.values()]
        if points:
            (inputs, _), distances = self.solid.query_nearest(points, return_distance=True, all_matches=False)
            for index, distance in zip(inputs.tolist(), distances.tolist(), strict=True):
                radius = self.specs[robots[index]].radius
                assert distance > radius + WALL - INTO_WALL, (robots[index], self.run.time, distance)
            assert not any(block.contains(point) for block in self.blocks for point in points)
        for robot, pose in self.vehicles.items():
            inside = [room for room, outline in self.rooms.items() if outline.contains(shapely.Point(pose.point))]
            assert not inside, (robot, self.run.time, inside)

    def nobody_overlaps(self) -> None:
        """No two robots are in the same space, whatever their forms.

        A robot is a disc. As a vehicle it claims a box that is longer, which bodies keep out of, and so do other
        vehicles on straight ways; where corridors meet SUMO lets the corners of boxes touch, though not the robots.
        """
        poses = self.bodies | self.vehicles
        names, points = list(poses), [shapely.Point(pose.point) for pose in poses.values()]
        for one, other in shapely.STRtree(points).query(points, predicate="dwithin", distance=1.1).T.tolist():
            if one < other:
                a, b = names[one], names[other]
                assert self.gap(a, b) > -self.tolerance(a, b), (a, b, self.run.time, self.gap(a, b))

    def gap(self, a: RobotId, b: RobotId) -> float:
        """How far two robots are apart [m]."""
        poses = self.bodies | self.vehicles
        turned = abs(math.sin(poses[a].heading - poses[b].heading)) > SLANTED
        if a in self.vehicles and b in self.vehicles and turned:
            return math.dist(poses[a].point, poses[b].point) - self.specs[a].radius - self.specs[b].radius
        rims = sum(self.specs[robot].radius for robot in (a, b) if robot in self.bodies)
        return float(shapely.distance(self.shape(a), self.shape(b))) - rims

    def tolerance(self, a: RobotId, b: RobotId) -> float:
        """How far two robots may come into one another [m]."""
        return TURNING if a in self.vehicles and b in self.vehicles else INTO_ANOTHER

    def shape(self, robot: RobotId) -> shapely.Geometry:
        """A body's centre, or a vehicle's box."""
        if robot in self.bodies:
            return shapely.Point(self.bodies[robot].point)
        pose, (length, width) = self.vehicles[robot], VEHICLE
        box = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        return shapely.affinity.affine_transform(box, (cos, -sin, sin, cos, pose.x, pose.y))

    def facts(self) -> None:
        """The facts are those that follow from where everybody and everything is, and from the log."""
        found: set[Fact] = set()
        for robot, pose in (self.bodies | self.vehicles).items():
            inside = [room for room, outline in self.rooms.items() if outline.covers(shapely.Point(pose.point))]
            known = [fact[2] for fact in self.mission.facts if fact[:2] == ("at-robot", robot)]
            assert len(known) == 1
            assert known[0] in {*inside} or (known[0] == ZONE and not inside), (
                robot,
                self.run.time,
                pose,
                known,
                inside,
            )
            found.add(("at-robot", robot, known[0]))
        for spec in self.world.objects:
            carrier = self.mission.site.rooms.carrier(spec.id)
            if carrier is not None:
                found.add(("holding", carrier, spec.id))
                continue
            position = self.mission.site.item_position(spec.id)
            assert position is not None
            inside = [room for room, outline in self.rooms.items() if outline.covers(shapely.Point(position))]
            self.lies[spec.id] = self.lies[spec.id] if not inside or self.lies[spec.id] in inside else inside[0]
            found.add(("at-object", spec.id, self.lies[spec.id]))
        found |= {("prepared", item) for item in self.follow_prepared()}
        assert found == self.mission.facts, (self.run.time, found ^ self.mission.facts)

    def follow_prepared(self) -> set[ObjectId]:
        """The objects that an action prepared, unless they were shoved since then."""
        site = self.mission.site
        for item, anchor in list(self.prepared.items()):
            position = None if site.rooms.carrier(item) else site.item_position(item)
            if anchor is not None and position is not None and math.dist(anchor, position) > SHOVED:
                del self.prepared[item]
            else:
                self.prepared[item] = position if anchor is None or position is None else anchor
        for _, _, event in self.run.log[self.read :]:
            if isinstance(event, ActionEnded) and event.ending == "finished" and event.action.startswith("prepare("):
                item = ObjectId(event.action.split(", ")[1])
                self.prepared[item] = None if site.rooms.carrier(item) else site.item_position(item)
        self.read = len(self.run.log)
        return set(self.prepared)


def rectangle(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    """A rectangle's corners from its lower left one."""
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))


def row(rooms: int, folder: Path, *, closet: bool = False) -> BuildingMap:
    """Rooms of 8 x 6 m on both sides of a corridor, a pillar in each; a closet behind a narrow door of the first.

    The ways to the doors of two rooms that face each other meet the corridor 3 m apart: no four ways cross.
    """
    built, doors, corridors, junctions = [], [], [], []
    for number in range(rooms):
        x, up = 10.0 * (number // 2), number % 2 == 0
        name, door, bottom = RoomId(f"l{number}"), DoorId(f"d{number}"), 4.0 if up else -10.0
        built.append(Room(name, rectangle(x, bottom, 8, 6), (rectangle(x + 5.5, bottom + 2.5, 1, 1),)))
        at = (x + (2.5 if up else 5.5), 4.0 if up else -4.0)
        heading = -math.pi / 2 if up else math.pi / 2
        doors.append(Door(id=door, rooms=(name,), position=at, heading=heading, width=1.8))
        junctions.append(Junction(f"j{number}", (at[0], 0.0)))
        corridors.append(Corridor(id=CorridorId(f"s{number}"), start=door, end=f"j{number}", shape=(at, (at[0], 0.0))))
    for begin, end in itertools.pairwise(junctions):
        shape = (begin.position, end.position)
        corridors.append(Corridor(id=CorridorId(f"c-{begin.id}"), start=begin.id, end=end.id, shape=shape))
    if closet:
        built.append(Room(RoomId("closet"), rectangle(-4, 4, 4, 6)))
        doors.append(
            Door(id=DoorId("dc"), rooms=(RoomId("l0"), RoomId("closet")), position=(0, 7), heading=math.pi, width=1.2)
        )
    building = BuildingMap(
        name=f"row-{rooms}",
        rooms=tuple(built),
        doors=tuple(doors),
        junctions=tuple(junctions),
        corridors=tuple(corridors),
    )
    path = folder / f"{building.name}.net.xml.gz"
    build_network(building, path)
    return replace(building, network=path)


def robot(name: str, room: str, at: Point, *goals: Fact) -> RobotSpec:
    """A robot."""
    return RobotSpec(id=RobotId(name), room=RoomId(room), pose=Pose(*at), goals=goals)


def thing(name: str, room: str, at: Point) -> ObjectSpec:
    """An object."""
    return ObjectSpec(id=ObjectId(name), room=RoomId(room), position=at)


def crowd(folder: Path) -> World:
    """Twelve robots in three rooms and a closet, who want the same objects moved and prepared, and pass each other."""
    building = row(3, folder, closet=True)
    at = {"l0": (1.0, 5.2), "l1": (1.0, -9.0), "l2": (11.0, 5.2)}
    goals: dict[str, tuple[Fact, ...]] = {
        "r00": (("holding", "r00", "o0"), ("at-robot", "r00", "l1")),
        "r01": (("holding", "r01", "o1"), ("prepared", "o2")),
        "r02": (("at-object", "o3", "closet"),),
        "r03": (("at-object", "o2", "l0"), ("at-robot", "r03", "l2")),
        "r04": (("at-robot", "r04", "closet"),),
        "r05": (("prepared", "o0"), ("at-robot", "r05", "l0")),
        "r06": (("at-object", "o2", "l0"), ("at-robot", "r06", "l2")),
        "r07": (("at-robot", "r07", "l0"),),
        "r08": (("prepared", "o4"), ("at-robot", "r08", "l0")),
        "r09": (("at-robot", "r09", "closet"),),
        "r10": (("at-object", "o3", "closet"), ("at-robot", "r10", "l1")),
        "r11": (("prepared", "o5"), ("holding", "r11", "o4")),
    }
    rooms = ["l0", "l1", "l2"]
    robots = []
    for number, name in enumerate(sorted(goals)):
        room = rooms[number % 3]
        x, y = at[room]
        robots.append(robot(name, room, (x + 1.5 * (number // 3), y), *goals[name]))
    objects = (
        thing("o0", "l0", (2, 8)),
        thing("o1", "l0", (5, 9)),
        thing("o2", "l1", (3, -6)),
        thing("o3", "l2", (12, 8.5)),
        thing("o4", "l2", (16, 9)),
        thing("o5", "closet", (-2, 9)),
    )
    return World(name="crowd", map=building, robots=tuple(robots), objects=objects, until=600.0)


def errands(count: int, folder: Path) -> World:
    """Any number of robots, three to five a room, of which each has one thing to do."""
    building = row(max(2, 2 * math.ceil(count / 8)), folder)
    rooms = building.rooms
    robots: list[RobotSpec] = []
    objects: list[ObjectSpec] = []
    for number in range(count):
        home, other = rooms[number % len(rooms)], rooms[(number * 5 + 3) % len(rooms)]
        (x, y), place = home.outline[0], number // len(rooms)
        name = f"r{number:02}"
        goal: Fact = ("at-robot", name, other.id)
        if number % 5 == 0 and len(objects) < 3:
            objects.append(thing(f"o{number:02}", home.id, (x + 1.0, y + 3.0)))
            goal = ("prepared", f"o{number:02}")
        robots.append(robot(name, home.id, (x + 0.8 + 1.5 * place, y + (0.8 if y > 0 else 5.2)), goal))
    return World(
        name=f"errands-{count}",
        map=building,
        robots=tuple(robots),
        objects=tuple(objects),
        until=180.0,
        skills=SkillSettings(prepare=2.0, grasp=1.0),
    )


def watched(world: World) -> Iterator[Run]:
    """A run that a witness looks at after every tick until it has ended."""
    with Run(world) as run:
        witness = Witness(run, world)
        while not run.done:
            run.step()
            witness.look()
            yield run


def test_in_a_crowd_all_is_as_it_must_be_in_every_tick(tmp_path: Path) -> None:
    """Twelve robots with goals that overlap reach them, and nothing impossible happens on the way."""
    world = crowd(tmp_path)
    (*_, run) = watched(world)
    assert run.mission.outcome is Outcome.GOALS_REACHED, run.mission.why
    assert {goal for spec in world.robots for goal in spec.goals} <= run.mission.facts


@pytest.mark.parametrize("count", [1, 2, 10, 50])
def test_any_number_of_robots_does_the_same_again(count: int, tmp_path: Path) -> None:
    """However many there are, all get where they want, nothing impossible happens, and a second run is the same."""
    world = errands(count, tmp_path)
    (*_, run) = watched(world)
    assert run.mission.outcome is Outcome.GOALS_REACHED, run.mission.why
    with Run(world) as again:
        again.finish()
        assert again.log == run.log
