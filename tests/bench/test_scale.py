"""How a run grows with its robots: the whole tick against the bare engines, real-time factor, memory; and a peer.

Run with ``make bench``. A building of rooms in a grid of two-lane corridors, ten robots a room at most; each robot has
an executive and a plan: most drive to another room, some prepare an object or bring it somewhere. Each size runs in a
process of its own (``python tests/bench/test_scale.py ROBOTS TICKS`` prints its numbers), and the peer in another.

The *bare engines* do the same moves without us, recorded from the run: SUMO gets the same vehicles on the same routes
in the same ticks, pymunk the same discs with the same velocities. Planning is reported apart: plans for such errands
are written down as they are asked for (``Errands``), and what the planner takes for some of these questions is measured
by itself. Nothing is asserted about times; process time is what is measured. 5,000 robots: ``-k 5000``, some minutes.
"""

import json
import math
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any, cast

import pytest

from clo_fleet.planning.planner import PlanFound, PlanReply
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.sim.map_folder import write_building
from clo_fleet.sim.network import NetconvertMissingError
from clo_fleet.study.run import Run
from clo_fleet.world.buildings import Measures, grid
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import ObjectId, ObjectSpec, Pose, RobotId, RobotSpec, World
from clo_fleet.world.schemas import Domain

pytestmark = [pytest.mark.bench, pytest.mark.timeout(1800)]

SIDE = 10  # rooms; twice that for 5,000 robots, so that the building is as full
SPACING = 24.0  # [m] from crossing to crossing
TICKS = {10: 900, 100: 900, 1000: 900, 5000: 150}
FIRST = 150  # [ticks] 30 s in which all set out at once: most of them queue at the doors of their rooms
SAMPLE = 6  # questions that the planner is asked
TICK = 0.2  # [s]


# ---- the world -----------------------------------------------------------------------------------------------


