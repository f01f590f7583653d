"""Robots that are sent another way while they drive."""

from pathlib import Path

import pytest

from clo_fleet.sim.corridors import Corridors
from clo_fleet.sim.map_folder import write_building
from clo_fleet.sim.routes import Routes
from clo_fleet.world.buildings import Measures, line
from clo_fleet.world.model import DoorId, RobotId


@pytest.mark.parametrize("shut", [False, True], ids=["open behind it", "closed behind it"])
@pytest.mark.parametrize("ahead", [0, 1, 2, 3], ids=lambda ahead: f"{ahead} edges on")
def test_a_diverted_robot_leaves_one_lane_after_the_other_and_arrives(tmp_path: Path, ahead: int, shut: bool) -> None:
    """However far it has come, and also when it is diverted twice; the lanes that it has left never come back."""
    building, _ = write_building(line(7, Measures(two_lane=True)), tmp_path)
    routes = Routes(building)
    robot, start = RobotId("r1"), DoorId("room-0-door")
    with Corridors(building, seed=0) as corridors:
        ways = [routes.fastest(start, DoorId(f"room-{room}-door")) for room in (6, 5, 4)]
        far, nearer, near = (way for way in ways if way is not None)
        corridors.enter(robot, far, 1.0)
        others, left = [nearer, near], len(far.edges)
        for _ in range(1000):
            corridors.step()
            lanes = corridors.lanes_left(robot)
            edge = corridors.turning_point(robot)
            turned = len(others) < 2
            if others and edge is not None and edge == far.edges[ahead + turned]:
                for passed in far.edges[: ahead + turned + 1] if shut else ():
                    corridors.close_edge(passed)
                corridors.divert(robot, others.pop(0))
                lanes = corridors.lanes_left(robot)
                left = len(lanes)
            assert lanes == (nearer if len(others) == 1 else far if others else near).edges[-len(lanes) :]
            assert len(lanes) <= left
            left = len(lanes)
            if robot in corridors.arrived():
                break
        assert not others
        assert robot in corridors.arrived()
        assert lanes == near.edges[-1:]
