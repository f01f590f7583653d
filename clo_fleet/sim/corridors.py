"""Robots in corridors: who is let in, on its way, or holds at its far door. The traffic itself is ``sumo.Sumo``'s.

Theory of operation. ``enter`` asks for a robot to be let in; the ``step`` in which its lane has room for it inserts it,
and ``entered`` names it. It drives to its far door, where ``arrived`` names it and it holds, with whatever queues up
behind it, until ``let_out`` lets it go and ``remove`` takes its vehicle out. Whoever calls keeps the robot's body
elsewhere until it has entered and from when it is let out, so that it is never in both places or in neither.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from clo_fleet.sim.corridor_errors import (
    CorridorsFailedError,
    CorridorsMisuseError,
    CorridorsOpenError,
    NetworkRefusedError,
)
from clo_fleet.sim.network import network_edges
from clo_fleet.sim.network_check import check_network
from clo_fleet.sim.routes import Route
from clo_fleet.sim.sumo import SHORT, Sumo
from clo_fleet.sim.under_way import Phase, Vehicle
from clo_fleet.sim.vehicle import ENTRY, check_speed
from clo_fleet.world.model import BuildingMap, Point, Pose, RobotId

__all__ = [
    "Corridors",
    "CorridorsFailedError",
    "CorridorsMisuseError",
    "CorridorsOpenError",
    "NetworkRefusedError",
]

HELD = -1  # for the mark of a robot that holds at its door
NOWHERE = (-2, 0)  # for the mark of one that is not known to be on one edge only, and the tick to look at it
FOR_EVER = 10**9  # [ticks]


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
        self._sumo = Sumo(seed=seed, tick=tick)
        self._vehicles: dict[RobotId, Vehicle] = {}
        self._asking: set[RobotId] = set()  # those of them that have not been let in yet
        self._entered: tuple[RobotId, ...] = ()
        self._stopped: tuple[RobotId, ...] = ()
        self._ticks = 0  # since they were opened
        # of those that are on one edge with all of their length: SUMO's mark of it, and the tick until which that is so
        self._clear: dict[RobotId, tuple[int, int]] = {}
        self._closed: set[str] = set()

    def __enter__(self) -> Self:
        """Start SUMO on the building's network.

        Raises:
            CorridorsOpenError: if some are open already.
            MissingLibraryError: if libsumo lacks system libraries.
            NetworkRefusedError: if the network is not the map's, or SUMO refuses it.
            CorridorsFailedError: if SUMO refuses the state to go on from.
        """
        path = self.building.network
        if path is None:
            raise NetworkRefusedError(path, "the map has none")
        if self._saved is None and (faults := check_network(self.building, path)):  # what was saved ran on it
            raise NetworkRefusedError(path, "; ".join(faults)[:SHORT])
        max_speeds = {robot: vehicle.max_speed for robot, vehicle in self._vehicles.items()}
        self._sumo.open(path, self._saved, max_speeds, self._closed)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop SUMO and forget all robots; closed corridors may be closed again."""
        self._sumo.close()
        self._saved = None
        self._vehicles.clear()
        self._asking.clear()
        self._clear.clear()
        self._entered = ()

    def entry_clear(self, route: Route) -> bool:
        """Whether the route's first lane has room for one more robot just behind the door, and none waits for it."""
        first = route.edges[0]
        if not self._sumo.entry_free(first):
            return False
        return all(self._vehicles[robot].route.edges[0] != first for robot in self._asking)

    def entry_pose(self, route: Route) -> Pose:
        """Where a robot is when it has just entered on this route."""
        return self._sumo.pose_on_lane(route.edges[0], ENTRY)

    def exit_pose(self, route: Route) -> Pose:
        """Where a robot holds at the end of this route."""
        return self._sumo.pose_on_lane(route.edges[-1], self._sumo.length(route.edges[-1]))

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
        self._sumo.add(robot, route.edges, max_speed)
        self._vehicles[robot] = Vehicle(route, max_speed)
        self._asking.add(robot)

    def step(self) -> None:
        """Let one tick of traffic happen."""
        entered, stopped = self._sumo.step()
        self._entered, self._stopped = tuple(entered), tuple(stopped)
        self._asking.difference_update(entered)
        for robot in entered:
            self._vehicles[robot].phase = Phase.DRIVING
        for robot in stopped:
            self._vehicles[robot].phase = Phase.HOLDING
            self._clear.pop(robot, None)
        self._ticks += 1

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
        return self._sumo.odometer(robot)

    def near(self, point: Point, within: float) -> list[Pose]:
        """The poses of the robots whose centre may be this near to a point [m], and perhaps of some beyond."""
        return self._sumo.near(point, within, self._vehicles)

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
        pose = self.entry_pose(vehicle.route) if vehicle.phase is Phase.ASKED else self._sumo.pose(robot)
        self._sumo.remove(robot)
        del self._vehicles[robot]
        self._asking.discard(robot)
        self._clear.pop(robot, None)
        return pose

    def pose(self, robot: RobotId) -> Pose:
        """Where a robot is that has entered (else ``CorridorsMisuseError``)."""
        self._check_inside(robot)
        return self._sumo.pose(robot)

    def poses(self) -> dict[RobotId, Pose]:
        """Where each robot is that has entered, sorted by robot."""
        return self._sumo.poses(self._inside())

    def speed(self, robot: RobotId) -> float:
        """How fast a robot drives that has entered (else ``CorridorsMisuseError``) [m/s]."""
        self._check_inside(robot)
        return self._sumo.speed(robot)

    def set_max_speed(self, robot: RobotId, max_speed: float) -> None:
        """Change a robot's own limit [m/s]; 0 brings it to a stand.

        Raises:
            CorridorsMisuseError: if the robot is not here, or the speed is no speed.
        """
        vehicle = self._vehicle(robot)
        check_speed(max_speed)
        self._sumo.set_max_speed(robot, max_speed)
        self._clear.pop(robot, None)
        vehicle.max_speed = max_speed

    def lengths(self) -> dict[str, float]:
        """How long the lane of each edge is [m]."""
        return {edge.id: self._sumo.length(edge.id) for edge in network_edges(self.building)}

    def lanes_left(self, robot: RobotId) -> tuple[str, ...]:
        """The edges of its route that a robot has not left with its tail; all of them until it has entered."""
        vehicle = self._vehicle(robot)
        if vehicle.phase is not Phase.DRIVING:
            return vehicle.route.edges if vehicle.phase is Phase.ASKED else vehicle.route.edges[-1:]
        return vehicle.route.edges[self._sumo.tail_number(robot, vehicle.route.edges) :]

    def moved_on(self) -> dict[RobotId, tuple[str, ...]]:
        """``lanes_left`` of those robots on their way that may have left a lane since this was last asked, sorted.

        Who is on a lane with all of its length is looked at again when it can have come to the end of it.
        """
        moved: dict[RobotId, tuple[str, ...]] = {}
        under_way = self._vehicles.keys() - self._asking
        for robot in sorted(r for r in under_way if self._clear.get(r, NOWHERE)[1] <= self._ticks):
            vehicle, edges = self._vehicles[robot], self._vehicles[robot].route.edges
            held = vehicle.phase is not Phase.DRIVING
            mark = HELD if held else self._sumo.mark(robot)
            if self._clear.get(robot, NOWHERE)[0] != mark:
                moved[robot] = left = self.lanes_left(robot)
                if not held and len(left) > len(edges) - self._sumo.number(robot, edges):
                    continue  # its tail is still on the lane before
            sure = FOR_EVER if held else self._sumo.soonest_ahead(robot, vehicle.max_speed)
            self._clear[robot] = (mark, self._ticks + sure)
        return moved

    def turning_point(self, robot: RobotId) -> str | None:
        """The edge on which a robot drives, if it could still turn off at the end of it; ``None`` else."""
        vehicle = self._vehicle(robot)
        return self._sumo.turning_point(robot) if vehicle.phase is Phase.DRIVING else None

    def divert(self, robot: RobotId, route: Route) -> None:
        """Send a robot another way, from the edge on which it drives to where the route ends.

        Args:
            robot: on its way.
            route: begins with the edges that the robot drove on so far, its present one included.

        Raises:
            CorridorsMisuseError: if the robot is not on its way, or not where the route says.
        """
        vehicle = self._vehicle(robot)
        self._clear.pop(robot, None)
        number = self._sumo.number(robot, vehicle.route.edges) if vehicle.phase is Phase.DRIVING else -1
        if number < 0 or route.edges[: number + 1] != vehicle.route.edges[: number + 1]:
            raise CorridorsMisuseError(f"robot {robot!r} cannot turn off to door {route.end!r}")
        self._sumo.divert(robot, route.edges, number, self._closed)
        vehicle.route = route

    def close_edge(self, edge: str) -> None:
        """Let nobody drive onto an edge any more; who is on it drives on."""
        self._sumo.close_edge(edge)
        self._closed.add(edge)

    def open_edge(self, edge: str) -> None:
        """Let robots drive onto an edge again."""
        self._sumo.open_edge(edge)
        self._closed.discard(edge)

    def waiting(self) -> dict[RobotId, RobotId | None]:
        """The robots that have stood on their way for over a second, sorted, and the robot that each stands behind.

        ``None`` stands for another reason, such as cross traffic or a breakdown. Robots that have arrived do not wait.
        """
        return self._sumo.waiting(self._inside())

    def save(self, path: Path) -> None:
        """Write SUMO's half of the state to a file, ``.xml`` or ``.xml.gz``; the other half is ``state``.

        SUMO goes on a little differently after loading. To be repeatable, a run that saves must itself close and go on
        from what it saved.
        """
        self._sumo.save(path)

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
        corridors._asking = {robot for robot, v in corridors._vehicles.items() if v.phase is Phase.ASKED}
        corridors._closed = set(state["closed"])
        return corridors

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
