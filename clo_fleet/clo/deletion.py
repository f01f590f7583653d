"""Deletion: what a plan can do without after facts flipped, with the reason for each step that goes.

Borrajo and Veloso 2024, Algorithms 3 and 4, made sound (DECISIONS 4), on supports that are kept up to date.

1. *Needless* steps support nothing that is left; they go first, and what they needed loses a use in turn.
2. *Impossible* steps lack a condition; they go if no goal goes with them.
3. *Loops* leave and come back: their steps support one another. A step that lost a use, or that now ends what would
   hold without it, is tried: it goes with all that cannot be done then, if no goal does. If it has to stay, the steps
   that serve it alone are tried: a round trip through several places begins before the place that lost its use.

A trial is action elimination from one step (see ``elimination``).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

from clo_fleet.clo.elimination import eliminated, eliminated_impossible
from clo_fleet.clo.links import Unsupported
from clo_fleet.clo.plan import Step
from clo_fleet.clo.replacements import replacements
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Fact
from clo_fleet.clo.timeline import END, GAP, NOW, Timeline

__all__ = ["MOST_OPERATIONS", "Deleted", "Drop", "DropReason", "delete"]

# Steps looked at for one suspect. A microsecond each; the longest loop that is found has as many steps.
MOST_OPERATIONS = 200


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
class Deleted:
    """What a deletion came to.

    Attributes:
        drops: the steps that left, in the plan's order.
        gaps: what the steps and goals that are left still lack; empty if the plan runs through to its goals.
    """

    drops: tuple[Drop, ...]
    gaps: tuple[Unsupported, ...]


def delete(
    supports: Supports,
    changed: Mapping[Fact, bool | None],
    *,
    everywhere: bool = False,
    operations: int = MOST_OPERATIONS,
) -> Deleted:
    """Flip the facts that changed, and take out of the plan, in place, what it does not need any more.

    The cost does not grow with the plan: O(log n) for each flip, each gap, each step that goes and each step looked at
    in a trial, and at most ``operations`` of these for each use that was lost and each threat that went.

    Args:
        supports: the plan; changed in place. Who may want the old plan back sets a mark first.
        changed: the new values of all facts of one observation; ``None``: not known any more.
        everywhere: look for loops in the whole plan, not only near what changed: for a plan that is new. A trial for
            each step that ends what another one restores, and all of them once more after something was found.
        operations: the most steps to look at for one suspect. A longer loop stays.

    >>> from clo_fleet.clo.plan import goals_of, number
    >>> from clo_fleet.clo.task import Action
    >>> fetch = Action(schema="fetch", args=("o1",), needs=(), adds=frozenset({("holding", "o1")}), deletes=frozenset())
    >>> supports = Supports(frozenset(), number([fetch]), goals_of([("holding", "o1")]))
    >>> for drop in delete(supports, {("holding", "o1"): True}).drops:
    ...     print(drop.step, drop.reason.name, drop.because)
    fetch(o1) NEEDLESS (('holding', 'o1'),)
    """
    was = {fact: supports.timeline.value(fact) for fact in changed}
    had_needless = supports.has_needless()
    for fact, value in changed.items():
        supports.flip(fact, value)
    reasons = _reasons(supports, operations, everywhere=everywhere)
    news = frozenset(fact for fact, value in changed.items() if value)
    if not news or (len(news) == 1 and not had_needless):
        because = dict.fromkeys(reasons, tuple(news))
    else:
        indirect = {place: reason is not DropReason.NEEDLESS for place, reason in reasons.items()}
        because = replacements(supports.timeline, indirect, was, news)
    steps = supports.timeline.steps
    drops = tuple(Drop(steps[place], reasons[place], because[place]) for place in sorted(reasons))
    return Deleted(drops, supports.gaps())


def _reasons(supports: Supports, operations: int, *, everywhere: bool) -> dict[int, DropReason]:
    """Take out what the plan does not need; the places of the steps that went, and why each did."""
    deletion = _Deletion(supports, operations, everywhere=everywhere)
    if supports.is_whole():
        deletion.run()
        return deletion.reasons
    # A step may look needless only because one that is impossible seems to do its work.
    possible = eliminated_impossible(supports, operations)
    before = supports.mark()
    deletion.run()
    if supports.is_whole() or possible is None:
        supports.keep(before)
        return deletion.reasons
    supports.undo(before)
    deletion = _Deletion(supports, operations, everywhere=everywhere)
    deletion.remove(possible, DropReason.IMPOSSIBLE)
    deletion.run()
    return deletion.reasons


class _Deletion:
    """One deletion at work."""

    __slots__ = ("_everywhere", "_operations", "_pool", "_supports", "_to_search", "_tried", "reasons")

    def __init__(self, supports: Supports, operations: int, *, everywhere: bool) -> None:
        self._supports = supports
        self._operations = operations
        self._everywhere = self._to_search = everywhere
        self._pool: list[int] = []  # steps to be tried
        self._tried: set[int] = set()
        self.reasons: dict[int, DropReason] = {}  # place -> why its step went

    def run(self) -> None:
        """Take out what can go, until nothing can."""
        while True:
            self.reasons |= dict.fromkeys(self._supports.take_needless(), DropReason.NEEDLESS)
            if not self._skip_impossible() and not self._skip_loop():
                return

    def remove(self, places: Iterable[int], reason: DropReason) -> None:
        """Remove the steps at these places."""
        self._supports.remove(places)
        self._to_search = self._everywhere
        self.reasons |= dict.fromkeys(places, reason)

    def _skip_impossible(self) -> bool:
        """Remove a step that lacks a condition, and all that fails with it, if the goals stand; whether one was."""
        if self._supports.is_whole():
            return False
        for place in self._supports.lacking():
            gone = None if place == END else eliminated(self._supports, place, self._operations)[0]
            if gone is not None:
                self.remove(gone, DropReason.IMPOSSIBLE)
                return True
        return False

    def _skip_loop(self) -> bool:
        """Remove a suspect, and all that fails with it, if the goals stand; whether one was."""
        suspects = self._supports.suspects()
        self._tried.difference_update(suspects)
        self._pool += suspects
        if self._skip_one():
            return True
        if not self._to_search:
            return False
        self._to_search = False
        self._tried.clear()
        self._pool += _undoers(self._supports.timeline)
        return self._skip_one()

    def _skip_one(self) -> bool:
        """Try the steps of the pool, the last first, each with those that serve it alone; whether one went."""
        while self._pool:
            chain, operations = [self._pool.pop()], self._operations
            while chain:
                place = chain.pop()
                if place in self._tried or not self._supports.timeline.is_left(place):
                    continue
                self._tried.add(place)
                gone, looked_at = eliminated(self._supports, place, operations)
                if gone is not None:
                    self.remove(gone, DropReason.LOOP)
                    return True
                operations -= looked_at
                if operations:
                    chain += self._servants(place)
        return False

    def _servants(self, place: int) -> list[int]:
        """The steps all of whose uses are by the step at the place."""
        supports = self._supports
        uses: dict[int, int] = {}
        for literal in supports.timeline.needs(place):
            producer = supports.timeline.support(literal, place)
            if producer < END:
                uses[producer] = uses.get(producer, 0) + 1
        return sorted(producer for producer, count in uses.items() if supports.uses[producer] == count)


def _undoers(timeline: Timeline) -> list[int]:
    """The steps that end what a later step restores for a reader, in the plan's order. Linear."""
    since = [NOW if holds else GAP for holds in timeline.now]  # literal -> its support at this point of the plan
    ended: dict[int, int] = {}  # literal -> the step that last ended it
    undone: dict[int, int] = {}  # literal that holds -> the step that had ended it before
    found: set[int] = set()
    for place in (*timeline.places(), END):
        found.update(undone[lit] for lit in timeline.needs(place) if lit in undone and since[lit] != GAP)
        for literal in timeline.makes(place):
            if since[literal] == GAP:
                since[literal] = place
                if literal in ended:
                    undone[literal] = ended[literal]
            if since[literal ^ 1] != GAP:
                since[literal ^ 1] = GAP
                ended[literal ^ 1] = place
    return sorted(found)
