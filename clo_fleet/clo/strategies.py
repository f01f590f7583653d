"""What to do about surprises: one protocol, one class a strategy.

A strategy is asked whenever the world differs from what the plan expects, and answers with a *revision*:
keep the plan, adopt a repaired one, or ask the planner. It has no state of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from clo_fleet.clo.links import End, Links, Unsupported
from clo_fleet.clo.plan import Plan
from clo_fleet.clo.repair import Repaired, repair
from clo_fleet.clo.task import Condition, Fact, fact_text

__all__ = [
    "STRATEGIES",
    "Adopt",
    "Clo",
    "Everything",
    "Keep",
    "PlanAgain",
    "Replan",
    "ReplanOnFailure",
    "Revision",
    "Situation",
    "Strategy",
    "Watch",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a strategy decides on.

    Attributes:
        state: the facts believed true.
        plan: the steps left, the running one first, with the conditions that it still needs.
        goals: what must hold in the end.
        changed: facts whose value is found to differ from what was expected.
        since: all such facts since the plan was last whole, these included.
        links: the links of the plan before those changes.
        promised: facts that others have in hand and announced to bring about.
    """

    state: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    changed: frozenset[Fact]
    since: frozenset[Fact]
    links: Links
    promised: frozenset[Fact]


@dataclass(frozen=True, slots=True)
class Keep:
    """Go on as planned."""


@dataclass(frozen=True, slots=True)
class Adopt:
    """Go on with the repaired plan. ``on_promise``: valid only if what was promised comes true."""

    repaired: Repaired
    on_promise: bool = False


@dataclass(frozen=True, slots=True)
class PlanAgain:
    """Ask the planner. ``refused``: the reason why a repair was not possible, empty if none was tried."""

    why: str
    refused: str = ""


Revision = Keep | Adopt | PlanAgain


@dataclass(frozen=True, slots=True)
class Everything:
    """A watch set that leaves nothing out."""

    def __contains__(self, fact: object) -> bool:
        return True


Watch = frozenset[Fact] | Everything


class Strategy(Protocol):
    """What an executive asks of its strategy."""

    @property
    def name(self) -> str:
        """The name that users write."""

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """The facts worth sensing, given the plan's links and the effects of the running action."""

    def revise(self, situation: Situation) -> Revision:
        """What becomes of the plan after unexpected changes, or after a new plan arrived."""


@dataclass(frozen=True, slots=True)
class Clo:
    """Causal-link opportunities: repair; ask the planner only if the repair is refused."""

    name: str = "clo"

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """Opportunities, guards and the effects of the running action."""
        return links.watched | running

    def revise(self, situation: Situation) -> Revision:
        """The repaired plan, or why there is none."""
        state, plan, goals, links = situation.state, situation.plan, situation.goals, situation.links
        found = repair(state, plan, goals, before=links, changed=situation.since)
        if isinstance(found, Repaired):
            return Adopt(found)
        if promised := situation.promised - state:
            hoped = repair(state | promised, plan, goals, before=links, changed=situation.since | promised)
            if isinstance(hoped, Repaired):
                return Adopt(hoped, on_promise=True)
        why = "; ".join(_gap(gap, situation.plan) for gap in found.missing)
        return PlanAgain("the repair was refused", refused=why)


@dataclass(frozen=True, slots=True)
class Replan:
    """The paper's baseline: plan again at any difference between what is seen and what was expected."""

    name: str = "replan"

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """All that the sensors reach."""
        return Everything()

    def revise(self, situation: Situation) -> Revision:
        """A new plan if anything differs."""
        if not situation.changed:
            return Keep()
        return PlanAgain(f"unexpected: {', '.join(fact_text(fact) for fact in sorted(situation.changed))}")


@dataclass(frozen=True, slots=True)
class ReplanOnFailure:
    """Plan again only when the plan cannot go on: an action failed, or the next one cannot start."""

    name: str = "replan-on-failure"

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """All that the sensors reach."""
        return Everything()

    def revise(self, situation: Situation) -> Revision:
        """The plan as it is; the executive finds out when it cannot go on."""
        return Keep()


STRATEGIES: Mapping[str, Strategy] = MappingProxyType(
    {strategy.name: strategy for strategy in (Clo(), Replan(), ReplanOnFailure())}
)


def _gap(gap: Unsupported, plan: Plan) -> str:
    """The gap in words."""
    if gap.consumer is End.GOAL:
        return f"nothing brings about the goal {gap.condition}"
    consumer = next(step for step in plan if step.id == gap.consumer)
    return f"nothing brings about {gap.condition} for {consumer}"
