"""What to do about surprises: one protocol, one class a strategy.

A strategy is asked whenever the world differs from what the plan expects, and answers with a *revision*:
keep the plan, adopt a repaired one, or ask the planner. It has no state of its own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Protocol

from clo_fleet.clo.links import End, Links, Unsupported, causal_links
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import Plan
from clo_fleet.clo.printed import opportunities, printed_links, printed_repair
from clo_fleet.clo.repair import Drop, DropReason, Refusal, Refused, Repaired, Setting, repair
from clo_fleet.clo.task import Condition, Fact, State, fact_text

__all__ = [
    "STRATEGIES",
    "ActionSource",
    "Adopt",
    "AsPrinted",
    "Clo",
    "Everything",
    "Keep",
    "PlanAgain",
    "Replan",
    "ReplanOnFailure",
    "ReplanOnOpportunity",
    "Revision",
    "Situation",
    "Strategy",
    "Watch",
]


class ActionSource(Protocol):
    """Who knows what the robot could do."""

    def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
        """The actions that can become applicable from ``state``, with bits for the ``goals``.

        Called at each repair that needs more than the plan's own steps: renew them when objects have appeared.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a strategy decides on.

    Attributes:
        state: the facts believed true.
        plan: the steps left, the running one first, with the conditions that it still needs.
        goals: what must hold in the end.
        changed: facts whose value is found to differ from what was expected.
        since: all such facts since the plan was last whole, these included.
        past: the facts believed before those changes.
        promised: facts that others have in hand and announced to bring about.
        accidental: whether all of ``since`` is nobody's doing: it may be undone, and need not be worked round.
        running: whether the first step is under way.
        unknown: facts not known to be true or to be false.
        new_plan: whether the plan has just arrived.
        new_goals: whether the goals are others than those that the plan was made for.
        actions: who knows what else could be done; ``None`` if nobody does.
        next_id: the id for the next new step.
    """

    state: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]
    changed: frozenset[Fact]
    since: frozenset[Fact]
    past: frozenset[Fact]
    promised: frozenset[Fact]
    accidental: bool = False
    running: bool = False
    unknown: frozenset[Fact] = frozenset()
    new_plan: bool = False
    new_goals: bool = False
    actions: ActionSource | None = None
    next_id: int | None = None


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

    @property
    def heeds_own_effects(self) -> bool:
        """Whether it is asked as well about facts that the robot's own action has changed as expected."""

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """The facts worth sensing, given the plan's links and the effects of the running action."""

    def revise(self, situation: Situation) -> Revision:
        """What becomes of the plan after unexpected changes, or after a new plan arrived."""


@dataclass(frozen=True, slots=True)
class Clo:
    """Causal-link opportunities: repair; ask the planner only if the repair is refused.

    A plan is mended by its own steps if that can be done, else with what others have promised to bring about, else with
    new actions. ``improve``: look for shorter and cheaper ways as well, after every change; without it only when an
    obstacle is gone, since no step is there to remove one, and so no link shows what that is worth.
    """

    name: str = "clo"
    heeds_own_effects: bool = False
    improve: bool = False

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """Opportunities, guards and the effects of the running action."""
        return links.watched | running

    def revise(self, situation: Situation) -> Revision:
        """The repaired plan, or why there is none."""
        if not self.improve and _freed(situation):
            return replace(self, improve=True).revise(situation)
        promised = situation.promised - situation.state
        found: Repaired | Refused | None = None
        if promised or not self.improve or situation.actions is None:
            found = self._repair(situation)
        if isinstance(found, Refused) and promised:
            hoped = self._repair(situation, promised)
            if isinstance(hoped, Repaired):
                return Adopt(hoped, on_promise=True)
        if situation.actions is not None and (self.improve or isinstance(found, Refused)):
            found = self._repair(situation, operators=situation.actions.operators(situation.state, situation.goals))
        assert found is not None, "neither its own steps nor others were tried"
        if isinstance(found, Repaired):
            return Adopt(found)
        refused = "; ".join(_gap(gap, situation.plan) for gap in found.missing)
        if found.why is not Refusal.NO_ACTIONS:
            refused += f": {found.why.value}"
        return PlanAgain("the repair was refused", refused=refused)

    def _repair(
        self, situation: Situation, promised: frozenset[Fact] = frozenset(), operators: Operators | None = None
    ) -> Repaired | Refused:
        return repair(
            situation.state | promised,
            situation.plan,
            situation.goals,
            changed=situation.since | promised,
            unknown=situation.unknown - promised,
            operators=operators,
            improve=self.improve,
            everywhere=situation.new_plan or situation.new_goals,
            under_way=situation.running,
            undo=situation.accidental,
            next_id=situation.next_id,
        )


