"""The executive of one robot: told what happened, it answers what to do. No I/O, no clock, no randomness.

Theory of operation
-------------------
The executive holds what its robot believes, the steps left of its plan, and what is under way: a running
action, a question to the planner, accepted offers. ``handle(event)`` takes one event and returns commands (do
this) and decisions (this is why), in order. ``TRANSITIONS`` lists which events a mode knows; any other event
raises and changes nothing.

A surprise is a fact that differs from what was believed and from what the running action is about to bring
about. Surprises go to the strategy, which keeps the plan, repairs it or asks for a new one. After every event
the executive *advances*: the goals hold, or the next step starts, or it waits and says for what.

Three things keep robots from tripping over one another. A step whose work another robot has in hand and
announced is *suspended*: it stays in the plan, is not started, and is dropped when the promise comes true.
While a handover is under way, no action starts that would break it. And a question to which the planner had no
answer is not asked again before a belief changes.

A new plan is asked for from the state in which the running action will have ended, so that it can go on.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import Self

from clo_fleet.clo.links import Links, causal_links
from clo_fleet.clo.messages import (
    AcceptOffer,
    ActionCancelled,
    ActionFailed,
    ActionFinished,
    AskPlan,
    Begin,
    CancelAction,
    Cause,
    Command,
    Event,
    Finished,
    Flip,
    GoalsMet,
    Observed,
    Offered,
    OfferEnded,
    PlanAdopted,
    PlanArrived,
    PlanFailure,
    PlanMissing,
    Promised,
    RefuseOffer,
    RepairRefused,
    StartAction,
    StepsDropped,
    Waits,
    Wake,
)
from clo_fleet.clo.plan import Plan, Step, first_fault, number
from clo_fleet.clo.repair import Drop, Refused, repair
from clo_fleet.clo.state import ExecutiveState, Tally
from clo_fleet.clo.strategies import Adopt, Keep, PlanAgain, Revision, Situation, Strategy, Watch
from clo_fleet.clo.task import Action, Condition, Fact, apply, holds, unmet
from clo_fleet.errors import CloFleetError

__all__ = ["Executive", "Mode", "UnexpectedEventError"]

MOST_ATTEMPTS = 3  # the same action failing this often, nothing achieved or learnt by it meanwhile: stuck
MOST_RELAPSES = 5  # goals met and lost again this often: conflict


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
    """Runs one robot's plan. See the module's docstring."""

    def __init__(self, strategy: Strategy, beliefs: Iterable[Fact], goals: Iterable[Condition]) -> None:
        self._strategy = strategy
        self._data = ExecutiveState(beliefs=set(beliefs), goals=tuple(goals))
        self._links = Links()

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
        return self._step(self._data.running) if self._data.running is not None else None

    @property
    def suspended(self) -> frozenset[int]:
        """The ids of steps put off because another robot has promised their work."""
        return frozenset(self._data.suspended)

    @property
    def links(self) -> Links:
        """The links of the steps left, as things are believed."""
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
        return self._strategy.watch(self._links, effects | {goal.fact for goal in self._data.goals})

    @property
    def planning_state(self) -> frozenset[Fact]:
        """The state a new plan should start from: what is believed and promised, the running action done."""
        data = self._data
        state = frozenset(data.beliefs) | data.promised
        running = self.running
        if running is None or data.cancelling or unmet(_under_way(running).action, data.beliefs):
            return state
        return apply(state, running.action)

    def state(self) -> dict[str, object]:
        """All that it remembers, as plain data."""
        return self._data.state()

    @classmethod
    def from_state(cls, strategy: Strategy, state: Mapping[str, object]) -> Self:
        """The executive that ``state()`` was taken from."""
        executive = cls(strategy, (), ())
        executive._data = ExecutiveState.from_state(state)
        executive._relink()
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
        commands = (*act(self, event), *self._advance())
        if commands or not isinstance(event, Wake):
            self._relink()
        return commands

    # ---- events --------------------------------------------------------------------------------------------

    def _begin(self, event: Begin) -> list[Command]:
        self._data.begun = True
        return [] if self._reached() else self._ask("first plan")

    def _plan_arrived(self, event: PlanArrived) -> list[Command]:
        data = self._data
        question, data.question = data.question or frozenset(), None
        running = [self._step(data.running)] if data.running is not None else []
        superseded = tuple(step for step in data.plan if step.id != data.running)
        steps = self._numbered(event.actions)
        first = data.tally.plans == 0
        data.plan = [*running, *steps]
        data.suspended = set()
        data.tally = data.tally.with_plan(len(steps), len(superseded), first=first)
        data.news = {fact: cause for fact, cause in data.news.items() if (fact in data.beliefs) != (fact in question)}
        commands: list[Command] = [PlanAdopted(steps, superseded, first)]
        situation = self._situation(frozenset(data.news))
        revision = self._strategy.revise(replace(situation, links=causal_links(question, steps, data.goals)))
        if isinstance(revision, PlanAgain):
            if self._sound():
                return commands
            data.unsolvable = question  # asked the same again, the planner would say the same again
        return commands + self._follow(revision)

    def _plan_missing(self, event: PlanMissing) -> list[Command]:
        data = self._data
        question, data.question = data.question, None
        if event.failure is PlanFailure.NO_PLAN:
            data.unsolvable = question
        if event.failure is PlanFailure.NO_PLAN or self._reached() or self._sound():
            return []
        if event.failure is PlanFailure.DIED and data.planner_deaths == 0:
            data.planner_deaths += 1
            return self._ask("the planner died: once more")
        return self._give_up(f"planner failed: {event.failure.value}", event.failure.value)

    def _action_finished(self, event: ActionFinished) -> list[Command]:
        data = self._data
        step = self._step(event.step)
        was_cancelling, data.cancelling = data.cancelling, False
        data.running = None
        data.plan.remove(step)
        data.beliefs = set(apply(data.beliefs, step.action))
        data.tally = data.tally.plus(executed=1)
        data.attempts = {}
        return self._revise(dict.fromkeys(step.action.adds | step.action.deletes)) if was_cancelling else []

    def _action_failed(self, event: ActionFailed) -> list[Command]:
        data = self._data
        step = self._step(event.step)
        data.running, data.cancelling = None, False
        key = step.action.name
        again = self._numbered([step.action])
        data.plan[data.plan.index(step)] = again[0]
        data.tally = data.tally.plus(failed=1, added=1)
        self._relink()
        learnt = self._learn(event.learnt)
        data.attempts = {} if learnt else data.attempts
        data.attempts[key] = data.attempts.get(key, 0) + 1
        if data.attempts[key] >= MOST_ATTEMPTS:
            return self._give_up("stuck", f"{step} failed {MOST_ATTEMPTS} times, the last time: {event.reason}")
        return self._revise(learnt)

    def _action_cancelled(self, event: ActionCancelled) -> list[Command]:
        data = self._data
        step = self._step(event.step)
        data.running, data.cancelling = None, False
        data.plan.remove(step)
        data.tally = data.tally.plus(cancelled=1)
        return []

    def _observed(self, event: Observed) -> list[Command]:
        news = self._learn(event.flips)
        unsettled = event.promised is not None and self._rely_on(event.promised)
        return self._revise(news) if news or unsettled else []

    def _promised(self, event: Promised) -> list[Command]:
        return self._revise({}) if self._rely_on(event.facts) else []

    def _rely_on(self, promised: frozenset[Fact]) -> bool:
        """Note what is promised; whether the plan has to be looked at for it."""
        data = self._data
        changed, data.promised = promised != data.promised, promised
        return changed and bool(data.suspended or not self._sound())

    def _offered(self, event: Offered) -> list[Command]:
        data = self._data
        state = set(data.beliefs)
        for flip in event.flips:
            (state.add if flip.value else state.discard)(flip.fact)
        wanted = any(Condition(flip.fact, flip.value) in data.goals for flip in event.flips)
        if not wanted and isinstance(repair(state, self._rest(), data.goals), Refused):
            return [RefuseOffer(event.offer, "the plan would not stand any more")]
        data.offers[event.offer] = event.needs
        return [AcceptOffer(event.offer)]

    def _offer_ended(self, event: OfferEnded) -> list[Command]:
        self._data.offers.pop(event.offer, None)
        return []

    def _wake(self, event: Wake) -> list[Command]:
        return []

    # ---- deciding ------------------------------------------------------------------------------------------

    def _revise(self, news: Mapping[Fact, Cause | None]) -> list[Command]:
        """Ask the strategy what becomes of the plan; while a new one is awaited, only note the news."""
        data = self._data
        if data.outcome:
            return []
        data.news |= news
        if data.question is not None:
            return []
        if self._reached():
            revision = self._strategy.revise(self._situation(frozenset(news))) if data.plan else Keep()
            if isinstance(revision, Adopt):
                return self._follow(revision)
            running = self.running
            over = running is None or apply(data.beliefs, running.action) == data.beliefs
            return [] if over else self._stop("the goals hold already")
        if data.satisfied:
            data.satisfied = False
            data.relapses += 1
            if data.relapses >= MOST_RELAPSES:
                return self._give_up("conflict", f"its goals were met and lost again {MOST_RELAPSES} times")
        elif not data.plan:
            return []
        return self._follow(self._strategy.revise(self._situation(frozenset(news))))

    def _follow(self, revision: Revision) -> list[Command]:
        data = self._data
        if isinstance(revision, Keep):
            data.news = {}
            return []
        if isinstance(revision, PlanAgain):
            refused: list[Command] = [RepairRefused(revision.refused)] if revision.refused else []
            return refused + self._ask(revision.why)
        drops = revision.repaired.dropped
        if not revision.on_promise:
            data.suspended = set()
            commands = self._drop(drops)
            data.news = {}
            return commands
        # what is needless for what is true already goes; what is needless if a promise is kept is put off
        gone = tuple(drop for drop in drops if data.beliefs.issuperset(drop.because))
        data.suspended = {drop.step.id for drop in drops if drop not in gone and drop.step.id != data.running}
        return self._drop(gone)

    def _drop(self, drops: tuple[Drop, ...]) -> list[Command]:
        """Take the dropped steps out of the plan; one decision for each fact that made steps needless."""
        data = self._data
        commands: list[Command] = []
        groups: dict[tuple[Fact | None, str], list[Step]] = {}
        for drop in drops:
            if drop.step.id == data.running:
                commands += self._stop(drop.reason.value)
                continue
            groups.setdefault((drop.because[0] if drop.because else None, drop.reason.value), []).append(drop.step)
        gone = {step.id for steps in groups.values() for step in steps}
        data.plan = [step for step in data.plan if step.id not in gone]
        data.tally = data.tally.plus(dropped=len(gone))
        for (fact, reason), steps in groups.items():
            cause = data.news.get(fact) if fact is not None else None
            commands.append(StepsDropped(tuple(steps), reason, fact, cause))
        return commands

    def _stop(self, why: str) -> list[Command]:
        """Have the running step cancelled, unless that is asked already."""
        if self._data.cancelling or self._data.running is None:
            return []
        self._data.cancelling = True
        return [CancelAction(self._step(self._data.running), why)]

    def _advance(self) -> list[Command]:
        """Start the next step, or say why not."""
        data = self._data
        if data.running is not None or data.question is not None or not data.begun or data.outcome:
            return []
        if self._reached():
            return self._settle()
        step = next((step for step in data.plan if step.id not in data.suspended), None)
        if step is None:
            if all(holds(goal, data.beliefs | data.promised) for goal in data.goals):
                return self._wait("for what another robot has in hand")
            return self._ask("the plan ended without its goals" if data.tally.plans else "first plan")
        missing = unmet(step.action, data.beliefs)
        if missing:
            return self._blocked(step, missing)
        threatened = {need for needs in data.offers.values() for need in needs}
        after = apply(data.beliefs, step.action)
        if any(not holds(need, after) for need in threatened if holds(need, data.beliefs)):
            return self._wait("for a handover to end")
        data.running, data.waiting, data.satisfied = step.id, "", False
        return [StartAction(step)]

    def _blocked(self, step: Step, missing: tuple[Condition, ...]) -> list[Command]:
        """The next step cannot start: wait if the rest is promised, else have the plan made good."""
        data = self._data
        if all(holds(condition, frozenset(data.beliefs) | data.promised) for condition in missing):
            return self._wait("for what another robot has in hand")
        revision = self._strategy.revise(self._situation(frozenset()))
        if isinstance(revision, Adopt) and step.id not in {kept.id for kept in revision.repaired.plan}:
            return self._follow(revision) + self._advance()
        lacks = ", ".join(str(condition) for condition in missing)
        why = PlanAgain(f"{step} cannot start: it lacks {lacks}")
        return self._follow(revision if isinstance(revision, PlanAgain) else why)

    def _settle(self) -> list[Command]:
        """The goals hold: whatever is left of the plan is not needed."""
        data = self._data
        commands: list[Command] = []
        if data.plan:
            commands.append(StepsDropped(tuple(data.plan), "the goals hold already"))
            data.tally = data.tally.plus(dropped=len(data.plan))
            data.plan, data.suspended = [], set()
        if not data.satisfied:
            data.satisfied, data.waiting = True, ""
            commands.append(GoalsMet())
        return commands

    def _ask(self, why: str) -> list[Command]:
        data = self._data
        if data.unsolvable is not None and data.unsolvable == self.planning_state:
            return self._wait("no plan exists as things are believed")
        running = self.running
        lacks = unmet(_under_way(running).action, data.beliefs) if running is not None else ()
        stop = self._stop(f"it lacks {', '.join(map(str, lacks))}") if lacks else []
        data.question, data.unsolvable, data.waiting = self.planning_state, None, ""
        data.suspended = set()
        data.tally = data.tally.plus(planner_calls=1)
        return [*stop, AskPlan(why)]

    def _wait(self, why: str) -> list[Command]:
        if self._data.waiting == why:
            return []
        self._data.waiting = why
        return [Waits(why)]

    def _give_up(self, outcome: str, why: str) -> list[Command]:
        if self._data.outcome:
            return []
        self._data.outcome, self._data.question = outcome, None
        return [Finished(outcome, why)]

    # ---- small questions -----------------------------------------------------------------------------------

    def _learn(self, flips: Iterable[Flip]) -> dict[Fact, Cause | None]:
        """Believe the flips; returns those that were not expected, with their causes."""
        data = self._data
        running = self.running
        news: dict[Fact, Cause | None] = {}
        for flip in flips:
            if (flip.fact in data.beliefs) is flip.value:
                continue
            (data.beliefs.add if flip.value else data.beliefs.discard)(flip.fact)
            effects = (running.action.adds if flip.value else running.action.deletes) if running else ()
            if flip.fact not in effects:
                news[flip.fact] = flip.cause
        return news

    def _reached(self) -> bool:
        return all(holds(goal, self._data.beliefs) for goal in self._data.goals)

    def _sound(self) -> bool:
        return first_fault(self._data.beliefs, self._rest(), self._data.goals) is None

    def _step(self, step_id: int | None) -> Step:
        return next(step for step in self._data.plan if step.id == step_id)

    def _numbered(self, actions: Iterable[Action]) -> Plan:
        steps = number(actions, self._data.next_step)
        self._data.next_step += len(steps)
        return steps

    def _rest(self) -> Plan:
        """The plan; of the running step only the conditions that it does not itself end."""
        return tuple(_under_way(step) if step.id == self._data.running else step for step in self._data.plan)

    def _situation(self, changed: frozenset[Fact]) -> Situation:
        data = self._data
        plan = self._rest()
        return Situation(
            state=frozenset(data.beliefs),
            plan=plan,
            goals=data.goals,
            changed=changed,
            since=frozenset(data.news),
            links=causal_links(data.beliefs ^ data.news.keys(), plan, data.goals),
            promised=data.promised,
        )

    def _relink(self) -> None:
        self._links = causal_links(self._data.beliefs, self._rest(), self._data.goals)


def _under_way(step: Step) -> Step:
    """A running step: it needs no longer what it ends itself (a robot that has left is still moving)."""
    ended = step.action.adds | step.action.deletes
    needs = tuple(need for need in step.action.needs if need.fact not in ended)
    return Step(step.id, replace(step.action, needs=needs))


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
        Promised: (_ANY, Executive._promised),
        Offered: (_BEGUN - {Mode.GAVE_UP}, Executive._offered),
        OfferEnded: (_BEGUN, Executive._offer_ended),
        Wake: (_BEGUN, Executive._wake),
    }
)
