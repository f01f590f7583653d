"""Repair: what is left of a plan after the world changed, without planning again.

Borrajo and Veloso 2024, Algorithms 3 and 4, made sound (DECISIONS 4). A repair

1. supports every condition anew and drops each step that supports nothing still needed;
2. drops *loops*: steps that undo a fact and have it made again later (there and back);
3. skips steps that cannot be done any more and are not needed either;
4. states what is missing if some needed condition has no support: then the repair is *refused*.

A repaired plan reaches its goals when it is run from the state given: every condition has a support, and
supports are chosen so that nothing between a producer and its consumer undoes the fact.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from clo_fleet.clo.links import Consumer, End, Link, Links, Unsupported, causal_links
from clo_fleet.clo.plan import Plan, Step, cost
from clo_fleet.clo.task import Condition, Fact, State, holds, unmet

__all__ = ["Drop", "DropReason", "Refused", "Repaired", "repair"]


class DropReason(Enum):
    """Why a step left the plan."""

    NEEDLESS = "nothing that is left needs it"
    LOOP = "it only left and came back"
    IMPOSSIBLE = "it cannot be done any more, and is not needed"


@dataclass(frozen=True, slots=True)
class Drop:
    """A step that the plan can do without. ``because``: the facts, newly true, that replaced it."""

    step: Step
    reason: DropReason
    because: tuple[Fact, ...] = ()


@dataclass(frozen=True, slots=True)
class Repaired:
    """A plan that reaches its goals from the state it was repaired for, with its links."""

    plan: Plan
    dropped: tuple[Drop, ...]
    links: Links


@dataclass(frozen=True, slots=True)
class Refused:
    """No repair by these means: the needed conditions that nothing supports."""

    missing: tuple[Unsupported, ...]


def repair(
    state: State,
    plan: Plan,
    goals: Iterable[Condition],
    *,
    before: Links | None = None,
    changed: Collection[Fact] = (),
) -> Repaired | Refused:
    """The plan, less what it does not need any more, for the present ``state``.

    Args:
        state: what is true now.
        plan: the steps still to be done.
        goals: what must hold at the end.
        before: the plan's links before the change, to say which fact made which step needless.
        changed: the facts that changed.

    Cost: linear in the plan's conditions for each round; a round is repeated while it drops steps. Loops cost
    a run of the plan for each candidate.
    """
    goals = tuple(goals)
    dropped: dict[int, DropReason] = {}
    rest, links = _reduced(state, plan, goals, dropped)
    if links.unsupported:
        # A step may look needless only because one that is impossible seems to do its work.
        possible = _eliminated(state, plan, goals, End.GOAL)
        if possible is None:
            return Refused(links.unsupported)
        dropped = _left_out(plan, possible, DropReason.IMPOSSIBLE)
        rest, links = _reduced(state, possible, goals, dropped)
    news = frozenset(Condition(fact) for fact in changed if fact in state)
    because = _replacements(plan, dropped, before or causal_links(state, plan, goals), news)
    drops = tuple(Drop(step, dropped[step.id], because[step.id]) for step in plan if step.id in dropped)
    return Repaired(rest, drops, links)


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
