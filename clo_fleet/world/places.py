"""Places and the ways between them: what a plan sees of a building.

A zone is a maximal network of corridors joined at junctions; doors end it and join nothing. So a way from room to
room goes through one door that both share, or out of one door, through one zone, and in at another door.
Estimates assume free corridors and an empty building.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush

import networkx as nx

from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, PlaceId, Point, RoomId
from clo_fleet.world.outlines import centroid, covers, length

__all__ = [
    "Way",
    "Ways",
    "connected_rooms",
    "reachable_rooms",
    "room_at",
    "round_trips",
    "travel_time",
    "zones",
]

CROSSING_SPEED = 1.0  # m/s, the top speed of a robot that a world says nothing else about

RoomPair = tuple[RoomId, RoomId]
Node = tuple[str, str]  # a junction, or a door's exit or entry, with its name


@dataclass(frozen=True, slots=True)
class Way:
    """A way from one room to another.

    Attributes:
        time: estimate from the middle of the one room to the middle of the other [s].
        exit: the door out of the first room.
        entry: the door into the second room; the same where the rooms share it.
        zone: the zone between the doors, ``None`` if they are one.
    """

    time: float
    exit: DoorId
    entry: DoorId
    zone: PlaceId | None


def zones(building: BuildingMap) -> dict[PlaceId, frozenset[CorridorId]]:
    """The corridors of each zone; zones are numbered from 1 in the order of their smallest corridor."""
    junctions = {junction.id for junction in building.junctions}
    graph: nx.Graph[tuple[str, str]] = nx.Graph()
    for corridor in building.corridors:
        graph.add_node(("corridor", corridor.id))
        for node in {corridor.start, corridor.end} & junctions:
            graph.add_edge(("corridor", corridor.id), ("junction", node))
    parts = [
        sorted(CorridorId(name) for kind, name in part if kind == "corridor") for part in nx.connected_components(graph)
    ]
    return {PlaceId(f"zone-{number}"): frozenset(part) for number, part in enumerate(sorted(parts), start=1)}


class Ways:
    """The ways of a building, found room by room as they are asked for and then kept.

    One shortest-path search for each door that leads out of a room. For all pairs of 1,000 rooms in a single zone that
    is a million answers, in seconds; whoever asks about a few rooms only pays for these.
    """

    def __init__(self, building: BuildingMap) -> None:
        self._doors = {door.id: door for door in building.doors}
        self._rooms = [room.id for room in building.rooms]
        middles = {room.id: centroid(room.outline) for room in building.rooms}
        self._crossing = {
            (room, door.id): math.dist(middles[room], door.position) / CROSSING_SPEED
            for door in building.doors
            for room in door.rooms
        }
        self._doors_of: dict[RoomId, list[Door]] = {room: [] for room in middles}
        for door in building.doors:
            for room in door.rooms:
                self._doors_of[room].append(door)
        corridors = {corridor.id: corridor for corridor in building.corridors}
        self._zones = {
            zone: _zone_steps([corridors[member] for member in sorted(members)], self._doors)
            for zone, members in zones(building).items()
        }
        self._zones_of: dict[str, list[PlaceId]] = defaultdict(list)
        for zone, steps in self._zones.items():
            for kind, name in steps:
                if kind == "exit":
                    self._zones_of[name].append(zone)
        self._found: dict[RoomId, dict[RoomId, tuple[Way, ...]]] = {}

    def between(self, start: RoomId, end: RoomId) -> tuple[Way, ...]:
        """The ways from one room to another without passing a third, the quickest first."""
        return self.out_of(start).get(end, ())

    def out_of(self, start: RoomId) -> Mapping[RoomId, tuple[Way, ...]]:
        """The ways out of a room, by the room that they lead to, in the order of names; none for an unknown room."""
        if start not in self._found:
            self._found[start] = self._search(start)
        return self._found[start]

    def all(self) -> Iterator[tuple[RoomPair, tuple[Way, ...]]]:
        """Every ordered pair of connected rooms with its ways, in the order of names."""
        for start in sorted(self._rooms):
            for end, found in self.out_of(start).items():
                yield (start, end), found

    def _search(self, start: RoomId) -> dict[RoomId, tuple[Way, ...]]:
        found: dict[RoomId, list[Way]] = defaultdict(list)
        for leave in self._doors_of.get(start, ()):
            before = self._crossing[start, leave.id]
            for other in leave.rooms:
                if other != start:
                    found[other].append(Way(before + self._crossing[other, leave.id], leave.id, leave.id, None))
            for zone in self._zones_of.get(leave.id, ()):
                for (kind, name), time in _times(self._zones[zone], ("exit", leave.id)).items():
                    if kind == "entry":
                        for room in self._doors[DoorId(name)].rooms:
                            if room != start:
                                total = before + time + self._crossing[room, DoorId(name)]
                                found[room].append(Way(total, leave.id, DoorId(name), zone))
        return {end: tuple(sorted(found[end], key=_quickest)) for end in sorted(found)}


def connected_rooms(building: BuildingMap) -> tuple[RoomPair, ...]:
    """The ordered pairs of different rooms between which a way leads without passing a third room, sorted."""
    return tuple(pair for pair, _ in Ways(building).all())


def travel_time(building: BuildingMap) -> dict[RoomPair, float]:
    """Estimates for the quickest way between each ordered pair of connected rooms, from middle to middle [s]."""
    return {pair: found[0].time for pair, found in Ways(building).all()}


def reachable_rooms(building: BuildingMap, starts: Iterable[RoomId]) -> dict[RoomId, frozenset[RoomId]]:
    """The rooms that can be reached from each start, over any number of others, itself included.

    Linear in the building for each start, where pairs of rooms may be quadratic.
    """
    graph = _building_graph(building)
    rooms = {("room", str(room.id)): room.id for room in building.rooms}
    return {
        start: frozenset({start, *(rooms[node] for node in nx.descendants(graph, ("room", start)) if node in rooms)})
        for start in sorted(set(starts))
    }


def round_trips(building: BuildingMap) -> tuple[frozenset[RoomId], ...]:
    """The rooms in parts: within a part one gets from any room to any other. Linear in the building."""
    rooms = {("room", str(room.id)): room.id for room in building.rooms}
    parts = nx.strongly_connected_components(_building_graph(building))
    return tuple(
        frozenset(rooms[node] for node in part if node in rooms) for part in parts if not part.isdisjoint(rooms)
    )


def room_at(building: BuildingMap, point: Point) -> RoomId | None:
    """The room that the point lies in, the first one for a point on a common wall; ``None`` outside of all."""
    return next((room.id for room in building.rooms if covers(room.outline, point)), None)


def _building_graph(building: BuildingMap) -> "nx.DiGraph[Node]":
    """All that leads anywhere: rooms, both sides of doors, and junctions."""
    doors = {door.id: door for door in building.doors}
    graph = _zone_graph(building.corridors, doors)
    for door in building.doors:
        for room in door.rooms:
            graph.add_edge(("room", room), ("exit", door.id))
            graph.add_edge(("entry", door.id), ("room", room))
        if len(door.rooms) == 2:
            graph.add_edge(("exit", door.id), ("entry", door.id))
    graph.add_nodes_from(("room", room.id) for room in building.rooms)
    return graph


def _zone_graph(corridors: Iterable[Corridor], doors: Mapping[DoorId, Door]) -> "nx.DiGraph[Node]":
    """Times along corridors [s]. A door is two nodes, so that no way leads through it to another corridor."""
    graph: nx.DiGraph[Node] = nx.DiGraph()
    for corridor in corridors:
        time = length(corridor.shape) / corridor.max_speed
        directions = [(corridor.start, corridor.end)]
        if not corridor.one_way:
            directions.append((corridor.end, corridor.start))
        for start, end in directions:
            tail = ("exit" if start in doors else "junction", start)
            head = ("entry" if end in doors else "junction", end)
            if time < graph.get_edge_data(tail, head, {"weight": math.inf})["weight"]:  # corridors side by side
                graph.add_edge(tail, head, weight=time)
    return graph


def _zone_steps(corridors: Iterable[Corridor], doors: Mapping[DoorId, Door]) -> dict[Node, list[tuple[Node, float]]]:
    """The graph of a zone as what follows each node: plain lists, as there is a search for every door."""
    graph = _zone_graph(corridors, doors)
    return {node: [(head, edge["weight"]) for head, edge in graph.adj[node].items()] for node in graph}


def _times(steps: Mapping[Node, list[tuple[Node, float]]], start: Node) -> dict[Node, float]:
    """The time from the start to each node that can be reached [s]: Dijkstra's algorithm."""
    times: dict[Node, float] = {}
    frontier = [(0.0, start)]
    while frontier:
        time, node = heappop(frontier)
        if node not in times:
            times[node] = time
            for head, duration in steps[node]:
                if head not in times:
                    heappush(frontier, (time + duration, head))
    return times


def _quickest(way: Way) -> tuple[float, DoorId, DoorId]:
    return (way.time, way.exit, way.entry)
