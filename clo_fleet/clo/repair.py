"""Repair: a plan made good after the world changed, without planning again.

Borrajo and Veloso 2024, Algorithms 3 and 4, made sound (DECISIONS 4) and carried on (DECISIONS 16). In this order; the
first that makes the plan whole ends it:

1. *deletion*: every condition is supported anew; steps that support nothing still needed go, then loops (there and
   back), then steps that cannot be done any more and are not needed either;
2. *relinking*: a condition that lost its support finds another among the steps left, some of them left out or put off;
3. *rebinding*: another object in the place of one that the surprise took;
4. a *bridge*: a few new actions that lead back into the plan.

The last two need to know the actions that there are. What none of them mends is *refused*, with what is missing and
why. A repaired plan reaches its goals when it is run from the state given. Deletion states it by its links: every
condition has a support, chosen so that nothing between a producer and its consumer undoes it. What the others return is
run forward once more before it is believed.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from clo_fleet.clo.bridge import Breach, NoBridge, Refusal, Way
from clo_fleet.clo.links import Consumer, End, Guard, Link, Links, Unsupported, causal_links
from clo_fleet.clo.mending import Means, mended, shortened
from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.plan import Plan, Step, cost
from clo_fleet.clo.task import Condition, Fact, State, holds, unmet

__all__ = ["Drop", "DropReason", "Means", "Refusal", "Refused", "Repaired", "repair"]


class DropReason(Enum):
    """Why a step left the plan."""

    NEEDLESS = "nothing that is left needs it"
    LOOP = "it only left and came back"
    IMPOSSIBLE = "it cannot be done any more, and is not needed"
    REPLACED = "another way takes its place"


@dataclass(frozen=True, slots=True)
class Drop:
    """A step that the plan can do without. ``because``: the facts, newly true, that replaced it."""

    step: Step
    reason: DropReason
    because: tuple[Fact, ...] = ()


@dataclass(frozen=True, slots=True)
class Repaired:
    """A plan that reaches its goals from the state it was repaired for, with its links.

    Attributes:
        plan: the steps, old ones with their ids.
        dropped: the steps that are no longer in it, in their order.
        links: the links of the plan.
        added: the steps that are new in it.
        means: what it took to make it whole.
        shortened: whether some of it was replaced by a shorter or cheaper way.
        effort: how many states and conditions a search looked at.
    """

    plan: Plan
    dropped: tuple[Drop, ...]
    links: Links
    added: Plan = ()
    means: Means = Means.DELETION
    shortened: bool = False
    effort: int = 0

    def certificate(self, before: Links) -> tuple[Link | Guard, ...]:
        """The supports that the repair has changed or made; all others are as they were ``before``."""
        known = {*before.links, *before.guards}
        supports: tuple[Link | Guard, ...] = (*self.links.links, *self.links.guards)
        return tuple(support for support in supports if support not in known)


@dataclass(frozen=True, slots=True)
class Refused:
    """No repair: the needed conditions that nothing supports, and why no other means helped."""

    missing: tuple[Unsupported, ...]
    why: Refusal = Refusal.NO_ACTIONS
    effort: int = 0


def repair(
    state: State,
    plan: Plan,
    goals: Iterable[Condition],
    *,
    before: Links | None = None,
    changed: Collection[Fact] = (),
    unknown: Collection[Fact] = (),
    operators: Operators | None = None,
    spared: Collection[Condition] = (),
    improve: bool = False,
    under_way: bool = False,
    next_id: int | None = None,
) -> Repaired | Refused:
    """The plan, made good for the present ``state``.

    Args:
        state: what is true now.
        plan: the steps still to be done.
        goals: what must hold at the end.
        before: the plan's links before the change, to say which fact made which step needless.
        changed: the facts that changed. No bridge leads back into the state before they did.
        unknown: facts that are neither known to be true nor to be false: they support nothing.
        operators: the actions that the robot could do. Without them the plan is mended by its own steps only.
        spared: conditions that others need: no new action may end them.
        improve: whether to look for shorter and cheaper ways as well. Needs operators.
        under_way: the first step has begun: new steps come after it, or in its place if it cannot end well any more.
        next_id: the id of the first new step; without it, one more than the highest of the plan.

    Cost: deletion is in proportion to what it touches, after one linear pass over the plan (see ``supports``). Searches
    have budgets, counted in operations (see ``bridge``, ``improvement``).
    """
    goals = tuple(goals)
    before = before or causal_links(state, plan, goals, unknown)
    news = frozenset(Condition(fact) for fact in changed if fact in state)
    found = _deletion(state, plan, goals, before, news, unknown)
    if operators is None or not operators.covers((*goals, *(need for step in plan for need in step.action.needs))):
        return found
    breach = Breach(
        operators=operators,
        state=operators.state(state, unknown),
        plan=(),
        goals=operators.mask(goals),
        before=operators.state(state ^ frozenset(changed), unknown) if changed else None,
        spared=operators.mask(condition for condition in spared if operators.covers((condition,))),
    )
    changes = _Changes(state, plan, goals, unknown, next_id)
    if isinstance(found, Refused):
        mend = mended(replace(breach, plan=_operators(operators, plan)), under_way=under_way)
        if isinstance(mend, NoBridge):
            return Refused(found.missing, mend.why, mend.effort)
        found = changes.made(Repaired(plan, (), before, means=mend.means, effort=mend.effort), mend.way)
    if improve:
        begun = under_way and found.plan[:1] == plan[:1]
        way = shortened(replace(breach, plan=_operators(operators, found.plan)), under_way=begun)
        found = changes.made(replace(found, shortened=way != tuple(range(len(found.plan)))), way)
    return found


def _deletion(
    state: State,
    plan: Plan,
    goals: Sequence[Condition],
    before: Links,
    news: frozenset[Condition],
    unknown: Collection[Fact],
) -> Repaired | Refused:
    """The plan by its own steps alone, in their order."""
    dropped: dict[int, DropReason] = {}
    rest, links = _reduced(state, plan, goals, dropped)
    if links.unsupported:
        # A step may look needless only because one that is impossible seems to do its work.
        possible = _eliminated(state, plan, goals, End.GOAL)
        if possible is None:
            return Refused(links.unsupported)
        dropped = _left_out(plan, possible, DropReason.IMPOSSIBLE)
        rest, links = _reduced(state, possible, goals, dropped)
    because = _replacements(plan, dropped, before, news)
    drops = tuple(Drop(step, dropped[step.id], because[step.id]) for step in plan if step.id in dropped)
    return Repaired(rest, drops, links, means=_means(links, before))


def _means(links: Links, before: Links) -> Means:
    """Relinking, if a condition that lost its producer or its place in the present has found another producer."""
    had: dict[tuple[Condition, Consumer], int | None]
    had = {(guard.condition, guard.consumer): None for guard in before.guards}
    had |= {(link.condition, link.consumer): link.producer for link in before.links}
    moved = any(had.get((link.condition, link.consumer), link.producer) != link.producer for link in links.links)
    return Means.RELINKING if moved else Means.DELETION


def _operators(operators: Operators, plan: Plan) -> tuple[Operator, ...]:
    return tuple(operators.operator(step.action) for step in plan)


@dataclass(frozen=True, slots=True)
class _Changes:
    """What changed plans are made from: the plan as it was, and what it has to do."""

    state: State
    plan: Plan
    goals: tuple[Condition, ...]
    unknown: Collection[Fact]
    next_id: int | None

    def made(self, found: Repaired, way: Way) -> Repaired:
        """The repaired plan as the way says it goes on; new steps get new ids. It is run forward before it counts."""
        if way == tuple(range(len(found.plan))):
            return found
        new_id = 1 + max((step.id for step in (*self.plan, *found.plan)), default=0)
        new_id = max(new_id, self.next_id or 0)
        steps: list[Step] = []
        for step in way:
            steps.append(Step(new_id, step.action) if isinstance(step, Operator) else found.plan[step])
            new_id += isinstance(step, Operator)
        links = causal_links(self.state, tuple(steps), self.goals, self.unknown)
        assert not links.unsupported, "a mended plan does not run through"
        kept, old = {step.id for step in steps}, {step.id for step in self.plan}
        known = {drop.step.id: drop for drop in found.dropped}
        dropped = (known.get(step.id, Drop(step, DropReason.REPLACED)) for step in self.plan if step.id not in kept)
        added = tuple(step for step in steps if step.id not in old)
        return replace(found, plan=tuple(steps), links=links, added=added, dropped=tuple(dropped))


def _reduced(
    state: State, plan: Plan, goals: Sequence[Condition], dropped: dict[int, DropReason]
) -> tuple[Plan, Links]:
    """What is left of the plan, and its links, when nothing more can be dropped from it."""
    while True:
        plan, links = _without_needless(state, plan, goals, dropped)
        shorter = _without_impossible(state, plan, goals, links) or _without_loop(state, plan, goals, links)
        if shorter is None:
            return plan, links
        dropped.update(_left_out(plan, *shorter))
        plan = shorter[0]


def _left_out(plan: Plan, rest: Plan, reason: DropReason) -> dict[int, DropReason]:
    """The steps of the plan that are not in the rest of it."""
    return dict.fromkeys({step.id for step in plan} - {step.id for step in rest}, reason)


def _without_needless(
    state: State, plan: Plan, goals: Sequence[Condition], dropped: dict[int, DropReason]
) -> tuple[Plan, Links]:
    """The plan without the steps that support neither a goal nor a step that does; its links."""
    while True:
        links = causal_links(state, plan, goals)
        needed: set[Consumer] = {End.GOAL}
        by_producer: dict[int, list[Link]] = {}
        for link in links.links:
            by_producer.setdefault(link.producer, []).append(link)
        for step in reversed(plan):
            if any(link.consumer in needed for link in by_producer.get(step.id, ())):
                needed.add(step.id)
        rest = tuple(step for step in plan if step.id in needed)
        if len(rest) == len(plan):
            return plan, links
        dropped.update(_left_out(plan, rest, DropReason.NEEDLESS))
        plan = rest


def _without_impossible(
    state: State, plan: Plan, goals: Sequence[Condition], links: Links
) -> tuple[Plan, DropReason] | None:
    """The plan without a step that lacks a condition, and all that fails with it, if the goals stand."""
    for gap in links.unsupported:
        shorter = _eliminated(state, plan, goals, gap.consumer)
        if shorter is not None:
            return shorter, DropReason.IMPOSSIBLE
    return None


def _without_loop(state: State, plan: Plan, goals: Sequence[Condition], links: Links) -> tuple[Plan, DropReason] | None:
    """The cheapest plan found by dropping one step that undoes what a later step makes again for another."""
    best: Plan | None = None
    for step in _undoers(state, plan, links):
        shorter = _eliminated(state, plan, goals, step)
        if shorter is not None and cost(shorter) < cost(best if best is not None else plan):
            best = shorter
    return None if best is None else (best, DropReason.LOOP)


def _undoers(state: State, plan: Plan, links: Links) -> tuple[int, ...]:
    """The steps that end a condition which a later step restores for a consumer, in the plan's order."""
    restored = {(link.producer, link.condition) for link in links.links}
    value = set(state)
    ended_by: dict[Condition, int] = {}
    found: dict[int, None] = {}
    for step in plan:
        begins = [Condition(fact) for fact in step.action.adds - value]
        begins += [Condition(fact, positive=False) for fact in step.action.deletes & value]
        for condition in begins:
            if condition in ended_by and (step.id, condition) in restored:
                found[ended_by[condition]] = None
            ended_by[Condition(condition.fact, not condition.positive)] = step.id
        value -= step.action.deletes
        value |= step.action.adds
    return tuple(step.id for step in plan if step.id in found)


