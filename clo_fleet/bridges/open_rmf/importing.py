"""From a building file to a map: cells, corridors, bays and names, with a last check of it all."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import networkx as nx
import shapely
from shapely.ops import nearest_points

from clo_fleet.bridges.drawings import Names, Skipped
from clo_fleet.bridges.open_rmf.bays import FOOTHOLD, Wish, bay_at
from clo_fleet.bridges.open_rmf.cells import RoomsAndDoors, cells_of, mouth, rooms_and_doors, rounded
from clo_fleet.bridges.open_rmf.corridors import DOORWAY, Ground, attached, tidied
from clo_fleet.bridges.open_rmf.lanes import Network, Way, hub_network, without_leaf
from clo_fleet.bridges.open_rmf.reading import Level, OpenRmfError, Vertex, read_level
from clo_fleet.bridges.open_rmf.relaxing import relaxed
from clo_fleet.sim.map_folder import write_building
from clo_fleet.world.checks import map_findings
from clo_fleet.world.faults import Fault, Finding, key_text
from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, Junction, Point, Pose, Room, SpawnPoint

__all__ = ["Imported", "import_building", "import_to_folder"]

MAX_SPEED = 1.5  # [m/s] where a lane has no limit
HARM_WHERE_NEEDED, HARM_WHERE_NICE = 20.0, 8.0  # [m2] done to the corridors by a room for a place
ASIDE = 0.15  # [m] besides a door's way: an object there is in nobody's way


@dataclass(frozen=True, slots=True)
class Imported:
    """A building as a map, without a network yet.

    Attributes:
        building: the map.
        skipped: what of the building file is missing from it, or different.
        scale_m_per_px: metres per pixel of the drawing.
        cells: connected pieces of floor between walls and doors, the hub included.
    """

    building: BuildingMap
    skipped: tuple[Skipped, ...]
    scale_m_per_px: float
    cells: int


def import_building(path: Path, *, level: str | None = None) -> Imported:
    """The map of one level of an Open-RMF building, in metres and the building's own frame with y up.

    Args:
        path: the ``.building.yaml`` file.
        level: the level's name; may be left out if there is only one.

    Raises:
        OpenRmfError: if the file is faulty, or no map can be made of it.
    """
    drawing = read_level(path, level)

    def refuse(findings: Iterable[Finding]) -> OpenRmfError:
        faults = (
            Fault(file=path, line=1, column=1, key=key_text(f.key), value=f.value or "the drawing", expected=f.expected)
            for f in findings
        )
        return OpenRmfError(faults)

    names = Names()
    cells = cells_of(drawing)
    if cells is None:
        raise refuse([Finding(("levels", drawing.name, "lanes"), "lanes that run over floors")])
    found = rooms_and_doors(drawing, cells, names)
    network, node_of, unused = hub_network(drawing, cells.hub)
    draft = _Draft(drawing, names, Ground(cells.hub), network, [*found.skipped, *unused])
    draft.free_stops(node_of)
    draft.attach(found)
    draft.add_bays(node_of)
    joined = sum(len(door.rooms) == 1 for door in draft.doors)
    if joined < 2:
        expected = "two rooms or places (dispensers, chargers, parking) that lanes join, with space for robots"
        raise refuse([Finding(("levels", drawing.name), expected, f"{joined} of them")])
    building = draft.building(path.name.partition(".")[0])
    findings = (*map_findings(building), *_one_way_findings(building))
    if findings:
        raise refuse(findings)
    skipped = (*drawing.skipped, *draft.skipped, *_models(drawing))
    return Imported(building, skipped, drawing.scale, cells.count)


def import_to_folder(
    path: Path, folder: Path, *, level: str | None = None, force: bool = False
) -> tuple[Imported, Path]:
    """Import a building and write its map, with its network beside it, into a folder; returns the map's path too.

    Args:
        path: the ``.building.yaml`` file.
        folder: made if it is not there.
        level: the level's name; may be left out if there is only one.
        force: whether a map of that name may be overwritten.

    Raises:
        OpenRmfError: if the file is faulty, or no map can be made of it.
        MapExistsError: if there is such a map and ``force`` is not given.
        NetconvertMissingError, NetworkBuildError: if the network cannot be built.
        FileWriteError: if the files cannot be written.
    """
    imported = import_building(path, level=level)
    building, target = write_building(imported.building, folder, force=force)
    return replace(imported, building=building), target


@dataclass(frozen=True, slots=True)
class _Arrival:
    """How a lane came to a place: its direction [rad], the node before, and the lane's speed limit [m/s]."""

    direction: float = 0.0
    node: str = ""
    max_speed: float | None = None


