"""Right of way: who may set out, and who has to wait for what."""

import json

import pytest

from clo_fleet.sim.lanes import ChainWay, Ground, ground, lane_capacity, single_lane_doors
from clo_fleet.sim.right_of_way import OVERTAKINGS, Claim, Hindrance, NoClaimError, Obstacle, RightOfWay
from clo_fleet.world.buildings import Measures, line, ring
from clo_fleet.world.model import BuildingMap, Corridor, CorridorId, Door, DoorId, Junction, RobotId, RoomId

A, B, C = RoomId("a"), RoomId("b"), RoomId("c")
NOBODY: dict[RoomId, list[RobotId]] = {}

# Two rooms at a single lane, drawn from a to b.
LINE = Ground(
    capacity={"s": 4, "-s": 4},
    ways={"s": ChainWay("s", True), "-s": ChainWay("s", False)},
    places={A: 5, B: 5, C: 5},
)
THERE, BACK = Claim(A, B, ("s",)), Claim(B, A, ("-s",))


def r(number: int) -> RobotId:
    """A robot's id."""
    return RobotId(f"r{number:02}")


def test_who_finds_the_way_free_sets_out_at_once() -> None:
    """And has its claim until it gives it back."""
    right = RightOfWay(LINE)
    assert not right.ask(r(1), THERE)
    assert right.decide(NOBODY) == (r(1),)
    assert right.granted(r(1))
    assert right.ask(r(1), THERE)
    assert right.load("s") == 0.25
    right.withdraw(r(1))
    assert not right.granted(r(1))
    assert right.load("s") == 0.0


def test_a_single_lane_is_used_in_one_direction_at_a_time() -> None:
    """Followers may join; who comes the other way waits until the last has left it."""
    right = RightOfWay(LINE)
    for number, claim in enumerate((THERE, BACK, THERE)):
        right.ask(r(number), claim)
    assert right.decide(NOBODY) == (r(0), r(2))
    assert right.hindrance(r(1)) == Hindrance(Obstacle.SINGLE_LANE, "s", (r(0), r(2)))
    assert right.against("-s") == 2
    right.left(r(0), ())
    assert right.decide(NOBODY) == ()
    right.left(r(2), ())
    assert right.decide(NOBODY) == (r(1),)
    assert right.hindrance(r(1)) is None


def test_a_stream_of_followers_ends_when_somebody_has_been_overtaken_often_enough() -> None:
    """The other direction comes to its turn."""
    right = RightOfWay(Ground({"s": 99, "-s": 99}, LINE.ways, {A: 99, B: 99}))
    right.ask(r(0), THERE)
    right.decide(NOBODY)
    right.ask(r(1), BACK)
    for number in range(2, 30):
        right.ask(r(number), THERE)
    granted = right.decide(NOBODY)
    assert len(granted) == OVERTAKINGS
    assert right.hindrance(r(29)) == Hindrance(Obstacle.TURN, B, (r(1),))
    for robot in (r(0), *granted):
        right.withdraw(robot)
    assert right.decide(NOBODY) == (r(1),)


def test_lanes_that_can_fill_up_never_form_a_circle() -> None:
    """Round a square some have to wait, however many want to go; all get there."""
    lanes = ["n", "e", "s", "w"]
    square = Ground(dict.fromkeys(lanes, 2), {}, {A: 99})
    right = RightOfWay(square)
    for number in range(20):
        begin = number % 4
        right.ask(r(number), Claim(B, A, tuple((lanes + lanes)[begin : begin + 3])))
    granted = right.decide(NOBODY)
    assert granted
    found = right.hindrance(next(r(n) for n in range(20) if r(n) not in granted))
    assert found is not None
    assert found.obstacle is Obstacle.FULL_LANES
    assert set(found.by) <= set(granted)
    done = list(granted)
    for robot in done:
        right.withdraw(robot)
        done += right.decide(NOBODY)
    assert sorted(done) == [r(number) for number in range(20)]


def test_a_way_that_comes_back_through_the_same_single_lane_is_refused() -> None:
    """A robot would meet itself."""
    right = RightOfWay(LINE)
    right.ask(r(1), Claim(A, B, ("s", "-s")))
    assert right.decide(NOBODY) == ()


def test_places_in_rooms_are_booked_in_turn() -> None:
    """Robots that stand there count, and those on their way; who left makes room."""
    right = RightOfWay(Ground({"x": 99}, {}, {B: 2}))
    for number in range(3):
        right.ask(r(number), Claim(A, B, ("x",)))
    assert right.decide({B: [r(9)]}) == (r(0),)
    assert right.hindrance(r(2)) == Hindrance(Obstacle.ROOM, B, (r(9),))
    right.withdraw(r(0))
    assert right.decide({B: [r(0), r(9)]}) == ()
    assert right.decide({B: [r(0)]}) == (r(1),)


@pytest.mark.parametrize("rooms", [2, 3])
def test_full_rooms_exchange_robots_in_a_circle(rooms: int) -> None:
    """One after the other through a single lane, though no room has a place."""
    names = [A, B, C][:rooms]
    places = Ground(LINE.capacity, LINE.ways, dict.fromkeys(names, 1))
    right, standing = RightOfWay(places), {room: [r(number)] for number, room in enumerate(names)}
    lanes = [("s",), ("-s",), ()]
    for number, room in enumerate(names):
        right.ask(r(number), Claim(room, names[(number + 1) % rooms], lanes[number]))
    assert r(0) in right.decide(standing)
    right.ask(r(7), Claim(A, B, ("s",)))
    assert right.decide(standing) == ()  # it has no part in the exchange
    standing[A].remove(r(0))
    standing[B].append(r(0))
    right.withdraw(r(0))
    assert r(1) in right.decide(standing)
    assert right.hindrance(r(7)) == Hindrance(Obstacle.ROOM, B, (r(1), r(0)))


