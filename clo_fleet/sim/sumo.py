"""SUMO (libsumo), as far as corridors need it.

===========================  ================================================================
here                         SUMO
===========================  ================================================================
robot                        vehicle of the same id, 0.8 m long for a robot of 0.6 m diameter
corridor, one direction      edge with one lane (see ``network``)
pose: centre, heading        front bumper; degrees clockwise from north
robot that entered           departed vehicle
robot that arrived           vehicle holding at a stop at the end of its last lane
robot that is just leaving   the same vehicle still: nobody may drive up to where its body stands yet
===========================  ================================================================

libsumo simulates one network per process, and starting a second silently replaces the first; so ``Sumo`` refuses to
open while another is open. Nothing of libsumo leaves this file: while closed, everything raises
``CorridorsMisuseError``, and whatever libsumo raises becomes ``CorridorsFailedError``.
"""

import tempfile
from collections.abc import Collection, Iterable, Mapping, Sequence
from math import atan2, inf, pi, radians
from pathlib import Path
from typing import Any

from clo_fleet.sim.corridor_errors import (
    CorridorsFailedError,
    CorridorsMisuseError,
    CorridorsOpenError,
    NetworkRefusedError,
)
from clo_fleet.sim.nearby import Nearby
from clo_fleet.sim.preflight import check_libsumo
from clo_fleet.sim.stderr import stderr_into
from clo_fleet.sim.vehicle import ENTRY_ROOM, LENGTH, VEHICLE, VEHICLE_TYPE, vehicle_pose
from clo_fleet.world.model import Point, Pose, RobotId

__all__ = ["SHORT", "Sumo"]

FOR_EVER = 1e8  # [s]
STANDING = 0.05  # [m/s]
STANDING_TIME = 1.0  # [s] of standing before a robot counts as waiting
CLOSE = 1.0  # [m] ahead of a waiting robot: what stands further off does not hold it up; SUMO keeps 0.3
OPTIONS = (
    *("--time-to-teleport", "-1"),  # teleported robots pass through one another
    *("--collision.action", "warn"),
    *("--save-state.precision", "9"),
    "--no-warnings",
    "--no-step-log",
    "--duration-log.disable",
)
CRAWL = 0.001  # [m/s] a speed that SUMO takes for one in a saved state
SHORT = 300  # characters of SUMO's messages that are passed on


