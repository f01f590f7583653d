"""Zones and ways between rooms."""

import math
from itertools import permutations

import networkx as nx
import pytest

from clo_fleet.world.buildings import grid
from clo_fleet.world.model import (
    BuildingMap,
    Corridor,
    CorridorId,
    Door,
    DoorId,
    Junction,
    PlaceId,
    Point,
    Room,
    RoomId,
)
from clo_fleet.world.outlines import centroid, length
from clo_fleet.world.places import (
    Way,
    Ways,
    connected_rooms,
    reachable_rooms,
    room_at,
    round_trips,
    travel_time,
    zones,
)


def room_id(name: str) -> RoomId:
    """The name as a room's id."""
    return RoomId(PlaceId(name))


def square(name: str, x: float, y: float) -> Room:
    """A room of 4 m by 4 m with its lower left corner at x, y."""
    return Room(room_id(name), ((x, y), (x + 4, y), (x + 4, y + 4), (x, y + 4)))


def door(name: str, at: Point, *rooms: str) -> Door:
    """A door of 1 m."""
    return Door(id=DoorId(name), rooms=tuple(map(room_id, rooms)), position=at, heading=0.0, width=1.0)


def corridor(name: str, start: str, end: str, *shape: Point, one_way: bool = False) -> Corridor:
    """A corridor at 2 m/s."""
    return Corridor(id=CorridorId(name), start=start, end=end, shape=shape, max_speed=2.0, one_way=one_way)


def led_through(ways: tuple[Way, ...]) -> list[tuple[str, str, str | None]]:
    """What each way leads through."""
    return [(way.exit, way.entry, way.zone) for way in ways]


# a and b share a door; a-j-c is one zone; the corridor c-d is another, which only the door of c joins to the first.
BUILDING = BuildingMap(
    name="corner",
    rooms=(square("a", 0, 0), square("b", 0, 4), square("c", 14, 0), square("d", 14, -14)),
    doors=(
        door("dab", (2, 4), "a", "b"),
        door("da", (4, 2), "a"),
        door("dc", (14, 2), "c"),
        door("dd", (14, -12), "d"),
    ),
    junctions=(Junction("j", (9, 2)),),
    corridors=(
        corridor("k3", "da", "j", (4, 2), (9, 2)),
        corridor("k2", "j", "dc", (9, 2), (14, 2)),
        corridor("k1", "dc", "dd", (14, 2), (10, 2), (10, -12), (14, -12), one_way=True),
    ),
)


def test_doors_end_zones_and_junctions_join_them() -> None:
    """Corridors that meet only at a door are two zones; zones are numbered by their smallest corridor."""
    assert zones(BUILDING) == {"zone-1": {"k1"}, "zone-2": {"k2", "k3"}}


def test_rooms_are_connected_by_a_shared_door_or_by_one_zone() -> None:
    """No pair leads through a third room or on through a door, and one-way corridors connect one way."""
    assert connected_rooms(BUILDING) == (("a", "b"), ("a", "c"), ("b", "a"), ("c", "a"), ("c", "d"))


def test_the_doors_between_rooms_are_known_with_their_zone() -> None:
    """A shared door is exit and entry at once."""
    ways = Ways(BUILDING)
    assert led_through(ways.between(room_id("a"), room_id("b"))) == [("dab", "dab", None)]
    assert led_through(ways.between(room_id("a"), room_id("c"))) == [("da", "dc", "zone-2")]
    assert ways.between(room_id("d"), room_id("c")) == ways.between(room_id("x"), room_id("c")) == ()


def test_travel_time_is_free_flow_with_crossings_at_1_m_s() -> None:
    """From the middle of a room to its door, along the corridors, and to the middle of the other."""
    times = travel_time(BUILDING)
    assert times[room_id("a"), room_id("c")] == pytest.approx(2 + 10 / 2 + 2)
    assert times[room_id("a"), room_id("b")] == pytest.approx(4)
    assert times[room_id("c"), room_id("d")] == pytest.approx(2 + 22 / 2 + 2)


def test_of_two_ways_the_quicker_counts() -> None:
    """A second pair of doors on a longer corridor comes second and changes no time."""
    longer = corridor("k0", "da2", "dc2", (2, 0), (2, -4), (16, -4), (16, 0))
    doors = (*BUILDING.doors, door("da2", (2, 0), "a"), door("dc2", (16, 0), "c"))
    building = BuildingMap(
        name="two ways",
        rooms=BUILDING.rooms,
        doors=doors,
        junctions=BUILDING.junctions,
        corridors=(*BUILDING.corridors, longer),
    )
    a, c = room_id("a"), room_id("c")
    assert led_through(Ways(building).between(a, c)) == [("da", "dc", "zone-3"), ("da2", "dc2", "zone-1")]
    assert travel_time(building)[a, c] == travel_time(BUILDING)[a, c]


def test_reachable_rooms_lie_at_any_distance_but_not_against_one_way_corridors() -> None:
    """From a everything, from d nothing else."""
    assert reachable_rooms(BUILDING, [room_id("b"), room_id("d")]) == {"b": {"a", "b", "c", "d"}, "d": {"d"}}


def test_rooms_come_in_parts_of_round_trips() -> None:
    """What one reaches but cannot leave again is a part of its own."""
    assert set(round_trips(BUILDING)) == {frozenset({"a", "b", "c"}), frozenset({"d"})}


def test_a_point_is_in_the_room_that_covers_it() -> None:
    """Walls belong to rooms, corridors to none."""
    assert room_at(BUILDING, (1, 1)) == "a"
    assert room_at(BUILDING, (2, 4)) == "a"
    assert room_at(BUILDING, (9, 2)) is None
    assert room_at(BUILDING, (math.inf, 2)) is None


def test_times_are_those_of_the_shortest_paths() -> None:
    """In a grid every room is one way from every other, as long as the shortest path through the corridors."""
    building = grid(4, 3)
    graph: nx.Graph[str] = nx.Graph()
    for piece in building.corridors:
        graph.add_edge(piece.start, piece.end, weight=length(piece.shape) / piece.max_speed)
    ways = Ways(building)
    for a, b in permutations(building.rooms, 2):
        (way,) = ways.between(a.id, b.id)
        inside = sum(math.dist(centroid(room.outline), door_of(building, room).position) for room in (a, b))
        path = nx.shortest_path_length(graph, way.exit, way.entry, weight="weight")
        assert way.time == pytest.approx(inside + path)
    assert len(list(ways.all())) == 12 * 11


def door_of(building: BuildingMap, room: Room) -> Door:
    """A room's only door."""
    (found,) = (door for door in building.doors if room.id in door.rooms)
    return found
