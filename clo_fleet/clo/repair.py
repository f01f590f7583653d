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

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from clo_fleet.clo.bridge import Breach, NoBridge, Refusal, Way
from clo_fleet.clo.deletion import Drop, DropReason, delete
from clo_fleet.clo.improvement import Focus
from clo_fleet.clo.links import Consumer, Guard, Link, Links, Unsupported, causal_links
from clo_fleet.clo.mending import Means, mended, shortened
from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Condition, Fact, State

__all__ = ["Drop", "DropReason", "Means", "Refusal", "Refused", "Repaired", "Setting", "repair"]


@dataclass(frozen=True, slots=True)
class Setting:
    """What a plan is repaired for: the state that it starts in, what it has to reach, and what is not known."""

    state: State
    goals: tuple[Condition, ...]
    unknown: Collection[Fact] = ()


@dataclass(frozen=True, slots=True)
class Repaired:
    """A plan that reaches its goals from the state it was repaired for.

    Attributes:
        plan: the steps, old ones with their ids.
        dropped: the steps that are no longer in it, in their order.
        added: the steps that are new in it.
        means: what it took to make it whole.
        shortened: whether some of it was replaced by a shorter or cheaper way.
        effort: how many states and conditions a search looked at.
        setting: what it was repaired for.
    """

    plan: Plan
    dropped: tuple[Drop, ...]
    added: Plan = ()
    means: Means = Means.DELETION
    shortened: bool = False
    effort: int = 0
    setting: Setting = field(default=Setting(frozenset(), ()), compare=False, repr=False)

    @property
    def links(self) -> Links:
        """The links of the plan in the state that it was repaired for. Linear, worked out at each call."""
        return causal_links(self.setting.state, self.plan, self.setting.goals, self.setting.unknown)

    def certificate(self, before: Links) -> tuple[Link | Guard, ...]:
        """The supports that the repair has changed or made; all others are as they were ``before``. Linear."""
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
    changed: Collection[Fact] = (),
    unknown: Collection[Fact] = (),
    operators: Operators | None = None,
    spared: Collection[Condition] = (),
    improve: bool = False,
    everywhere: bool = False,
    under_way: bool = False,
    undo: bool = False,
    next_id: int | None = None,
) -> Repaired | Refused:
    """The plan, made good for the present ``state``.

    Args:
        state: what is true now.
        plan: the steps still to be done.
        goals: what must hold at the end.
        changed: the facts that changed; they say what made which step needless. No bridge leads back into the state
            before they did.
        unknown: facts that are neither known to be true nor to be false: they support nothing.
        operators: the actions that the robot could do. Without them the plan is mended by its own steps only.
        spared: conditions that others need: no new action may end them.
        improve: whether to look for shorter and cheaper ways as well. Needs operators.
        everywhere: look for loops and shorter ways in the whole plan, not only about what changed: for a plan that is
            new. So it is without changes as well.
        under_way: the first step has begun: new steps come after it, or in its place if it cannot end well any more.
        undo: a bridge may lead back into the state before the changes: nobody meant them to be.
        next_id: the id of the first new step; without it, one more than the highest of the plan.

    Cost: deletion is in proportion to what it touches, after one linear pass over the plan (see ``supports``). Searches
    have budgets, counted in operations (see ``bridge``, ``improvement``).
    """
    goals = tuple(goals)
    everywhere = everywhere or not changed
    setting = Setting(state, goals, unknown)
    past = state ^ frozenset(changed)
    supports = Supports(past, plan, goals, frozenset(unknown).difference(changed))
    values = {fact: None if fact in unknown else fact in state for fact in sorted(changed)}
    before = supports.links() if _breaks(supports, values) else None
    deleted = delete(supports, values, everywhere=everywhere)
    found: Repaired | Refused
    if deleted.gaps:
        found = Refused(deleted.gaps)
    else:
        means = Means.DELETION if before is None else _means(supports.links(), before)
        found = Repaired(supports.plan, deleted.drops, means=means, setting=setting)
    if operators is None or (isinstance(found, Repaired) and not improve):
        return found
    operators = operators.covering((*goals, *spared, *(need for step in plan for need in step.action.needs)))
    breach = Breach(
        operators=operators,
        state=operators.state(state, unknown),
        plan=tuple(operators.operator(step.action) for step in plan),
        goals=operators.mask(goals),
        before=operators.state(past, unknown) if changed and not undo else None,
        spared=operators.mask(spared),
    )
    way: Way
    if isinstance(found, Refused):
        mend = mended(breach, under_way=under_way)
        if isinstance(mend, NoBridge):
            return Refused(found.missing, mend.why, mend.effort)
        found = Repaired(plan, (), means=mend.means, effort=mend.effort, setting=setting)
        way, focus = mend.way, None
    else:
        kept = {step.id for step in found.plan}
        way = places = tuple(place for place, step in enumerate(plan) if step.id in kept)
        news = operators.covered(Condition(fact, value) for fact, value in values.items() if value is not None)
        focus = None if everywhere else Focus(_gaps(places, len(plan)), news)
    if improve:
        better = shortened(breach, way, focus, under_way=under_way)
        found, way = replace(found, shortened=better != way), better
    return _changed(found, _again(way, plan, under_way=under_way), plan, next_id)


