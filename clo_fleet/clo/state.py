"""What an executive remembers, as plain data that can be saved and restored."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Self

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.plain import (
    plain_cause,
    plain_conditions,
    plain_facts,
    plain_plan,
    read_cause,
    read_conditions,
    read_facts,
    read_plan,
)
from clo_fleet.clo.plan import Step
from clo_fleet.clo.task import Condition, Fact

__all__ = ["ExecutiveState", "Tally"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """What became of a robot's steps.

    Always: ``planned + planned_again + added = executed + dropped + cancelled + failed + superseded + pending``.

    Attributes:
        planned: steps of the first plan.
        planned_again: steps of later plans.
        added: steps put in by the executive: a failed step that is tried again, the new steps of a mended plan.
        executed: steps carried out to their end.
        dropped: steps that a repair or a goal reached made needless.
        cancelled: running steps stopped because they became needless.
        failed: steps tried in vain.
        superseded: steps left over when a new plan took the place of an old one.
        pending: steps still to be done.
        plans: plans received.
        planner_calls: questions to the planner.
    """

    planned: int = 0
    planned_again: int = 0
    added: int = 0
    executed: int = 0
    dropped: int = 0
    cancelled: int = 0
    failed: int = 0
    superseded: int = 0
    pending: int = 0
    plans: int = 0
    planner_calls: int = 0

    def plus(
        self, *, executed: int = 0, dropped: int = 0, cancelled: int = 0, failed: int = 0, added: int = 0,
        planner_calls: int = 0,
    ) -> "Tally":  # fmt: skip
        """The tally with these added."""
        return replace(
            self,
            executed=self.executed + executed,
            dropped=self.dropped + dropped,
            cancelled=self.cancelled + cancelled,
            failed=self.failed + failed,
            added=self.added + added,
            planner_calls=self.planner_calls + planner_calls,
        )

    def with_plan(self, steps: int, superseded: int, *, first: bool) -> "Tally":
        """The tally after a plan of ``steps`` took the place of ``superseded`` steps."""
        return replace(
            self,
            planned=self.planned + (steps if first else 0),
            planned_again=self.planned_again + (0 if first else steps),
            superseded=self.superseded + superseded,
            plans=self.plans + 1,
        )

    @property
    def adds_up(self) -> bool:
        """Whether every step that came in is accounted for."""
        came = self.planned + self.planned_again + self.added
        went = self.executed + self.dropped + self.cancelled + self.failed + self.superseded + self.pending
        return came == went


@dataclass(slots=True, kw_only=True)
class ExecutiveState:
    """The memory of an executive.

    Attributes:
        question: the state from which a plan was asked for, until the answer comes.
        news: facts that changed unexpectedly since the plan was last whole, and by whose action.
        unsolvable: the last state from which the planner was asked in vain.
        unknown: facts not known to be true or to be false; they are not among the beliefs.
        asked: the goals that the planner was last asked for.
        part: those of the goals that the planner is asked for now; empty: all.
        meanwhile: the steps of a plan to a part of the goals, made because there is none to all.
    """

    beliefs: set[Fact]
    goals: tuple[Condition, ...]
    begun: bool = False
    satisfied: bool = False
    cancelling: bool = False
    running: int | None = None
    outcome: str = ""
    waiting: str = ""
    plan: list[Step] = field(default_factory=list)
    suspended: set[int] = field(default_factory=set)
    promised: frozenset[Fact] = frozenset()
    offers: dict[int, tuple[Condition, ...]] = field(default_factory=dict)
    question: frozenset[Fact] | None = None
    news: dict[Fact, Cause | None] = field(default_factory=dict)
    attempts: dict[str, int] = field(default_factory=dict)
    unsolvable: frozenset[Fact] | None = None
    unknown: set[Fact] = field(default_factory=set)
    asked: tuple[Condition, ...] | None = None
    part: tuple[Condition, ...] = ()
    meanwhile: set[int] = field(default_factory=set)
    planner_deaths: int = 0
    relapses: int = 0
    next_step: int = 1
    tally: Tally = Tally()

    @property
    def new_goals(self) -> bool:
        """Whether the goals have changed since the planner was last asked."""
        return self.asked is not None and self.asked != self.goals

    def state(self) -> dict[str, object]:
        """Plain data: numbers, texts, lists and dictionaries."""
        return {
            **{name: getattr(self, name) for name in _SCALARS},
            "beliefs": plain_facts(self.beliefs),
            "goals": plain_conditions(self.goals),
            "plan": plain_plan(self.plan),
            "suspended": sorted(self.suspended),
            "promised": plain_facts(self.promised),
            "offers": [[offer, plain_conditions(needs)] for offer, needs in self.offers.items()],
            "question": None if self.question is None else plain_facts(self.question),
            "news": [[list(fact), plain_cause(cause)] for fact, cause in self.news.items()],
            "attempts": dict(self.attempts),
            "unsolvable": None if self.unsolvable is None else plain_facts(self.unsolvable),
            "unknown": plain_facts(self.unknown),
            "asked": None if self.asked is None else plain_conditions(self.asked),
            "part": plain_conditions(self.part),
            "meanwhile": sorted(self.meanwhile),
            "tally": asdict(self.tally),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The memory that ``state()`` was taken from."""
        return cls(
            **{name: state[name] for name in _SCALARS},
            beliefs=set(read_facts(state["beliefs"])),
            goals=read_conditions(state["goals"]),
            plan=list(read_plan(state["plan"])),
            suspended=set(state["suspended"]),
            promised=read_facts(state["promised"]),
            offers={offer: read_conditions(needs) for offer, needs in state["offers"]},
            question=None if state["question"] is None else read_facts(state["question"]),
            news={tuple(fact): read_cause(cause) for fact, cause in state["news"]},
            attempts=dict(state["attempts"]),
            unsolvable=None if state["unsolvable"] is None else read_facts(state["unsolvable"]),
            unknown=set(read_facts(state["unknown"])),
            asked=None if state["asked"] is None else read_conditions(state["asked"]),
            part=read_conditions(state["part"]),
            meanwhile=set(state["meanwhile"]),
            tally=Tally(**state["tally"]),
        )


_SCALARS = (
    "begun",
    "satisfied",
    "cancelling",
    "running",
    "outcome",
    "waiting",
    "planner_deaths",
    "relapses",
    "next_step",
)
