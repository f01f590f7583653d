"""Bridges: a few actions from the present that lead back into a plan which a surprise has broken.

Theory of operation
-------------------
The goals are regressed through the plan once: place k can be entered from every state that holds ``needed[k]``. What is
looked for is a short way to *some* such state, and the later the place, the less is left to be done. In this order, the
first that finds a way wins:

1. the plan's own steps, some left out: a prefix and a jump, or every step that can be done in turn;
2. breadth first, a few hundred expansions: most bridges are one or two actions long;
3. best first. One pass of the additive heuristic scores all places at once; the search aims at the place that
   minimises ``5 h + what is left`` and tests every generated state against all places.

A bridge may not pass through the state before the surprise: going back is what nearly every one-action bridge would do,
and it undoes the other robot's work. It ends no condition that others have announced to need. Budgets count operations,
so that a busy machine finds the same bridge.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from heapq import heappop, heappush
from itertools import accumulate

from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.regression import NEVER, entries, regressed, turns
from clo_fleet.clo.relaxation import INFINITE, Relaxation

__all__ = ["Breach", "Bridge", "NoBridge", "Refusal", "Way", "bridge", "detour", "long_bridge", "short_bridge"]

MOST_EXPANSIONS = 300  # breadth first
MOST_STATES = 20_000  # the same, where much can be done in every state
# States and conditions looked at best first, about 0.1 s: of 610 bridges found in 7 IPC domains, none took more than
# 260,000.
MOST_EFFORT = 400_000
MOST_TRIES = 100_000  # of steps, to bring them into another order: about 15 ms
WEIGHT = 5  # of the heuristic against the price of what is left: CLO prototype, 13 IPC domains


class Refusal(Enum):
    """Why a broken plan could not be mended."""

    NO_ACTIONS = "it is not known which actions there are to mend it with"
    UNSOLVABLE = "no plan exists: the goals are out of reach by all actions that there are"
    ONLY_BACK = "there is no way on, unless back through the state before the surprise"
    SPARED = "there is no way on that leaves alone what others have announced to need"
    BUDGET = "the search came to the end of its budget"


Way = tuple[int | Operator, ...]
"""A changed plan: the places of the steps that are kept, and the new operators between them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Breach:
    """What a bridge is to mend.

    Attributes:
        state: what holds now.
        plan: the steps that were still to be done.
        goals: what must hold in the end.
        before: the state before the surprise, into which no new action may lead back.
        spared: conditions that no new action may end.
    """

    operators: Operators
    state: int
    plan: Sequence[Operator]
    goals: int
    before: int | None = None
    spared: int = 0

    @property
    def back(self) -> int | None:
        """The state that there is no way back into; ``None`` if the surprise changed nothing that actions speak of."""
        return None if self.before == self.state else self.before


@dataclass(frozen=True, slots=True)
class Bridge:
    """Do ``actions``, then the plan from place ``entry`` on. ``effort``: states and conditions looked at."""

    actions: tuple[Operator, ...]
    entry: int
    effort: int

    def way(self, steps: int) -> Way:
        """The plan of so many steps, mended."""
        return (*self.actions, *range(self.entry, steps))


@dataclass(frozen=True, slots=True)
class NoBridge:
    """There is none, or it was not found."""

    why: Refusal
    effort: int


def detour(breach: Breach) -> Way | None:
    """The plan with some steps left out or put off, and no new ones, so that it reaches its goals again."""
    found = entries(regressed(breach.plan, breach.goals), breach.state)
    state = breach.state
    entry = found.latest_at_origin()
    for place, operator in enumerate(breach.plan):
        if entry is not None and entry >= place:
            return (*range(place), *range(entry, len(breach.plan)))
        if operator.needs & state != operator.needs:
            break
        state = state & ~operator.ends | operator.gains
        entry = found.latest(state)
    return _in_another_order(breach)


def _in_another_order(breach: Breach) -> Way | None:
    """Each step as soon as it can be done; ``None`` if that does not lead to the goals."""
    state = breach.state
    done: list[int] = []
    left = list(range(len(breach.plan)))
    tries = 0
    while tries <= MOST_TRIES:
        tries += len(left)
        put_off = []
        for place in left:
            operator = breach.plan[place]
            if operator.needs & state == operator.needs:
                state = state & ~operator.ends | operator.gains
                done.append(place)
            else:
                put_off.append(place)
        if breach.goals & state == breach.goals:
            return tuple(done)
        if len(put_off) == len(left):
            break
        left = put_off
    return None


def bridge(breach: Breach) -> Bridge | NoBridge:
    """The first bridge found, breadth first and then best first; its length is small, not always the smallest."""
    found = short_bridge(breach)
    return long_bridge(breach) if isinstance(found, NoBridge) and found.why is Refusal.BUDGET else found


def short_bridge(breach: Breach) -> Bridge | NoBridge:
    """A bridge of the fewest actions, if breadth first search finds one."""
    search = _Search(breach)
    return search.at_once() or search.breadth_first()