@dataclass(frozen=True, slots=True)
class AsPrinted:
    """The paper's algorithms as they are printed, faults included (see ``printed``): a baseline.

    For every opportunity that is true, expected or not, its links go, and the steps that have none left.
    """

    name: str = "clo-as-printed"
    heeds_own_effects: bool = True

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """Opportunities and the effects of the running action; guards are left out, as in the paper."""
        return frozenset(link.condition.fact for link in links.links) | running

    def revise(self, situation: Situation) -> Revision:
        """The plan without the steps whose links are all gone."""
        steps = situation.plan
        actions = tuple(step.action for step in steps)
        links = printed_links(actions, situation.goals)
        left = tuple(range(len(steps)))
        because: dict[int, Fact] = {}
        for fact in sorted(opportunities(links) & situation.state) if situation.changed else ():
            rest = tuple(action if i in left else None for i, action in enumerate(actions))
            stages, still = printed_repair(fact, rest, links)
            because |= dict.fromkeys(set(left) - set(still), fact)
            left, links = still, stages[-1]
        if not because:
            return Keep()
        plan = tuple(steps[i] for i in left)
        drops = tuple(Drop(steps[i], DropReason.NEEDLESS, (fact,)) for i, fact in sorted(because.items()))
        return Adopt(Repaired(plan, drops, setting=Setting(situation.state, situation.goals)))


@dataclass(frozen=True, slots=True)
class Replan:
    """The paper's baseline: plan again at any difference between what is seen and what was expected."""

    name: str = "replan"
    heeds_own_effects: bool = False

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """All that the sensors reach."""
        return Everything()

    def revise(self, situation: Situation) -> Revision:
        """A new plan if anything differs."""
        if situation.new_goals:
            return PlanAgain("the goals have changed")
        return _unexpected(situation.changed)


@dataclass(frozen=True, slots=True)
class ReplanOnOpportunity:
    """Plan again when a fact that some step was to make true has come true by itself, or when the plan is broken."""

    name: str = "replan-on-opportunity"
    heeds_own_effects: bool = False

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """Opportunities, guards and the effects of the running action."""
        return links.watched | running

    def revise(self, situation: Situation) -> Revision:
        """A new plan if there is something to gain by it, or something to mend."""
        if situation.new_goals:
            return PlanAgain("the goals have changed")
        state, plan = situation.state, situation.plan
        links = causal_links(state, plan, situation.goals, situation.unknown)
        if links.unsupported:
            promised = situation.promised
            if not causal_links(state | promised, plan, situation.goals, situation.unknown - promised).unsupported:
                return Keep()
            return PlanAgain("; ".join(_gap(gap, plan) for gap in links.unsupported))
        opportunities = causal_links(situation.past, plan, situation.goals, situation.unknown).opportunities
        return _unexpected(fact for fact in situation.changed if Condition(fact, fact in state) in opportunities)


@dataclass(frozen=True, slots=True)
class ReplanOnFailure:
    """Plan again only when the plan cannot go on: an action failed, or the next one cannot start."""

    name: str = "replan-on-failure"
    heeds_own_effects: bool = False

    def watch(self, links: Links, running: frozenset[Fact]) -> Watch:
        """All that the sensors reach."""
        return Everything()

    def revise(self, situation: Situation) -> Revision:
        """The plan as it is; the executive finds out when it cannot go on."""
        return Keep()


_ALL: tuple[Strategy, ...] = (
    Clo(),
    Clo("clo-improve", improve=True),
    AsPrinted(),
    Replan(),
    ReplanOnOpportunity(),
    ReplanOnFailure(),
)
STRATEGIES: Mapping[str, Strategy] = MappingProxyType({strategy.name: strategy for strategy in _ALL})


def _freed(situation: Situation) -> bool:
    """Whether something is gone of a kind that steps like those of the plan must not find, and that none removes."""
    gone = {fact[0] for fact in situation.since - situation.state}
    actions = [step.action for step in situation.plan] if gone else []
    gone.difference_update(fact[0] for action in actions for fact in action.deletes)
    return any(not need.positive and need.fact[0] in gone for action in actions for need in action.needs)


def _unexpected(facts: Iterable[Fact]) -> Revision:
    """Plan again for these facts, if there are any."""
    texts = [fact_text(fact) for fact in sorted(facts)]
    return PlanAgain(f"unexpected: {', '.join(texts)}") if texts else Keep()


def _gap(gap: Unsupported, plan: Plan) -> str:
    """The gap in words."""
    if gap.consumer is End.GOAL:
        return f"nothing brings about the goal {gap.condition}"
    consumer = next(step for step in plan if step.id == gap.consumer)
    return f"nothing brings about {gap.condition} for {consumer}"
