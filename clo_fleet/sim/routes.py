"""Ways through the corridors of a building, from door to door."""

import heapq
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import inf
from typing import Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.network import network_edges, network_turns
from clo_fleet.world.model import BuildingMap, DoorId

__all__ = ["Delay", "Route", "Routes", "UnknownDoorError"]

Delay = Callable[[str], float]  # [s] on an edge beyond its free flow; infinite: nobody may use it


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
    """The quickest routes of a building. Of equally quick ones the map alone decides, always alike."""

    def __init__(self, building: BuildingMap) -> None:
        """Take the corridors of the building."""
        self._doors = {str(d.id) for d in building.doors}
        self._empty: dict[tuple[DoorId, DoorId], Route | None] = {}
        edges = network_edges(building)
        self._edges = {edge.id: edge for edge in edges}
        self._time = {edge.id: edge.length / edge.corridor.max_speed for edge in edges}
        self._order = {edge.id: number for number, edge in enumerate(edges)}
        self._turns: dict[str, list[str]] = {edge.id: [] for edge in edges}
        for before, after in network_turns(building, edges):
            if self._edges[before].end not in self._doors:  # a way ends at a door; it never leads past one
                self._turns[before].append(after)
        self._from: dict[str, list[str]] = {}
        for edge in edges:
            self._from.setdefault(edge.start, []).append(edge.id)

    def fastest(self, start: DoorId, end: DoorId) -> Route | None:
        """The fastest way from door to door in empty corridors; ``None`` if there is none, or if they are the same.

        Raises:
            UnknownDoorError: if the map lacks one of them.
        """
        if (start, end) not in self._empty:
            self._empty[start, end] = self.quickest(start, end, lambda _: 0.0)[0]
        return self._empty[start, end]

    def quickest(self, start: DoorId, end: DoorId, delay: Delay) -> tuple[Route | None, float]:
        """The way from door to door that takes least with the delay on each edge, and how long it takes [s].

        Raises:
            UnknownDoorError: if the map lacks one of them.
        """
        for door in (start, end):
            if door not in self._doors:
                raise UnknownDoorError(door)
        found, time = ((), inf) if start == end else self._search(self._from.get(start, []), end, delay)
        return (self.route(start, end, found) if found else None, time)

    def onward(self, edge: str, end: DoorId, delay: Delay) -> tuple[tuple[str, ...], float]:
        """The edges to a door after one on which a robot is, and how long they take [s]; infinite: there is no way."""
        if self._edges[edge].end == end:
            return (), 0.0
        return self._search(self._turns[edge], end, delay)

    def time(self, edge: str) -> float:
        """Over the whole edge at its top speed [s]."""
        return self._time[edge]

    def route(self, start: DoorId, end: DoorId, edges: Sequence[str]) -> Route:
        """The route along these edges."""
        along = [self._edges[edge] for edge in edges]
        return Route(
            start=start,
            end=end,
            edges=tuple(edges),
            length=sum(edge.length for edge in along),
            time=sum(self._time[edge] for edge in edges),
        )

    def _search(self, first: Iterable[str], end: str, delay: Delay) -> tuple[tuple[str, ...], float]:
        """Dijkstra's algorithm over edges, as turns are from edge to edge."""
        heap = [(self._cost(edge, delay), self._order[edge], edge, "") for edge in first]
        heapq.heapify(heap)
        before: dict[str, str] = {}
        while heap:
            time, _, edge, previous = heapq.heappop(heap)
            if edge in before or time == inf:
                continue
            before[edge] = previous
            if self._edges[edge].end == end:
                way = [edge]
                while before[way[-1]]:
                    way.append(before[way[-1]])
                return tuple(reversed(way)), time
            for after in self._turns[edge]:
                if after not in before:
                    heapq.heappush(heap, (time + self._cost(after, delay), self._order[after], after, edge))
        return (), inf

    def _cost(self, edge: str, delay: Delay) -> float:
        return self._time[edge] + delay(edge)
