"""Corridor traffic, with SUMO itself: entering, driving, holding, leaving, and what is refused."""

import gzip
import json
import pickle
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, pairwise
from math import cos, dist, pi, remainder, sin, tau
from pathlib import Path

import pytest

from clo_fleet.sim.corridors import (
    Corridors,
    CorridorsFailedError,
    CorridorsMisuseError,
    CorridorsOpenError,
    NetworkRefusedError,
)
from clo_fleet.sim.network import build_network
from clo_fleet.sim.routes import Route, Routes
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    Point,
    Pose,
    RobotId,
    RoomId,
)

W, E, S, N = map(DoorId, ("west", "east", "south", "north"))
POSITIONS: dict[DoorId, Point] = {W: (-8.0, 0.0), E: (8.0, 0.0), S: (0.0, -8.0), N: (0.0, 8.0)}
R1, R2, R3 = map(RobotId, ("r1", "r2", "r3"))


def door(name: DoorId) -> Door:
    """A door onto corridors."""
    return Door(id=name, rooms=(RoomId(f"l-{name}"),), position=POSITIONS[name], heading=0.0, width=1.6)


def corridor(name: str, start: str, end: str, *shape: Point, max_speed: float = 1.5) -> Corridor:
    """A corridor along a line."""
    return Corridor(id=CorridorId(name), start=start, end=end, shape=shape, max_speed=max_speed)


def star(name: str, *doors: DoorId) -> BuildingMap:
    """Corridors of 8 m from the doors to a junction in the middle."""
    return BuildingMap(
        name=name,
        rooms=(),
        doors=tuple(door(d) for d in doors),
        junctions=(Junction("j", (0.0, 0.0)),),
        corridors=tuple(corridor(f"c-{d}", d, "j", POSITIONS[d], (0.0, 0.0)) for d in doors),
    )


def built(building: BuildingMap, folder: Path) -> BuildingMap:
    """The map with its network."""
    path = folder / f"{building.name}.net.xml.gz"
    build_network(building, path)
    return replace(building, network=path)


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> BuildingMap:
    """Two rooms, one corridor of 8 m."""
    west = Door(id=W, rooms=(RoomId("l1"),), position=(-8.0, 0.0), heading=0.0, width=1.6)
    east = Door(id=E, rooms=(RoomId("l2"),), position=(0.0, 0.0), heading=pi, width=1.6)
    building = BuildingMap(
        name="line",
        rooms=(),
        doors=(west, east),
        corridors=(corridor("c1", W, E, (-8.0, 0.0), (0.0, 0.0)),),
    )
    return built(building, tmp_path_factory.mktemp("line"))


@pytest.fixture(scope="module")
def tee(tmp_path_factory: pytest.TempPathFactory) -> BuildingMap:
    """Three doors round a junction."""
    return built(star("tee", W, E, N), tmp_path_factory.mktemp("tee"))


@pytest.fixture(scope="module")
def plus(tmp_path_factory: pytest.TempPathFactory) -> BuildingMap:
    """Four doors round a crossing."""
    return built(star("plus", W, E, S, N), tmp_path_factory.mktemp("plus"))


def way(corridors: Corridors, start: DoorId, end: DoorId) -> Route:
    """The route, which exists."""
    route = Routes(corridors.building).fastest(start, end)
    assert route is not None
    return route


def steps(corridors: Corridors, count: int) -> Iterator[dict[RobotId, Pose]]:
    """Where the robots are after each of some steps."""
    for _ in range(count):
        corridors.step()
        yield corridors.poses()


def near(pose: Pose, other: Pose) -> bool:
    """Whether two poses differ by less than 0.01 m and 0.01 rad."""
    return dist(pose.point, other.point) < 0.01 and abs(remainder(pose.heading - other.heading, tau)) < 0.01


def apart(a: Pose, b: Pose) -> float:
    """The smallest distance between two robots' centres or the circles at their ends [m], as rims 0.3 m away."""

    def middles(p: Pose) -> list[Point]:
        return [(p.x + d * cos(p.heading), p.y + d * sin(p.heading)) for d in (-0.1, 0.0, 0.1)]

    return min(dist(p, q) for p in middles(a) for q in middles(b))


