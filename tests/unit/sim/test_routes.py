"""Ways from door to door."""

import json
import math

import pytest

from clo_fleet.sim.routes import Route, Routes, UnknownDoorError
from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, Junction, Point, RoomId

W, E, N = map(DoorId, ("west", "east", "north"))


def door(name: DoorId, position: Point, *rooms: str) -> Door:
    """A door; its heading does not matter here."""
    return Door(id=name, rooms=tuple(map(RoomId, rooms)), position=position, heading=0.0, width=1.6)


def corridor(name: str, start: str, end: str, *shape: Point, max_speed: float = 1.5, one_way: bool = False) -> Corridor:
    """A corridor along a line."""
    return Corridor(id=CorridorId(name), start=start, end=end, shape=shape, max_speed=max_speed, one_way=one_way)


def building(*corridors: Corridor) -> BuildingMap:
    """Doors at both ends and one between two rooms, two junctions between, and the corridors given."""
    return BuildingMap(
        name="m",
        rooms=(),
        doors=(door(W, (0.0, 0.0), "l1"), door(E, (9.0, 0.0), "l2"), door(N, (0.0, 9.0), "l1", "l2")),
        junctions=(Junction("a", (3.0, 0.0)), Junction("b", (6.0, 0.0))),
        corridors=corridors,
    )


IN = corridor("in", W, "a", (0.0, 0.0), (3.0, 0.0))
OUT = corridor("out", "b", E, (6.0, 0.0), (9.0, 0.0))
DIRECT = corridor("direct", "a", "b", (3.0, 0.0), (6.0, 0.0), max_speed=0.1)
ROUND = corridor("round", "a", "b", (3.0, 0.0), (3.0, 4.0), (6.0, 0.0))


def test_a_route_follows_edges_and_knows_its_length_and_time() -> None:
    """Backwards the edges carry a minus."""
    routes = Routes(building(IN, DIRECT, OUT))
    there, back = routes.fastest(W, E), routes.fastest(E, W)
    assert there is not None
    assert back is not None
    assert (there.start, there.end, there.edges) == (W, E, ("in", "direct", "out"))
    assert back.edges == ("-out", "-direct", "-in")
    assert there.length == pytest.approx(9.0)
    assert there.time == pytest.approx(2.0 + 30.0 + 2.0)
    assert routes.fastest(W, E) is there
    assert Route.from_state(json.loads(json.dumps(there.state()))) == there


def test_the_fastest_way_is_taken_not_the_shortest() -> None:
    """Also between corridors that join the same two nodes, and in whatever order the map names them."""
    for corridors in ((IN, DIRECT, ROUND, OUT), (OUT, ROUND, DIRECT, IN)):
        route = Routes(building(*corridors)).fastest(W, E)
        assert route is not None
        assert route.edges == ("in", "round", "out")
        assert route.length == pytest.approx(3 + 4 + 5 + 3)


def test_of_two_equally_fast_corridors_the_first_by_id_is_taken() -> None:
    """Not the first in the file."""
    twins = [corridor(name, W, E, (0.0, 0.0), (9.0, 0.0)) for name in ("c2", "c1", "c3")]
    route = Routes(building(*twins)).fastest(W, E)
    assert route is not None
    assert route.edges == ("c1",)


def test_where_no_way_leads_there_is_no_route() -> None:
    """Against a one-way corridor, to a door without corridors, and from a door to itself."""
    routes = Routes(building(corridor("c1", W, E, (0.0, 0.0), (9.0, 0.0), one_way=True)))
    assert routes.fastest(W, E) is not None
    assert [routes.fastest(a, b) for a, b in ((E, W), (W, W), (W, N), (N, W))] == [None] * 4


def test_an_unknown_door_is_an_error() -> None:
    """A junction is no door either."""
    routes = Routes(building(IN))
    with pytest.raises(UnknownDoorError, match="no door 'a'"):
        routes.fastest(W, DoorId("a"))


def test_no_way_leads_past_a_door() -> None:
    """Whoever stands before one would block it; and plans do not count on it either."""
    through = building(corridor("c1", W, N, (0.0, 0.0), (0.0, 9.0)), corridor("c2", N, E, (0.0, 9.0), (9.0, 0.0)))
    routes = Routes(through)
    assert routes.fastest(W, N) is not None
    assert routes.fastest(W, E) is None


def test_a_delay_leads_another_way_and_an_infinite_one_nowhere() -> None:
    """The time counts the delays; the route's own time does not."""
    routes = Routes(building(IN, DIRECT, ROUND, OUT))
    route, time = routes.quickest(W, E, lambda edge: 30.0 if edge == "round" else 0.0)
    assert route is not None
    assert route.edges == ("in", "direct", "out")
    assert time == pytest.approx(34.0)
    assert route.time == pytest.approx(34.0)
    assert routes.quickest(W, E, lambda edge: math.inf if edge == "in" else 0.0) == (None, math.inf)


def test_a_robot_on_its_way_goes_on_from_the_end_of_its_edge() -> None:
    """Round the loop to come back, as it cannot turn on the spot."""
    routes = Routes(building(IN, DIRECT, ROUND, OUT))
    assert routes.onward("in", W, lambda _: 0.0)[0] == ("round", "-direct", "-in")
    assert routes.onward("round", E, lambda _: 0.0)[0] == ("out",)
    assert routes.onward("round", E, lambda _: 0.0)[1] == pytest.approx(2.0)
    assert routes.onward("out", E, lambda _: 0.0) == ((), 0.0)
    assert routes.onward("out", W, lambda _: 0.0) == ((), math.inf)
    assert [routes.time(edge) for edge in ("in", "direct")] == pytest.approx([2.0, 30.0])
