"""Action elimination on supports: what goes if some steps go, and whether a goal goes with it.

Nakhost and Müller 2010 drop a step of a plan, run the rest forward, drop each step that cannot be done then, and see
whether the goals still hold. Here only those steps are looked at that read a fact whose value then differs from what it
is in the plan. It differs from a step that goes to the next step that writes it: the steps between that need it go, and
no others. Nothing is changed: the answer is a set of places.
"""

from bisect import bisect_left, bisect_right
from heapq import heappop, heappush

from clo_fleet.clo.supports import Supports
from clo_fleet.clo.timeline import END

__all__ = ["eliminated", "eliminated_impossible"]

_UNKNOWN = -1  # stands for the literal that holds, of a fact of which neither is known to hold


def eliminated(supports: Supports, place: int, operations: int) -> tuple[set[int] | None, int]:
    """The step at the place and all that cannot be done without it.

    Returns:
        Their places; ``None`` if a goal would be lost, or if they are more than ``operations``.
        How many steps were looked at.
    """
    run = _Run(supports, operations)
    return run.outcome([place], only_impossible=False), operations - run.operations


def eliminated_impossible(supports: Supports, operations: int) -> set[int] | None:
    """All steps that cannot be done, whether now or once the others of them are left out.

    Returns:
        Their places; ``None`` if a goal does not hold then, or if more steps than ``operations`` had to be looked at.
    """
    return _Run(supports, operations).outcome(supports.lacking(), only_impossible=True)


class _Run:
    """A run through the plan, of which only the differences from the plan's own run are kept."""

    __slots__ = ("_agenda", "_differs", "_supports", "_timeline", "operations")

    def __init__(self, supports: Supports, operations: int) -> None:
        self.operations = operations  # that are left
        self._supports, self._timeline = supports, supports.timeline
        self._agenda: list[int] = []  # a heap of places
        self._differs: dict[int, tuple[int, int]] = {}  # fact, as its true literal -> what holds instead, up to where

    def outcome(self, agenda: list[int], *, only_impossible: bool) -> set[int] | None:
        """What goes, from the places of the sorted agenda on: those themselves, or only if they cannot be done."""
        self._agenda = agenda
        gone: set[int] = set()
        while agenda:
            place = heappop(agenda)
            if place in gone:
                continue
            if not self.operations:
                return None
            self.operations -= 1
            fails = self._fails(place)
            if fails is None:
                return None
            if fails or not only_impossible:
                if place == END or not self._skip(place):
                    return None
                gone.add(place)
        return gone

    def _fails(self, place: int) -> bool | None:
        """Whether the step lacks something; ``None`` if a goal lacks the same. Puts the next on the agenda."""
        differs = self._differs
        fails: bool | None = False
        for literal in self._timeline.needs(place):
            instead, until = differs.get(literal & ~1, _SAME)
            if until < place:
                fails = fails or self._supports.lacks(place, literal)
            elif instead != literal:
                fails = True
                if not self._look_ahead(literal, place, until):
                    return None
        return fails

    def _skip(self, place: int) -> bool:
        """Note what holds in place of what the step makes; whether no goal is lost by that."""
        all_makers, differs = self._timeline.makers, self._differs
        for literal in self._timeline.codes[place][1]:
            fact = literal & ~1
            makers, threats = all_makers[literal], all_makers[literal ^ 1]
            i, j = bisect_left(makers, place), bisect_left(threats, place)
            instead, until = differs.get(fact, _SAME)
            if until < place:
                if j and (not i or threats[j - 1] > makers[i - 1]):
                    instead = literal ^ 1
                elif i or self._timeline.now[literal]:
                    continue
                else:
                    instead = literal ^ 1 if self._timeline.now[literal ^ 1] else _UNKNOWN
            if instead == literal:
                continue
            until = threats[j] if j < len(threats) else END
            if i + 1 < len(makers) and makers[i + 1] < until:
                until = makers[i + 1]
            differs[fact] = instead, until
            if not self._look_ahead(literal, place, until):
                return False
        return True

    def _look_ahead(self, literal: int, place: int, until: int) -> bool:
        """Put the next reader of a literal that does not hold on the agenda; whether that is no goal."""
        readers = self._timeline.readers[literal]
        i = bisect_right(readers, place)
        if i < len(readers):
            reader = readers[i]
            if reader == END == until:
                return False
            if reader <= until:
                heappush(self._agenda, reader)
        return True


_SAME = _UNKNOWN, -END  # nothing holds instead
