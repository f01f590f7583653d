"""Ground actions as bit sets: what a search may use, indexed by what the actions make true.

Each condition that some action or goal needs or changes is one bit, the negative ones apart from the positive: a state
is a whole number, and an action is applicable if all bits of its ``needs`` are set. A fact whose value is unknown has
neither bit set. Adding a fact clears the bit of its negation and the other way round, so that nothing past this file
has to know of signs.

| here       | in terms of sets                                 |
|------------|--------------------------------------------------|
| `needs`    | the preconditions                                |
| `gains`    | the conditions that hold after it, whatever held |
| `ends`     | the conditions that do not hold after it         |
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

from clo_fleet.clo.task import Action, Condition, Fact, State

__all__ = ["Operator", "Operators", "bits", "run"]


@dataclass(frozen=True, slots=True)
class Operator:
    """An action as bit sets. ``price``: its cost, and at least 1, so that no search goes on for nothing."""

    action: Action
    needs: int
    gains: int
    ends: int
    price: int


class Operators:
    """The actions that a robot could do, each at its place in ``all``.

    Args:
        actions: ground actions, those that can become applicable; their order settles ties.
        goals: further conditions that will be asked about.

    Attributes:
        all: the operators.
        prices, gained, needs_count: of each operator its price, the bits that it gains, how many it needs.
        always: the places of the operators that need nothing.
        achievers: for each bit, the places of the operators that gain it.
        consumers: for each bit, the places of the operators that need it.
    """

    def __init__(self, actions: Iterable[Action], goals: Iterable[Condition] = ()) -> None:
        self._positive: dict[Fact, int] = {}
        self._negative: dict[Fact, int] = {}
        self._conditions: list[Condition] = []
        given = tuple(actions)
        for action in given:
            self._add(action.needs)
        self._add(goals)
        for action in given:
            for fact in sorted((action.adds | action.deletes).difference(self._positive)):
                self._add((Condition(fact),))
        self.all = tuple(map(self._translated, given))
        self.gained = tuple(tuple(bits(operator.gains)) for operator in self.all)
        self.prices = tuple(operator.price for operator in self.all)
        needed = tuple(tuple(bits(operator.needs)) for operator in self.all)
        self.needs_count = tuple(map(len, needed))
        self.always = tuple(place for place, count in enumerate(self.needs_count) if not count)
        self.achievers: tuple[list[int], ...] = tuple([] for _ in self._conditions)
        self.consumers: tuple[list[int], ...] = tuple([] for _ in self._conditions)
        for place, (gained, lacks) in enumerate(zip(self.gained, needed, strict=True)):
            for bit in gained:
                self.achievers[bit].append(place)
            for bit in lacks:
                self.consumers[bit].append(place)
        self._by_name = {(action.schema, action.args): place for place, action in enumerate(given)}
        self._objects = _objects(given)
        self._about: dict[str, int] = {}
        # Each operator is looked at only where its rarest condition holds.
        count = tuple(map(len, self.consumers))
        self._watching: dict[int, list[Operator]] = {}
        for operator, lacks in zip(self.all, needed, strict=True):
            if lacks:
                self._watching.setdefault(min(lacks, key=count.__getitem__), []).append(operator)
        self._watched = sum(1 << bit for bit in self._watching)

    def _add(self, conditions: Iterable[Condition]) -> None:
        for condition in conditions:
            side = self._positive if condition.positive else self._negative
            if condition.fact not in side:
                side[condition.fact] = 1 << len(self._conditions)
                self._conditions.append(condition)

    def covers(self, conditions: Iterable[Condition]) -> bool:
        """Whether each of the conditions has a bit: no other can be brought about, or told from a bit set."""
        return all(c.fact in (self._positive if c.positive else self._negative) for c in conditions)

    def covered(self, conditions: Iterable[Condition]) -> int:
        """Those of the conditions that have a bit, as a bit set."""
        return self.mask(condition for condition in conditions if self.covers((condition,)))

    def covering(self, conditions: Iterable[Condition]) -> "Operators":
        """These operators if they cover the conditions, else the same actions with bits for them as well.

        >>> Operators(()).covering([Condition(("open", "d1"))]).covers([Condition(("open", "d1"))])
        True
        """
        wanted = tuple(conditions)
        if self.covers(wanted):
            return self
        return Operators((operator.action for operator in self.all), (*self._conditions, *wanted))

    def conditions(self, mask: int) -> tuple[Condition, ...]:
        """The conditions whose bits are set."""
        return tuple(self._conditions[bit] for bit in bits(mask))

    def objects(self, schema: str, position: int) -> tuple[str, ...]:
        """The objects that stand at this position of the schema's actions, sorted."""
        return self._objects.get((schema, position), ())

    def about(self, name: str) -> int:
        """The conditions that name the object."""
        found = self._about.get(name)
        if found is None:
            found = sum(1 << bit for bit, condition in enumerate(self._conditions) if name in condition.fact[1:])
            self._about[name] = found
        return found

    def named(self, schema: str, args: tuple[str, ...]) -> Operator | None:
        """The operator of that name; the last, if there are several."""
        place = self._by_name.get((schema, args))
        return None if place is None else self.all[place]

    def operator(self, action: Action) -> Operator:
        """The action as bit sets; what no bit stands for is left out of its effects.

        Raises:
            KeyError: if the action needs a condition that none of the actions given speaks of (see ``covers``).
        """
        known = self.named(action.schema, action.args)
        if known is not None and (known.action is action or known.action == action):
            return known
        return self._translated(action)

    def _translated(self, action: Action) -> Operator:
        positive, negative = self._positive, self._negative
        gains = ends = 0
        for fact in action.adds:
            gains |= positive.get(fact, 0)
            ends |= negative.get(fact, 0)
        for fact in action.deletes:
            gains |= negative.get(fact, 0)
            ends |= positive.get(fact, 0)
        return Operator(action, self.mask(action.needs), gains, ends, max(action.cost, 1))

    def mask(self, conditions: Iterable[Condition]) -> int:
        """The conditions as a bit set.

        Raises:
            KeyError: if no bit stands for one of them.
        """
        found = 0
        for condition in conditions:
            found |= (self._positive if condition.positive else self._negative)[condition.fact]
        return found

    def state(self, state: State, unknown: Collection[Fact] = ()) -> int:
        """The state as a bit set."""
        found = sum(bit for fact, bit in self._negative.items() if fact not in state and fact not in unknown)
        for fact in self._positive.keys() & state:
            found |= self._positive[fact]
        for fact in unknown:
            found &= ~self._positive.get(fact, 0)
        return found

    def applicable(self, state: int) -> Iterator[Operator]:
        """The operators that can be done in the state, always in the same order."""
        for place in self.always:
            yield self.all[place]
        for bit in bits(state & self._watched):
            for operator in self._watching[bit]:
                if operator.needs & state == operator.needs:
                    yield operator


def _objects(actions: Iterable[Action]) -> dict[tuple[str, int], tuple[str, ...]]:
    rows: dict[tuple[str, int], list[tuple[str, ...]]] = {}
    for action in actions:
        rows.setdefault((action.schema, len(action.args)), []).append(action.args)
    found: dict[tuple[str, int], set[str]] = {}
    for (schema, _), group in rows.items():
        for position, column in enumerate(zip(*group, strict=True)):
            found.setdefault((schema, position), set()).update(column)
    return {key: tuple(sorted(names)) for key, names in found.items()}


def bits(number: int) -> Iterator[int]:
    """The places of the bits that are set, from the lowest.

    >>> list(bits(0b10110))
    [1, 2, 4]
    """
    while number:
        lowest = number & -number
        yield lowest.bit_length() - 1
        number ^= lowest


def run(state: int, operators: Iterable[Operator]) -> int | None:
    """The state after the operators; ``None`` if one of them cannot be done."""
    for operator in operators:
        if operator.needs & state != operator.needs:
            return None
        state = state & ~operator.ends | operator.gains
    return state