def _eliminated(state: State, plan: Plan, goals: Sequence[Condition], first: Consumer) -> Plan | None:
    """The plan without step ``first`` and all that cannot be done then; ``None`` if a goal is lost.

    Action elimination (Nakhost and Mueller 2010) from one step.
    """
    kept: list[Step] = []
    state = set(state)
    for step in plan:
        if step.id == first or unmet(step.action, state):
            continue
        kept.append(step)
        state -= step.action.deletes
        state |= step.action.adds
    return tuple(kept) if all(holds(goal, state) for goal in goals) else None


def _replacements(
    plan: Plan, dropped: Mapping[int, DropReason], before: Links, news: frozenset[Condition]
) -> dict[int, tuple[Fact, ...]]:
    """For each dropped step, the news that took its place, followed along the links it had."""
    by_producer: dict[int, list[Link]] = {}
    for link in before.links:
        by_producer.setdefault(link.producer, []).append(link)
    found: dict[int, frozenset[Condition]] = {}
    for step in reversed(plan):
        if step.id in dropped:
            found[step.id] = frozenset().union(*(_replaced(link, found, news) for link in by_producer.get(step.id, ())))
    everything = frozenset().union(*found.values()) or news
    return {
        step: tuple(sorted(condition.fact for condition in why or (everything if dropped[step] in _INDIRECT else ())))
        for step, why in found.items()
    }


def _replaced(
    link: Link, found: Mapping[int, frozenset[Condition]], news: frozenset[Condition]
) -> frozenset[Condition]:
    """The news that made a link needless: what made its consumer needless, or else its own condition come true."""
    if not isinstance(link.consumer, End) and link.consumer in found:
        return found[link.consumer]
    return news & {link.condition}


_INDIRECT = (DropReason.LOOP, DropReason.IMPOSSIBLE)  # no link of such a step says what made it needless
