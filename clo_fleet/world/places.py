"""Places and the ways between them: what a plan sees of a building.

A zone is a maximal network of corridors joined at junctions; doors end it and join nothing. So a way from room to
room goes through one door that both share, or out of one door, through one zone, and in at another door.
Estimates assume free corridors and an empty building.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import networkx as nx

from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, PlaceId, Point, RoomId
from clo_fleet.world.outlines import centroid, covers, length

__all__ = [
    "Way",
    "connected_rooms",
    "doors_between",
    "reachable_rooms",
    "room_at",
    "travel_time",
    "ways",
    "zones",
]

CROSSING_SPEED = 1.0  # m/s, the top speed of a robot that a world says nothing else about

RoomPair = tuple[RoomId, RoomId]


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


def ways(building: BuildingMap, start: RoomId | None = None) -> dict[RoomPair, tuple[Way, ...]]:
    """The ways between rooms, all or those out of one room, by the ordered pair of rooms, the quickest first.

    One shortest-path search for each door that leads out, and as many answers as there are connected pairs: 24 s for
    1,000 rooms in a single zone. Keep the answer rather than ask again.
    """
    doors = {door.id: door for door in building.doors}
    middles = {room.id: centroid(room.outline) for room in building.rooms}
    crossing = {
        (room, door.id): math.dist(middles[room], door.position) / CROSSING_SPEED
        for door in building.doors
        for room in door.rooms
    }
    found: dict[RoomPair, set[Way]] = defaultdict(set)
    for leave, enter, zone, time in _passages(building, doors, start):
        for a in leave.rooms:
            for b in enter.rooms:
                if a != b and start in (a, None):
                    total = crossing[a, leave.id] + time + crossing[b, enter.id]
                    found[a, b].add(Way(total, leave.id, enter.id, zone))
    return {pair: tuple(sorted(found[pair], key=_quickest)) for pair in sorted(found)}


def connected_rooms(building: BuildingMap) -> tuple[RoomPair, ...]:
    """The ordered pairs of different rooms between which a way leads without passing a third room, sorted."""
    return tuple(ways(building))


def doors_between(
    building: BuildingMap, start: RoomId, end: RoomId
) -> tuple[tuple[DoorId, DoorId, PlaceId | None], ...]:
    """Exit door, entry door and the zone between them (``None`` for one shared door) of each way, quickest first."""
    return tuple((way.exit, way.entry, way.zone) for way in ways(building, start).get((start, end), ()))


def travel_time(building: BuildingMap) -> dict[RoomPair, float]:
    """Estimates for the quickest way between each ordered pair of connected rooms, from middle to middle [s]."""
    return {pair: found[0].time for pair, found in ways(building).items()}


def reachable_rooms(building: BuildingMap, starts: Iterable[RoomId]) -> dict[RoomId, frozenset[RoomId]]:
    """The rooms that can be reached from each start, over any number of others, itself included.

    Linear in the building for each start, where pairs of rooms may be quadratic.
    """
    doors = {door.id: door for door in building.doors}
    graph = _zone_graph(building.corridors, doors)
    for door in building.doors:
        for room in door.rooms:
            graph.add_edge(("room", room), ("exit", door.id))
            graph.add_edge(("entry", door.id), ("room", room))
        if len(door.rooms) == 2:
            graph.add_edge(("exit", door.id), ("entry", door.id))
    graph.add_nodes_from(("room", room.id) for room in building.rooms)
    rooms = {("room", str(room.id)): room.id for room in building.rooms}
    return {
        start: frozenset({start, *(rooms[node] for node in nx.descendants(graph, ("room", start)) if node in rooms)})
        for start in sorted(set(starts))
    }


def room_at(building: BuildingMap, point: Point) -> RoomId | None:
    """The room that the point lies in, the first one for a point on a common wall; ``None`` outside of all."""
    return next((room.id for room in building.rooms if covers(room.outline, point)), None)


def _passages(
    building: BuildingMap, doors: Mapping[DoorId, Door], start: RoomId | None
) -> Iterator[tuple[Door, Door, PlaceId | None, float]]:
    """Door out, door in, zone and time [s] between the doors, of every way out of the start, or of every room."""
    for door in building.doors:
        if len(door.rooms) == 2:
            yield door, door, None, 0.0
    corridors = {corridor.id: corridor for corridor in building.corridors}
    for zone, members in zones(building).items():
        graph = _zone_graph([corridors[member] for member in sorted(members)], doors)
        for name in sorted(node for kind, node in graph if kind == "exit"):
            if start is not None and start not in doors[DoorId(name)].rooms:
                continue
            times = nx.single_source_dijkstra_path_length(graph, ("exit", name))
            for (kind, end), time in sorted(times.items()):
                if kind == "entry":
                    yield doors[DoorId(name)], doors[DoorId(end)], zone, float(time)


def _zone_graph(corridors: Iterable[Corridor], doors: Mapping[DoorId, Door]) -> "nx.DiGraph[tuple[str, str]]":
    """Times along corridors [s]. A door is two nodes, so that no way leads through it to another corridor."""
    graph: nx.DiGraph[tuple[str, str]] = nx.DiGraph()
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


def _quickest(way: Way) -> tuple[float, DoorId, DoorId]:
    return (way.time, way.exit, way.entry)