def test_a_robot_enters_drives_and_holds_until_it_is_removed(line: BuildingMap) -> None:
    """Its life in the corridors, with the poses that were foretold."""
    with Corridors(line, seed=1) as corridors:
        route = way(corridors, W, E)
        assert (route.edges, route.length) == (("c1",), 8.0)
        assert route.time == pytest.approx(8 / 1.5)
        corridors.enter(R1, route, 1.0)
        assert (corridors.entered(), corridors.poses()) == ((), {})
        corridors.step()
        assert corridors.entered() == (R1,)
        assert near(corridors.pose(R1), corridors.entry_pose(route))
        assert near(corridors.pose(R1), Pose(-7.5, -0.35, 0.0))
        corridors.step()
        assert corridors.entered() == ()
        for _ in steps(corridors, 60):
            pass
        assert corridors.arrived() == (R1,)
        assert corridors.speed(R1) == 0.0
        assert corridors.waiting() == {}
        for _ in steps(corridors, 60):
            pass
        assert near(corridors.pose(R1), corridors.exit_pose(route))
        assert near(corridors.remove(R1), Pose(-0.4, -0.35, 0.0))
        assert (corridors.arrived(), corridors.poses()) == ((), {})


def test_traffic_keeps_right_in_both_directions(line: BuildingMap) -> None:
    """Two robots pass each other in a corridor, each at its own limit."""
    with Corridors(line, seed=1) as corridors:
        corridors.enter(R1, way(corridors, W, E), 1.5)
        corridors.enter(R2, way(corridors, E, W), 0.5)
        tracks = list(steps(corridors, 100))
        assert {round(p[R1].y, 3) for p in tracks} == {-0.35}
        assert {round(p[R2].y, 3) for p in tracks} == {0.35}
        assert corridors.arrived() == (R1, R2)
        fastest = {r: max(dist(a[r].point, b[r].point) for a, b in pairwise(tracks)) / 0.2 for r in (R1, R2)}
        assert fastest[R1] == pytest.approx(1.5, abs=0.01)
        assert fastest[R2] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("start", "end"), [(a, b) for a in (W, E, S, N) for b in (W, E, S, N) if a != b])
def test_entry_and_exit_poses_are_foretold_for_every_way(plus: BuildingMap, start: DoorId, end: DoorId) -> None:
    """Straight on, left and right, from and to each side; and never a jump on the way."""
    with Corridors(plus, seed=1) as corridors:
        route = way(corridors, start, end)
        corridors.enter(R1, route, 1.5)
        track = [poses[R1] for poses in steps(corridors, 100)]
        assert corridors.arrived() == (R1,)
        assert near(track[0], corridors.entry_pose(route))
        assert near(track[-1], corridors.exit_pose(route))
        assert dist(track[0].point, POSITIONS[start]) == pytest.approx(dist((0.5, 0.35), (0, 0)), abs=0.01)
        assert dist(track[-1].point, POSITIONS[end]) == pytest.approx(dist((0.4, 0.35), (0, 0)), abs=0.01)
        assert max(dist(a.point, b.point) for a, b in pairwise(track)) < 0.5


def test_a_slow_robot_delays_the_one_behind_it(line: BuildingMap) -> None:
    """Corridors are narrow: nobody overtakes."""

    def arrival(first_speed: float) -> int:
        with Corridors(line, seed=1) as corridors:
            route = way(corridors, W, E)
            corridors.enter(R1, route, first_speed)
            corridors.enter(R2, route, 1.5)
            for tick in range(400):
                corridors.step()
                if R1 in corridors.arrived():
                    corridors.remove(R1)
                if R2 in corridors.arrived():
                    return tick
        raise AssertionError("never arrived")

    assert arrival(0.3) > arrival(1.5) + 50


