"""One robot: its executive, the skill that it is carrying out, and what it does while it has nothing to do."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.messages import Cause
from clo_fleet.clo.plain import plain_cause, read_cause
from clo_fleet.clo.plan import Step
from clo_fleet.robot.aside import StandAside
from clo_fleet.robot.drive import Drive
from clo_fleet.robot.handling import Handle
from clo_fleet.robot.rest import Idle
from clo_fleet.robot.skill import Body, Cancelled, Done, Exchange, Failed, Progress, Skill, Under
from clo_fleet.robot.skills import saved_skill, skill_of
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world.chance import varied
from clo_fleet.world.model import DoorId, Point, RobotId, RobotSpec, SkillSettings
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["MISHAP", "Meters", "Robot"]

MISHAP = "a mishap"  # why an action failed
STRIKES_AFTER = 1.0  # [s] after an action began, a mishap strikes; a drive at once, because doorways come soon


@dataclass(slots=True, kw_only=True)
class Meters:
    """How a robot's simulated time went [s], and how far it came [m]."""

    travelling: float = 0.0
    working: float = 0.0
    waiting: float = 0.0
    distance: float = 0.0


class Robot:
    """The body of one executive. It carries out one step at a time.

    Attributes:
        broken: it stands where it is, and does nothing with its hands either.
        blind: it does not see; it drives on, but what takes eyes waits.
    """

    def __init__(self, spec: RobotSpec, executive: Executive, *, seed: int) -> None:
        self.spec = spec
        self.executive = executive
        self.meters = Meters()
        self.cause: Cause | None = None
        self._seed = seed
        self._skill: Skill | None = None
        self._factor = 1.0
        self._last: Point = spec.pose.point
        self._aside = StandAside()
        self._mishap: float | None = None
        self._spends = ""  # on which meter the last tick was counted
        self._cancelled = False  # known to the skill as well, which is saved: this is for those who need not ask it
        self.broken = False
        self.blind = False

    @property
    def id(self) -> RobotId:
        """The robot's id."""
        return self.spec.id

    def begin(
        self, step: Step, event: int, words: Vocabulary, settings: SkillSettings, *, mishap: float | None = None
    ) -> None:
        """Start the skill of ``step``, whose start is event ``event`` of the log.

        ``mishap``: the time [s] of a start that is doomed: the skill will fail once it is under way.
        """
        self._skill = skill_of(words.deed(step.action))
        self._factor = varied(1.0, settings.spread, self._seed, f"{self.id}/skills/{step.id}")
        self.cause = Cause(self.id, step.action.name, event)
        self._aside = StandAside()
        self._mishap, self._cancelled = None, False
        if mishap is not None:
            self._mishap = mishap if isinstance(self._skill, Drive) else mishap + STRIKES_AFTER

    def cancel(self) -> None:
        """Ask the skill to stop where that is safe."""
        if self._skill is not None:
            self._skill.cancel()
            self._cancelled = True

    def step(self, site: Site, truth: Truth, exchange: Exchange, settings: SkillSettings, time: float) -> Progress:
        """Go on for one tick: with the skill, or standing out of the way."""
        if self.broken:
            return self._stand(site, "its repair")
        if self.blind and isinstance(self._skill, Handle):
            return self._stand(site, "its sight")
        running = self.executive.running
        if self._skill is None or self.cause is None or running is None:
            return self._idle(site, time)
        action = running.action
        body = Body(
            spec=self.spec,
            site=site,
            truth=truth,
            exchange=exchange,
            settings=settings,
            time=time,
            cause=self.cause,
            action=action,
            takes=truth.words.duration(action.schema, settings) * self._factor,
        )
        progress = self._struck(self._skill.step(body), time)
        self._measure(site, progress)
        if isinstance(progress, Done):
            changes = dict.fromkeys(action.deletes, False) | dict.fromkeys(action.adds, True)
            truth.come_about(changes, self.cause)
        if isinstance(progress, Failed | Cancelled):
            self._skill.release(body)
        if not isinstance(progress, Under):
            self._skill = None
        return progress

    @property
    def busy(self) -> bool:
        """Whether a skill is under way."""
        return self._skill is not None

    @property
    def out(self) -> DoorId | None:
        """The door by which it is about to leave its room."""
        return self._skill.way.out if isinstance(self._skill, Drive) else None

    def measure_distance(self, site: Site) -> None:
        """Count the way since the last tick."""
        here = site.pose(self.id).point
        self.meters.distance += math.dist(here, self._last)
        self._last = here

    def measure_rest(self, seconds: float) -> None:
        """Count a time in which nobody looked at the robot: it did what it did in the tick before [s]."""
        self._spend(self._spends, seconds)

    def measure_journey(self, site: Site, distance: float) -> None:
        """Count the way of a journey that nobody looked at [m]."""
        self.meters.distance = round(self.meters.distance + distance, 6)  # the same in however many parts it is told
        self._last = site.pose(self.id).point

    @property
    def disturbed(self) -> bool:
        """Whether its skill has to be stepped even if that is at rest: it is broken, doomed, or to stop."""
        return self.broken or self._mishap is not None or self._cancelled

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "executive": self.executive.state(),
            "skill": self._skill.state() if self._skill else None,
            "factor": self._factor,
            "cause": plain_cause(self.cause),
            "meters": asdict(self.meters),
            "last": list(self._last),
            "aside": self._aside.state(),
            "mishap": self._mishap,
            "broken": self.broken,
            "blind": self.blind,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave, all but the executive."""
        self._skill = saved_skill(state["skill"]) if state["skill"] else None
        self._factor = state["factor"]
        self.cause = read_cause(state["cause"])
        self.meters = Meters(**state["meters"])
        self._last = (state["last"][0], state["last"][1])
        self._aside = StandAside.from_state(state["aside"])
        self._mishap = state["mishap"]
        self.broken, self.blind = state["broken"], state["blind"]

    def _stand(self, site: Site, why: str) -> Under:
        """Do nothing for a tick."""
        under = Under(direct=True, standing_for=why)
        self._measure(site, under)
        return under

    def _idle(self, site: Site, time: float) -> Under:
        """Stand out of the way."""
        under = self._aside.step(site, self.spec, time)
        self._measure(site, under)
        if self._skill is None and under == _NOTHING:
            return Under(rest=Idle(self.executive, self.executive.mode))
        return under

    def _struck(self, progress: Progress, time: float) -> Progress:
        """What comes of the skill's progress if it is doomed: it is stopped, and that is a failure."""
        if self._mishap is None or self._skill is None:
            return progress
        if isinstance(progress, Cancelled):
            return Failed(MISHAP)
        if time >= self._mishap - 1e-9:
            self._skill.cancel()
        return progress

    def _measure(self, site: Site, progress: Progress) -> None:
        if self._skill is None:
            self._spends = "waiting" if self.executive.mode is Mode.WAITING else ""
        elif isinstance(progress, Under) and progress.standing_for:
            self._spends = "waiting"
        else:
            self._spends = "travelling" if isinstance(self._skill, Drive) else "working"
        self._spend(self._spends, site.tick)

    def _spend(self, on: str, seconds: float) -> None:
        if on:  # rounded, so that it is the same sum in however many parts a time is told
            setattr(self.meters, on, round(getattr(self.meters, on) + seconds, 9))


_NOTHING = Under()