@dataclass(slots=True)
class _Draft:
    """A map in the making."""

    level: Level
    names: Names
    ground: Ground
    network: Network
    skipped: list[Skipped]
    rooms: list[Room] = field(default_factory=list)
    doors: list[Door] = field(default_factory=list)
    arrivals: dict[int, _Arrival] = field(default_factory=dict)

    def free_stops(self, node_of: dict[int, str]) -> None:
        """Take lanes away that end at places: rooms go there. How they came stays known."""
        for vertex in self._stops():
            node = node_of.get(vertex.index, "")
            for way in self.network.at(node)[:1]:
                (ax, ay), (bx, by) = self.network.nodes[way.start], self.network.nodes[way.end]
                direction = math.atan2(by - ay, bx - ax)
                self.arrivals[vertex.index] = _Arrival(direction, way.other(node), way.max_speed)
            self.network = without_leaf(self.network, node)
        self._await_others()

    def attach(self, found: RoomsAndDoors) -> None:
        """Lead the corridors up to the real doors; rooms that they do not reach drop out."""
        for door in found.onto_hub:
            ground = self.ground.with_door(door)
            led = attached(self.network, ground, door)
            if led is None:
                self.skipped.append(Skipped("door", door.id, "no lane can be led to it"))
            else:
                self.ground, self.network = ground, led[0]
                self.doors.append(door)
        reached = {room for door in self.doors for room in door.rooms}
        for _ in found.rooms:
            reached |= {room for door in found.between if reached & set(door.rooms) for room in door.rooms}
        self.doors += [door for door in found.between if set(door.rooms) <= reached]
        self.rooms += [room for room in found.rooms if room.id in reached]
        lost = [room.id for room in found.rooms if room.id not in reached]
        self.skipped += [Skipped("room", room, "none of its doors can be reached") for room in lost]

    def add_bays(self, node_of: dict[int, str]) -> None:
        """Make a room of every place in the hub, what is needed first."""
        for vertex in sorted(self._stops(), key=lambda vertex: (not vertex.needed, vertex.index)):
            if self._room_at(vertex):
                continue
            if not self.ground.hub.covers(shapely.Point(vertex.point)):
                self.skipped.append(Skipped("place", vertex.id, "it is in no room that robots reach"))
                continue
            name = self.names.new(vertex.id)
            arrival = self.arrivals.pop(vertex.index, _Arrival())
            wish = Wish(
                room=name,
                door=self.names.new(f"{name}_door"),
                point=vertex.point,
                direction=arrival.direction,
                max_speed=arrival.max_speed,
                most_harm=HARM_WHERE_NEEDED if vertex.needed else HARM_WHERE_NICE,
                elsewhere=tuple(other.point for other in self._stops() if other.needed and other != vertex),
            )
            self._await_others()
            bay = bay_at(wish, self.network, self.ground)
            if bay is None:
                self.skipped.append(Skipped("place", vertex.id, "no room with a door onto the corridors fits there"))
            else:
                self.network, self.ground = bay.network, bay.ground
                self.rooms.append(bay.room)
                self.doors.append(bay.door)

    def building(self, name: str) -> BuildingMap:
        """The map."""
        network, dead = tidied(self.network, self.ground)
        self.skipped += dead
        network = relaxed(network, self.ground)
        called = {node: node if node in network.doors else self.names.new(node) for node in network.nodes}
        corridors = Names()
        return BuildingMap(
            name=name,
            rooms=tuple(self.rooms),
            doors=tuple(self.doors),
            junctions=tuple(
                Junction(called[node], point) for node, point in network.nodes.items() if node not in network.doors
            ),
            corridors=tuple(
                _corridor(network, way, called, corridors.new(f"{called[way.start]}-{called[way.end]}"))
                for way in network.ways
            ),
            spawn_points=self._spawn_points(),
        )

    def _await_others(self) -> None:
        """Have dead ends respected from which places are still to be reached."""
        self.ground = replace(self.ground, wanted=frozenset(arrival.node for arrival in self.arrivals.values()))

    def _stops(self) -> list[Vertex]:
        return [vertex for vertex in self.level.vertices if vertex.stop and (vertex.name or vertex.needed)]

    def _room_at(self, vertex: Vertex) -> Room | None:
        """The room that the vertex is in."""
        point = shapely.Point(vertex.point)
        return next((room for room in self.rooms if shapely.Polygon(room.outline).covers(point)), None)

    def _spawn_points(self) -> tuple[SpawnPoint, ...]:
        """A spawn point at each place, or as near to it as its room allows."""
        found: list[SpawnPoint] = []
        names = Names()
        made = {room.id: room for room in self.rooms}
        for vertex in self._stops():
            room = self._room_at(vertex) or next((made[i] for i in made if i == vertex.id), None)
            doors = [door for door in self.doors if room and room.id in door.rooms]
            others = [spawn.pose.point for spawn in found if room and spawn.room == room.id]
            point = _standing(room, doors, others, vertex.point) if room else None
            if room is None or point is None:
                if room is not None:
                    self.skipped.append(Skipped("spawn point", vertex.id, f"room {room.id} has no space for it"))
                continue
            x, y = min((door.position for door in doors), key=lambda place: math.dist(place, point))
            heading = round(math.atan2(y - point[1], x - point[0]), 3)
            found.append(SpawnPoint(names.new(vertex.id), room.id, Pose(*point, heading)))
        return tuple(found)