def test_a_room_that_nobody_leaves_lets_nobody_in() -> None:
    """That is no exchange."""
    right = RightOfWay(Ground(LINE.capacity, LINE.ways, {A: 1, B: 1}))
    right.ask(r(0), THERE)
    assert right.decide({A: [r(0)], B: [r(1)]}) == ()


def test_closed_lanes_are_granted_to_nobody_until_they_are_open_again() -> None:
    """Who has them keeps them; who waits for one does not hold up others."""
    right = RightOfWay(LINE)
    right.close("s")
    right.ask(r(1), THERE)
    right.ask(r(2), BACK)
    assert right.decide(NOBODY) == (r(2),)
    assert right.hindrance(r(1)) == Hindrance(Obstacle.CLOSED, "s")
    assert right.closed("s")
    right.withdraw(r(2))
    right.open("s")
    assert right.decide(NOBODY) == (r(1),)


def test_a_claim_can_be_exchanged_if_the_other_one_can_be_had_at_once() -> None:
    """Else all stays as it was."""
    loop = Ground(
        {"in": 3, "x": 3, "y": 3, "-y": 3},
        {"y": ChainWay("y", True), "-y": ChainWay("y", False)},
        {A: 2, B: 2, C: 1},
    )
    right = RightOfWay(loop)
    right.ask(r(1), Claim(A, B, ("in", "x")))
    right.decide(NOBODY)
    assert right.exchange(r(1), Claim(A, B, ("in", "y")))
    assert (right.load("x"), right.load("y")) == (0.0, 1 / 3)
    right.ask(r(2), Claim(A, B, ("in", "x")))
    assert right.decide({C: [r(5)]}) == (r(2),)
    assert not right.exchange(r(2), Claim(A, B, ("in", "-y")))  # against the other
    assert not right.exchange(r(2), Claim(A, C, ("in",)))  # no place there
    right.close("y")
    assert not right.exchange(r(2), Claim(A, B, ("in", "y")))
    assert right.load("x") == 1 / 3
    with pytest.raises(NoClaimError, match="r03"):
        right.exchange(r(3), THERE)
    with pytest.raises(NoClaimError):
        right.left(r(3), ())


def test_asking_for_something_else_keeps_the_turn() -> None:
    """And the place, if the goal is the same."""
    right = RightOfWay(Ground(LINE.capacity, LINE.ways, {A: 1, B: 1, C: 1}))
    right.ask(r(0), BACK)
    right.decide(NOBODY)
    right.ask(r(1), THERE)
    right.ask(r(2), Claim(C, B))
    assert right.decide(NOBODY) == ()
    right.ask(r(1), Claim(A, B))
    assert right.decide(NOBODY) == (r(1),)


def test_a_saved_state_goes_on_alike() -> None:
    """Through JSON, with claims partly given back, turns, exchanges and closings."""
    right = RightOfWay(LINE)
    for number in range(9):
        right.ask(r(number), THERE if number % 3 else BACK)
    right.decide({A: [r(1)]})
    right.left(r(0), ())
    right.close("x")
    other = RightOfWay(LINE)
    other.ask(r(50), THERE)
    other.decide(NOBODY)
    other.restore(json.loads(json.dumps(right.state())))
    assert other.state() == right.state()
    for number in range(9):
        for one in (right, other):
            one.withdraw(r(number))
        assert other.decide({A: [r(1)]}) == right.decide({A: [r(1)]})
        assert [other.hindrance(r(n)) for n in range(9)] == [right.hindrance(r(n)) for n in range(9)]


def test_a_chain_is_a_row_of_single_lanes_however_they_are_drawn() -> None:
    """It ends where a third corridor meets it, and where a second lane begins."""

    def corridor(name: str, start: str, end: str, single: bool = True) -> Corridor:
        return Corridor(id=CorridorId(name), start=start, end=end, shape=((0, 0), (5, 0)), single_lane=single)

    building = BuildingMap(
        name="m",
        rooms=(),
        doors=tuple(Door(id=DoorId(n), rooms=(A,), position=(0, 0), heading=0, width=1.0) for n in ("d1", "d2")),
        junctions=tuple(Junction(name, (0, 0)) for name in "jklm"),
        corridors=(
            corridor("c1", "d1", "j"),
            corridor("c2", "k", "j"),
            corridor("c3", "k", "l"),
            corridor("c4", "l", "d2"),
            corridor("c5", "l", "m"),
            corridor("c6", "m", "m2", single=False),
        ),
    )
    ways = ground(building, {}, {}).ways
    assert {edge: (way.chain, way.forwards) for edge, way in ways.items() if not edge.startswith("-")} == {
        "c1": ("c1", True),
        "c2": ("c1", False),
        "c3": ("c1", True),
        "c4": ("c4", True),
        "c5": ("c5", True),
    }
    assert all(ways[f"-{edge}"].forwards != ways[edge].forwards for edge in ("c1", "c2", "c3"))
    assert single_lane_doors(building) == {"d1", "d2"}


def test_rooms_have_places_by_their_floor_and_always_for_those_who_begin_there() -> None:
    """Ten robots are promised space in a room of 5 x 5 m."""
    building = line(2, Measures())
    room = building.rooms[0].id
    assert ground(building, {}, {}).places[room] >= 20
    assert ground(building, {}, {room: 50}).places[room] == 50
    assert lane_capacity(0.3) == 1
    single = {c.id for c in ring(4, Measures()).corridors if c.single_lane}
    assert {edge.removeprefix("-") for edge in ground(ring(4, Measures()), {}, {}).ways} == single
