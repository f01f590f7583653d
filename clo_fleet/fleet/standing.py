"""Which robots stand though they have somewhere to go, and why: what the log tells where it is new."""

from collections.abc import Mapping

from clo_fleet.fleet.waits import Waits
from clo_fleet.robot.skill import Under
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.sim.site import Site
from clo_fleet.world.events import Waiting
from clo_fleet.world.model import RobotId

__all__ = ["Standing"]


class Standing:
    """Follows who stands, tick by tick: in rooms as the skills say, in corridors as SUMO does.

    Attributes:
        texts: why each of those who stand does so, in words, in the order of ids.
    """

    def __init__(self, site: Site, waits: Waits) -> None:
        """``waits``: is kept up to date."""
        self._site, self._waits = site, waits
        self.texts: dict[str, str] = {}

    def note(self, time: float, wanted: Mapping[RobotId, Under]) -> list[Waiting]:
        """Take down who stands now [s], and tell of those whose reason is new. ``wanted``: what their skills want."""
        waits = {
            robot: Wait(WaitCause.CROSSING) if ahead is None else Wait(WaitCause.VEHICLE, on=(ahead,))
            for robot, ahead in self._site.waiting().items()
        }
        texts = {robot: wait.text for robot, wait in waits.items()}
        for robot, under in wanted.items():
            if under.standing_for:
                waits[robot] = under.wait or Wait(WaitCause.OTHER, under.standing_for)
                texts[robot] = under.standing_for
        new = {*self._waits.note(time, self._site.tick, waits)}
        new.update(robot for robot, text in texts.items() if text != self.texts.get(robot))
        self.texts = {str(robot): text for robot, text in sorted(texts.items())}
        return [Waiting(r, texts[r], waits[r].cause.value, waits[r].where, waits[r].on) for r in sorted(new)]

    def state(self) -> dict[str, str]:
        """Plain data; the waits are for whoever gave them to save."""
        return dict(self.texts)

    def restore(self, state: Mapping[str, str]) -> None:
        """Take up what ``state()`` gave."""
        self.texts = dict(state)
