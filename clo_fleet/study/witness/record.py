"""Invariants of the log: ids are dense, times go on, and what refers to an event refers to the right one."""

from collections.abc import Sequence

from clo_fleet.fleet.mission import Mission
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.witness.broken import BrokenInvariantError
from clo_fleet.world.events import (
    ActionCalledOff,
    ActionEnded,
    ActionStarted,
    AlsoHappened,
    Event,
    FactChanged,
    OfferAnswered,
    OfferClosed,
    OfferMade,
    PlanFollowed,
    PlanMended,
    RunEnded,
    RunStarted,
    Sensed,
    StepsLeftOut,
    kind,
)

__all__ = ["Record"]


class Record:
    """Reads along in the log."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._id: int | None = None
        self._time = 0.0
        self._last: Event | None = None
        self._started: dict[int, ActionStarted] = {}
        self._along: dict[int, AlsoHappened] = {}
        self._under_way: dict[str, int] = {}  # robot -> id of its action's start
        self._steps: dict[str, set[tuple[int, str]]] = {spec.id: set() for spec in mission.world.robots}
        self._offers: dict[int, int] = {}  # offer -> how often it was answered or closed

    def look(self, news: Sequence[Recorded]) -> None:
        """Read the events since the last look.

        Raises:
            BrokenInvariantError: for the first that is not as it must be.
        """
        for number, time, event in news:
            broken = self._order(number, time, event) or self._reference(number, event)
            if broken:
                who = getattr(event, "robot", None)
                raise BrokenInvariantError(f"event {number} ({kind(event)}): {broken}", (who,) if who else (), time)
            self._id, self._time, self._last = number, time, event

    def look_at_end(self) -> None:
        """The run has ended: the log says so, and nobody is left in the middle of something."""
        if not isinstance(self._last, RunEnded):
            last = kind(self._last) if self._last is not None else "nothing"
            raise BrokenInvariantError(f"the run has ended, and the log ends with {last}", (), self._mission.time)

    def _order(self, number: int, time: float, event: Event) -> str:
        if self._id is not None and number != self._id + 1:
            return f"follows event {self._id}"
        if time < self._time or time > self._mission.time:
            return f"at {time} s after one at {self._time} s, and it is {self._mission.time} s"
        if isinstance(event, RunStarted) is not (number == 0):
            return "the log begins otherwise"
        return "after the end" if isinstance(self._last, RunEnded) else ""

    def _reference(self, number: int, event: Event) -> str:
        match event:
            case PlanFollowed(robot, steps) | PlanMended(robot, _, steps):
                return self._new_steps(robot, steps)
            case ActionStarted(robot, step, action):
                return self._begin(number, event) if robot in self._steps else f"no robot {robot}: {step}, {action}"
            case ActionEnded():
                return self._end(event)
            case FactChanged(_, _, by, cause) | Sensed(_, _, _, _, _, by, cause) | StepsLeftOut(_, _, _, _, by, cause):
                return self._caused(by, cause)
            case ActionCalledOff(robot, step, action, _, _, by, cause):
                return self._called_off(robot, step, action) or self._caused(by, cause)
            case AlsoHappened(robot, action, _, _, started):
                self._along[number] = event
                began = self._started.get(started)
                right = began is not None and (began.robot, began.action) == (robot, action)
                return "" if right else f"with event {started} began {began or 'nothing'}"
            case OfferMade(offer):
                known = offer in self._offers
                self._offers[offer] = 0
                return f"offer {offer} was made before" if known else ""
            case OfferAnswered(offer) | OfferClosed(offer):
                return "" if offer in self._offers else f"nobody made offer {offer}"
        return ""

    def _new_steps(self, robot: str, steps: Sequence[tuple[int, str]]) -> str:
        """Steps that came into a plan; an id always means the same action."""
        known = dict(self._steps[robot])
        for step, action in steps:
            if known.get(step, action) != action:
                return f"step {step} is {action}, and was {known[step]}"
        self._steps[robot].update(steps)
        return ""

    def _begin(self, number: int, event: ActionStarted) -> str:
        if event.robot in self._under_way:
            return f"{event.action} begins before event {self._under_way[event.robot]} has ended"
        self._started[number] = event
        self._under_way[event.robot] = number
        return ""

    def _called_off(self, robot: str, step: int, action: str) -> str:
        began = self._started.get(self._under_way.get(robot, -1))
        return "" if began == ActionStarted(robot, step, action) else f"under way is {began or 'nothing'}"

    def _end(self, event: ActionEnded) -> str:
        began = self._started.get(event.started)
        if began is None:
            return f"nothing began with event {event.started}"
        if (began.robot, began.step, began.action) != (event.robot, event.step, event.action):
            return f"with event {event.started} began {began}"
        if self._under_way.pop(event.robot, None) != event.started:
            return f"{event.action} has ended already"
        return ""

    def _caused(self, by: str | None, cause: int | None) -> str:
        if cause is None:
            return "" if by is None else f"by {by}, of whom no action is named"
        began = self._started.get(cause)
        if cause in self._along:
            return "" if self._along[cause].by == by else f"by {by}'s event {cause}, which is {self._along[cause]}"
        if began is None or began.robot != by:
            return f"by {by}'s event {cause}, which is {began or 'no action that began'}"
        return ""