def _standing(room: Room, doors: list[Door], others: list[Point], wish: Point) -> Point | None:
    """The place nearest to the wish where a robot may stand beside others, out of the way of doors if possible."""
    floor = shapely.Polygon(room.outline, room.obstacles).buffer(-FOOTHOLD, join_style="mitre")
    floor = floor.difference(shapely.union_all([shapely.Point(other).buffer(2 * FOOTHOLD) for other in others]))
    ways = [mouth(door, -DOORWAY - ASIDE, DOORWAY, ASIDE) for door in doors]
    aside = floor.difference(shapely.union_all(ways))
    best = floor if aside.is_empty else aside
    return None if best.is_empty else rounded(nearest_points(best, shapely.Point(wish))[0].coords[0])


def _corridor(network: Network, way: Way, called: dict[str, str], name: str) -> Corridor:
    return Corridor(
        id=CorridorId(name),
        start=called[way.start],
        end=called[way.end],
        shape=network.line(way),
        max_speed=way.max_speed or MAX_SPEED,
        one_way=way.one_way,
    )


def _one_way_findings(building: BuildingMap) -> list[Finding]:
    """Doors from which one-way corridors do not let robots come to the others and back."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    for corridor in building.corridors:
        graph.add_edge(corridor.start, corridor.end)
        if not corridor.one_way:
            graph.add_edge(corridor.end, corridor.start)
    doors = [door.id for door in building.doors if len(door.rooms) == 1]
    round_trip = {node: part for part in nx.strongly_connected_components(graph) for node in part}
    return [
        Finding(("lanes",), f"lanes that lead from {doors[0]} to {door} and back", "one-way lanes")
        for door in doors[1:]
        if door not in round_trip[doors[0]]
    ]


def _models(level: Level) -> list[Skipped]:
    counts = sorted(Counter(level.models).items())
    return [Skipped("model", name, "the file does not say how large it is", count) for name, count in counts]