def test_a_robot_that_holds_keeps_the_others_back(line: BuildingMap) -> None:
    """Spill-back: the queue reaches the entry, and moves on when its head leaves."""
    with Corridors(line, seed=1) as corridors:
        route = way(corridors, W, E)
        queue = [RobotId(f"q{i}") for i in range(9)]
        for robot in queue:
            corridors.enter(robot, route, 1.5)
        for _ in steps(corridors, 200):
            pass
        inside = corridors.poses()
        assert list(inside) == queue[:7]  # 8 m hold 7 robots of 0.8 m with their gaps
        assert corridors.arrived() == (queue[0],)
        assert corridors.waiting() == {b: a for a, b in pairwise(queue[:7])}
        assert not corridors.entry_clear(route)
        assert all(apart(a, b) >= 0.6 for a, b in combinations(inside.values(), 2))
        corridors.let_out(queue[0])
        for _ in steps(corridors, 50):
            pass
        assert corridors.arrived() == ()
        assert list(corridors.poses()) == queue[1:7]  # nobody came up to where the first may still be
        corridors.remove(queue[0])
        for _ in steps(corridors, 50):
            pass
        assert corridors.arrived() == (queue[1],)
        assert queue[7] in corridors.poses()


def test_an_entry_is_clear_until_somebody_asks_for_it_or_stands_in_it(line: BuildingMap) -> None:
    """A robot let in leaves the entry clear once it is 0.3 m and a length further."""
    with Corridors(line, seed=1) as corridors:
        route, back = way(corridors, W, E), way(corridors, E, W)
        assert corridors.entry_clear(route)
        corridors.enter(R1, route, 1.5)
        assert not corridors.entry_clear(route)
        assert corridors.entry_clear(back)
        corridors.step()
        assert not corridors.entry_clear(route)
        while not corridors.entry_clear(route):
            corridors.step()
        assert corridors.pose(R1).x - corridors.entry_pose(route).x == pytest.approx(1.1, abs=0.3)
        corridors.enter(R2, route, 1.5)
        corridors.step()
        assert corridors.entered() == (R2,)


def test_a_breakdown_is_waited_for(tee: BuildingMap) -> None:
    """A robot that stands waits for nobody; the one behind it waits for it; both go on once it can."""
    with Corridors(tee, seed=1) as corridors:
        route = way(corridors, W, N)
        corridors.enter(R1, route, 1.0)
        for _ in steps(corridors, 15):
            pass
        corridors.set_max_speed(R1, 0.0)
        corridors.enter(R2, route, 1.0)
        for _ in steps(corridors, 40):
            pass
        assert corridors.waiting() == {R1: None, R2: R1}
        corridors.set_max_speed(R1, 1.0)
        for _ in steps(corridors, 150):
            pass
        assert corridors.arrived() == (R1,)
        assert corridors.waiting() == {R2: R1}


def test_lanes_left_and_who_waits_are_known_in_every_tick_though_few_are_looked_at(plus: BuildingMap) -> None:
    """Also of those that are slowed down, stopped, and made faster than before: as one finds who looks at them all."""
    known: dict[RobotId, tuple[str, ...]] = {}
    with Corridors(plus, seed=3) as corridors:
        for i, (a, b) in enumerate((a, b) for a in (W, E, S, N) for b in (W, E, S, N) if a != b):
            corridors.enter(RobotId(f"r{i:02}"), way(corridors, a, b), 0.5 + 0.1 * (i % 7))
        waited: set[RobotId] = set()
        for tick, poses in enumerate(steps(corridors, 500)):
            known |= corridors.moved_on()
            assert {robot: corridors.lanes_left(robot) for robot in poses} == {robot: known[robot] for robot in poses}
            waiting = corridors.waiting()
            looks, corridors._sumo._may_wait = corridors._sumo._may_wait, {}
            assert corridors.waiting() == waiting
            corridors._sumo._may_wait = looks
            waited |= waiting.keys()
            for number, robot in enumerate(poses):
                if (tick + 17 * number) % 120 == 60:
                    corridors.set_max_speed(robot, (0.0, 0.1, 2.0)[number % 3])
                if (tick + 17 * number) % 120 == 100:
                    corridors.set_max_speed(robot, 1.0)
            for robot in corridors.arrived()[:1]:
                if tick % 10 == 0:
                    corridors.remove(robot)
        assert waited
        assert len(corridors.poses()) < 12


