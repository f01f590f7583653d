"""Robots in corridors, as vehicles of SUMO (libsumo).

===========================  ================================================================
here                         SUMO
===========================  ================================================================
robot                        vehicle of the same id, 0.8 m long for a robot of 0.6 m diameter
corridor, one direction      edge with one lane (see ``network``)
pose: centre, heading        front bumper; degrees clockwise from north
robot that entered           departed vehicle
robot that arrived           vehicle holding at a stop at the end of its last lane
===========================  ================================================================

Theory of operation. ``enter`` asks for a robot to be let in; the ``step`` in which its lane has room for it inserts it,
and ``entered`` names it. It drives to its far door, where ``arrived`` names it and it holds, with whatever queues up
behind it, until ``remove`` takes it out. Whoever calls keeps the robot's body elsewhere until it has entered and from
when it is removed, so that it is never in both places or in neither.

libsumo simulates one network per process, and starting a second silently replaces the first; so ``Corridors`` is a
context manager that refuses to open while another is open. Nothing of libsumo leaves this file.
"""

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from math import atan2, cos, inf, isfinite, pi, radians, remainder, sin, tau
from pathlib import Path
from typing import IO, Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.network_check import check_network
from clo_fleet.sim.preflight import check_libsumo
from clo_fleet.sim.routes import Route, Routes
from clo_fleet.world.model import BuildingMap, DoorId, Point, Pose, RobotId

__all__ = [
    "Corridors",
    "CorridorsFailedError",
    "CorridorsMisuseError",
    "CorridorsOpenError",
    "NetworkRefusedError",
]

VEHICLE_TYPE = "robot"
VEHICLE = {  # SI units; nothing random in it
    "Length": 0.8,
    "Width": 0.6,
    "MinGap": 0.3,
    "MaxSpeed": 1.5,
    "Accel": 1.0,
    "Decel": 1.5,
    "ApparentDecel": 1.5,
    "Tau": 0.3,
    "Imperfection": 0.0,
    "SpeedDeviation": 0.0,
}
LENGTH = VEHICLE["Length"]
ENTRY = LENGTH + 0.1  # [m] along the first lane: where SUMO's departPos "base" puts the front bumper
ENTRY_ROOM = ENTRY + VEHICLE["MinGap"]  # [m] of the first lane that must be free
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
SHORT = 300  # characters of SUMO's messages that are passed on


