"""A robot that stands, or is on its way through the corridors, is left alone, and nothing is missed by that."""

from dataclasses import astuple

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


@pytest.mark.parametrize("world", ["hello", "office"])
def test_meters_are_the_same_however_often_one_looks(world: str, fleet_planners: PlannerPool) -> None:
    """Whoever asks for a robot wakes all; times and ways come out alike, and so does what happens."""
    ends = []
    for often in (False, True):
        with Run(read_world(shipped("worlds") / f"{world}.yaml"), "clo", planners=fleet_planners) as run:
            while not run.done:
                run.step()
                if often:
                    run.mission.robot(run.mission.robots[0].id)
            meters = [run.mission.robot(robot.id).meters for robot in run.mission.robots]
            ends.append((tuple(run.log), meters))
    (log, meters), (log_often, meters_often) = ends
    assert log == log_often
    for one, other in zip(meters, meters_often, strict=True):
        assert astuple(one)[:3] == pytest.approx(astuple(other)[:3], abs=1e-6)
        assert one.distance == pytest.approx(other.distance, abs=0.01)  # SUMO's way, and the same measured in pieces
    assert max(one.distance for one in meters) > 10.0
