"""What replaced the steps that left a plan: the news, followed along the links that the plan had.

A step whose link led to a step that left as well names what that one names; else the link's own fact, if it is new.
So each step names the news that is nearest to the goal. The old links are not kept: they follow from the steps that are
left and those that went.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Collection, Mapping

from clo_fleet.clo.task import Fact
from clo_fleet.clo.timeline import END, GAP, NOW, Timeline

__all__ = ["replacements"]


def replacements(
    timeline: Timeline, gone: Mapping[int, bool], was: Mapping[Fact, bool | None], news: frozenset[Fact]
) -> dict[int, tuple[Fact, ...]]:
    """For each step that went, the news that took its place. O(log n) for each condition and effect of those steps.

    Args:
        timeline: the plan as it is left.
        gone: the places of the steps that went; for each, whether it went for the sake of others, so that all news
            is named if its own links name none.
        was: the old values of the facts that changed.
        news: the facts that turned true.
    """
    old = _OldPlan(timeline, sorted(gone), was)
    found: dict[int, set[Fact]] = {place: set() for place in gone}
    for place in sorted(gone, reverse=True):
        for literal in timeline.makes(place):
            fact = timeline.fact(literal)
            if not literal & 1 and fact in news and old.supported_one_left(literal, place):
                found[place].add(fact)
        for literal in timeline.needs(place):
            producer = old.support(literal, place)
            if producer in found:
                found[producer] |= found[place]
    everything = tuple(sorted(frozenset[Fact]().union(*found.values()) or news))

    def indirect(place: int) -> bool:
        # A needless step whose consumers stay has been replaced by another step, which others had undone.
        return gone[place] or any(old.supported_one_left(literal, place) for literal in timeline.makes(place))

    return {
        place: tuple(sorted(facts)) if facts else everything if indirect(place) else ()
        for place, facts in found.items()
    }


class _OldPlan:
    """The links that a plan had before steps went and facts flipped."""

    __slots__ = ("_gone", "_timeline", "_was")

    def __init__(self, timeline: Timeline, gone: Collection[int], was: Mapping[Fact, bool | None]) -> None:
        self._timeline, self._was = timeline, was
        self._gone: dict[int, list[int]] = {}  # literal -> the places of its makers that went
        for place in gone:
            for literal in timeline.makes(place):
                self._gone.setdefault(literal, []).append(place)

    def support(self, literal: int, place: int) -> int:
        """The place of what supported the literal at a place; ``NOW`` or ``GAP``."""
        threat = self._last_before(literal ^ 1, place)
        if threat is None and self._held(literal):
            return NOW
        first = self._first_after(literal, -END if threat is None else threat)
        return first if first < place else GAP

    def supported_one_left(self, literal: int, place: int) -> bool:
        """Whether the step at the place, which makes the literal, supported a reader that is left."""
        readers = self._timeline.readers[literal]
        i = bisect_right(readers, place)
        if i == len(readers) or readers[i] > self._first_after(literal ^ 1, place):
            return False
        return self.support(literal, readers[i]) == place

    def _held(self, literal: int) -> bool:
        fact = self._timeline.fact(literal)
        if fact in self._was:
            return self._was[fact] is (literal & 1 == 0)
        return self._timeline.now[literal]

    def _last_before(self, literal: int, place: int) -> int | None:
        last: int | None = None
        for places in (self._timeline.makers[literal], self._gone.get(literal, ())):
            i = bisect_left(places, place)
            if i and (last is None or places[i - 1] > last):
                last = places[i - 1]
        return last

    def _first_after(self, literal: int, place: int) -> int:
        first = END
        for places in (self._timeline.makers[literal], self._gone.get(literal, ())):
            i = bisect_right(places, place)
            if i < len(places) and places[i] < first:
                first = places[i]
        return first
