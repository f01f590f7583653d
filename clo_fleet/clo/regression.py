"""Where a plan can be entered again: for each place, what must hold there so that the rest of the plan goes through."""

from collections.abc import Sequence
from dataclasses import dataclass

from clo_fleet.clo.operators import Operator, bits

__all__ = ["NEVER", "Entries", "entries", "regressed"]

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


@dataclass(frozen=True, slots=True)
class Entries:
    """The places of a plan that other states than ``origin`` may enter, found without looking at every place.

    A place that ``origin`` does not meet lacks something. Any other state that meets it has gained that, so a
    state needs to be compared only with the places that lack the bits that it has gained.

    Attributes:
        needed: for each place, what must hold there.
        origin: the state that they are seen from.
        lacking: bits that are lacked -> the places filed under them, the last ones first.
    """

    needed: tuple[int, ...]
    origin: int
    lacking: dict[int, tuple[int, ...]]
    key: int

    def latest(self, state: int) -> int | None:
        """The last place that ``state``, which is not the origin, can enter; ``None`` if there is none."""
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


def entries(needed: tuple[int, ...], origin: int) -> Entries:
    """The places, filed under a bit that the origin lacks: the one that fewest places lack."""
    lacks = [0 if mask == NEVER else mask & ~origin for mask in needed]
    count: dict[int, int] = {}
    for lack in lacks:
        for bit in bits(lack):
            count[bit] = count.get(bit, 0) + 1
    lacking: dict[int, list[int]] = {}
    for place in range(len(needed) - 1, -1, -1):
        if lacks[place]:
            rarest = min(bits(lacks[place]), key=lambda bit: (count[bit], bit))
            lacking.setdefault(rarest, []).append(place)
    return Entries(
        needed, origin, {bit: tuple(places) for bit, places in lacking.items()}, sum(1 << b for b in lacking)
    )