def long_bridge(breach: Breach) -> Bridge | NoBridge:
    """A bridge found by heuristic search."""
    search = _Search(breach)
    return search.at_once() or search.best_first()


@dataclass(frozen=True, slots=True)
class _Node:
    """A state reached, and by which operator from which node."""

    state: int
    price: int
    operator: Operator | None = None
    parent: "_Node | None" = None

    def actions(self) -> tuple[Operator, ...]:
        """The way from the root."""
        found = []
        node: _Node | None = self
        while node is not None and node.operator is not None:
            found.append(node.operator)
            node = node.parent
        return tuple(reversed(found))


class _Search:
    """One search for a bridge. Lives as long as the call."""

    def __init__(self, breach: Breach) -> None:
        self._breach = breach
        needed = regressed(breach.plan, breach.goals)
        self._entries = entries(needed, breach.state)
        self._turns = turns(needed)
        prices = [operator.price for operator in breach.plan]
        self._left = (*reversed(tuple(accumulate(reversed(prices)))), 0)  # the price of the plan from each place on
        self._seen = {breach.state} if breach.back is None else {breach.state, breach.back}
        self._root = _Node(breach.state, 0)
        self._expansions = self._effort = 0
        self._spared = self._turned_back = False

    def at_once(self) -> Bridge | None:
        """The bridge of no actions, if the plan can be entered from where it is broken."""
        entry = self._entries.latest_at_origin()
        return None if entry is None else Bridge((), entry, 0)

    def breadth_first(self) -> Bridge | NoBridge:
        """The best of the first layer in which a bridge ends."""
        layer = [self._root]
        while layer:
            following: list[_Node] = []
            best: tuple[int, _Node, int] | None = None
            for node in layer:
                if self._is_broad():
                    break
                for child in self._children(node):
                    entry = self._entries.latest(child.state)
                    if entry is None:
                        following.append(child)
                    elif best is None or child.price + self._left[entry] < best[0]:
                        best = child.price + self._left[entry], child, entry
            if best is not None:
                return Bridge(best[1].actions(), best[2], self._effort)
            if self._is_broad():
                return NoBridge(Refusal.BUDGET, self._effort)
            layer = following
        return self._nowhere_left()

    def _is_broad(self) -> bool:
        return self._expansions >= MOST_EXPANSIONS or self._effort >= MOST_STATES

    def _nowhere_left(self) -> NoBridge:
        """All states have been seen that can be reached by what is allowed."""
        why = Refusal.ONLY_BACK if self._turned_back else Refusal.UNSOLVABLE
        return NoBridge(Refusal.SPARED if self._spared else why, self._effort)

    def best_first(self) -> Bridge | NoBridge:
        """Greedy towards the place that promises the cheapest whole."""
        queue: list[tuple[int, int, int, _Node]] = [(0, 0, 0, self._root)]
        number = 0
        while queue:
            *_, node = heappop(queue)
            relaxed = Relaxation.of(self._breach.operators, node.state, self._breach.spared)
            self._effort += relaxed.touched
            aim = self._aim(relaxed)
            if aim is None:
                self._spared |= bool(self._breach.spared)
                continue
            target, estimate = aim
            helpful = {id(operator) for operator in relaxed.plan(self._entries.needed[target])}
            priority = node.price + estimate
            for child in self._children(node):
                entry = self._entries.latest(child.state)
                if entry is not None:
                    return Bridge(child.actions(), entry, self._effort)
                number += 1
                heappush(queue, (priority, id(child.operator) not in helpful, number, child))
            if self._effort > MOST_EFFORT:
                return NoBridge(Refusal.BUDGET, self._effort)
        return self._nowhere_left()

    def _aim(self, relaxed: Relaxation) -> tuple[int, int] | None:
        """The place to aim at, and ``5 h + what is left`` there; ``None`` if all are out of reach."""
        best: tuple[int, int] | None = None
        distance, estimate = relaxed.distance, 0
        for place in range(len(self._left) - 1, -1, -1):
            left = self._left[place]
            if (best is not None and left >= best[1]) or self._entries.needed[place] == NEVER:
                break
            begun, ended = self._turns[place]
            for bit in begun:
                estimate += distance[bit]
            for bit in ended:
                estimate -= distance[bit]
            self._effort += len(begun) + len(ended)
            if estimate < INFINITE and (best is None or WEIGHT * estimate + left < best[1]):
                best = place, WEIGHT * estimate + left
        return best

    def _children(self, node: _Node) -> list[_Node]:
        """The new states one operator further."""
        found: list[_Node] = []
        spared, back, seen = self._breach.spared, self._breach.back, self._seen
        for operator in self._breach.operators.applicable(node.state):
            if operator.ends & spared:
                self._spared = True
                continue
            state = node.state & ~operator.ends | operator.gains
            if state not in seen:
                seen.add(state)
                found.append(_Node(state, node.price + operator.price, operator, node))
            elif state == back:
                self._turned_back = True
        self._expansions += 1
        self._effort += len(found)
        return found
