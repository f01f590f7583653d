"""How far away a condition is if nothing is ever undone: the additive heuristic and its relaxed plans.

Bonet and Geffner 2001 (h_add); Hoffmann and Nebel 2001 (relaxed plans, helpful actions), with best supporters chosen by
h_add as in Keyder and Geffner 2008.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from clo_fleet.clo.operators import Operator, Operators, bits

__all__ = ["INFINITE", "Relaxation"]

FARTHEST = 1 << 40  # what is further counts as that far: the sums double with each level of conditions
INFINITE = 1 << 80  # more than any sum of what is within reach


@dataclass(frozen=True, slots=True)
class Relaxation:
    """The estimates from one state.

    Attributes:
        distance: for each bit the estimated price to gain it, 0 where it holds, ``INFINITE`` where it never can.
        supporter: for each bit the place of the operator by which it is gained the cheapest.
        touched: how many conditions of operators were looked at.
    """

    operators: Operators
    state: int
    distance: Sequence[int]
    supporter: Sequence[int]
    touched: int

    @classmethod
    def of(cls, operators: Operators, state: int, forbidden: int = 0) -> "Relaxation":
        """The estimates from ``state`` without the operators that end a ``forbidden`` condition.

        Dijkstra's algorithm over conditions: linear in the conditions of all reachable operators, times log.
        """
        everything, consumers = operators.all, operators.consumers
        distance = [INFINITE] * len(consumers)
        supporter = [-1] * len(consumers)
        missing = list(operators.needs_count)
        sums = list(operators.prices)
        queue: list[tuple[int, int]] = []
        touched = 0

        def gain(place: int) -> None:
            operator = everything[place]
            if operator.ends & forbidden:
                return
            price = min(sums[place], FARTHEST)
            for bit in operators.gained[place]:
                if price < distance[bit]:
                    distance[bit] = price
                    supporter[bit] = place
                    heappush(queue, (price, bit))

        for bit in bits(state):
            distance[bit] = 0
            queue.append((0, bit))  # all alike: already a heap
        for place in operators.always:
            gain(place)
        while queue:
            far, bit = heappop(queue)
            if far > distance[bit]:
                continue
            for place in consumers[bit]:
                sums[place] += far
                missing[place] -= 1
                if not missing[place]:
                    gain(place)
            touched += len(consumers[bit])
        return cls(operators, state, distance, supporter, touched)

    def plan(self, conditions: int) -> tuple[Operator, ...]:
        """Operators that, were nothing ever undone, would gain the conditions, which have to be within reach."""
        todo = list(bits(conditions & ~self.state))
        seen = set(todo)
        places: set[int] = set()
        while todo:
            place = self.supporter[todo.pop()]
            places.add(place)
            for bit in bits(self.operators.all[place].needs & ~self.state):
                if bit not in seen:
                    seen.add(bit)
                    todo.append(bit)
        return tuple(self.operators.all[place] for place in sorted(places))
