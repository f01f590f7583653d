"""What a robot's action has brought about when its skill is done: what it is there for, and what came along by chance.

A world can say that an action *may also* make other facts true: a person who is asked one question answers another as
well. Whether it does is drawn from the run's seed, for what was done how often before, by whomever; so the same people
say the same, whichever robot asks them, and whatever strategy it follows (DECISIONS 41). The robot whose action it was
notices at once what came along; the others see it, or are told.
"""

from collections.abc import Mapping
from typing import Any

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.task import Action, Fact, fact_text
from clo_fleet.sim.truth import Truth
from clo_fleet.world.chance import uniform
from clo_fleet.world.events import AlsoHappened, Recorder
from clo_fleet.world.may_also import may_also_facts
from clo_fleet.world.model import RobotId

__all__ = ["Effects"]


class Effects:
    """The effects of the actions of one run."""

    def __init__(self, truth: Truth, recorder: Recorder, seed: int) -> None:
        self._truth, self._words, self._recorder, self._seed = truth, truth.words, recorder, seed
        self._times: dict[str, int] = {}  # how often something has been done, of what may bring about more
        self._meant: dict[RobotId, tuple[Flip, ...]] = {}  # of the action that a robot has just ended
        self._along: dict[RobotId, tuple[Flip, ...]] = {}

    def end(self, action: Action, cause: Cause, time: float) -> None:
        """The action has been done: note what it meant to bring about, and draw what comes along."""
        robot = RobotId(cause.robot)
        meant = dict.fromkeys(action.adds, True) | dict.fromkeys(action.deletes, False)
        self._meant[robot] = tuple(Flip(fact, value, cause) for fact, value in sorted(meant.items()))
        if self._words.may_also(action.schema):
            self._along[robot] = tuple(self._draw(action, cause, time))

    def noticed(self, robot: RobotId) -> dict[Fact, bool]:
        """What came along with the action that the robot has just ended, wherever it looks."""
        return {flip.fact: flip.value for flip in self._along.get(robot, ()) if self._is_so(flip)}

    def told(self, robot: RobotId) -> tuple[Flip, ...]:
        """What the action that the robot has just ended has truly changed, to be told to the others, once."""
        flips = (*self._meant.pop(robot, ()), *self._along.pop(robot, ()))
        return tuple(flip for flip in flips if self._words.told(flip.fact) and self._is_so(flip))

    def state(self) -> dict[str, int]:
        """Plain data; between ticks no action has just ended."""
        return dict(sorted(self._times.items()))

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._times = dict(state)

    def _draw(self, action: Action, cause: Cause, time: float) -> list[Flip]:
        values, doer = self._words.values(action), self._words.variable(action.schema, "robot")
        deed = " ".join((action.schema, *(value for variable, value in values.items() if variable != doer)))
        nth = self._times[deed] = self._times.get(deed, 0) + 1
        found = []
        for number, rule in enumerate(self._words.may_also(action.schema)):
            for fact in may_also_facts(rule, action, self._words):
                chance = uniform(self._seed, f"may_also/{deed}/{nth}/{number}/{fact_text(fact)}")
                if fact not in self._truth.effects and chance < rule.chance:
                    by = values[rule.by]
                    event = self._recorder.record(time, AlsoHappened(cause.robot, action.name, fact, by, cause.event))
                    found.append(Flip(fact, True, Cause(by, action.name, event)))
                    self._truth.come_about({fact: True}, found[-1].cause)
        return found

    def _is_so(self, flip: Flip) -> bool:
        return (flip.fact in self._truth.facts) is flip.value
