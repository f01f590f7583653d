"""Robots in corridors, as vehicles of SUMO (libsumo).

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

Theory of operation. ``enter`` asks for a robot to be let in; the ``step`` in which its lane has room for it inserts it,
and ``entered`` names it. It drives to its far door, where ``arrived`` names it and it holds, with whatever queues up
behind it, until ``let_out`` lets it go and ``remove`` takes its vehicle out. Whoever calls keeps the robot's body
elsewhere until it has entered and from when it is let out, so that it is never in both places or in neither.

libsumo simulates one network per process, and starting a second silently replaces the first; so ``Corridors`` is a
context manager that refuses to open while another is open. Nothing of libsumo leaves this file.
"""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import atan2, inf, pi, radians
from pathlib import Path
from typing import Any, Self

from clo_fleet.sim.corridor_errors import (
    CorridorsFailedError,
    CorridorsMisuseError,
    CorridorsOpenError,
    NetworkRefusedError,
)
from clo_fleet.sim.nearby import Nearby
from clo_fleet.sim.network import network_edges
from clo_fleet.sim.network_check import check_network
from clo_fleet.sim.preflight import check_libsumo
from clo_fleet.sim.routes import Route
from clo_fleet.sim.stderr import stderr_into
from clo_fleet.sim.under_way import Phase, Vehicle
from clo_fleet.sim.vehicle import (
    ENTRY,
    ENTRY_ROOM,
    LENGTH,
    VEHICLE,
    VEHICLE_TYPE,
    check_speed,
    vehicle_pose,
)
from clo_fleet.world.model import BuildingMap, Point, Pose, RobotId

__all__ = [
    "Corridors",
    "CorridorsFailedError",
    "CorridorsMisuseError",
    "CorridorsOpenError",
    "NetworkRefusedError",
]

HELD = -1  # for the index of the edge on which a robot holds at its door
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


