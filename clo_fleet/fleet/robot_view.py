"""A robot as others see it from outside while a mission runs."""

from dataclasses import dataclass
from typing import Self

from clo_fleet.clo.executive import Mode
from clo_fleet.clo.links import Links
from clo_fleet.clo.plan import Plan
from clo_fleet.clo.task import Fact
from clo_fleet.robot.robot import Robot
from clo_fleet.sim.site import Site
from clo_fleet.world.model import Pose, RobotId

__all__ = ["RobotView"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotView:
    """A robot at one moment."""

    id: RobotId
    pose: Pose
    place: str
    mode: Mode
    plan: Plan
    running: str
    links: Links
    beliefs: frozenset[Fact]
    carried: tuple[str, ...]

    @classmethod
    def of(cls, robot: Robot, site: Site) -> Self:
        """The robot as it is now."""
        executive = robot.executive
        return cls(
            id=robot.id,
            pose=site.pose(robot.id),
            place=site.place(robot.id),
            mode=executive.mode,
            plan=executive.plan,
            running=executive.running.action.name if executive.running else "",
            links=executive.links,
            beliefs=executive.beliefs,
            carried=tuple(site.rooms.carried(robot.id)),
        )