def errands(robots: int, folder: Path, seed: int = 1) -> World:
    """A building, and robots with something to do in it: 7 of 10 drive, the others prepare or bring an object."""
    side = SIDE if robots <= 1000 else 2 * SIDE
    measures = Measures(spacing=SPACING, room=6.0, two_lane=True)
    building, _ = write_building(grid(side, side, measures), folder, force=True)
    draw = random.Random(seed)
    order = sorted(building.rooms, key=lambda room: room.id)
    draw.shuffle(order)
    filled = dict.fromkeys((room.id for room in order), 0)
    specs, objects = [], []

    def spot(number: int) -> tuple[Any, tuple[float, float]]:
        room = order[number % len(order)]
        place, filled[room.id] = filled[room.id], filled[room.id] + 1
        x, y = (max(point[axis] for point in room.outline) for axis in (0, 1))
        return room, (x - 0.5 - 0.8 * (place % 6), y - 0.5 - 0.8 * (place // 6))

    for number in range(robots):
        room, (x, y) = spot(number)
        robot = RobotId(f"r{number:04}")
        goal: tuple[str, ...] = (
            "at-robot",
            robot,
            str(draw.choice([other.id for other in order if other is not room])),
        )
        kind = draw.random()
        if kind > 0.7:
            lies, at = spot(draw.randrange(len(order)))
            objects.append(ObjectSpec(id=ObjectId(f"o{number:04}"), room=lies.id, position=at))
            goal = ("prepared", f"o{number:04}") if kind > 0.85 else ("at-object", f"o{number:04}", goal[2])
        specs.append(RobotSpec(id=robot, room=room.id, pose=Pose(x, y, math.pi), goals=(goal,)))
    return World(
        name=f"{building.name}-{robots}",
        map=building,
        robots=tuple(specs),
        objects=tuple(objects),
        seed=seed,
        until=1e4,
    )


@dataclass
class Errands:
    """Answers the questions of this bench as ``PlannerPool`` would, but at once: the plans are plain."""

    domain: Domain
    asked: dict[str, PlanningTask] = field(default_factory=dict)
    sample: list[PlanningTask] = field(default_factory=list)

    def like(self, _: object) -> bool:
        """They suit the fleet's domain."""
        return True

    def warm(self) -> None:
        """Nothing to start."""

    close = forget = warm

    def submit(self, key: str, task: PlanningTask) -> None:
        """Takes a question."""
        self.asked[key] = task
        if len(self.sample) < SAMPLE:
            self.sample.append(task)

    def result(self, key: str) -> PlanReply:
        """The plan."""
        task = self.asked.pop(key)
        robot, costs = task.robot, dict(task.costs)
        lies = {fact[1]: fact[2] for fact in task.facts if fact[0] == "at-object"}
        here = next(fact[2] for fact in task.facts if fact[:2] == ("at-robot", robot))
        steps: list[tuple[str, ...]] = []

        def drive(start: str, end: str) -> str:
            steps.extend([("move", robot, start, end)] if start != end else [])
            return end

        for goal in task.goals:
            if goal in task.facts:
                continue
            if goal[0] == "at-robot":
                here = drive(here, goal[2])
                continue
            item = goal[1]
            here = drive(here, lies[item])
            if ("prepared", item) not in task.facts:
                steps.append(("prepare", robot, item, here))
            if goal[0] == "at-object":
                steps.append(("grasp", robot, item, here))
                here = drive(here, goal[2])
                steps.append(("place", robot, item, here))
        actions = tuple(self.domain.ground(step[0], step[1:], costs) for step in steps)
        return PlanFound(actions=actions, expansions=0, wall_seconds=0.0)


# ---- the run, and the same by the engines alone ------------------------------------------------------------------


@dataclass
class Recording:
    """What the engines were told, tick by tick."""

    radius: float = 0.3
    entered: list[list[tuple[str, tuple[str, ...], float]]] = field(default_factory=list)
    removed: list[list[str]] = field(default_factory=list)
    bodies: list[dict[str, tuple[float, float, float, float]]] = field(default_factory=list)

    def take(self, run: Run, before: set[str]) -> set[str]:
        """Add a tick; the vehicles there are now."""
        site = run.mission.site
        vehicles = {robot for robot in (spec.id for spec in run.mission.world.robots) if site.in_corridor(robot)}
        state = site.state()["vehicle"]
        self.entered.append(
            [
                (robot, tuple(state[robot]["edges"]), site.max_speed(RobotId(robot)))
                for robot in sorted(vehicles - before)
            ]
        )
        self.removed.append(sorted(before - vehicles))
        velocities = site.rooms.velocities()
        self.bodies.append({r: (p.x, p.y, *velocities[r]) for r, p in site.rooms.poses().items()})
        return cast("set[str]", vehicles)


def whole(robots: int, ticks: int, folder: Path) -> tuple[dict[str, Any], Recording, World]:
    """The run: its numbers, and what it told the engines."""
    begin = time.process_time()
    world = errands(robots, folder)
    made = time.process_time()
    planners = Errands(fleet_binding().domain)
    recording, vehicles, spent, times = Recording(), set[str](), 0.0, []
    with Run(world, "clo", planners=cast("PlannerPool", planners)) as run:
        run.step()
        started = time.process_time()
        for _ in range(ticks):
            before = time.process_time()
            run.step()
            times.append(time.process_time() - before)
            spent += times[-1]
            vehicles = recording.take(run, vehicles)
        under_way = len(vehicles)
        waiting = sum(bool(robot.mode.value == "waiting") for robot in run.mission.robots)
    numbers = {
        "robots": robots,
        "ticks": len(times),
        "tick_ms": spent / len(times) * 1e3,
        "first_ms": sum(times[:FIRST]) / len(times[:FIRST]) * 1e3,
        "typical_ms": median(times) * 1e3,
        "real_time": TICK * len(times) / spent,
        "world_s": made - begin,
        "start_s": started - made,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "vehicles": under_way,
        "waiting": waiting,
        "task": len(planners.sample[0].facts),
        "plan_ms": median(planner_times(planners.sample)) * 1e3,
    }
    return numbers, recording, world


def planner_times(tasks: Iterable[PlanningTask]) -> list[float]:
    """What the planner takes for each of the questions, in its own process [s]."""
    with PlannerPool(fleet_binding().domain, size=1) as pool:
        pool.warm()
        return [pool.plan(task).wall_seconds for task in tasks]


def bare_sumo(world: World, recording: Recording) -> float:
    """The same vehicles on the same routes, entering and leaving in the same ticks [s a tick]."""
    import libsumo

    from clo_fleet.sim.sumo import OPTIONS
    from clo_fleet.sim.vehicle import VEHICLE, VEHICLE_TYPE

    command = ["sumo", "-n", str(world.map.network), "--step-length", str(TICK), *OPTIONS]
    libsumo.start(command)
    libsumo.vehicletype.copy("DEFAULT_VEHTYPE", VEHICLE_TYPE)
    for name, value in VEHICLE.items():
        getattr(libsumo.vehicletype, f"set{name}")(VEHICLE_TYPE, value)
    spent, known = 0.0, set[str]()
    for entering, leaving in zip(recording.entered, recording.removed, strict=True):
        begin = time.process_time()
        for robot in leaving:
            libsumo.vehicle.remove(robot)
        for robot, edges, speed in entering:
            route = " ".join(edges)
            if route not in known:
                libsumo.route.add(route, edges)
                known.add(route)
            libsumo.vehicle.add(robot, route, typeID=VEHICLE_TYPE, depart="now", departPos="base", departSpeed="0")
            libsumo.vehicle.setMaxSpeed(robot, speed)
            libsumo.vehicle.setStop(robot, edges[-1], libsumo.lane.getLength(f"{edges[-1]}_0"), 0, 1e8, 0)
        libsumo.simulationStep()
        spent += time.process_time() - begin
    libsumo.close()
    return spent / len(recording.entered)


def bare_pymunk(world: World, recording: Recording) -> float:
    """The same discs among the same walls, with the velocities that they had [s a tick]."""
    import pymunk

    from clo_fleet.sim.walls import walls

    space = pymunk.Space()
    for begin_at, end_at in walls(world.map):
        space.add(pymunk.Segment(space.static_body, begin_at, end_at, 0.025))
    discs = {}
    for spec in world.robots:
        body = pymunk.Body(20.0, math.inf)
        discs[spec.id] = (body, pymunk.Circle(body, spec.radius))
    spent, present = 0.0, set[str]()
    for bodies in recording.bodies:
        begin = time.process_time()
        for robot in sorted(bodies.keys() - present):
            discs[RobotId(robot)][0].position = bodies[robot][:2]
            space.add(*discs[RobotId(robot)])
        for robot in sorted(present - bodies.keys()):
            space.remove(*discs[RobotId(robot)])
        present = set(bodies)
        for robot, (_, _, vx, vy) in bodies.items():
            if vx or vy:
                discs[RobotId(robot)][0].velocity = vx, vy
        for _ in range(4):
            space.step(TICK / 4)
        spent += time.process_time() - begin
    return spent / len(recording.bodies)


def peer(robots: int, folder: Path, ticks: int = 50) -> float:
    """ir-sim: as many discs that drive to goals of their own in an open field, without planning [s a tick]."""
    import irsim  # type: ignore[import-untyped,import-not-found,unused-ignore]  # no part of the project

    side = 12.0 * math.sqrt(max(robots, 10))
    path = folder / "peer.yaml"
    path.write_text(
        json.dumps(
            {
                "world": {
                    "height": side,
                    "width": side,
                    "step_time": TICK,
                    "sample_time": TICK,
                    "collision_mode": "stop",
                },
                "robot": [
                    {
                        "number": robots,
                        "distribution": {
                            "name": "random",
                            "range_low": [1, 1, -3.14],
                            "range_high": [side, side, 3.14],
                        },
                        "kinematics": {"name": "omni"},
                        "shape": {"name": "circle", "radius": 0.3},
                        "behavior": {"name": "dash"},
                        "vel_max": [1.0, 1.0],
                        "vel_min": [-1.0, -1.0],
                    }
                ],
            }
        )
    )
    env = irsim.make(str(path), display=False, log_level="ERROR", disable_all_plot=True)
    begin = time.process_time()
    for _ in range(ticks):
        env.step()
    return (time.process_time() - begin) / ticks


# ---- the tables --------------------------------------------------------------------------------------------------


def measured(*arguments: str) -> dict[str, Any]:
    """What this file prints when it runs by itself."""
    done = subprocess.run([sys.executable, __file__, *arguments], capture_output=True, text=True, timeout=1700)
    assert done.returncode == 0, done.stderr[-2000:]
    return cast("dict[str, Any]", json.loads(done.stdout.splitlines()[-1]))


def exponent(small: dict[str, Any], large: dict[str, Any], key: str) -> float:
    """How a number grows from one size to another: 1 is linear, 0 constant."""
    return math.log(large[key] / small[key]) / math.log(large["robots"] / small["robots"])


@pytest.mark.parametrize("sizes", [(10, 100, 1000), (5000,)], ids=["1000", "5000"])
def test_how_a_run_grows(
    sizes: tuple[int, ...], request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]
) -> None:
    """One row for each size: ms a tick in all and over the bare engines, real-time factor, memory, planner apart."""
    if 5000 in sizes and "5000" not in request.config.option.keyword:
        pytest.skip("5,000 robots take some minutes: -k 5000")
    if find_spec("sumo") is None:
        pytest.skip(str(NetconvertMissingError()))
    keys = (
        "robots",
        "tick_ms",
        "first_ms",
        "typical_ms",
        "bare_ms",
        "ratio",
        "real_time",
        "peak_mb",
        "vehicles",
        "start_s",
        "plan_ms",
    )
    rows = [measured(str(size), str(TICKS[size])) for size in sizes]
    lines = ["", "  ".join(f"{key:>10}" for key in keys)]
    lines += [
        "  ".join(f"{row[key]:10,.2f}" if isinstance(row[key], float) else f"{row[key]:10,}" for key in keys)
        for row in rows
    ]
    for small, large in pairwise(rows):
        grown = ", ".join(f"{key} {exponent(small, large, key):.2f}" for key in ("tick_ms", "bare_ms", "peak_mb"))
        lines.append(f"exponents from {small['robots']:,} to {large['robots']:,} robots: {grown}")
    with capsys.disabled():
        sys.stdout.write("\n".join([*lines, ""]))


def test_a_peer(capsys: pytest.CaptureFixture[str]) -> None:
    """ir-sim's ms a tick with as many robots, in an open field and without plans."""
    if find_spec("irsim") is None:
        pytest.skip("ir-sim is not installed: pip install ir-sim")
    lines = [
        f"ir-sim, {size:,} robots: {measured('peer', str(size))['tick_ms']:.2f} ms a tick" for size in (10, 100, 1000)
    ]
    with capsys.disabled():
        sys.stdout.write("\n".join(["", *lines, ""]))


def main() -> None:
    """Measure one size, and print the numbers as a line of JSON."""
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1] == "peer":
            sys.stdout.write(json.dumps({"tick_ms": peer(int(sys.argv[2]), Path(folder)) * 1e3}))
            return
        numbers, recording, world = whole(int(sys.argv[1]), int(sys.argv[2]), Path(folder))
        numbers["bare_ms"] = (bare_sumo(world, recording) + bare_pymunk(world, recording)) * 1e3
        numbers["ratio"] = numbers["tick_ms"] / numbers["bare_ms"]
        sys.stdout.write(json.dumps(numbers))


if __name__ == "__main__":
    main()
