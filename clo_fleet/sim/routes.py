"""Ways through the corridors of a building, from door to door."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import inf
from typing import Any, Self

import networkx as nx

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.network import Edge, network_edges
from clo_fleet.world.model import BuildingMap, DoorId

__all__ = ["Route", "Routes", "UnknownDoorError"]


class UnknownDoorError(CloFleetError):
    """The map has no such door.

    Attributes:
        door: the id asked for.
    """

    def __init__(self, door: DoorId) -> None:
        super().__init__(door)
        self.door = door

    def __str__(self) -> str:
        return f"the map has no door {self.door!r}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """A way through the corridors from door to door.

    Attributes:
        start, end: the doors.
        edges: ids of the network's edges that it follows, at least one.
        length: along the centre lines [m].
        time: at the corridors' top speeds, without other traffic and without stops at crossings [s].
    """

    start: DoorId
    end: DoorId
    edges: tuple[str, ...]
    length: float
    time: float

    def state(self) -> dict[str, object]:
        """The route as plain data for JSON."""
        return asdict(self) | {"edges": list(self.edges)}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The route that ``state`` gave."""
        return cls(**{**state, "edges": tuple(state["edges"])})


class Routes:
    """The fastest routes of a building, found once each. Of equally fast ones the map alone decides, always alike."""

    def __init__(self, building: BuildingMap) -> None:
        """Take the corridors of the building."""
        self._doors = {d.id for d in building.doors}
        self._found: dict[tuple[DoorId, DoorId], Route | None] = {}
        self._ways: nx.DiGraph[str] = nx.DiGraph()
        for edge in network_edges(building):
            if _time(edge) < self._ways.get_edge_data(edge.start, edge.end, {"time": inf})["time"]:
                self._ways.add_edge(edge.start, edge.end, time=_time(edge), edge=edge)

    def fastest(self, start: DoorId, end: DoorId) -> Route | None:
        """The fastest way from door to door in empty corridors; ``None`` if there is none, or if they are the same.

        Raises:
            UnknownDoorError: if the map lacks one of them.
        """
        if (start, end) not in self._found:
            for door in (start, end):
                if door not in self._doors:
                    raise UnknownDoorError(door)
            self._found[start, end] = self._search(start, end)
        return self._found[start, end]

    def _search(self, start: DoorId, end: DoorId) -> Route | None:
        if start == end or start not in self._ways or end not in self._ways:
            return None
        try:
            nodes = nx.dijkstra_path(self._ways, start, end, weight="time")
        except nx.NetworkXNoPath:
            return None
        edges: list[Edge] = [self._ways.edges[way]["edge"] for way in pairwise(nodes)]
        return Route(
            start=start,
            end=end,
            edges=tuple(e.id for e in edges),
            length=sum(e.length for e in edges),
            time=sum(map(_time, edges)),
        )


def _time(edge: Edge) -> float:
    """Over the whole edge at its top speed [s]."""
    return edge.length / edge.corridor.max_speed
