"""Right of way, whatever is asked in whatever order: nobody meets head-on, nothing freezes, nobody starves."""

from dataclasses import dataclass, field
from itertools import pairwise

import networkx as nx
from hypothesis import given, settings
from hypothesis import strategies as st

from clo_fleet.sim.lanes import ChainWay, Ground
from clo_fleet.sim.right_of_way import Claim, RightOfWay
from clo_fleet.world.model import RobotId, RoomId


@dataclass
class Town:
    """Lanes as queues that hold so many robots: only the first of each goes on, and only if there is room.

    This is the worst that corridors can do to their robots.
    """

    ground: Ground
    rooms: dict[RobotId, RoomId]
    right: RightOfWay
    lanes: dict[str, list[RobotId]] = field(default_factory=dict)
    ahead: dict[RobotId, list[str]] = field(default_factory=dict)
    goals: dict[RobotId, RoomId] = field(default_factory=dict)

    def standing(self) -> dict[RoomId, list[RobotId]]:
        """Who is in each room."""
        found: dict[RoomId, list[RobotId]] = {}
        for robot, room in sorted(self.rooms.items()):
            found.setdefault(room, []).append(robot)
        return found

    def set_out(self, robot: RobotId, claim: Claim) -> None:
        """A robot with the right of way waits to get onto its first lane."""
        self.ahead[robot], self.goals[robot] = list(claim.lanes), claim.goal

    def granted(self) -> tuple[RobotId, ...]:
        """Who may set out now. One who has just taken up the claims and must look at everybody decides the same."""
        twin, standing = RightOfWay(self.ground), self.standing()
        twin.restore(self.right.state())
        found = self.right.decide(standing)
        assert found == twin.decide(standing)
        assert self.right.state() == twin.state()
        return found

    def moves(self) -> list[RobotId]:
        """Who can go on by one lane, or into a room that is not overfull."""
        crowd = self.standing()
        found = []
        for robot, ahead in sorted(self.ahead.items()):
            here = next((lane for lane, queue in self.lanes.items() if robot in queue), None)
            if here is not None and self.lanes[here][0] != robot:
                continue
            if ahead:
                room = len(self.lanes.get(ahead[0], ())) < self.ground.capacity[ahead[0]]
            else:
                room = len(crowd.get(self.goals[robot], ())) <= self.ground.places[self.goals[robot]]
            if room:
                found.append(robot)
        return found

    def move(self, robot: RobotId) -> None:
        """Go on by one lane, or into the room."""
        for queue in self.lanes.values():
            if robot in queue:
                queue.remove(robot)
        self.rooms.pop(robot, None)
        if self.ahead[robot]:
            lane = self.ahead[robot].pop(0)
            self.lanes.setdefault(lane, []).append(robot)
            self.right.left(robot, [lane, *self.ahead[robot]])
        else:
            self.rooms[robot] = self.goals.pop(robot)
            del self.ahead[robot]
            self.right.withdraw(robot)

    def nobody_meets(self) -> None:
        """No chain has robots in both directions."""
        used = [self.ground.ways[lane] for lane, queue in self.lanes.items() if queue and lane in self.ground.ways]
        assert len({way.chain for way in used}) == len(set(used))


@st.composite
def towns(draw: st.DrawFn) -> "tuple[nx.DiGraph[int], Ground, dict[RobotId, RoomId], list[tuple[RobotId, RoomId]]]":
    """Crossings in any arrangement with a room at each, lanes for one or a few robots, and trips between the rooms."""
    nodes = draw(st.integers(2, 6))
    edges = {(n, draw(st.integers(0, n - 1))) for n in range(1, nodes)}
    edges |= draw(st.sets(st.tuples(st.integers(0, nodes - 1), st.integers(0, nodes - 1)), max_size=4))
    graph: nx.DiGraph[int] = nx.DiGraph()
    capacity, ways = {}, {}
    for a, b in sorted({(min(e), max(e)) for e in edges if e[0] != e[1]}):
        single, name = draw(st.booleans()), f"{a}-{b}"
        graph.add_edge(a, b, lane=name)
        graph.add_edge(b, a, lane=f"-{name}")
        for lane in (name, f"-{name}"):
            capacity[lane] = draw(st.integers(1, 2))
            if single:
                ways[lane] = ChainWay(name, lane == name)
    rooms = [RoomId(f"room{n}") for n in range(nodes)]
    count = draw(st.integers(1, 10))
    homes = {RobotId(f"r{n:02}"): rooms[draw(st.integers(0, nodes - 1))] for n in range(count)}
    crowd = [list(homes.values()).count(room) for room in rooms]
    places = {room: max(crowd[n], draw(st.integers(1, 4))) for n, room in enumerate(rooms)}
    trips, at = [], dict(homes)
    for _ in range(draw(st.integers(1, 15))):
        robot = draw(st.sampled_from(sorted(homes)))
        goal = draw(st.sampled_from([room for room in rooms if room != at[robot]]))
        trips.append((robot, goal))
        at[robot] = goal
    return graph, Ground(capacity, ways, places), homes, trips


def way(graph: "nx.DiGraph[int]", start: RoomId, goal: RoomId) -> tuple[str, ...]:
    """The lanes of a shortest way."""
    nodes = nx.shortest_path(graph, int(start[4:]), int(goal[4:]))
    return tuple(graph.edges[pair]["lane"] for pair in pairwise(nodes))


@settings(max_examples=200, deadline=None)
@given(towns(), st.randoms(use_true_random=False))
def test_all_get_where_they_want_unless_a_room_stays_full(
    town: "tuple[nx.DiGraph[int], Ground, dict[RobotId, RoomId], list[tuple[RobotId, RoomId]]]",
    dice: object,
) -> None:
    """However the robots that can move are chosen; who waits in the end waits for a room that nobody wants to leave."""
    graph, ground, homes, trips = town
    it = Town(ground, dict(homes), RightOfWay(ground))
    left: dict[RobotId, list[RoomId]] = {}
    for robot, goal in trips:
        left.setdefault(robot, []).append(goal)

    def set_out() -> None:
        for robot in it.granted():
            goal = left[robot].pop(0)
            it.set_out(robot, Claim(it.rooms[robot], goal, way(graph, it.rooms[robot], goal)))

    while True:
        for robot, goals in sorted(left.items()):
            if goals and robot in it.rooms and robot not in it.ahead:
                it.right.ask(robot, Claim(it.rooms[robot], goals[0], way(graph, it.rooms[robot], goals[0])))
                if dice.random() < 0.5:  # type: ignore[attr-defined]
                    set_out()
        set_out()
        moves = it.moves()
        if not moves:
            break
        it.move(dice.choice(moves))  # type: ignore[attr-defined]
        it.nobody_meets()
    assert not it.ahead
    for robot, goals in left.items():
        if goals:
            stuck = {goals[0]}
            for _ in ground.places:
                stuck |= {left[o][0] for o, room in it.rooms.items() if room in stuck and left.get(o)}
            assert any(not any(left.get(o) for o, room in it.rooms.items() if room == full) for full in stuck), robot