def test_in_dense_crossing_traffic_nobody_jumps_or_overlaps_and_all_arrive(plus: BuildingMap) -> None:
    """Twelve robots over every turn of a crossing, and twice the same."""

    def run() -> list[dict[RobotId, Pose]]:
        tracks = []
        with Corridors(plus, seed=3) as corridors:
            gone = set()
            for i, (a, b) in enumerate((a, b) for a in (W, E, S, N) for b in (W, E, S, N) if a != b):
                corridors.enter(RobotId(f"r{i:02}"), way(corridors, a, b), 1.0 + 0.05 * (i % 7))
            for poses in steps(corridors, 600):
                tracks.append(poses)
                for robot in corridors.arrived():
                    corridors.remove(robot)
                    gone.add(robot)
            assert len(gone) == 12
        return tracks

    tracks = run()
    assert max(dist(p.point, a[r].point) for a, b in pairwise(tracks) for r, p in b.items() if r in a) < 0.5
    assert min(dist(a.point, b.point) for poses in tracks for a, b in combinations(poses.values(), 2)) >= 0.6
    assert run() == tracks


def test_the_fastest_way_is_taken_not_the_shortest(tmp_path: Path) -> None:
    """A short corridor with a low limit loses to a longer one; the faster of two between the same nodes wins."""
    building = built(
        BuildingMap(
            name="ways",
            rooms=(),
            doors=(door(W), door(E)),
            junctions=(Junction("a", (-4.0, 0.0)), Junction("b", (4.0, 0.0))),
            corridors=(
                corridor("in", W, "a", (-8.0, 0.0), (-4.0, 0.0)),
                corridor("out", "b", E, (4.0, 0.0), (8.0, 0.0)),
                corridor("short", "a", "b", (-4.0, 0.0), (4.0, 0.0), max_speed=0.3),
                corridor("long", "a", "b", (-4.0, 0.0), (0.0, 5.0), (4.0, 0.0)),
            ),
        ),
        tmp_path,
    )
    with Corridors(building, seed=1) as corridors:
        assert way(corridors, W, E).edges == ("in", "long", "out")
        assert way(corridors, E, W).edges == ("-out", "-long", "-in")
        corridors.enter(R1, way(corridors, E, W), 1.5)
        track = [p[R1] for p in steps(corridors, 150)]
        assert corridors.arrived() == (R1,)
        assert max(dist(a.point, b.point) for a, b in pairwise(track)) < 0.5


def test_a_robot_not_yet_let_in_can_be_taken_back_and_come_again(line: BuildingMap) -> None:
    """It is nowhere in the corridors meanwhile."""
    with Corridors(line, seed=1) as corridors:
        route = way(corridors, W, E)
        corridors.enter(R1, route, 1.0)
        assert near(corridors.remove(R1), corridors.entry_pose(route))
        corridors.step()
        assert (corridors.entered(), corridors.poses()) == ((), {})
        corridors.enter(R1, route, 1.0)
        corridors.step()
        assert corridors.entered() == (R1,)


def test_misuse_is_refused_and_changes_nothing(line: BuildingMap) -> None:
    """Each with its own words."""
    corridors = Corridors(line, seed=1)
    route = way(corridors, W, E)
    with pytest.raises(CorridorsMisuseError, match="not open"):
        corridors.enter(R1, route, 1.0)
    with corridors:
        for call in (corridors.pose, corridors.speed, corridors.remove):
            with pytest.raises(CorridorsMisuseError, match="robot 'r1' is not in the corridors"):
                call(R1)
        for speed in (-1.0, float("nan"), float("inf")):
            with pytest.raises(CorridorsMisuseError, match="is no speed limit"):
                corridors.enter(R1, route, speed)
        corridors.enter(R1, route, 1.0)
        with pytest.raises(CorridorsMisuseError, match="has not entered the corridors yet"):
            corridors.pose(R1)
        with pytest.raises(CorridorsMisuseError, match="in the corridors already"):
            corridors.enter(R1, route, 1.0)
        corridors.step()
        with pytest.raises(CorridorsMisuseError, match="on its way to door 'east'"):
            corridors.remove(R1)
        assert list(corridors.poses()) == [R1]
    with pytest.raises(CorridorsMisuseError, match="not open"):
        corridors.step()


