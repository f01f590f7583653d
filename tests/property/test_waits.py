"""The search for circles of robots that wait for one another, held against networkx."""

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from clo_fleet.fleet.waits import Waits
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.world.model import RobotId

names = st.integers(0, 9).map(lambda number: RobotId(f"r{number}"))
waiting = st.dictionaries(names, st.lists(names, max_size=3).map(tuple), max_size=10)


@given(waiting)
def test_a_circle_is_found_just_when_there_is_one(on: dict[RobotId, tuple[RobotId, ...]]) -> None:
    """Each robot of it waits for the next, the last for the first, and it begins with the smallest."""
    waits = Waits()
    waits.note(0.2, 0.2, {robot: Wait(WaitCause.DOOR, "d", others) for robot, others in on.items()})
    graph = nx.DiGraph([(robot, other) for robot, others in on.items() for other in others])
    circle = waits.circle
    assert bool(circle) is not nx.is_directed_acyclic_graph(graph)
    assert all(after in on[robot] for robot, after in zip(circle, (*circle[1:], *circle[:1]), strict=True))
    assert not circle or circle[0] == min(circle)
