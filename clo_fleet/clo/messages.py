"""What an executive is told (events) and what it answers (commands and decisions). Values only.

Every event carries the time [s]; the executive has no clock of its own.
"""

from dataclasses import dataclass
from enum import Enum

from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.task import Action, Condition, Fact

__all__ = [
    "AcceptOffer",
    "ActionCancelled",
    "ActionFailed",
    "ActionFinished",
    "AskPlan",
    "Begin",
    "CancelAction",
    "Cause",
    "Command",
    "Event",
    "Finished",
    "Flip",
    "Forgotten",
    "GoalsChanged",
    "GoalsMet",
    "Observed",
    "OfferEnded",
    "Offered",
    "PlanAdopted",
    "PlanArrived",
    "PlanFailure",
    "PlanMended",
    "PlanMissing",
    "Promised",
    "RefuseOffer",
    "RepairRefused",
    "StartAction",
    "StepsDropped",
    "Waits",
    "Wake",
]


@dataclass(frozen=True, slots=True)
class Cause:
    """The action that changed a fact: whose doing that was, which, and the id of the event in the log that tells it."""

    robot: str
    action: str
    event: int


@dataclass(frozen=True, slots=True)
class Flip:
    """A fact now known to be true or false, and by whose action where that is known."""

    fact: Fact
    value: bool
    cause: Cause | None = None


# ---- events -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Begin:
    """Start: ask for a first plan."""

    time: float


@dataclass(frozen=True, slots=True)
class PlanArrived:
    """The planner found a plan, for the state that it was asked about."""

    time: float
    actions: tuple[Action, ...]


class PlanFailure(Enum):
    """Why the planner brought no plan."""

    NO_PLAN = "no plan exists"
    OUT_OF_TIME = "the planner ran out of time"
    OUT_OF_MEMORY = "the planner ran out of memory"
    DIED = "the planner died"


@dataclass(frozen=True, slots=True)
class PlanMissing:
    """The planner brought no plan."""

    time: float
    failure: PlanFailure


@dataclass(frozen=True, slots=True)
class ActionFinished:
    """The running action ended as its model says."""

    time: float
    step: int


@dataclass(frozen=True, slots=True)
class ActionFailed:
    """The running action ended otherwise: why, and what was learnt by it."""

    time: float
    step: int
    reason: str
    learnt: tuple[Flip, ...] = ()


@dataclass(frozen=True, slots=True)
class ActionCancelled:
    """The running action was stopped as asked, before its effects."""

    time: float
    step: int


@dataclass(frozen=True, slots=True)
class Observed:
    """Facts seen, or heard by radio, that differ from what was believed.

    ``promised``: what others have announced, if that changed at the same time (see ``Promised``). Who puts an object
    down where it was promised takes the promise back and makes it true at once; told apart, it would look like a loss.
    ``guess``: nobody has seen this, it is only taken to be so; a plan that runs through without it stays as it is.
    """

    time: float
    flips: tuple[Flip, ...]
    promised: frozenset[Fact] | None = None
    guess: bool = False


@dataclass(frozen=True, slots=True)
class Forgotten:
    """Facts that are not known any more to be true or to be false: no step may rely on either."""

    time: float
    facts: frozenset[Fact]


@dataclass(frozen=True, slots=True)
class GoalsChanged:
    """From now on these goals count, instead of those before."""

    time: float
    goals: tuple[Condition, ...]


@dataclass(frozen=True, slots=True)
class Promised:
    """All that others, who have it in hand, have announced to bring about. Replaces what was promised before."""

    time: float
    facts: frozenset[Fact]


@dataclass(frozen=True, slots=True)
class Offered:
    """Another robot stands by to change these facts, as long as ``needs`` holds. Answer: accept or refuse."""

    time: float
    offer: int
    by: str
    flips: tuple[Flip, ...]
    needs: tuple[Condition, ...] = ()


@dataclass(frozen=True, slots=True)
class OfferEnded:
    """An accepted offer is over: it was kept (the facts are seen as usual), or came to nothing."""

    time: float
    offer: int


@dataclass(frozen=True, slots=True)
class Wake:
    """Time has passed: try again what was put off."""

    time: float


Event = (
    Begin
    | PlanArrived
    | PlanMissing
    | ActionFinished
    | ActionFailed
    | ActionCancelled
    | Observed
    | Forgotten
    | GoalsChanged
    | Promised
    | Offered
    | OfferEnded
    | Wake
)


# ---- commands: do this -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class AskPlan:
    """Ask the planner for a plan from the executive's ``planning_state`` to its goals, or to ``part`` of them."""

    why: str
    part: tuple[Condition, ...] = ()


@dataclass(frozen=True, slots=True)
class StartAction:
    """Start this step."""

    step: Step


@dataclass(frozen=True, slots=True)
class CancelAction:
    """Stop the running step where that is safe; answer as usual with how it ended.

    ``fact``, ``cause``: what made it needless, if a fact did, and whose doing that is.
    """

    step: Step
    why: str
    fact: Fact | None = None
    cause: Cause | None = None


@dataclass(frozen=True, slots=True)
class AcceptOffer:
    """Yes: go ahead."""

    offer: int


@dataclass(frozen=True, slots=True)
class RefuseOffer:
    """No, and why not."""

    offer: int
    why: str


# ---- decisions: this is why --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PlanAdopted:
    """This plan is followed from now on. ``superseded``: what was left of the plan before it."""

    plan: Plan
    superseded: Plan
    first: bool


@dataclass(frozen=True, slots=True)
class StepsDropped:
    """These steps left the plan: ``reason``, and the fact that took their place, if one did, and by whom."""

    steps: Plan
    reason: str
    fact: Fact | None = None
    cause: Cause | None = None


@dataclass(frozen=True, slots=True)
class PlanMended:
    """The plan has steps that it had not before, or another order: what is ``added``, the whole, and by what means."""

    added: Plan
    plan: Plan
    means: str


@dataclass(frozen=True, slots=True)
class RepairRefused:
    """The plan could not be repaired: what it lacks."""

    why: str


@dataclass(frozen=True, slots=True)
class Waits:
    """Nothing to do for the time being, and why."""

    why: str


@dataclass(frozen=True, slots=True)
class GoalsMet:
    """All goals are believed true."""


@dataclass(frozen=True, slots=True)
class Finished:
    """The executive gave up for good: stuck, in conflict, or without a planner."""

    outcome: str
    why: str


Command = (
    AskPlan
    | StartAction
    | CancelAction
    | AcceptOffer
    | RefuseOffer
    | PlanAdopted
    | StepsDropped
    | PlanMended
    | RepairRefused
    | Waits
    | GoalsMet
    | Finished
)