class NetworkRefusedError(CloFleetError):
    """SUMO cannot simulate the map's network, or it is not the map's.

    Attributes:
        path: the network file, ``None`` if the map names none.
        reason: what is wrong with it.
    """

    def __init__(self, path: Path | None, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = path, reason

    def __str__(self) -> str:
        return f"corridor network {self.path}: {self.reason}; build it anew with clo-fleet build-network MAP"


class CorridorsOpenError(CloFleetError):
    """The process simulates corridors already, and SUMO can do so only once at a time."""


class CorridorsMisuseError(CloFleetError):
    """A call that does not fit where a robot is, or whether the corridors are open; nothing has changed."""


class CorridorsFailedError(CloFleetError):
    """SUMO failed to do something that it should do.

    Attributes:
        task: what it was to do.
        reason: its own message.
    """

    def __init__(self, task: str, reason: str) -> None:
        super().__init__(task, reason)
        self.task, self.reason = task, reason

    def __str__(self) -> str:
        return f"SUMO could not {self.task}: {self.reason}"


class _Phase(Enum):
    """How far a robot has come."""

    ASKED = "asked"
    DRIVING = "driving"
    HOLDING = "holding"


@dataclass(slots=True)
class _Vehicle:
    """What is kept for each robot."""

    route: Route
    max_speed: float
    phase: _Phase = _Phase.ASKED


class Corridors:
    """The traffic in a building's corridors; use it as a context manager."""

    def __init__(self, building: BuildingMap, *, seed: int, tick: float = 0.2) -> None:
        """Prepare the corridors of a building, closed.

        Args:
            building: with the path of its network.
            seed: any whole number.
            tick: how far one step goes [s].
        """
        self._building = building
        self._seed = seed
        self._tick = tick
        self._saved: Path | None = None
        self._libsumo: Any = None
        self._vehicles: dict[RobotId, _Vehicle] = {}
        self._entered: tuple[RobotId, ...] = ()
        self._known_to_sumo: set[str] = set()
        self._types: set[str] = set()
        self._routes = Routes(building)

    def __enter__(self) -> Self:
        """Start SUMO on the building's network.

        Raises:
            CorridorsOpenError: if some are open already.
            MissingLibraryError: if libsumo lacks system libraries.
            NetworkRefusedError: if the network is not the map's, or SUMO refuses it.
            CorridorsFailedError: if SUMO refuses the state to go on from.
        """
        check_libsumo()
        import libsumo  # takes up to a second, and only runs need it

        if libsumo.isLoaded():
            raise CorridorsOpenError("corridors are open already in this process: close them first")
        path = self._building.network
        if path is None:
            raise NetworkRefusedError(path, "the map has none")
        if faults := check_network(self._building, path):
            raise NetworkRefusedError(path, "; ".join(faults)[:SHORT])
        self._start(libsumo, path)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop SUMO and forget all robots; closed corridors may be closed again."""
        if self._libsumo is not None:
            self._libsumo.close()
            self._libsumo = None
        self._saved = None
        self._vehicles.clear()
        self._entered = ()

    def route(self, start: DoorId, end: DoorId) -> Route | None:
        """The fastest way from door to door in empty corridors; ``None`` if there is none, or if they are the same.

        Raises:
            UnknownDoorError: if the map lacks one of them.
        """
        return self._routes.fastest(start, end)

    def entry_clear(self, route: Route) -> bool:
        """Whether the route's first lane has room for one more robot just behind the door, and none waits for it."""
        first = route.edges[0]
        if any(v.phase is _Phase.ASKED and v.route.edges[0] == first for v in self._vehicles.values()):
            return False
        with self._sumo("look at a lane") as sumo:
            there = sumo.lane.getLastStepVehicleIDs(_lane(first))
            return all(sumo.vehicle.getLanePosition(v) - LENGTH >= ENTRY_ROOM for v in there)

    def entry_pose(self, route: Route) -> Pose:
        """Where a robot is when it has just entered on this route."""
        return self._pose_on_lane(route.edges[0], ENTRY)

    def exit_pose(self, route: Route) -> Pose:
        """Where a robot holds at the end of this route."""
        with self._sumo("measure a lane") as sumo:
            return self._pose_on_lane(route.edges[-1], sumo.lane.getLength(_lane(route.edges[-1])))

    def enter(self, robot: RobotId, route: Route, max_speed: float) -> None:
        """Ask for a robot to be let in, standing, at the start of the route, as soon as there is room.

        Args:
            robot: not yet in these corridors.
            route: from ``route``.
            max_speed: the robot's own limit [m/s].

        Raises:
            CorridorsMisuseError: if the robot is here already, or the speed is no speed.
        """
        if robot in self._vehicles:
            raise CorridorsMisuseError(f"robot {robot!r} is in the corridors already")
        _check_speed(max_speed)
        with self._sumo(f"add robot {robot!r}") as sumo:
            name = " ".join(route.edges)
            if name not in self._known_to_sumo:
                sumo.route.add(name, route.edges)
                self._known_to_sumo.add(name)
            of_type = self._give_type(sumo, robot, max_speed)
            sumo.vehicle.add(robot, name, typeID=of_type, depart="now", departPos="base", departSpeed="0")
            last = route.edges[-1]
            sumo.vehicle.setStop(robot, last, sumo.lane.getLength(_lane(last)), 0, FOR_EVER, 0)
        self._vehicles[robot] = _Vehicle(route, max_speed)

    def step(self) -> None:
        """Let one tick of traffic happen."""
        with self._sumo("go on") as sumo:
            sumo.simulationStep()
            departed = sumo.simulation.getDepartedIDList()
            stopped = sumo.simulation.getStopStartingVehiclesIDList()
        self._entered = tuple(sorted(RobotId(v) for v in departed))
        for robot in self._entered:
            self._vehicles[robot].phase = _Phase.DRIVING
        for robot in stopped:
            self._vehicles[robot].phase = _Phase.HOLDING

    def entered(self) -> tuple[RobotId, ...]:
        """The robots let in by the last step, sorted."""
        return self._entered

    def arrived(self) -> tuple[RobotId, ...]:
        """The robots that hold at their far door, sorted."""
        return tuple(sorted(r for r, v in self._vehicles.items() if v.phase is _Phase.HOLDING))

    def remove(self, robot: RobotId) -> Pose:
        """Take out a robot that has arrived, or that is not let in yet, and tell where it held or would have entered.

        Raises:
            CorridorsMisuseError: if the robot is not here, or on its way.
        """
        vehicle = self._vehicle(robot)
        if vehicle.phase is _Phase.DRIVING:
            raise CorridorsMisuseError(f"robot {robot!r} is on its way to door {vehicle.route.end!r}")
        pose = self.entry_pose(vehicle.route) if vehicle.phase is _Phase.ASKED else self.pose(robot)
        with self._sumo(f"remove robot {robot!r}") as sumo:
            sumo.vehicle.remove(robot)
        del self._vehicles[robot]
        return pose

    def pose(self, robot: RobotId) -> Pose:
        """Where a robot is that has entered (else ``CorridorsMisuseError``)."""
        self._check_inside(robot)
        with self._sumo("find a robot") as sumo:
            return _vehicle_pose(sumo, robot)

    def poses(self) -> dict[RobotId, Pose]:
        """Where each robot is that has entered, sorted by robot."""
        with self._sumo("find the robots") as sumo:
            return {robot: _vehicle_pose(sumo, robot) for robot in self._inside()}

    def speed(self, robot: RobotId) -> float:
        """How fast a robot drives that has entered (else ``CorridorsMisuseError``) [m/s]."""
        self._check_inside(robot)
        with self._sumo("measure a robot's speed") as sumo:
            return float(sumo.vehicle.getSpeed(robot))

    def set_max_speed(self, robot: RobotId, max_speed: float) -> None:
        """Change a robot's own limit [m/s]; 0 brings it to a stand.

        Raises:
            CorridorsMisuseError: if the robot is not here, or the speed is no speed.
        """
        vehicle = self._vehicle(robot)
        _check_speed(max_speed)
        with self._sumo(f"change the speed of robot {robot!r}") as sumo:
            self._give_type(sumo, robot, max_speed)
        vehicle.max_speed = max_speed

    def waiting(self) -> dict[RobotId, RobotId | None]:
        """The robots that have stood on their way for over a second, sorted, and the robot that each stands behind.

        ``None`` stands for another reason, such as cross traffic or a breakdown. Robots that have arrived do not wait.
        """
        found: dict[RobotId, RobotId | None] = {}
        with self._sumo("look for waiting robots") as sumo:
            for robot in self._inside():
                stood = sumo.vehicle.getWaitingTime(robot)  # 0 for those that hold
                if stood > STANDING_TIME and sumo.vehicle.getSpeed(robot) < STANDING:
                    leader, gap = sumo.vehicle.getLeader(robot, CLOSE) or ("", inf)
                    found[robot] = RobotId(leader) if gap <= CLOSE else None
        return found

    def save(self, path: Path) -> None:
        """Write SUMO's half of the state to a file, ``.xml`` or ``.xml.gz``; the other half is ``state``.

        SUMO goes on a little differently after loading. To be repeatable, a run that saves must itself close and go on
        from what it saved.
        """
        with self._sumo("save its state") as sumo:
            sumo.simulation.saveState(str(path))

    def state(self) -> dict[str, object]:
        """What these corridors keep beside SUMO's half of the state, as plain data for JSON."""
        vehicles = {
            robot: {"route": v.route.state(), "max_speed": v.max_speed, "phase": v.phase.value}
            for robot, v in sorted(self._vehicles.items())
        }
        return {"seed": self._seed, "tick": self._tick, "entered": list(self._entered), "vehicles": vehicles}

    @classmethod
    def from_state(cls, building: BuildingMap, state: Mapping[str, Any], saved: Path) -> Self:
        """Corridors, still closed, that go on from a state when opened.

        Args:
            building: the one that they were made with.
            state: from ``state``.
            saved: from ``save`` at the same moment.
        """
        corridors = cls(building, seed=state["seed"], tick=state["tick"])
        corridors._saved = saved
        corridors._entered = tuple(state["entered"])
        for robot, v in state["vehicles"].items():
            corridors._vehicles[robot] = _Vehicle(Route.from_state(v["route"]), v["max_speed"], _Phase(v["phase"]))
        return corridors

    def _start(self, libsumo: Any, path: Path) -> None:
        command = ["sumo", "-n", str(path), "--step-length", str(self._tick), "--seed", str(self._seed % 2**31)]
        if self._saved is not None:
            command += ["--load-state", str(self._saved)]
        with tempfile.TemporaryFile() as said:
            try:
                with _stderr_into(said):
                    libsumo.start([*command, *OPTIONS])
            except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
                libsumo.close()
                said.seek(0)
                reason = " ".join((said.read().decode(errors="replace") or str(error)).split())[:SHORT]
                if self._saved is None:
                    raise NetworkRefusedError(path, reason) from error
                raise CorridorsFailedError(f"go on from {self._saved.name}", reason) from error
        self._libsumo = libsumo
        try:
            with self._sumo("take over the robots") as sumo:
                self._set_up(sumo)
        except BaseException:
            self.close()
            raise

    def _set_up(self, sumo: Any) -> None:
        """Tell a SUMO that has just started or loaded a state what it does not know."""
        self._known_to_sumo = set(sumo.route.getIDList())
        if VEHICLE_TYPE not in sumo.vehicletype.getIDList():
            sumo.vehicletype.copy("DEFAULT_VEHTYPE", VEHICLE_TYPE)
        for name, value in VEHICLE.items():
            getattr(sumo.vehicletype, f"set{name}")(VEHICLE_TYPE, value)
        self._types = {of_type for of_type in sumo.vehicletype.getIDList() if of_type.startswith(f"{VEHICLE_TYPE}-")}
        for robot, vehicle in self._vehicles.items():
            self._give_type(sumo, robot, vehicle.max_speed)

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

    def _vehicle(self, robot: RobotId) -> _Vehicle:
        if robot not in self._vehicles:
            raise CorridorsMisuseError(f"robot {robot!r} is not in the corridors")
        return self._vehicles[robot]

    def _inside(self) -> list[RobotId]:
        return sorted(r for r, v in self._vehicles.items() if v.phase is not _Phase.ASKED)

    def _check_inside(self, robot: RobotId) -> None:
        if self._vehicle(robot).phase is _Phase.ASKED:
            raise CorridorsMisuseError(f"robot {robot!r} has not entered the corridors yet")

    def _pose_on_lane(self, edge: str, front: float) -> Pose:
        """The centre of a robot with its front at a point of the edge's lane [m]."""
        with self._sumo("measure a lane") as sumo:
            (x, y), (back_x, back_y) = (sumo.simulation.convert2D(edge, at, 0) for at in (front, front - LENGTH))
        return _centre((x, y), atan2(y - back_y, x - back_x))

    @contextmanager
    def _sumo(self, task: str) -> Iterator[Any]:
        """libsumo, for a task of which it may fail.

        Raises:
            CorridorsMisuseError: if the corridors are closed.
            CorridorsFailedError: if libsumo raises.
        """
        libsumo = self._libsumo
        if libsumo is None:
            raise CorridorsMisuseError("the corridors are not open")
        try:
            yield libsumo
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            raise CorridorsFailedError(task, str(error)[:SHORT]) from error


@contextmanager
def _stderr_into(file: IO[bytes]) -> Iterator[None]:
    """Catch what is written to standard error: SUMO's exceptions do not say what its messages there say."""
    kept = os.dup(2)
    try:
        os.dup2(file.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _lane(edge: str) -> str:
    return f"{edge}_0"


def _vehicle_pose(sumo: Any, robot: RobotId) -> Pose:
    """The pose of a vehicle, which points ``getAngle`` degrees clockwise from north."""
    return _centre(sumo.vehicle.getPosition(robot), pi / 2 - radians(sumo.vehicle.getAngle(robot)))


def _centre(front: Point, heading: float) -> Pose:
    """The pose of a robot whose front bumper is at a point."""
    x, y = front
    return Pose(x - LENGTH / 2 * cos(heading), y - LENGTH / 2 * sin(heading), remainder(heading, tau))


def _check_speed(speed: float) -> None:
    if not (isfinite(speed) and speed >= 0):
        raise CorridorsMisuseError(f"{speed} m/s is no speed limit")
