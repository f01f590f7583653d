"""A plan laid out on a line of places, and who makes and who reads each literal where.

Each step has a place, a number that it keeps when others leave. Steps put in front get places below zero; they lie at
the end of the arrays, where Python's negative indices find them. The goals are read at the place ``END``.
"""

from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterable, Iterator

from clo_fleet.clo.links import Consumer, End, Guard, Link, Links, Unsupported
from clo_fleet.clo.literals import Code, Literals
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.task import Condition, Fact, State
from clo_fleet.errors import CloFleetError

__all__ = ["END", "GAP", "NOW", "NoStepError", "Places", "Timeline"]

END = 1 << 60  # the place of the goals, after all steps
NOW = END + 1  # the support of what the present gives
GAP = END + 2  # the support of what nothing gives

# Most literals have few makers and readers. These are kept in tuples, which are small, and which the garbage collector
# does not follow: with lists it takes more than half of the time that a long plan needs.
Places = tuple[int, ...] | list[int]
_SHORT = 4


class NoStepError(CloFleetError):
    """A step was asked for that is not in the plan, or not any more.

    Attributes:
        step: its id; ``None``: the first step of an empty plan.
    """

    def __init__(self, step: int | None) -> None:
        super().__init__("the plan has no step left" if step is None else f"the plan has no step {step}")
        self.step = step