def test_corridors_open_once_at_a_time_and_again_after_closing(line: BuildingMap, plus: BuildingMap) -> None:
    """The refused one leaves the open one running."""
    with Corridors(line, seed=1) as first:
        first.enter(R1, way(first, W, E), 1.0)
        with pytest.raises(CorridorsOpenError), Corridors(plus, seed=1):
            pass
        with pytest.raises(CorridorsOpenError), first:
            pass
        first.step()
        assert first.entered() == (R1,)
    first.close()
    with first as again:
        again.step()
        assert again.poses() == {}


def test_a_network_of_another_map_is_refused(line: BuildingMap, plus: BuildingMap) -> None:
    """With what differs and what to do."""
    with pytest.raises(NetworkRefusedError, match=r"edge 'c1' is missing.*build it anew"):
        Corridors(replace(line, network=plus.network), seed=1).__enter__()
    with pytest.raises(NetworkRefusedError, match="the map has none"):
        Corridors(replace(line, network=None), seed=1).__enter__()


def test_a_network_that_sumo_refuses_is_told_in_its_words(
    line: BuildingMap, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """By the error alone, not on the terminal; and the next network opens as if nothing had been."""
    assert line.network is not None
    text = gzip.decompress(line.network.read_bytes()).decode()
    path = tmp_path / "broken.net.xml.gz"
    path.write_bytes(gzip.compress(text.replace('incLanes="c1_0"', 'incLanes="c9_0"').encode()))
    with pytest.raises(NetworkRefusedError, match=r"unknown lane.*c9_0.*build it anew") as caught:
        Corridors(replace(line, network=path), seed=1).__enter__()
    assert capfd.readouterr() == ("", "")
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)  # noqa: S301  # our own bytes
    with Corridors(line, seed=1) as corridors:
        corridors.step()


def test_sumo_is_quiet(line: BuildingMap, capfd: pytest.CaptureFixture[str]) -> None:
    """Nothing on the terminal from opening to closing."""
    with Corridors(line, seed=2**40) as corridors:
        corridors.enter(R1, way(corridors, W, E), 1.0)
        for _ in steps(corridors, 80):
            pass
        corridors.remove(R1)
        corridors.step()
    assert capfd.readouterr() == ("", "")


def test_a_saved_state_goes_on_the_same_way_each_time(plus: BuildingMap, tmp_path: Path) -> None:
    """Robots that drive, hold and have not entered, and their own speeds, come back."""
    saved = tmp_path / "sumo.xml.gz"
    with Corridors(plus, seed=1) as corridors:
        corridors.enter(R1, way(corridors, W, E), 1.5)
        for _ in steps(corridors, 80):
            pass
        assert corridors.arrived() == (R1,)
        corridors.enter(R2, way(corridors, N, S), 0.4)
        corridors.step()
        corridors.step()
        corridors.enter(R3, way(corridors, N, W), 1.2)
        corridors.save(saved)
        state, poses = json.loads(json.dumps(corridors.state())), corridors.poses()

    def resumed() -> list[dict[RobotId, Pose]]:
        with Corridors.from_state(plus, state, saved) as corridors:
            assert corridors.state() == state
            assert all(near(p, poses[r]) for r, p in corridors.poses().items())
            assert corridors.arrived() == (R1,)
            tracks = list(steps(corridors, 300))
            assert corridors.arrived() == (R1, R2, R3)
            return tracks

    tracks = resumed()
    assert resumed() == tracks
    assert max(dist(a[R2].point, b[R2].point) for a, b in pairwise(tracks)) < 0.4 * 0.2 + 0.001


