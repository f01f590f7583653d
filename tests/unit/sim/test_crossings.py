"""Where on a crossing robots would touch is written into its network, and robots heed it."""

import gzip
import math
import random
from itertools import combinations, pairwise, product
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from clo_fleet.sim.corridors import Corridors
from clo_fleet.sim.network import build_network
from clo_fleet.sim.network_check import check_network
from clo_fleet.sim.routes import Route, Routes
from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, Junction, Point, RobotId, RoomId

ARM = 9.0  # [m]
WIDTH = 0.6  # [m] of a robot
STAR = (0.0, 45.0, 90.0, 180.0, 270.0)  # a crossing of a made grid: four corridors, and a spur between two


def star(folder: Path, *degrees: float) -> BuildingMap:
    """Corridors that meet in one junction, from doors all round it."""
    ends: dict[str, Point] = {
        f"d{angle:.0f}": (round(ARM * math.cos(math.radians(angle)), 3), round(ARM * math.sin(math.radians(angle)), 3))
        for angle in degrees
    }
    building = BuildingMap(
        name="star",
        rooms=(),
        doors=tuple(
            Door(id=DoorId(n), rooms=(RoomId(f"room-{n}"),), position=at, heading=0.0, width=1.6)
            for n, at in ends.items()
        ),
        junctions=(Junction("j", (0.0, 0.0)),),
        corridors=tuple(
            Corridor(id=CorridorId(f"c-{n}"), start=n, end="j", shape=(at, (0.0, 0.0))) for n, at in ends.items()
        ),
        network=folder / "star.net.xml.gz",
    )
    assert building.network is not None
    build_network(building, building.network)
    return building


def parsed(building: BuildingMap) -> ET.Element:
    """The building's network."""
    assert building.network is not None
    return ET.fromstring(gzip.decompress(building.network.read_bytes()))


def points(lane: ET.Element) -> list[Point]:
    """A point of the lane's middle line every 2 cm."""
    corners = [tuple(map(float, corner.split(","))) for corner in lane.attrib["shape"].split()]
    found: list[Point] = []
    for (ax, ay), (bx, by) in pairwise(corners):
        steps = max(1, math.ceil(math.dist((ax, ay), (bx, by)) / 0.02))
        found += [(ax + (bx - ax) * step / steps, ay + (by - ay) * step / steps) for step in range(steps)]
    return found


@pytest.mark.parametrize("degrees", [STAR, (0.0, 60.0, 180.0), (0.0, 90.0, 180.0, 270.0), (20.0, 100.0, 150.0, 260.0)])
def test_ways_that_come_near_one_another_are_foes(tmp_path: Path, degrees: tuple[float, ...]) -> None:
    """Of both it is written until where; ways from one lane, or into one, are left as they are."""
    root = parsed(star(tmp_path, *degrees))
    lanes = {lane.attrib["id"]: lane for lane in root.iterfind("edge/lane")}
    links = list(root.iterfind("connection[@via]"))
    requests = {r.attrib["index"]: r for r in root.iterfind("junction[@id='j']/request")}
    noted = {
        (link.attrib["via"], conflict.attrib["from"], conflict.attrib["to"]): conflict
        for link in links
        for conflict in link.iterfind("conflict")
    }
    near = 0
    for one, other in combinations(links, 2):
        both = [(a.attrib["via"], b.attrib["from"], b.attrib["to"]) for a, b in ((one, other), (other, one))]
        if one.attrib["from"] == other.attrib["from"] or one.attrib["to"] == other.attrib["to"]:
            assert not noted.keys() & set(both)
            continue
        gap = min(math.dist(a, b) for a, b in product(*(points(lanes[link.attrib["via"]]) for link in (one, other))))
        if gap < WIDTH / 2:  # beyond that it depends on how robots cut corners
            near += 1
            assert noted.keys() >= set(both)
        for mine, foe in ((one, other), (other, one)):
            conflict = noted.get((mine.attrib["via"], foe.attrib["from"], foe.attrib["to"]))
            if conflict is None:
                continue
            assert 0.0 < float(conflict.attrib["startPos"]) < float(conflict.attrib["endPos"])
            bits = requests[mine.attrib["via"].split("_")[-2]].attrib
            place = -1 - int(foe.attrib["via"].split("_")[-2])
            assert bits["foes"][place] == bits["response"][place] == "1"
    assert near


def test_the_check_takes_a_network_with_conflicts_for_the_map_s(tmp_path: Path) -> None:
    """And SUMO reads it."""
    building = star(tmp_path, *STAR)
    assert building.network is not None
    assert check_network(building, building.network) == ()
    with Corridors(building, seed=1) as corridors:
        corridors.step()


@pytest.mark.parametrize("seed", range(4))
def test_all_come_over_a_crowded_crossing_and_nobody_touches_another(tmp_path: Path, seed: int) -> None:
    """Two robots for each of the twenty ways over a crossing of five corridors, in any order and at any speed."""
    building, draw = star(tmp_path, *STAR), random.Random(seed)
    crowd = 2 * routes(building)
    draw.shuffle(crowd)
    left = {RobotId(f"r{number:02}") for number in range(len(crowd))}
    with Corridors(building, seed=1) as corridors:
        for robot, route in zip(sorted(left), crowd, strict=True):
            corridors.enter(robot, route, draw.choice((0.5, 1.0, 1.2)))
        for _ in range(1500):
            corridors.step()
            places = [pose.point for pose in corridors.poses().values()]
            assert min((math.dist(a, b) for a, b in combinations(places, 2)), default=math.inf) >= WIDTH
            for robot in corridors.arrived():
                corridors.remove(robot)
                left.remove(robot)
    assert not left


def routes(building: BuildingMap) -> list[Route]:
    """From every door to every other."""
    ways = Routes(building)
    found = [ways.quickest(a.id, b.id, lambda _: 0.0)[0] for a in building.doors for b in building.doors if a != b]
    return [route for route in found if route is not None]


@pytest.mark.parametrize("degrees", [STAR, (0.0, 50.0, 100.0), (20.0, 100.0, 150.0, 260.0)])
def test_any_two_robots_that_meet_on_a_crossing_pass_without_touching(
    tmp_path: Path, degrees: tuple[float, ...]
) -> None:
    """Each pair of ways, one robot a little later than the other, by up to what it takes to cross."""
    building = star(tmp_path, *degrees)
    pairs = [(a, b) for a, b in combinations(routes(building), 2) if a.start != b.start and a.end != b.end]
    with Corridors(building, seed=1) as corridors:
        for number, (one, other) in enumerate(pairs):
            robots = RobotId("one"), RobotId("other")
            late = 0.6 * (number % 7)
            corridors.enter(robots[0], one, 1.0)
            time, inside = 0.0, False
            while not (inside and all(map(corridors.has_arrived, robots))):
                if not inside and time >= late:
                    corridors.enter(robots[1], other, 1.0)
                    inside = True
                corridors.step()
                time += 0.2
                assert time < 60.0, (one, other)
                poses = list(corridors.poses().values())
                assert len(poses) < 2 or math.dist(poses[0].point, poses[1].point) >= WIDTH, (one, other, poses)
            for robot in robots:
                corridors.remove(robot)
