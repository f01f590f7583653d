"""Improvement: a valid plan made shorter or cheaper, within a budget.

Two ways, one after the other, until neither finds anything or the budget is used up:

- *action elimination* (Nakhost and Müller 2010): leave out a step with all that cannot be done without it;
- *windows*: what a run of steps leaves behind that is still needed may be had by fewer or cheaper actions. A round trip
  is a window that needs none at all; a way through a room where nothing is to be done any more needs a direct one.

What a window has to bring about is what must hold at its end (see ``regression``), so a check is local to it. Shorter
ways are looked for backwards, from what is missing. The budget counts operators looked at, so that a busy machine
decides the same.

After a small change to a plan that was improved before, only two things can be new: windows about the places where
steps have gone, and actions that need what has come true. A ``Focus`` says so, and spares the rest of the plan.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from clo_fleet.clo.bridge import Breach, Way
from clo_fleet.clo.operators import Operator, bits
from clo_fleet.clo.regression import regressed

__all__ = ["Focus", "eliminated", "improved"]

BUDGET = 40_000  # operators looked at: about 10 ms
FOCUSED_BUDGET = 1_000
DEEPER_FOCUSED_BUDGET = 100  # for ways of more than one new action: what they find about one gap, they find soon
LONGEST_WINDOW = 8
MOST_NEW = 3  # actions in the place of a window

_Pair = tuple[Operator, int | None]  # a step of the way, and its place in the plan; ``None``: it is new


@dataclass(frozen=True, slots=True)
class Focus:
    """Where a plan has changed since it was last improved.

    Attributes:
        places: those in front of which steps have gone.
        news: the conditions that have come true.
    """

    places: frozenset[int]
    news: int

    def behind_first(self) -> "Focus":
        """The same in the plan without its first step."""
        return Focus(frozenset(max(place - 1, 0) for place in self.places), self.news)


def improved(breach: Breach, way: Way, budget: int | None = None, focus: Focus | None = None) -> Way:
    """The way, which has to reach the goals, made no dearer and no longer.

    Cheaper means a smaller sum of costs, and of equal sums fewer steps. Without a ``focus`` the whole way is looked at.
    """
    improvement = _Improvement(breach, way, budget or (FOCUSED_BUDGET if focus else BUDGET), focus)
    improvement.improve()
    return improvement.way()


def eliminated(breach: Breach, way: Way, budget: int = BUDGET) -> Way:
    """The way, which has to reach the goals, without the steps that action elimination finds needless."""
    improvement = _Improvement(breach, way, budget, None)
    improvement.eliminate()
    return improvement.way()


class _Improvement:
    """One attempt to improve a way. Lives as long as the call."""

    def __init__(self, breach: Breach, way: Way, budget: int, focus: Focus | None) -> None:
        self._breach = breach
        self._left = budget
        self._near = None if focus is None else set(focus.places)
        self._fresh: list[Operator] = []
        for bit in bits(focus.news if focus is not None else 0):
            self._fresh += (breach.operators.all[place] for place in breach.operators.consumers[bit])
        self._way: list[_Pair] = [
            (step, None) if isinstance(step, Operator) else (breach.plan[step], step) for step in way
        ]

    def way(self) -> Way:
        """The way as it is now."""
        return tuple(operator if place is None else place for operator, place in self._way)

    def improve(self) -> None:
        """Go on until nothing more is found: first without new actions, then with one, with two..."""
        if self._near is None:
            self.eliminate(keep=self._left // 2)  # it would use up all for a long plan
        length = 1
        while length <= MOST_NEW and self._left > 0:
            if length > 1 and self._near is not None:
                self._left = min(self._left, DEEPER_FOCUSED_BUDGET)
            if self._replace(length):
                self.eliminate(keep=self._left // 2)
                length = 1
            else:
                length += 1

    def eliminate(self, keep: int = 0) -> None:
        """Leave out each step in turn with what cannot be done without it, where the goals are still reached.

        Args:
            keep: how much of the budget to leave.
        """
        place, state = 0, self._breach.state
        while place < len(self._way) and self._left > keep:
            rest = self._without(place, state)
            if rest is None:
                operator = self._way[place][0]
                state = state & ~operator.ends | operator.gains
                place += 1
            else:
                self._way[place:] = rest

    def _without(self, first: int, state: int) -> list[_Pair] | None:
        """What follows ``first`` if it is left out, with all that cannot be done then; ``None`` if a goal is lost."""
        rest = []
        there = state
        self._left -= len(self._way) - first
        for pair in self._way[first + 1 :]:
            operator = pair[0]
            if operator.needs & there == operator.needs:
                there = there & ~operator.ends | operator.gains
                rest.append(pair)
        return None if self._breach.goals & ~there or self._leads_back(state, rest) else rest

    def _leads_back(self, state: int, rest: Sequence[_Pair]) -> bool:
        """Whether one of the new actions that are done from ``state`` leads into the state before the surprise."""
        for operator, place in rest if self._breach.back is not None else ():
            state = state & ~operator.ends | operator.gains
            if place is None and state == self._breach.back:
                return True
        return False

    def _replace(self, length: int) -> bool:
        """Replace windows by at most ``length`` actions, from the front to the end; whether one was replaced."""
        replaced = False
        needed = self._needed()
        place, state = 0, self._breach.state
        while place < len(self._way) and self._left > 0:
            found = self._better(place, state, needed, length)
            rest = None if found is None else [*((operator, None) for operator in found[1]), *self._way[found[0] :]]
            if rest is None or self._leads_back(state, rest):
                operator = self._way[place][0]
                state = state & ~operator.ends | operator.gains
                place += 1
            else:
                self._shift(place, len(self._way) - len(rest))
                self._way[place:] = rest
                needed = self._needed()
                replaced = True
        return replaced

    def _shift(self, place: int, shorter: int) -> None:
        """Keep the places in focus while the way becomes shorter behind ``place``, which comes into focus too."""
        if self._near is not None:
            self._near = {near if near <= place else max(place, near - shorter) for near in self._near} | {place}

    def _better(
        self, place: int, state: int, needed: Sequence[int], length: int
    ) -> tuple[int, tuple[Operator, ...]] | None:
        """The end of a window that begins here, and what is to take its place."""
        near = self._near is None or any(place + begin in self._near for begin in range(LONGEST_WINDOW + 1))
        if near and (found := self._jump(place, state, needed)):
            return found
        if length > 1:
            return self._window(place, state, needed, length) if near else None
        wanted = 0
        for end in range(place + 1, min(place + LONGEST_WINDOW, len(self._way)) + 1):
            wanted |= needed[end]
        wanted &= ~state
        for operator in self._breach.operators.applicable(state) if near else self._fresh:
            self._left -= 1
            if operator.gains & wanted and operator.needs & ~state == 0 and not operator.ends & self._breach.spared:
                found = self._by(operator, place, state & ~operator.ends | operator.gains, needed)
                if found is not None:
                    return found
        return None

    def _by(
        self, operator: Operator, place: int, then: int, needed: Sequence[int]
    ) -> tuple[int, tuple[Operator, ...]] | None:
        """The longest window that the operator alone, leading to state ``then``, can take the place of."""
        best, cost = None, 0
        for end in range(place + 1, min(place + LONGEST_WINDOW, len(self._way)) + 1):
            cost += self._way[end - 1][0].action.cost
            cheaper = (operator.action.cost, 1) < (cost, end - place)
            if cheaper and needed[end] & ~then == 0:
                best = end, (operator,)
        return best

    def _needed(self) -> Sequence[int]:
        self._left -= len(self._way) // 8  # a place costs far less than an operator that is looked at, here and below
        return regressed([operator for operator, _ in self._way], self._breach.goals)

    def _jump(self, place: int, state: int, needed: Sequence[int]) -> tuple[int, tuple[Operator, ...]] | None:
        """The last place further on that can be entered from here at once."""
        self._left -= (len(needed) - place) // 8
        for end in range(len(needed) - 1, place, -1):
            if needed[end] & ~state == 0:
                return end, ()
        return None

    def _window(
        self, place: int, state: int, needed: Sequence[int], length: int
    ) -> tuple[int, tuple[Operator, ...]] | None:
        """The end of a window that begins here, and the fewer or cheaper actions that take its place."""
        cost = 0
        for end in range(place + 1, min(place + LONGEST_WINDOW, len(self._way)) + 1):
            cost += self._way[end - 1][0].action.cost
            if end - place < length:  # fewer new actions have been tried before
                continue
            found = self._way_to(needed[end], state, cost, end - place, length)
            if found is not None:
                return end, found
        return None

    def _way_to(self, needed: int, state: int, cost: int, steps: int, length: int) -> tuple[Operator, ...] | None:
        """At most ``length`` actions from ``state`` to what is needed, cheaper than ``cost``, or shorter at that cost.

        Backwards: some action of the way has to gain what is missing; it is taken to be the last. What fewest actions
        gain is taken first.
        """
        missing = needed & ~state
        if not missing:
            return () if cost > 0 or steps > 0 else None
        best: tuple[Operator, ...] | None = None
        achievers = self._breach.operators.achievers
        for place in min((achievers[bit] for bit in bits(missing)), key=len):
            self._left -= 1
            if self._left <= 0:
                break
            operator = self._breach.operators.all[place]
            left = cost - operator.action.cost
            if left < 0 or (needed | self._breach.spared) & operator.ends:
                continue
            still = needed & ~operator.gains | operator.needs
            if length == 1 and still & ~state:
                continue
            before = self._way_to(still, state, left, steps - 1, length - 1)
            if before is not None and not self._leads_back(state, [(o, None) for o in (*before, operator)]):
                best = (*before, operator)
                cost, steps = sum(o.action.cost for o in best), len(best)
        return best