def _gaps(way: tuple[int, ...], steps: int) -> frozenset[int]:
    """The places of the way in front of which some of the plan's ``steps`` are missing."""
    neighbours = zip((-1, *way), (*way, steps), strict=True)
    return frozenset(place for place, (last, following) in enumerate(neighbours) if following - last > 1)


def _breaks(supports: Supports, values: Mapping[Fact, bool | None]) -> bool:
    """Whether the plan lacks something with these values."""
    mark = supports.mark()
    for fact, value in values.items():
        supports.flip(fact, value)
    broken = not supports.is_whole()
    supports.undo(mark)
    return broken


def _means(links: Links, before: Links) -> Means:
    """Relinking, if a condition that lost its producer or its place in the present has found another producer."""
    had: dict[tuple[Condition, Consumer], int | None]
    had = {(guard.condition, guard.consumer): None for guard in before.guards}
    had |= {(link.condition, link.consumer): link.producer for link in before.links}
    moved = any(had.get((link.condition, link.consumer), link.producer) != link.producer for link in links.links)
    return Means.RELINKING if moved else Means.DELETION


def _again(way: Way, plan: Plan, *, under_way: bool) -> Way:
    """The way with the plan's own steps in the place of new operators that do the same: brought forward, or put off.

    A step under way cannot be begun again, even if it is stopped.
    """
    taken = {0, *way} if under_way else set(way)
    spare: dict[tuple[str, tuple[str, ...]], list[int]] = {}
    for place in reversed(range(len(plan))):
        if place not in taken:
            spare.setdefault((plan[place].action.schema, plan[place].action.args), []).append(place)
    found: list[int | Operator] = []
    for step in way:
        places = spare.get((step.action.schema, step.action.args)) if isinstance(step, Operator) else None
        found.append(places.pop() if places else step)
    return tuple(found)


def _changed(found: Repaired, way: Way, plan: Plan, next_id: int | None) -> Repaired:
    """The plan as the way says it goes on; new steps get new ids. It is run forward before it counts."""
    new_id = max(1 + max((step.id for step in plan), default=0), next_id or 0)
    steps: list[Step] = []
    for step in way:
        steps.append(Step(new_id, step.action) if isinstance(step, Operator) else plan[step])
        new_id += isinstance(step, Operator)
    if tuple(steps) == found.plan:
        return found
    old, kept = {step.id for step in plan}, {step.id for step in steps}
    known = {drop.step.id: drop for drop in found.dropped}
    changed = replace(
        found,
        plan=tuple(steps),
        added=tuple(step for step in steps if step.id not in old),
        dropped=tuple(known.get(step.id, Drop(step, DropReason.REPLACED)) for step in plan if step.id not in kept),
    )
    assert not changed.links.unsupported, "a mended plan does not run through"
    return changed