class Corridors:
    """The traffic in a building's corridors; use it as a context manager."""

    def __init__(self, building: BuildingMap, *, seed: int, tick: float = 0.2) -> None:
        """Prepare the corridors of a building, closed.

        Args:
            building: with the path of its network.
            seed: any whole number.
            tick: how far one step goes [s].
        """
        self.building = building
        self._seed = seed
        self._tick = tick
        self._saved: Path | None = None
        self._libsumo: Any = None
        self._vehicles: dict[RobotId, Vehicle] = {}
        self._entered: tuple[RobotId, ...] = ()
        self._stopped: tuple[RobotId, ...] = ()
        self._clear_on: dict[RobotId, int] = {}  # SUMO's index of the edge that each is on with all of its length
        self._lanes: Nearby | None = None  # those on crossings included
        self._known_to_sumo: set[str] = set()
        self._types: set[str] = set()
        self._closed: set[str] = set()

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
        path = self.building.network
        if path is None:
            raise NetworkRefusedError(path, "the map has none")
        if self._saved is None and (faults := check_network(self.building, path)):  # what was saved ran on it
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

    def entry_clear(self, route: Route) -> bool:
        """Whether the route's first lane has room for one more robot just behind the door, and none waits for it."""
        first = route.edges[0]
        with self._sumo("look at a lane") as sumo:
            there = sumo.lane.getLastStepVehicleIDs(_lane(first))
            if any(sumo.vehicle.getLanePosition(v) - LENGTH < ENTRY_ROOM for v in there):
                return False
        return all(v.phase is not Phase.ASKED or v.route.edges[0] != first for v in self._vehicles.values())

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
            route: a way through this building.
            max_speed: the robot's own limit [m/s].

        Raises:
            CorridorsMisuseError: if the robot is here already, or the speed is no speed.
        """
        if robot in self._vehicles:
            raise CorridorsMisuseError(f"robot {robot!r} is in the corridors already")
        check_speed(max_speed)
        with self._sumo(f"add robot {robot!r}") as sumo:
            name = " ".join(route.edges)
            if name not in self._known_to_sumo:
                sumo.route.add(name, route.edges)
                self._known_to_sumo.add(name)
            of_type = self._give_type(sumo, robot, max_speed)
            sumo.vehicle.add(robot, name, typeID=of_type, depart="now", departPos="base", departSpeed="0")
            last = route.edges[-1]
            sumo.vehicle.setStop(robot, last, sumo.lane.getLength(_lane(last)), 0, FOR_EVER, 0)
        self._vehicles[robot] = Vehicle(route, max_speed)

    def step(self) -> None:
        """Let one tick of traffic happen."""
        with self._sumo("go on") as sumo:
            sumo.simulationStep()
            departed = sumo.simulation.getDepartedIDList()
            stopped = sumo.simulation.getStopStartingVehiclesIDList()
        self._entered = tuple(sorted(RobotId(v) for v in departed))
        for robot in self._entered:
            self._vehicles[robot].phase = Phase.DRIVING
        self._stopped = tuple(sorted(RobotId(v) for v in stopped))
        for robot in self._stopped:
            self._vehicles[robot].phase = Phase.HOLDING

    def entered(self) -> tuple[RobotId, ...]:
        """The robots let in by the last step, sorted."""
        return self._entered

    def arrived(self) -> tuple[RobotId, ...]:
        """The robots that hold at their far door, sorted."""
        return tuple(sorted(r for r, v in self._vehicles.items() if v.phase is Phase.HOLDING))

    def has_arrived(self, robot: RobotId) -> bool:
        """Whether the robot holds at its far door."""
        return robot in self._vehicles and self._vehicles[robot].phase is Phase.HOLDING

    def stopped(self) -> tuple[RobotId, ...]:
        """The robots that have come to their far doors in the last step, sorted."""
        return self._stopped

    def odometer(self, robot: RobotId) -> float:
        """How far a robot has come since it entered [m]."""
        self._check_inside(robot)
        with self._sumo("read an odometer") as sumo:
            return float(sumo.vehicle.getDistance(robot))

    def near(self, point: Point, within: float) -> list[Pose]:
        """The poses of the robots whose centre may be this near to a point [m], and perhaps of some beyond."""
        with self._sumo("look for robots near by") as sumo:
            if self._lanes is None:
                self._lanes = Nearby({lane: sumo.lane.getShape(lane) for lane in sumo.lane.getIDList()})
            lanes = self._lanes.names(point, within + LENGTH)
            there = sorted(RobotId(v) for lane in lanes for v in sumo.lane.getLastStepVehicleIDs(lane))
            return [_vehicle_pose(sumo, robot) for robot in there if robot in self._vehicles]

    def let_out(self, robot: RobotId) -> Pose:
        """Let go of a robot that has arrived, and tell where it held; there its vehicle keeps the place until removed.

        Raises:
            CorridorsMisuseError: if the robot is not here, or has not arrived.
        """
        vehicle = self._vehicle(robot)
        if vehicle.phase is not Phase.HOLDING:
            raise CorridorsMisuseError(f"robot {robot!r} does not hold at door {vehicle.route.end!r}")
        pose = self.pose(robot)
        vehicle.phase = Phase.LEAVING
        return pose

    def remove(self, robot: RobotId) -> Pose:
        """Take out a robot that is not on its way, let in or not, and tell where it held or would have entered.

        Raises:
            CorridorsMisuseError: if the robot is not here, or on its way.
        """
        vehicle = self._vehicle(robot)
        if vehicle.phase is Phase.DRIVING:
            raise CorridorsMisuseError(f"robot {robot!r} is on its way to door {vehicle.route.end!r}")
        asked = vehicle.phase is Phase.ASKED
        with self._sumo(f"remove robot {robot!r}") as sumo:
            pose = self.entry_pose(vehicle.route) if asked else _vehicle_pose(sumo, robot)
            sumo.vehicle.remove(robot)
        del self._vehicles[robot]
        self._clear_on.pop(robot, None)
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
        check_speed(max_speed)
        with self._sumo(f"change the speed of robot {robot!r}") as sumo:
            self._give_type(sumo, robot, max_speed)
        vehicle.max_speed = max_speed

    def lengths(self) -> dict[str, float]:
        """How long the lane of each edge is [m]."""
        with self._sumo("measure the lanes") as sumo:
            return {edge.id: float(sumo.lane.getLength(_lane(edge.id))) for edge in network_edges(self.building)}

    def lanes_left(self, robot: RobotId) -> tuple[str, ...]:
        """The edges of its route that a robot has not left with its tail; all of them until it has entered."""
        vehicle = self._vehicle(robot)
        if vehicle.phase is not Phase.DRIVING:
            return vehicle.route.edges if vehicle.phase is Phase.ASKED else vehicle.route.edges[-1:]
        with self._sumo("find a robot") as sumo:
            number = _number(sumo, robot, vehicle)
            straddles = number > 0 and sumo.vehicle.getLanePosition(robot) < LENGTH
            if straddles and sumo.vehicle.getRoadID(robot) == vehicle.route.edges[number]:
                number -= 1
        return vehicle.route.edges[number:]

    def moved_on(self) -> dict[RobotId, tuple[str, ...]]:
        """``lanes_left`` of those robots on their way that may have left a lane since this was last asked, sorted.

        All that it takes for the others is to look at how far they are on their routes.
        """
        moved: dict[RobotId, tuple[str, ...]] = {}
        with self._sumo("follow the robots") as sumo:
            for robot, vehicle in sorted(self._vehicles.items()):
                if vehicle.phase is Phase.ASKED:
                    continue
                held = vehicle.phase is not Phase.DRIVING
                index = HELD if held else sumo.vehicle.getRouteIndex(robot)
                if self._clear_on.get(robot) != index:
                    moved[robot] = left = self.lanes_left(robot)
                    if held or len(left) <= len(vehicle.route.edges) - _number(sumo, robot, vehicle):
                        self._clear_on[robot] = index  # with its tail as well
        return moved

    def turning_point(self, robot: RobotId) -> str | None:
        """The edge on which a robot drives, if it could still turn off at the end of it; ``None`` else."""
        vehicle = self._vehicle(robot)
        if vehicle.phase is not Phase.DRIVING:
            return None
        with self._sumo("find a robot") as sumo:
            edge, speed = sumo.vehicle.getRoadID(robot), sumo.vehicle.getSpeed(robot)
            if edge.startswith(":"):
                return None
            left = sumo.lane.getLength(_lane(edge)) - sumo.vehicle.getLanePosition(robot)
        return str(edge) if left > speed * speed / VEHICLE["Decel"] + speed * self._tick else None

    def divert(self, robot: RobotId, route: Route) -> None:
        """Send a robot another way, from the edge on which it drives to where the route ends.

        Args:
            robot: on its way.
            route: begins with the edges that the robot drove on so far, its present one included.

        Raises:
            CorridorsMisuseError: if the robot is not on its way, or not where the route says.
        """
        vehicle = self._vehicle(robot)
        self._clear_on.pop(robot, None)
        with self._sumo(f"divert robot {robot!r}") as sumo:
            number = _number(sumo, robot, vehicle) if vehicle.phase is Phase.DRIVING else -1
            if number < 0 or route.edges[: number + 1] != vehicle.route.edges[: number + 1]:
                raise CorridorsMisuseError(f"robot {robot!r} cannot turn off to door {route.end!r}")
            sumo.vehicle.replaceStop(robot, 0, "")
            shut = sorted(self._closed.intersection(route.edges[: number + 1]))
            for edge in shut:  # SUMO wants a route to be open where the robot has been as well
                _open(sumo, edge)
            sumo.vehicle.setRoute(robot, route.edges[number:])
            for edge in shut:
                _close(sumo, edge)
            last = route.edges[-1]
            sumo.vehicle.setStop(robot, last, sumo.lane.getLength(_lane(last)), 0, FOR_EVER, 0)
        vehicle.route = route

    def close_edge(self, edge: str) -> None:
        """Let nobody drive onto an edge any more; who is on it drives on."""
        with self._sumo(f"close {edge!r}") as sumo:
            _close(sumo, edge)
        self._closed.add(edge)

    def open_edge(self, edge: str) -> None:
        """Let robots drive onto an edge again."""
        with self._sumo(f"open {edge!r}") as sumo:
            _open(sumo, edge)
        self._closed.discard(edge)

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
            still = [of_type for of_type in sorted(self._types) if sumo.vehicletype.getMaxSpeed(of_type) < CRAWL]
            for of_type in still:  # SUMO does not load a type that stands; opening gives robots their own speed again
                sumo.vehicletype.setMaxSpeed(of_type, CRAWL)
            sumo.simulation.saveState(str(path))
            for of_type in still:
                sumo.vehicletype.setMaxSpeed(of_type, 0.0)

    def state(self) -> dict[str, object]:
        """What these corridors keep beside SUMO's half of the state, as plain data for JSON."""
        vehicles = {robot: vehicle.state() for robot, vehicle in sorted(self._vehicles.items())}
        return {
            "seed": self._seed,
            "tick": self._tick,
            "entered": list(self._entered),
            "vehicles": vehicles,
            "closed": sorted(self._closed),
        }

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
        corridors._vehicles = {robot: Vehicle.from_state(v) for robot, v in state["vehicles"].items()}
        corridors._closed = set(state["closed"])
        return corridors

    def _start(self, libsumo: Any, path: Path) -> None:
        command = ["sumo", "-n", str(path), "--step-length", str(self._tick), "--seed", str(self._seed % 2**31)]
        if self._saved is not None:
            command += ["--load-state", str(self._saved)]
        with tempfile.TemporaryFile() as said:
            try:
                with stderr_into(said):
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
        for edge in sorted(self._closed):
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

    def _vehicle(self, robot: RobotId) -> Vehicle:
        if robot not in self._vehicles:
            raise CorridorsMisuseError(f"robot {robot!r} is not in the corridors")
        return self._vehicles[robot]

    def _inside(self) -> list[RobotId]:
        return sorted(r for r, v in self._vehicles.items() if v.phase in (Phase.DRIVING, Phase.HOLDING))

    def _check_inside(self, robot: RobotId) -> None:
        match self._vehicle(robot).phase:
            case Phase.ASKED:
                raise CorridorsMisuseError(f"robot {robot!r} has not entered the corridors yet")
            case Phase.LEAVING:
                raise CorridorsMisuseError(f"robot {robot!r} was let out of the corridors")

    def _pose_on_lane(self, edge: str, front: float) -> Pose:
        """The centre of a robot with its front at a point of the edge's lane [m]."""
        with self._sumo("measure a lane") as sumo:
            (x, y), (back_x, back_y) = (sumo.simulation.convert2D(edge, at, 0) for at in (front, front - LENGTH))
        return vehicle_pose((x, y), atan2(y - back_y, x - back_x))

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


def _lane(edge: str) -> str:
    return f"{edge}_0"


def _close(sumo: Any, edge: str) -> None:
    sumo.lane.setDisallowed(_lane(edge), ["all"])


def _open(sumo: Any, edge: str) -> None:
    sumo.lane.setDisallowed(_lane(edge), [])


def _vehicle_pose(sumo: Any, robot: RobotId) -> Pose:
    """The pose of a vehicle, which points ``getAngle`` degrees clockwise from north."""
    return vehicle_pose(sumo.vehicle.getPosition(robot), pi / 2 - radians(sumo.vehicle.getAngle(robot)))


def _number(sumo: Any, robot: RobotId, vehicle: Vehicle) -> int:
    """On which edge of its route a robot is, counted from its end: SUMO may have forgotten its beginning or not."""
    left = len(sumo.vehicle.getRoute(robot)) - sumo.vehicle.getRouteIndex(robot)
    return len(vehicle.route.edges) - int(left)