class Sumo:
    """The one SUMO of this process: its network, and the vehicles on it."""

    def __init__(self, *, seed: int, tick: float) -> None:
        """SUMO, closed. ``tick``: how far one step goes [s]."""
        self._seed = seed
        self._tick = tick
        self._libsumo: Any = None
        self._lanes: Nearby | None = None  # those on crossings included
        self._routes: set[str] = set()  # those that SUMO knows
        self._types: set[str] = set()
        self._ticks = 0  # since it was opened
        self._may_wait: dict[RobotId, int] = {}  # the tick until which each robot cannot have stood for long enough

    def open(
        self, network: Path, saved: Path | None, max_speeds: Mapping[RobotId, float], closed: Iterable[str]
    ) -> None:
        """Start.

        Args:
            network: the file.
            saved: from ``save``, to go on from there.
            max_speeds: of the robots that are there then [m/s].
            closed: the edges that are closed then.

        Raises:
            CorridorsOpenError: if one is open already.
            MissingLibraryError: if libsumo lacks system libraries.
            NetworkRefusedError: if SUMO refuses the network.
            CorridorsFailedError: if it refuses the state to go on from.
        """
        check_libsumo()
        import libsumo  # takes up to a second, and only runs need it

        if libsumo.isLoaded():
            raise CorridorsOpenError("corridors are open already in this process: close them first")
        self._start(libsumo, network, saved)
        self._libsumo = libsumo
        self._may_wait.clear()
        try:
            with self._doing("take over the robots") as sumo:
                self._set_up(sumo, max_speeds, closed)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop, if open."""
        if self._libsumo is not None:
            self._libsumo.close()
            self._libsumo = None

    def step(self) -> tuple[list[RobotId], list[RobotId]]:
        """Let one tick of traffic happen; returns who has been let in, and who has come to its stop, sorted."""
        with self._doing("go on") as sumo:
            sumo.simulationStep()
            departed = sumo.simulation.getDepartedIDList()
            stopped = sumo.simulation.getStopStartingVehiclesIDList()
        self._ticks += 1
        return sorted(map(RobotId, departed)), sorted(map(RobotId, stopped))

    def save(self, path: Path) -> None:
        """Write its state to a file, ``.xml`` or ``.xml.gz``."""
        with self._doing("save its state") as sumo:
            still = [of_type for of_type in sorted(self._types) if sumo.vehicletype.getMaxSpeed(of_type) < CRAWL]
            for of_type in still:  # SUMO does not load a type that stands; opening gives robots their own speed again
                sumo.vehicletype.setMaxSpeed(of_type, CRAWL)
            sumo.simulation.saveState(str(path))
            for of_type in still:
                sumo.vehicletype.setMaxSpeed(of_type, 0.0)

    # ---- lanes ---------------------------------------------------------------------------------------------

    def length(self, edge: str) -> float:
        """How long the lane of an edge is [m]."""
        with self._doing("measure the lanes") as sumo:
            return float(sumo.lane.getLength(_lane(edge)))

    def entry_free(self, edge: str) -> bool:
        """Whether the lane of an edge has room for one more robot at its beginning."""
        with self._doing("look at a lane") as sumo:
            there = sumo.lane.getLastStepVehicleIDs(_lane(edge))
            return all(sumo.vehicle.getLanePosition(v) - LENGTH >= ENTRY_ROOM for v in there)

    def pose_on_lane(self, edge: str, front: float) -> Pose:
        """The pose of a robot with its front at a point of the edge's lane [m]."""
        with self._doing("measure a lane") as sumo:
            (x, y), (back_x, back_y) = (sumo.simulation.convert2D(edge, at, 0) for at in (front, front - LENGTH))
        return vehicle_pose((x, y), atan2(y - back_y, x - back_x))

    def close_edge(self, edge: str) -> None:
        """Let nobody drive onto an edge any more."""
        with self._doing(f"close {edge!r}") as sumo:
            _close(sumo, edge)

    def open_edge(self, edge: str) -> None:
        """Let robots drive onto an edge again."""
        with self._doing(f"open {edge!r}") as sumo:
            _open(sumo, edge)

    # ---- robots --------------------------------------------------------------------------------------------

    def add(self, robot: RobotId, edges: Sequence[str], max_speed: float) -> None:
        """Let a robot in, standing, as soon as there is room; it is to stop at the end of these edges."""
        with self._doing(f"add robot {robot!r}") as sumo:
            name = " ".join(edges)
            if name not in self._routes:
                sumo.route.add(name, edges)
                self._routes.add(name)
            of_type = self._give_type(sumo, robot, max_speed)
            sumo.vehicle.add(robot, name, typeID=of_type, depart="now", departPos="base", departSpeed="0")
            _stop_at_end(sumo, robot, edges[-1])

    def remove(self, robot: RobotId) -> None:
        """Take a robot out, let in or not."""
        self._may_wait.pop(robot, None)
        with self._doing(f"remove robot {robot!r}") as sumo:
            sumo.vehicle.remove(robot)

    def set_max_speed(self, robot: RobotId, max_speed: float) -> None:
        """Change a robot's own limit [m/s]."""
        with self._doing(f"change the speed of robot {robot!r}") as sumo:
            self._give_type(sumo, robot, max_speed)

    def divert(self, robot: RobotId, edges: Sequence[str], number: int, closed: Collection[str]) -> None:
        """Send a robot on along other edges; it is on that of this number. ``closed``: those that are closed now."""
        with self._doing(f"divert robot {robot!r}") as sumo:
            sumo.vehicle.replaceStop(robot, 0, "")
            shut = sorted(set(edges[: number + 1]).intersection(closed))
            for edge in shut:  # SUMO wants a route to be open where the robot has been as well
                _open(sumo, edge)
            sumo.vehicle.setRoute(robot, edges[number:])
            for edge in shut:
                _close(sumo, edge)
            _stop_at_end(sumo, robot, edges[-1])

    def pose(self, robot: RobotId) -> Pose:
        """Where a robot is."""
        with self._doing("find a robot") as sumo:
            return _vehicle_pose(sumo, robot)

    def poses(self, robots: Iterable[RobotId]) -> dict[RobotId, Pose]:
        """Where each of some robots is."""
        with self._doing("find the robots") as sumo:
            return {robot: _vehicle_pose(sumo, robot) for robot in robots}

    def near(self, point: Point, within: float, among: Collection[RobotId]) -> list[Pose]:
        """The poses of those robots whose centre may be this near to a point [m], and perhaps of some beyond."""
        with self._doing("look for robots near by") as sumo:
            if self._lanes is None:
                self._lanes = Nearby({lane: sumo.lane.getShape(lane) for lane in sumo.lane.getIDList()})
            lanes = self._lanes.names(point, within + LENGTH)
            there = sorted(RobotId(v) for lane in lanes for v in sumo.lane.getLastStepVehicleIDs(lane))
            return [_vehicle_pose(sumo, robot) for robot in there if robot in among]

    def speed(self, robot: RobotId) -> float:
        """How fast a robot drives [m/s]."""
        with self._doing("measure a robot's speed") as sumo:
            return float(sumo.vehicle.getSpeed(robot))

    def odometer(self, robot: RobotId) -> float:
        """How far a robot has come since it entered [m]."""
        with self._doing("read an odometer") as sumo:
            return float(sumo.vehicle.getDistance(robot))

    def waiting(self, robots: Iterable[RobotId]) -> dict[RobotId, RobotId | None]:
        """Those of some robots that have stood on their way for over a second, and the robot that each stands behind.

        ``None`` stands for another reason, such as cross traffic or a breakdown. Whoever drives now is not looked at
        again before it can have stood so long.
        """
        found: dict[RobotId, RobotId | None] = {}
        due = [robot for robot in robots if self._may_wait.get(robot, 0) <= self._ticks]
        with self._doing("look for waiting robots") as sumo:
            for robot in due:
                stood = sumo.vehicle.getWaitingTime(robot)  # 0 for those that hold
                if stood > STANDING_TIME and sumo.vehicle.getSpeed(robot) < STANDING:
                    leader, gap = sumo.vehicle.getLeader(robot, CLOSE) or ("", inf)
                    found[robot] = RobotId(leader) if gap <= CLOSE else None
                self._may_wait[robot] = self._ticks + int(max(0.0, STANDING_TIME - stood) / self._tick)
        return found

    # ---- how far they are on their ways --------------------------------------------------------------------

    def mark(self, robot: RobotId) -> int:
        """A number that becomes another when the robot's front comes onto the next edge."""
        with self._doing("follow a robot") as sumo:
            return int(sumo.vehicle.getRouteIndex(robot))

    def soonest_ahead(self, robot: RobotId, max_speed: float) -> int:
        """The ticks in which the robot's front is sure not to come off its lane, unless its limit [m/s] is raised."""
        with self._doing("follow a robot") as sumo:
            left = sumo.lane.getLength(sumo.vehicle.getLaneID(robot)) - sumo.vehicle.getLanePosition(robot)
            return int(left / (max(max_speed, sumo.vehicle.getSpeed(robot), CRAWL) * self._tick))

    def number(self, robot: RobotId, edges: Sequence[str]) -> int:
        """On which of these edges, along which it was sent, a robot is with its front."""
        with self._doing("find a robot") as sumo:
            return _number(sumo, robot, edges)

    def tail_number(self, robot: RobotId, edges: Sequence[str]) -> int:
        """On which of these edges, along which it was sent, a robot is with its tail."""
        with self._doing("find a robot") as sumo:
            number = _number(sumo, robot, edges)
            straddles = number > 0 and sumo.vehicle.getLanePosition(robot) < LENGTH
            return number - 1 if straddles and sumo.vehicle.getRoadID(robot) == edges[number] else number

    def turning_point(self, robot: RobotId) -> str | None:
        """The edge on which a robot drives, if it could still turn off at the end of it; ``None`` else."""
        with self._doing("find a robot") as sumo:
            edge, speed = sumo.vehicle.getRoadID(robot), sumo.vehicle.getSpeed(robot)
            if edge.startswith(":"):
                return None
            left = sumo.lane.getLength(_lane(edge)) - sumo.vehicle.getLanePosition(robot)
        return str(edge) if left > speed * speed / VEHICLE["Decel"] + speed * self._tick else None

    # ---- private -------------------------------------------------------------------------------------------

    def _start(self, libsumo: Any, network: Path, saved: Path | None) -> None:
        command = ["sumo", "-n", str(network), "--step-length", str(self._tick), "--seed", str(self._seed % 2**31)]
        if saved is not None:
            command += ["--load-state", str(saved)]
        with tempfile.TemporaryFile() as said:
            try:
                with stderr_into(said):
                    libsumo.start([*command, *OPTIONS])
            except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
                libsumo.close()
                said.seek(0)
                reason = " ".join((said.read().decode(errors="replace") or str(error)).split())[:SHORT]
                if saved is None:
                    raise NetworkRefusedError(network, reason) from error
                raise CorridorsFailedError(f"go on from {saved.name}", reason) from error

    def _set_up(self, sumo: Any, max_speeds: Mapping[RobotId, float], closed: Iterable[str]) -> None:
        """Tell a SUMO that has just started or loaded a state what it does not know."""
        self._routes = set(sumo.route.getIDList())
        if VEHICLE_TYPE not in sumo.vehicletype.getIDList():
            sumo.vehicletype.copy("DEFAULT_VEHTYPE", VEHICLE_TYPE)
        for name, value in VEHICLE.items():
            getattr(sumo.vehicletype, f"set{name}")(VEHICLE_TYPE, value)
        self._types = {of_type for of_type in sumo.vehicletype.getIDList() if of_type.startswith(f"{VEHICLE_TYPE}-")}
        for robot, max_speed in max_speeds.items():
            self._give_type(sumo, robot, max_speed)
        for edge in sorted(closed):
            _close(sumo, edge)

    def _give_type(self, sumo: Any, robot: RobotId, max_speed: float) -> str:
        """The robot's own vehicle type, with its speed.

        SUMO makes a type of its own as well for a vehicle whose speed is set, but a saved state keeps such types of
        vehicles that are gone, and after loading it their robots cannot be added again.
        """
        of_type = f"{VEHICLE_TYPE}-{robot}"
        if of_type not in self._types:
            sumo.vehicletype.copy(VEHICLE_TYPE, of_type)
            self._types.add(of_type)
        sumo.vehicletype.setMaxSpeed(of_type, max_speed)
        return of_type

    def _doing(self, task: str) -> "_Doing":
        """libsumo, for a task at which it may fail."""
        if self._libsumo is None:
            raise CorridorsMisuseError("the corridors are not open")
        return _Doing(self._libsumo, task)


