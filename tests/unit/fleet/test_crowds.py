"""Rooms in which nothing stirs are left alone, and nothing is missed by that."""

from clo_fleet.fleet.crowds import Crowds
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.robot.skill import Under
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.model import RobotId
from clo_fleet.world.world_file import read_world


def test_who_wants_something_new_is_steered_also_in_a_room_at_rest(fleet_planners: PlannerPool) -> None:
    """The same wish twice is told once; another one is told at once, and so is who was at rest."""
    with Run(read_world(shipped("worlds") / "hello.yaml"), "clo", planners=fleet_planners) as run:
        site = run.mission.site
        robots = {RobotId(robot.id): run.mission.robot(robot.id) for robot in run.mission.robots}
        crowds, robot = Crowds(site, robots), next(iter(robots))
        still, go = {name: Under() for name in robots}, {name: Under((0.2, 0.0)) for name in robots}
        for _ in range(3):
            crowds.steer(still)
            site.step()
        assert site.rooms.moving == set()
        before = site.pose(robot)
        for _ in range(5):
            crowds.steer(still | {robot: go[robot]})
            site.step()
        assert robot in site.rooms.moving
        assert site.pose(robot) != before
        for _ in range(15):
            crowds.steer(still)
            site.step()
        assert site.rooms.moving == set()
