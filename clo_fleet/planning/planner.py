"""What a planner is asked and what it may answer."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from clo_fleet.clo.task import Action
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import Domain

__all__ = [
    "Answer",
    "NoPlan",
    "PlanFound",
    "PlanReply",
    "Planner",
    "PlannerDied",
    "PlannerOutOfMemory",
    "PlannerOutOfTime",
    "Verdict",
    "reply_to",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanFound:
    """A plan; empty when the goals hold already.

    Attributes:
        actions: the steps in order.
        expansions: how many states the planner expanded.
        wall_seconds: how long it took by the clock on the wall; replies are equal whatever it is.
    """

    actions: tuple[Action, ...]
    expansions: int
    wall_seconds: float = field(compare=False)

    @property
    def cost(self) -> int:
        """The sum of the actions' costs."""
        return sum(action.cost for action in self.actions)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoPlan:
    """The search ended without a plan; ``proven``: there is none."""

    proven: bool
    expansions: int | None
    wall_seconds: float = field(compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerOutOfTime:
    """The planner met its wall limit. ``expansions``: as last reported, if at all."""

    expansions: int | None = field(compare=False)
    wall_seconds: float = field(compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerOutOfMemory:
    """The planner met its memory limit. ``expansions``: as last reported, if at all."""

    expansions: int | None = field(compare=False)
    wall_seconds: float = field(compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerDied:
    """The planner's process ended without an answer."""

    reason: str = field(compare=False)
    wall_seconds: float = field(compare=False)


PlanReply = PlanFound | NoPlan | PlannerOutOfTime | PlannerOutOfMemory | PlannerDied


class Planner(Protocol):
    """Answers planning tasks; the same task gets the same reply, wall-clock readings apart."""

    def plan(self, task: PlanningTask) -> PlanReply:
        """The reply to ``task``."""
        ...


class Verdict(Enum):
    """How a call of the planner ended, as its process reports it."""

    PLAN = "plan"
    NO_PLAN_PROVEN = "no_plan_proven"
    NO_PLAN = "no_plan"
    OUT_OF_TIME = "out_of_time"
    OUT_OF_MEMORY = "out_of_memory"
    DIED = "died"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What the planner's process reports: names only, grounded by the process that asked.

    Attributes:
        steps: the plan, each step the schema's name and its arguments.
        expansions: how many states were expanded, where the planner says so.
        reason: why it died.
        wall_seconds: how long the call took.
    """

    verdict: Verdict
    steps: tuple[tuple[str, ...], ...] = ()
    expansions: int | None = None
    reason: str = ""
    wall_seconds: float = 0.0


def reply_to(task: PlanningTask, domain: Domain, answer: Answer) -> PlanReply:
    """The reply that ``answer`` amounts to, its steps grounded in the domain."""
    expansions, wall_seconds = answer.expansions, answer.wall_seconds
    match answer.verdict:
        case Verdict.PLAN:
            costs = dict(task.costs)
            actions = tuple(domain.ground(step[0], step[1:], costs) for step in answer.steps)
            return PlanFound(actions=actions, expansions=expansions or 0, wall_seconds=wall_seconds)
        case Verdict.NO_PLAN_PROVEN | Verdict.NO_PLAN:
            proven = answer.verdict is Verdict.NO_PLAN_PROVEN
            return NoPlan(proven=proven, expansions=expansions, wall_seconds=wall_seconds)
        case Verdict.OUT_OF_TIME:
            return PlannerOutOfTime(expansions=expansions, wall_seconds=wall_seconds)
        case Verdict.OUT_OF_MEMORY:
            return PlannerOutOfMemory(expansions=expansions, wall_seconds=wall_seconds)
        case Verdict.DIED:
            return PlannerDied(reason=answer.reason, wall_seconds=wall_seconds)
