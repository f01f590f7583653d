"""One run: an executive with its strategy in the symbolic world, planning with Fast Downward, until its goals hold.

The world does one action at a time. What the robot then looks at is what its strategy watches; it is told what it saw
before it is told that the action has ended, so that a new plan is there before the next action starts.
"""

import time
from dataclasses import dataclass, field

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.messages import (
    ActionFailed,
    ActionFinished,
    Begin,
    Command,
    Event,
    Flip,
    Observed,
    PlanArrived,
    PlanFailure,
    PlanMissing,
    StepsDropped,
)
from clo_fleet.clo.plan import Step, goals_of
from clo_fleet.clo.strategies import Strategy
from clo_fleet.clo.task import Action, apply, fact_text, holds
from clo_fleet.paper.actions import KnownActions
from clo_fleet.paper.calls import PaperPlanner
from clo_fleet.paper.symbolic import SymbolicWorld

__all__ = ["GOALS_REACHED", "PAPER_LIMITS", "Episode", "Limits", "Meters"]

GOALS_REACHED = "goals reached"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """When a run counts as not done [s]: its planning and deciding in all, one planner call, one decision."""

    run: float
    call: float
    links: float


PAPER_LIMITS = Limits(run=1800.0, call=500.0, links=300.0)


@dataclass(slots=True)
class Meters:
    """What an episode cost. ``wall_*`` [s] depend on the machine, the rest does not.

    Attributes:
        calls, expansions: of the planner.
        first_plan: steps of the first plan.
        looked_at: facts that the senses attended to, summed over the actions.
        noticed: facts seen that were not expected.
        repairs: surprises after which steps left the plan.
        wall_planning, wall_search: of all calls.
        wall_deciding: of the executive: links, repairs, choice of the next step.
        wall_first_*: the share of the first plan: its call, and what was decided on it before the first action.
    """

    calls: int = 0
    expansions: int = 0
    first_plan: int = 0
    looked_at: int = 0
    noticed: int = 0
    repairs: int = 0
    wall_planning: float = 0.0
    wall_search: float = 0.0
    wall_deciding: float = 0.0
    wall_first_planning: float = 0.0
    wall_first_search: float = 0.0
    wall_first_deciding: float = 0.0


@dataclass(slots=True)
class Episode:
    """A run under way. ``outcome`` is empty until it has ended."""

    world: SymbolicWorld
    strategy: Strategy
    planner: PaperPlanner
    limits: Limits = PAPER_LIMITS
    meters: Meters = field(default_factory=Meters)
    executive: Executive = field(init=False)
    outcome: str = field(default="", init=False)

    def __post_init__(self) -> None:
        world = self.world
        actions = KnownActions(world.setting.domain(), world.task)
        self.executive = Executive(self.strategy, world.facts, goals_of(world.task.goals), actions)

    def finish(self) -> str:
        """Go on until the end; returns the outcome."""
        self._tell(Begin(0.0))
        while not self.outcome:
            mode = self.executive.mode
            if mode in (Mode.PLANNING, Mode.ACTING_AND_PLANNING):
                self._plan()
            elif mode is Mode.ACTING:
                self._act()
            else:
                self._end(mode)
        return self.outcome

    @property
    def _time(self) -> float:
        return float(self.world.tried)

    def _end(self, mode: Mode) -> None:
        """Judge by the truth, not by what the robot believes."""
        if all(holds(goal, self.world.facts) for goal in self.executive.goals):
            self.outcome = GOALS_REACHED
        else:
            self.outcome = self.executive.outcome or f"ended {mode.value}"

    def _plan(self) -> None:
        meters = self.meters
        left = self.limits.run - meters.wall_planning - meters.wall_deciding
        called = self.planner.call(self.world.question(self.executive.planning_state), min(left, self.limits.call))
        meters.calls += 1
        meters.expansions += called.expansions
        meters.wall_planning += called.wall
        meters.wall_search += called.wall_search
        if called.failure is PlanFailure.OUT_OF_TIME:
            limit = (
                f"the run, {self.limits.run:g}" if left < self.limits.call else f"a planner call, {self.limits.call:g}"
            )
            self.outcome = f"limit of {limit} s"
            return
        if called.failure is PlanFailure.OUT_OF_MEMORY:
            self.outcome = called.failure.value
            return
        if called.actions is None:
            self._tell(PlanMissing(self._time, called.failure or PlanFailure.NO_PLAN))
            return
        self._tell(PlanArrived(self._time, called.actions))
        if meters.calls == 1:
            meters.first_plan = len(called.actions)
            meters.wall_first_planning, meters.wall_first_search = meters.wall_planning, meters.wall_search
            meters.wall_first_deciding = meters.wall_deciding

    def _act(self) -> None:
        running = self.executive.running
        assert running is not None
        watch = self.executive.watch
        happened = self.world.execute(running.action)
        beliefs = self.executive.beliefs
        attended = watch if isinstance(watch, frozenset) else self.world.facts | beliefs
        self.meters.looked_at += len(attended)
        flips = tuple(flip for flip in happened.flips if flip.fact in watch)
        self.meters.noticed += len(flips)
        if not happened.missing:
            flips += self._last_effects(running.action, flips)
        if flips:
            self._tell(Observed(self._time, flips))
        # a precondition that did not hold in truth is learnt by failing
        self._tell(self._end_of(running, tuple(Flip(need.fact, not need.positive) for need in happened.missing)))

    def _last_effects(self, action: Action, flips: tuple[Flip, ...]) -> tuple[Flip, ...]:
        """The action's own effects, if the goals hold with them: nobody should ask for another plan then."""
        state = self.executive.beliefs - {flip.fact for flip in flips if not flip.value}
        after = apply(state | {flip.fact for flip in flips if flip.value}, action)
        if not all(holds(goal, after) for goal in self.executive.goals):
            return ()
        effects = [(fact, True) for fact in sorted(action.adds)] + [(fact, False) for fact in sorted(action.deletes)]
        return tuple(Flip(fact, value) for fact, value in effects)

    def _end_of(self, running: Step, learnt: tuple[Flip, ...]) -> Event:
        if not learnt:
            return ActionFinished(self._time, running.id)
        reason = f"it lacked {', '.join(fact_text(flip.fact) for flip in learnt)}"
        return ActionFailed(self._time, running.id, reason, learnt)

    def _tell(self, event: Event) -> None:
        start = time.perf_counter()
        commands: tuple[Command, ...] = self.executive.handle(event)
        spent = time.perf_counter() - start
        self.meters.wall_deciding += spent
        self.meters.repairs += any(isinstance(command, StepsDropped) for command in commands)
        if spent > self.limits.links:
            self.outcome = f"limit of a decision, {self.limits.links:g} s"