def test_robots_that_have_broken_down_can_be_saved(plus: BuildingMap, tmp_path: Path) -> None:
    """They stand after loading as before, and drive on when their speed is given back; so do those that were away."""
    saved = tmp_path / "sumo.xml.gz"
    with Corridors(plus, seed=1) as corridors:
        corridors.enter(R1, way(corridors, W, E), 1.5)
        corridors.enter(R2, way(corridors, N, S), 1.5)
        for _ in steps(corridors, 80):
            pass
        corridors.set_max_speed(R1, 0.0)
        corridors.remove(R1)
        corridors.enter(R3, way(corridors, N, W), 1.2)
        for _ in steps(corridors, 15):
            pass
        corridors.set_max_speed(R3, 0.0)
        corridors.save(saved)
        state = json.loads(json.dumps(corridors.state()))
        for _ in steps(corridors, 10):
            pass
        assert corridors.speed(R3) == 0.0
    with Corridors.from_state(plus, state, saved) as corridors:
        for _ in steps(corridors, 10):
            pass
        assert corridors.speed(R3) == 0.0
        corridors.set_max_speed(R3, 1.2)
        corridors.enter(R1, way(corridors, W, E), 1.5)
        for _ in steps(corridors, 80):
            pass
        assert corridors.arrived() == (R1, R2, R3)


def test_a_saved_state_that_cannot_be_read_is_told(plus: BuildingMap, tmp_path: Path) -> None:
    """And nothing stays open."""
    state = Corridors(plus, seed=1).state()
    (torn := tmp_path / "torn.xml").write_text("<snapshot")
    with pytest.raises(CorridorsFailedError, match=r"SUMO could not go on from torn\.xml: "):
        Corridors.from_state(plus, state, torn).__enter__()
    with Corridors(plus, seed=1) as corridors:
        corridors.step()


def test_a_door_can_lie_on_a_corridor(tmp_path: Path) -> None:
    """Robots pass it without slowing down, end at it and enter from it."""
    middle = replace(door(N), position=(0.0, 0.0))
    building = built(
        BuildingMap(
            name="passage",
            rooms=(),
            doors=(door(W), door(E), middle),
            corridors=(
                corridor("c1", W, N, (-8.0, 0.0), (0.0, 0.0)),
                corridor("c2", N, E, (0.0, 0.0), (8.0, 0.0)),
            ),
        ),
        tmp_path,
    )
    with Corridors(building, seed=1) as corridors:
        through = Routes(building).route(W, E, ("c1", "c2"))
        to, out = (way(corridors, a, b) for a, b in ((E, N), (N, E)))
        assert (to.edges, out.edges) == (("-c2",), ("c2",))
        corridors.enter(R1, through, 1.5)
        corridors.enter(R2, to, 1.5)
        for tick, _ in enumerate(steps(corridors, 30)):
            assert tick < 8 or corridors.speed(R1) == pytest.approx(1.5)
        corridors.enter(R3, out, 1.5)
        tracks = list(steps(corridors, 60))
        assert corridors.arrived() == (R1, R2)
        assert near(corridors.pose(R2), corridors.exit_pose(to))
        assert all(apart(*pair) >= 0.6 for poses in tracks for pair in combinations(poses.values(), 2))


def test_poses_hold_where_a_lane_is_counted_longer_than_it_is(tmp_path: Path) -> None:
    """Doors 1.6 m from a crossing: 0.6 m of lane, counted as 1.2 m."""
    positions = {W: (-1.6, 0.0), E: (1.6, 0.0), N: (0.0, 8.0)}
    building = built(
        BuildingMap(
            name="short",
            rooms=(),
            doors=tuple(replace(door(d), position=p) for d, p in positions.items()),
            junctions=(Junction("j", (0.0, 0.0)),),
            corridors=tuple(corridor(f"c-{d}", d, "j", p, (0.0, 0.0)) for d, p in positions.items()),
        ),
        tmp_path,
    )
    with Corridors(building, seed=1) as corridors:
        route = way(corridors, W, E)
        corridors.enter(R1, route, 1.5)
        track = [poses[R1] for poses in steps(corridors, 100)]
        assert corridors.arrived() == (R1,)
        assert near(track[0], corridors.entry_pose(route))
        assert near(track[-1], corridors.exit_pose(route))
        assert max(dist(a.point, b.point) for a, b in pairwise(track)) < 0.5
