"""Where a plan can be entered again: for each place, what must hold there so that the rest of the plan goes through."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from clo_fleet.clo.operators import Operator, bits

__all__ = ["NEVER", "Entries", "entries", "regressed", "turns"]

NEVER = -1  # all bits: no state meets it


def regressed(plan: Sequence[Operator], goals: int) -> tuple[int, ...]:
    """For each place 0..n of the plan the conditions that must hold there, ``goals`` at the end.

    ``NEVER`` stands where a step ends what the rest needs: the plan cannot be entered there or before. Linear in n.
    """
    needed = goals
    found = [needed]
    for operator in reversed(plan):
        if needed == NEVER or needed & operator.ends:
            needed = NEVER
        else:
            needed = needed & ~operator.gains | operator.needs
        found.append(needed)
    return tuple(reversed(found))


def turns(needed: Sequence[int]) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]:
    """For each place the bits that are needed there and not at the next place, and the other way round.

    Few bits turn at a place, many may be needed: what is summed up along these is linear in the plan.

    >>> turns((NEVER, 0b011, 0b110))
    (((), (0, 1)), ((0,), (2,)), ((1, 2), ()))
    """
    masks = [0 if mask == NEVER else mask for mask in needed]
    pairs = zip(masks, (*masks[1:], 0), strict=True)
    return tuple((tuple(bits(mask & ~after)), tuple(bits(after & ~mask))) for mask, after in pairs)


@dataclass(frozen=True, slots=True)
class Entries:
    """The places of a plan that other states than ``origin`` may enter, found without looking at every place.

    A place that ``origin`` does not meet lacks something. Any other state that meets it has gained that, so a
    state needs to be compared only with the places that lack the bits that it has gained.

    Attributes:
        needed: for each place, what must hold there.
        origin: the state that they are seen from.
        lacking: bits that are lacked -> the places filed under them, the last ones first.
        key: all bits that places are filed under.
    """

    needed: tuple[int, ...]
    origin: int
    lacking: dict[int, tuple[int, ...]]
    key: int

    def latest(self, state: int) -> int | None:
        """The last place that ``state`` can enter and the origin cannot; ``None`` if there is none."""
        best = -1
        for bit in bits(state & ~self.origin & self.key):
            for place in self.lacking[bit]:
                if place <= best:
                    break
                needed = self.needed[place]
                if needed & state == needed:
                    best = place
                    break
        return best if best >= 0 else None

    def latest_at_origin(self) -> int | None:
        """The last place that the origin itself can enter."""
        for place in range(len(self.needed) - 1, -1, -1):
            if self.needed[place] != NEVER and self.needed[place] & ~self.origin == 0:
                return place
        return None


def entries(needed: Sequence[int], origin: int) -> Entries:
    """The places, filed under a bit that the origin lacks: the one that fewest places lack.

    Linear in what the places begin and cease to need, times log.

    >>> found = entries((0b0110, 0b0101, 0b1000), origin=0b0100)
    >>> found.latest_at_origin(), found.latest(0b0101), found.latest(0b1101)
    (None, 1, 2)
    """
    lacks = [0 if mask == NEVER else mask & ~origin for mask in needed]
    turning = turns(lacks)
    count: Counter[int] = Counter()
    for place, (begun, ended) in enumerate(turning, start=1):
        for bit in begun:
            count[bit] += place
        for bit in ended:
            count[bit] -= place
    queue: list[tuple[int, int]] = []
    lacking: dict[int, list[int]] = {}
    for place in range(len(lacks) - 1, -1, -1):
        for bit in turning[place][0]:
            heappush(queue, (count[bit], bit))
        while queue and not lacks[place] >> queue[0][1] & 1:
            heappop(queue)
        if queue:
            lacking.setdefault(queue[0][1], []).append(place)
    filed = {bit: tuple(places) for bit, places in lacking.items()}
    return Entries(tuple(needed), origin, filed, sum(1 << bit for bit in filed))