class Timeline:
    """The present, the steps of a plan at their places, and the goals. Not linked yet: see ``lay_out``.

    Args:
        state: the facts that hold now.
        plan: the steps.
        goals: what must hold in the end.
        unknown: facts of which it is not known whether they hold: neither they nor their opposites do.

    Attributes:
        goals: what must hold in the end.
        literals: the numbers of facts.
        steps: the step at each place, also after it has left.
        bound: the first number above all places.
        codes: the literals that the step at each place needs and makes.
        now: whether each literal holds now.
        makers: for each literal the places of the steps that make it, sorted.
        readers: for each literal the places of the steps that need it, sorted; ``END`` for each goal.
    """

    __slots__ = (
        "_alive",
        "_goals",
        "_head",
        "_low",
        "_place_by_id",
        "_size",
        "_state",
        "_unknown",
        "bound",
        "codes",
        "goals",
        "literals",
        "makers",
        "now",
        "readers",
        "steps",
    )

    def __init__(
        self, state: State, plan: Iterable[Step], goals: Iterable[Condition], unknown: frozenset[Fact]
    ) -> None:
        self.goals = tuple(goals)
        self.literals = Literals()
        self.steps = list(plan)
        self.codes: list[Code] = []
        self.now: list[bool] = []
        self.makers: list[Places] = []
        self.readers: list[Places] = []
        self._goals = self.literals.all_of(self.goals)
        self._state, self._unknown = frozenset(state), unknown
        self.bound = self._size = len(self.steps)
        self._alive = bytearray(b"\1") * self.bound
        self._low = self._head = 0  # no place is before the one, no step left before the other
        self._place_by_id: dict[int, int] | None = None  # once somebody asks
        self.grow()

    def lay_out(self) -> tuple[list[int], bool]:
        """Enter all steps and link them in one run, as ``causal_links`` does. Linear in conditions and effects.

        Returns:
            The number of conditions that the step at each place supports, and whether a condition has no support.
        """
        known, translated = self.literals.codes, self.literals.translated
        self.codes += [known.get(id(step.action)) or translated(step.action) for step in self.steps]
        self.grow()
        makers, readers = self.makers, self.readers
        by_now, by_none = self.bound, self.bound + 1  # two counts more, so that nothing has to be asked
        uses = [0] * (self.bound + 2)
        since = [by_now if holds else by_none for holds in self.now]  # literal -> its support at this point of the plan
        for place, (needs, makes) in enumerate(self.codes):
            here = (place,)
            for literal in needs:
                uses[since[literal]] += 1
                places = readers[literal]
                if not places:
                    readers[literal] = here
                elif isinstance(places, list):
                    places.append(place)
                else:
                    readers[literal] = places + here if len(places) < _SHORT else [*places, place]
            for literal in makes:
                if since[literal] == by_none:
                    since[literal] = place
                since[literal ^ 1] = by_none
                places = makers[literal]
                if not places:
                    makers[literal] = here
                elif isinstance(places, list):
                    places.append(place)
                else:
                    makers[literal] = places + here if len(places) < _SHORT else [*places, place]
        for literal in self._goals:
            uses[since[literal]] += 1
            _put(readers, literal, END)
        return uses[: self.bound], uses[by_none] > 0

    def grow(self) -> None:
        """Make room for facts that came to have numbers."""
        new = self.literals.facts[len(self.now) // 2 :]
        self.makers += [()] * (2 * len(new))
        self.readers += [()] * (2 * len(new))
        for fact in new:
            holds = fact in self._state
            self.now += (holds, not holds)
        for fact in self._unknown.intersection(new) if self._unknown else ():
            literal = self.literals.numbers[fact]
            self.now[literal : literal + 2] = False, False

    # ---- places ----------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        """The number of steps left."""
        return self._size

    @property
    def plan(self) -> Plan:
        """The steps left. Linear."""
        return tuple(self.steps[place] for place in self.places())

    def places(self) -> Iterator[int]:
        """The places of the steps left, in order. Linear."""
        alive = self._alive
        return (place for place in range(self._head, self.bound) if alive[place])

    def first(self) -> int:
        """The place of the first step left. O(1), spread over the steps that have left.

        Raises:
            NoStepError: if there is none.
        """
        if not self._size:
            raise NoStepError(None)
        while not self._alive[self._head]:
            self._head += 1
        return self._head

    def is_left(self, place: int) -> bool:
        """Whether the step at the place is still in the plan."""
        return bool(self._alive[place])

    def place_of(self, step: int) -> int:
        """The place of a step by its id. The first call is linear, the others O(1).

        Raises:
            NoStepError: if it is not in the plan.
        """
        if self._place_by_id is None:
            self._place_by_id = {self.steps[place].id: place for place in self.places()}
        place = self._place_by_id.get(step)
        if place is None or not self._alive[place] or self.steps[place].id != step:
            raise NoStepError(step)
        return place

    def consumer(self, place: int) -> Consumer:
        """Who reads at the place, as links name it."""
        return End.GOAL if place == END else self.steps[place].id

    def conditions(self, place: int) -> Iterable[tuple[Condition, int]]:
        """The conditions at a place, with their literals."""
        conditions = self.goals if place == END else self.steps[place].action.needs
        return zip(conditions, self.needs(place), strict=True)

    def needs(self, place: int) -> tuple[int, ...]:
        """The literals needed at a place."""
        return self._goals if place == END else self.codes[place][0]

    def makes(self, place: int) -> tuple[int, ...]:
        """The literals made at a place."""
        return () if place == END else self.codes[place][1]

    # ---- facts and supports ----------------------------------------------------------------------------------

    def state(self) -> frozenset[Fact]:
        """The facts that hold now. Linear in them and in the facts of the plan."""
        numbers, now = self.literals.numbers, self.now
        here = frozenset(fact for fact, literal in numbers.items() if now[literal])
        return here | (self._state - numbers.keys() - self._unknown)

    def value(self, fact: Fact) -> bool | None:
        """Whether the fact holds now; ``None``: unknown. O(1)."""
        literal = self.number(fact)
        return True if self.now[literal] else False if self.now[literal + 1] else None

    def fact(self, literal: int) -> Fact:
        """The fact that a literal speaks of."""
        return self.literals.facts[literal >> 1]

    def number(self, fact: Fact) -> int:
        """The literal that the fact is true, also if the plan does not speak of it."""
        literal = self.literals.numbers.get(fact)
        if literal is None:
            literal = self.literals.number(fact)
            self.grow()
        return literal

    def support(self, literal: int, reader: int) -> int:
        """The place of the step that supports a literal for a reader, ``NOW`` or ``GAP``. O(log n)."""
        threats, makers = self.makers[literal ^ 1], self.makers[literal]
        before = bisect_left(threats, reader)
        if before:
            i = bisect_left(makers, threats[before - 1])
        elif self.now[literal]:
            return NOW
        else:
            i = 0
        return makers[i] if i < len(makers) and makers[i] < reader else GAP

    def support_of(self, condition: Condition, consumer: Consumer) -> Link | Guard | Unsupported:
        """What supports a condition at a consumer, whether the consumer has that condition or not. O(log n).

        Raises:
            NoStepError: if the consumer is not in the plan.
        """
        place = END if isinstance(consumer, End) else self.place_of(consumer)
        producer = self.support(self.number(condition.fact) + (not condition.positive), place)
        if producer == NOW:
            return Guard(condition, consumer)
        if producer == GAP:
            return Unsupported(condition, consumer)
        return Link(self.steps[producer].id, condition, consumer)

    def links(self) -> Links:
        """What ``causal_links`` says of the steps left. Linear in their conditions and effects."""
        links: list[Link] = []
        guards: list[Guard] = []
        unsupported: list[Unsupported] = []
        since = [NOW if holds else GAP for holds in self.now]  # literal -> its support at this point of the plan
        for place in (*self.places(), END):
            consumer = self.consumer(place)
            for condition, literal in self.conditions(place):
                if since[literal] == NOW:
                    guards.append(Guard(condition, consumer))
                elif since[literal] == GAP:
                    unsupported.append(Unsupported(condition, consumer))
                else:
                    links.append(Link(self.steps[since[literal]].id, condition, consumer))
            for literal in self.makes(place):
                if since[literal] == GAP:
                    since[literal] = place
                since[literal ^ 1] = GAP
        return Links(tuple(links), tuple(guards), tuple(unsupported))

    def gaps(self) -> set[tuple[int, int]]:
        """All readers and literals without support. Linear in the conditions, times log n."""
        return {
            (reader, literal)
            for literal, readers in enumerate(self.readers)
            for reader in readers
            if self.support(literal, reader) == GAP
        }

    # ---- changes ---------------------------------------------------------------------------------------------

    def stop_reading(self, place: int) -> None:
        """Take the step at the place out of the plan, but for what it makes."""
        self._alive[place] = False
        self._size -= 1
        for literal in self.codes[place][0]:
            _take(self.readers, literal, place)

    def stop_making(self, literal: int, place: int) -> None:
        """Take out one thing that the step at the place makes."""
        _take(self.makers, literal, place)

    def put_back(self, place: int) -> None:
        """Put in again a step that was taken out."""
        self._alive[place] = True
        self._size += 1
        self._head = min(self._head, place)
        if self._place_by_id is not None:
            self._place_by_id[self.steps[place].id] = place
        needs, makes = self.codes[place]
        for literal in needs:
            _put(self.readers, literal, place)
        for literal in makes:
            _put(self.makers, literal, place)

    def place_in_front(self, step: Step, code: Code) -> int:
        """A new place before all others, for the step; it is not read or made there before it is put back."""
        if len(self.steps) + self._low == self.bound:
            room = max(16, -self._low)  # between the last place and the lowest, which is one of the negative indices
            self.steps[self.bound : self.bound] = [step] * room
            self.codes[self.bound : self.bound] = [code] * room
            self._alive[self.bound : self.bound] = bytes(room)
        self._low -= 1
        self.steps[self._low], self.codes[self._low] = step, code
        return self._low

    def free_front(self) -> None:
        """Take back the lowest place."""
        place = self._low
        self.stop_reading(place)
        for literal in self.codes[place][1]:
            self.stop_making(literal, place)
        self._low += 1


def _take(all_places: list[Places], literal: int, place: int) -> None:
    """Take a place out of those of a literal."""
    places = all_places[literal]
    i = bisect_left(places, place)
    if isinstance(places, list):
        del places[i]
    else:
        all_places[literal] = places[:i] + places[i + 1 :]


def _put(all_places: list[Places], literal: int, place: int) -> None:
    """Put a place among those of a literal."""
    places = all_places[literal]
    if isinstance(places, list):
        insort(places, place)
    else:
        i = bisect_right(places, place)
        longer = (*places[:i], place, *places[i:])
        all_places[literal] = longer if len(longer) <= _SHORT else list(longer)