class _Doing:
    """What libsumo raises at a task is raised as ``CorridorsFailedError``; a generator would take thrice as long."""

    __slots__ = ("_libsumo", "_task")

    def __init__(self, libsumo: Any, task: str) -> None:
        self._libsumo, self._task = libsumo, task

    def __enter__(self) -> Any:
        return self._libsumo

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if error is not None and isinstance(error, (self._libsumo.TraCIException, self._libsumo.FatalTraCIError)):
            raise CorridorsFailedError(self._task, str(error)[:SHORT]) from error


def _lane(edge: str) -> str:
    return f"{edge}_0"


def _close(sumo: Any, edge: str) -> None:
    sumo.lane.setDisallowed(_lane(edge), ["all"])


def _open(sumo: Any, edge: str) -> None:
    sumo.lane.setDisallowed(_lane(edge), [])


def _stop_at_end(sumo: Any, robot: RobotId, edge: str) -> None:
    sumo.vehicle.setStop(robot, edge, sumo.lane.getLength(_lane(edge)), 0, FOR_EVER, 0)


def _vehicle_pose(sumo: Any, robot: RobotId) -> Pose:
    """The pose of a vehicle, which points ``getAngle`` degrees clockwise from north."""
    return vehicle_pose(sumo.vehicle.getPosition(robot), pi / 2 - radians(sumo.vehicle.getAngle(robot)))


def _number(sumo: Any, robot: RobotId, edges: Sequence[str]) -> int:
    """On which edge of its route a robot is, counted from its end: SUMO may have forgotten its beginning or not."""
    left = len(sumo.vehicle.getRoute(robot)) - sumo.vehicle.getRouteIndex(robot)
    return len(edges) - int(left)
