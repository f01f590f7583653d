"""Improvement: a valid plan made shorter or cheaper, within a budget.

Two ways, one after the other, until neither finds anything or the budget is used up:

- *action elimination* (Nakhost and Müller 2010): leave out a step with all that cannot be done without it;
- *windows*: what a run of steps leaves behind that is still needed may be had by fewer or cheaper actions. A round trip
  is a window that needs none at all; a way through a room where nothing is to be done any more needs a direct one.

What a window has to bring about is what must hold at its end (see ``regression``), so a check is local to it. Shorter
ways are looked for backwards, from what is missing. The budget counts operators looked at, so that a busy machine
decides the same.
"""

from collections.abc import Sequence

from clo_fleet.clo.bridge import Way
from clo_fleet.clo.operators import Operator, Operators, bits
from clo_fleet.clo.regression import regressed

__all__ = ["eliminated", "improved"]

BUDGET = 40_000  # operators looked at: about 10 ms
LONGEST_WINDOW = 8
MOST_NEW = 3  # actions in the place of a window


def improved(
    operators: Operators, state: int, plan: Sequence[Operator], goals: int, spared: int = 0, budget: int = BUDGET
) -> Way:
    """The plan, no dearer and no longer, from ``state`` to ``goals``; the plan given has to be valid.

    Cheaper means a smaller sum of costs, and of equal sums fewer steps.
    """
    improvement = _Improvement(operators, state, plan, goals, spared, budget)
    improvement.improve()
    return improvement.way()


def eliminated(operators: Operators, state: int, plan: Sequence[Operator], goals: int) -> Way:
    """The valid plan without the steps that action elimination finds needless."""
    improvement = _Improvement(operators, state, plan, goals)
    improvement.eliminate()
    return improvement.way()


class _Improvement:
    """One attempt to improve a plan. Lives as long as the call."""

    def __init__(
        self,
        operators: Operators,
        state: int,
        plan: Sequence[Operator],
        goals: int,
        spared: int = 0,
        budget: int = BUDGET,
    ) -> None:
        self._state = state
        self._goals = goals
        self._left = budget
        self._operators = operators
        self._spared = spared
        self._way: list[tuple[Operator, int | None]] = [(operator, place) for place, operator in enumerate(plan)]

    def way(self) -> Way:
        """The plan as it is now."""
        return tuple(operator if place is None else place for operator, place in self._way)

    def improve(self) -> None:
        """Go on until nothing more is found: first without new actions, then with one, with two..."""
        self.eliminate()
        length = 1
        while length <= MOST_NEW and self._left > 0:
            if self._replace(length):
                self.eliminate()
                length = 1
            else:
                length += 1

    def eliminate(self) -> bool:
        """Leave out each step in turn with what cannot be done without it, where the goals are still reached."""
        shorter = False
        place, state = 0, self._state
        while place < len(self._way) and self._left > 0:
            rest = self._without(place, state)
            if rest is None:
                operator = self._way[place][0]
                state = state & ~operator.ends | operator.gains
                place += 1
            else:
                self._way[place:] = rest
                shorter = True
        return shorter

    def _without(self, first: int, state: int) -> list[tuple[Operator, int | None]] | None:
        """What follows ``first`` if it is left out, with all that cannot be done then; ``None`` if a goal is lost."""
        rest = []
        self._left -= len(self._way) - first
        for pair in self._way[first + 1 :]:
            operator = pair[0]
            if operator.needs & state == operator.needs:
                state = state & ~operator.ends | operator.gains
                rest.append(pair)
        return rest if state & self._goals == self._goals else None

    def _replace(self, length: int) -> bool:
        """Replace windows by at most ``length`` actions, from the front to the end; whether one was replaced."""
        replaced = False
        needed = regressed([operator for operator, _ in self._way], self._goals)
        place, state = 0, self._state
        while place < len(self._way) and self._left > 0:
            found = self._jump(place, state, needed) or self._window(place, state, needed, length)
            if found is None:
                operator = self._way[place][0]
                state = state & ~operator.ends | operator.gains
                place += 1
            else:
                end, actions = found
                self._way[place:end] = [(operator, None) for operator in actions]
                needed = regressed([operator for operator, _ in self._way], self._goals)
                replaced = True
        return replaced

    def _jump(self, place: int, state: int, needed: Sequence[int]) -> tuple[int, tuple[Operator, ...]] | None:
        """The last place further on that can be entered from here at once."""
        self._left -= (len(needed) - place) // 8  # a comparison costs far less than an operator
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
            found = self._way_to(needed[end], state, cost, end - place, length)
            if found is not None:
                return end, found
        return None

    def _way_to(self, needed: int, state: int, cost: int, steps: int, length: int) -> tuple[Operator, ...] | None:
        """At most ``length`` actions from ``state`` to what is needed, cheaper than ``cost``, or shorter at that cost.

        Backwards: some action of the way has to gain what is missing; it is taken to be the last.
        """
        missing = needed & ~state
        if not missing:
            return () if cost > 0 or steps > 0 else None
        if not length or steps <= 0:
            return None
        best: tuple[Operator, ...] | None = None
        bit = next(bits(missing))
        for place in self._operators.achievers[bit]:
            self._left -= 1
            if self._left <= 0:
                break
            operator = self._operators.all[place]
            left = cost - operator.action.cost
            if left < 0 or (needed | self._spared) & operator.ends:
                continue
            before = self._way_to(needed & ~operator.gains | operator.needs, state, left, steps - 1, length - 1)
            if before is not None:
                best = (*before, operator)
                cost, steps = sum(o.action.cost for o in best), len(best)
        return best
