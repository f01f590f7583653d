"""The executive of one robot: told what happened, it answers what to do. No I/O, no clock, no randomness.

Theory of operation
-------------------
The executive holds what its robot believes, the steps left of its plan, and what is under way: a running
action, a question to the planner, accepted offers. ``handle(event)`` takes one event and returns commands (do
this) and decisions (this is why), in order. ``TRANSITIONS`` lists which events a mode knows; any other event
raises and changes nothing.

A surprise is a fact that differs from what was believed and from what the running action is about to bring
about; what another's action has brought about in its place is one. Surprises go to the strategy, which keeps
the plan, repairs it or asks for a new one. After every event the executive *advances*: the goals hold, or the
next step starts, or it waits and says for what.

Three things keep robots from tripping over one another. A step whose work another robot has in hand and
announced is *suspended*: it stays in the plan, is not started, and is dropped when the promise comes true.
While a handover is under way, no action starts that would break it. And a question to which the planner had no
answer is not asked again before a belief changes; meanwhile the robot may work for those goals that are within reach.

A new plan is asked for from the state in which the running action will have ended, so that it can go on.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import Self

from clo_fleet.clo.deliberation import MOST_ATTEMPTS, Deliberation
from clo_fleet.clo.links import Links, causal_links
from clo_fleet.clo.messages import (
    AcceptOffer,
    ActionCancelled,
    ActionFailed,
    ActionFinished,
    Begin,
    Command,
    Event,
    Forgotten,
    GoalsChanged,
    Observed,
    Offered,
    OfferEnded,
    PlanAdopted,
    PlanArrived,
    PlanFailure,
    PlanMissing,
    Promised,
    RefuseOffer,
    Wake,
)
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.repair import Refused, repair
from clo_fleet.clo.state import ExecutiveState, Tally
from clo_fleet.clo.strategies import ActionSource, PlanAgain, Strategy, Watch
from clo_fleet.clo.task import Condition, Fact, apply
from clo_fleet.errors import CloFleetError

__all__ = ["Executive", "Mode", "UnexpectedEventError"]


class Mode(Enum):
    """What an executive is doing."""

    NEW = "new"
    PLANNING = "planning"
    ACTING = "acting"
    ACTING_AND_PLANNING = "acting and planning"
    WAITING = "waiting"
    SATISFIED = "satisfied"
    GAVE_UP = "gave up"


class UnexpectedEventError(CloFleetError):
    """An event that the executive's mode does not know, or about a step that is not running.

    Attributes:
        mode: the mode it was in, and still is.
        event: the event.
    """

    def __init__(self, mode: Mode, event: Event, detail: str = "") -> None:
        super().__init__(f"an executive that is {mode.value} cannot take {type(event).__name__}{detail}: {event}")
        self.mode = mode
        self.event = event


class Executive:
    """Runs one robot's plan. See the module's docstring.

    Args:
        strategy: what to do about surprises.
        beliefs: the facts believed true at the start.
        goals: what is to hold in the end.
        actions: who knows what the robot could do, for strategies that put new steps into a plan.
        partly: whether it works for the goals within reach while there is no plan to all of them.
    """

    def __init__(
        self,
        strategy: Strategy,
        beliefs: Iterable[Fact],
        goals: Iterable[Condition],
        actions: ActionSource | None = None,
        *,
        partly: bool = False,
    ) -> None:
        self._strategy = strategy
        self._data = ExecutiveState(beliefs=set(beliefs), goals=tuple(goals))
        self._mind = Deliberation(strategy, self._data, actions, partly)
        self._links: Links | None = None

    # ---- what can be asked ---------------------------------------------------------------------------------

    @property
    def mode(self) -> Mode:
        """What it is doing."""
        data = self._data
        if not data.begun:
            return Mode.NEW
        if data.outcome:
            return Mode.GAVE_UP
        if data.running is not None:
            return Mode.ACTING if data.question is None else Mode.ACTING_AND_PLANNING
        if data.question is not None:
            return Mode.PLANNING
        return Mode.SATISFIED if data.satisfied else Mode.WAITING

    @property
    def strategy(self) -> Strategy:
        """The strategy that it was given."""
        return self._strategy

    @property
    def beliefs(self) -> frozenset[Fact]:
        """The facts believed true."""
        return frozenset(self._data.beliefs)

    @property
    def goals(self) -> tuple[Condition, ...]:
        """What is to hold in the end."""
        return self._data.goals

    @property
    def plan(self) -> Plan:
        """The steps left, the running one first."""
        return tuple(self._data.plan)

    @property
    def running(self) -> Step | None:
        """The step under way."""
        return self._mind.step(self._data.running) if self._data.running is not None else None

    @property
    def suspended(self) -> frozenset[int]:
        """The ids of steps put off because another robot has promised their work."""
        return frozenset(self._data.suspended)

    @property
    def promised(self) -> frozenset[Fact]:
        """What others have promised to bring about, as it was told last."""
        return self._data.promised

    @property
    def links(self) -> Links:
        """The links of the steps left, as things are believed. Worked out when asked for after a change."""
        if self._links is None:
            data = self._data
            self._links = causal_links(data.beliefs, self._mind.rest(), data.goals, data.unknown)
        return self._links

    @property
    def tally(self) -> Tally:
        """What became of all steps so far."""
        return replace(self._data.tally, pending=len(self._data.plan))

    @property
    def outcome(self) -> str:
        """Why it gave up; empty if it did not."""
        return self._data.outcome

    @property
    def watch(self) -> Watch:
        """The facts that its senses and its radio should attend to."""
        running = self.running
        effects = running.action.adds | running.action.deletes if running else frozenset()
        return self._strategy.watch(self.links, effects | {goal.fact for goal in self._data.goals})

    @property
    def planning_state(self) -> frozenset[Fact]:
        """The state a new plan should start from: what is believed and promised, the running action done."""
        return self._mind.planning_state

    def state(self) -> dict[str, object]:
        """All that it remembers, as plain data."""
        return self._data.state()

    @classmethod
    def from_state(
        cls,
        strategy: Strategy,
        state: Mapping[str, object],
        actions: ActionSource | None = None,
        *,
        partly: bool = False,
    ) -> Self:
        """The executive that ``state()`` was taken from."""
        executive = cls(strategy, (), ())
        executive._data = ExecutiveState.from_state(state)
        executive._mind = Deliberation(strategy, executive._data, actions, partly)
        return executive

    # ---- the one entry -------------------------------------------------------------------------------------

    def handle(self, event: Event) -> tuple[Command, ...]:
        """What to do about ``event``.

        Raises:
            UnexpectedEventError: if the mode does not know such an event; nothing has changed then.
        """
        modes, act = TRANSITIONS[type(event)]
        if self.mode not in modes:
            raise UnexpectedEventError(self.mode, event)
        if isinstance(event, ActionFinished | ActionFailed | ActionCancelled) and event.step != self._data.running:
            raise UnexpectedEventError(self.mode, event, f" (running step: {self._data.running})")
        commands = (*act(self, event), *self._mind.advance())
        if not isinstance(event, Wake):
            self._links = None
        return commands

    # ---- events --------------------------------------------------------------------------------------------

    def _begin(self, event: Begin) -> list[Command]:
        self._data.begun = True
        return [] if self._mind.reached() else self._mind.ask("first plan")

    def _plan_arrived(self, event: PlanArrived) -> list[Command]:
        data = self._data
        question, data.question = data.question or frozenset(), None
        part, data.part = data.part, ()
        data.planner_deaths = 0
        running = [self._mind.step(data.running)] if data.running is not None else []
        superseded = tuple(step for step in data.plan if step.id != data.running)
        steps = self._mind.numbered(event.actions)
        first = data.tally.plans == 0
        data.plan = [*running, *steps]
        data.tally = data.tally.with_plan(len(steps), len(superseded), first=first)
        data.news = {fact: cause for fact, cause in data.news.items() if (fact in data.beliefs) != (fact in question)}
        commands: list[Command] = [PlanAdopted(steps, superseded, first)]
        data.meanwhile = {step.id for step in steps} if part else set()
        if part:
            return commands  # it has gaps: that is known
        situation = self._mind.situation(frozenset(data.news))
        revision = self._strategy.revise(replace(situation, past=question, new_plan=True))
        if isinstance(revision, PlanAgain):
            if self._mind.sound():
                return commands
            if not data.new_goals:
                data.unsolvable = question  # asked the same again, the planner would say the same again
        return commands + self._mind.follow(revision)

    def _plan_missing(self, event: PlanMissing) -> list[Command]:
        data = self._data
        question, data.question = data.question, None
        part, data.part = data.part, ()
        deaths, data.planner_deaths = data.planner_deaths, 0
        if data.new_goals:  # the question was about others
            return [] if self._mind.reached() or self._mind.sound() else self._mind.ask("the goals have changed")
        if event.failure is PlanFailure.NO_PLAN and not part:
            data.unsolvable = question
        if part or self._mind.reached() or self._mind.sound():
            return []
        if event.failure is PlanFailure.NO_PLAN:
            return self._mind.ask_for_part()
        if event.failure is PlanFailure.DIED and deaths == 0:
            data.planner_deaths = 1
            return self._mind.ask("the planner died: once more")
        return self._mind.give_up(f"planner failed: {event.failure.value}", event.failure.value)

    def _action_finished(self, event: ActionFinished) -> list[Command]:
        data = self._data
        step = self._mind.step(event.step)
        again, data.cancelling = data.cancelling or self._strategy.heeds_own_effects, False
        data.running = None
        data.plan.remove(step)
        data.beliefs = set(apply(data.beliefs, step.action))
        data.unknown -= step.action.adds | step.action.deletes
        data.tally = data.tally.plus(executed=1)
        data.attempts = {}
        return self._mind.revise(dict.fromkeys(step.action.adds | step.action.deletes)) if again else []

    def _action_failed(self, event: ActionFailed) -> list[Command]:
        data = self._data
        step = self._mind.step(event.step)
        data.running, data.cancelling = None, False
        key = step.action.name
        again = self._mind.numbered([step.action])
        data.plan[data.plan.index(step)] = again[0]
        data.meanwhile |= {again[0].id} if step.id in data.meanwhile else set()
        data.tally = data.tally.plus(failed=1, added=1)
        learnt = self._mind.learn(event.learnt)
        data.attempts = {} if learnt else data.attempts
        data.attempts[key] = data.attempts.get(key, 0) + 1
        if data.attempts[key] >= MOST_ATTEMPTS:
            return self._mind.give_up("stuck", f"{step} failed {MOST_ATTEMPTS} times, the last time: {event.reason}")
        return self._mind.revise(learnt)

    def _action_cancelled(self, event: ActionCancelled) -> list[Command]:
        data = self._data
        step = self._mind.step(event.step)
        asked, data.running, data.cancelling = data.cancelling, None, False
        data.plan.remove(step)
        data.tally = data.tally.plus(cancelled=1)
        if asked and self._mind.sound(data.promised):
            return []
        return self._mind.revise({})  # stopped by somebody else, or needed again since it was to stop

    def _observed(self, event: Observed) -> list[Command]:
        news = self._mind.learn(event.flips)
        if event.guess and self._data.question is None and self._mind.sound():
            return []
        unsettled = event.promised is not None and self._mind.rely_on(event.promised)
        return self._mind.revise(news) if news or unsettled else []

    def _forgotten(self, event: Forgotten) -> list[Command]:
        data = self._data
        running = self._mind.running
        effects = running.action.adds | running.action.deletes if running else frozenset()
        lost = sorted(event.facts - data.unknown - effects)
        data.beliefs.difference_update(lost)
        data.unknown.update(lost)
        return self._mind.revise(dict.fromkeys(lost)) if lost else []

    def _goals_changed(self, event: GoalsChanged) -> list[Command]:
        data = self._data
        if event.goals == data.goals:
            return []
        data.goals, data.unsolvable, data.satisfied = event.goals, None, False
        return self._mind.revise({}) if data.begun else []

    def _promised(self, event: Promised) -> list[Command]:
        return self._mind.revise({}) if self._mind.rely_on(event.facts) else []

    def _offered(self, event: Offered) -> list[Command]:
        data = self._data
        state = set(data.beliefs)
        for flip in event.flips:
            (state.add if flip.value else state.discard)(flip.fact)
        wanted = any(Condition(flip.fact, flip.value) in data.goals for flip in event.flips)
        unknown = data.unknown - {flip.fact for flip in event.flips}
        if not wanted and isinstance(repair(state, self._mind.rest(), data.goals, unknown=unknown), Refused):
            return [RefuseOffer(event.offer, "the plan would not stand any more")]
        data.offers[event.offer] = event.needs
        return [AcceptOffer(event.offer)]

    def _offer_ended(self, event: OfferEnded) -> list[Command]:
        self._data.offers.pop(event.offer, None)
        return []

    def _wake(self, event: Wake) -> list[Command]:
        return []


_RUNNING = frozenset({Mode.ACTING, Mode.ACTING_AND_PLANNING})
_ASKED = frozenset({Mode.PLANNING, Mode.ACTING_AND_PLANNING})
_ANY = frozenset(Mode)
_BEGUN = _ANY - {Mode.NEW}

# Which events each mode knows, and what answers them. After each answer the executive advances.
TRANSITIONS: Mapping[type[Event], tuple[frozenset[Mode], Callable[..., list[Command]]]] = MappingProxyType(
    {
        Begin: (frozenset({Mode.NEW}), Executive._begin),
        PlanArrived: (_ASKED, Executive._plan_arrived),
        PlanMissing: (_ASKED, Executive._plan_missing),
        ActionFinished: (_RUNNING | {Mode.GAVE_UP}, Executive._action_finished),
        ActionFailed: (_RUNNING | {Mode.GAVE_UP}, Executive._action_failed),
        ActionCancelled: (_RUNNING | {Mode.GAVE_UP}, Executive._action_cancelled),
        Observed: (_ANY, Executive._observed),
        Forgotten: (_ANY, Executive._forgotten),
        GoalsChanged: (_ANY - {Mode.GAVE_UP}, Executive._goals_changed),
        Promised: (_ANY, Executive._promised),
        Offered: (_BEGUN - {Mode.GAVE_UP}, Executive._offered),
        OfferEnded: (_BEGUN, Executive._offer_ended),
        Wake: (_BEGUN, Executive._wake),
    }
)
