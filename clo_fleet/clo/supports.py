"""The supports of a plan, kept up to date while facts flip and steps leave.

Theory of operation
-------------------
``causal_links`` says from scratch what supports each condition of a plan. ``Supports`` gives the same answer after
every change, at a cost that follows the change and not the length of the plan.

- Facts are numbers (``literals``), steps lie at places (``timeline``). For each literal the places of its *makers* and
  of its *readers* are sorted. The makers of the opposite literal are its *threats*: positive and negative conditions
  are one case. A step reads before it makes.
- The support of a reader follows by bisection: the last threat before it, then the first maker after that threat; with
  no such threat, the present if the literal holds now. With neither, the reader has a *gap*.
- So between two threats all readers behind the first maker have that maker as their support. A flip, or a step that
  leaves, moves whole ranges of readers from one support to another, and only *counts* are kept: ``uses[place]`` is the
  number of conditions that a step supports. The size of a range is the difference of two bisections.
- A step that has been done leaves without any change to the counts of others: what it made, the present gives now. The
  same read backwards puts a step in front.
- A step whose count falls to zero supports nothing. Producers stand before their consumers, so that counts suffice to
  find all that became needless with it. What has no use leaves no gap.
- A step that lost a use, or that ends what would hold without it, is a *suspect*: loops are looked for at suspects.
- All changes are entered in a journal while there is a mark, and can be taken back to it.

Each change leaves ``uses`` and the gaps as a new ``Supports`` of the plan that is left would have them.
"""

from bisect import bisect_right
from collections.abc import Iterable, Sequence

from clo_fleet.clo.journal import Journal, Mark
from clo_fleet.clo.links import Consumer, Guard, Link, Links, Unsupported
from clo_fleet.clo.literals import Code
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.task import Condition, Fact, State
from clo_fleet.clo.timeline import END, GAP, NoStepError, Timeline

__all__ = ["Supports"]

_USES, _NOW, _GAP, _OUT, _IN = range(5)  # what an entry of the journal takes back


class Supports:
    """A plan in a state, and how many conditions each step supports.

    To build it costs time and memory linear in the conditions and effects of the plan.

    Args:
        state: the facts that hold now.
        plan: the steps still to be done.
        goals: what must hold in the end.
        unknown: facts of which it is not known whether they hold: neither they nor their opposites support anything.

    Attributes:
        timeline: the steps, who makes and who reads what; for reading only.
        uses: the number of conditions that the step at each place supports; for reading only.

    >>> from clo_fleet.clo.plan import number
    >>> from clo_fleet.clo.task import Action
    >>> here, there = ("at-robot", "l1"), ("at-robot", "l2")
    >>> move = Action(schema="move", args=("l1", "l2"), needs=(Condition(here),),
    ...               adds=frozenset({there}), deletes=frozenset({here}))
    >>> supports = Supports({here}, number([move]), [Condition(there)])
    >>> supports.uses
    [1]
    >>> supports.flip(there, True), supports.take_needless(), supports.plan
    (True, [0], ())
    """

    __slots__ = ("_gaps", "_idle", "_journal", "_suspects", "timeline", "uses")

    def __init__(
        self, state: State, plan: Iterable[Step], goals: Iterable[Condition], unknown: frozenset[Fact] = frozenset()
    ) -> None:
        self.timeline = Timeline(state, plan, goals, unknown)
        self.uses, incomplete = self.timeline.lay_out()
        self._gaps = self.timeline.gaps() if incomplete else set()  # reader, literal
        self._idle = [place for place, count in enumerate(self.uses) if not count]
        self._suspects: list[int] = []
        self._journal = Journal()

    # ---- what there is --------------------------------------------------------------------------------------

    def __len__(self) -> int:
        """The number of steps left."""
        return len(self.timeline)

    @property
    def plan(self) -> Plan:
        """The steps left. Linear."""
        return self.timeline.plan

    @property
    def goals(self) -> tuple[Condition, ...]:
        """What must hold in the end."""
        return self.timeline.goals

    @property
    def state(self) -> frozenset[Fact]:
        """The facts that hold now. Linear in them and in the facts of the plan."""
        return self.timeline.state()

    @property
    def watched(self) -> frozenset[Fact]:
        """The facts of all links and guards: those worth looking at. Linear in the facts of the plan."""
        return frozenset(fact for fact in self.timeline.literals.facts if self.watches(fact))

    def watches(self, fact: Fact) -> bool:
        """Whether there is a link or guard on the fact or its opposite. O(1), but for gaps."""
        literal = self.timeline.number(fact)
        readers, gaps = self.timeline.readers, self._gaps
        return any((reader, lit) not in gaps for lit in (literal, literal + 1) for reader in readers[lit])

    def is_whole(self) -> bool:
        """Whether nothing lacks a support: the plan runs through to its goals. O(1)."""
        return not self._gaps

    def has_needless(self) -> bool:
        """Whether a step that is left supports nothing. O(1) after ``take_needless``."""
        return any(not self.uses[place] and self.timeline.is_left(place) for place in self._idle)

    def lacks(self, place: int, literal: int) -> bool:
        """Whether nothing supports the literal, which is needed at the place. O(1)."""
        return (place, literal) in self._gaps

    def lacking(self) -> list[int]:
        """The places where something is missing, in order. O(k log k)."""
        return sorted({place for place, _ in self._gaps})

    def gaps(self) -> tuple[Unsupported, ...]:
        """The conditions that nothing supports, in the plan's order. O(k log k)."""
        return tuple(
            Unsupported(condition, self.timeline.consumer(place))
            for place in self.lacking()
            for condition, literal in self.timeline.conditions(place)
            if (place, literal) in self._gaps
        )

    def support_of(self, condition: Condition, consumer: Consumer) -> Link | Guard | Unsupported:
        """What supports a condition at a consumer in the plan, whether it has that condition or not. O(log n)."""
        return self.timeline.support_of(condition, consumer)

    def links(self) -> Links:
        """What ``causal_links`` says of the plan that is left. Linear in its conditions and effects."""
        return self.timeline.links()

    # ---- changes --------------------------------------------------------------------------------------------

    def flip(self, fact: Fact, value: bool | None) -> bool:
        """Take the fact to be true, false or (``None``) unknown from now on; whether that is new.

        O(log n), and O(1) for each condition that the flip leaves without support, or gives one again.
        """
        literal = self.timeline.number(fact)
        is_new = self._set(literal, value is True)
        return self._set(literal + 1, value is False) or is_new

    def take_needless(self) -> list[int]:
        """Remove all steps that support neither a goal nor a step that does, until there are none; their places.

        In rounds: links move as steps leave, which may make more steps needless. O(log n) for each step removed.
        """
        gone: list[int] = []
        while self._idle:
            together: set[int] = set()
            while self._idle:
                place = self._idle.pop()
                if self.uses[place]:  # it has found another use
                    self._suspects.append(place)
                elif place not in together and self.timeline.is_left(place):
                    together.add(place)
                    self._release(place)
            gone += self._take_out(together)
        return gone

    def remove(self, places: Iterable[int]) -> None:
        """Remove the steps at these places, needed or not. O(log n) for each, and O(1) for each gap that it leaves.

        Raises:
            NoStepError: if one is not in the plan any more.
        """
        places = set(places)
        for place in places:
            if not self.timeline.is_left(place):
                raise NoStepError(self.timeline.steps[place].id)
        for place in places:
            self._release(place)
        self._take_out(places)

    def advance(self) -> Step:
        """Take out the first step: it has been done, and its effects hold now. O(log n).

        Raises:
            NoStepError: if no step is left.
        """
        timeline = self.timeline
        place = timeline.first()
        needs, makes = timeline.codes[place]
        for literal in needs:
            self._end_gaps(literal, (place,))
        timeline.stop_reading(place)
        self._journal.note(_OUT, place, 0)
        for literal in makes:
            timeline.stop_making(literal, place)
            self._hold(literal, True)
            self._hold(literal ^ 1, False)
        return timeline.steps[place]

    def prepend(self, steps: Sequence[Step]) -> None:
        """Put steps before the first. O(log n) for each, and O(1) for each gap that they end or leave."""
        codes = [self.timeline.literals.code(step.action) for step in steps]
        self.timeline.grow()
        now = self.timeline.now
        found: list[list[tuple[int, bool]]] = []  # for each step, what the present is for it of what it changes
        for _, makes in codes:
            found.append([(literal, now[literal]) for made in makes for literal in (made, made ^ 1)])
            for literal in makes:
                self._set(literal, True)
                self._set(literal ^ 1, False)
        for i in reversed(range(len(steps))):
            self._put_first(steps[i], codes[i], found[i])

    def suspects(self) -> list[int]:
        """The places of the steps left that became suspects since this was last asked, in order. O(k log k)."""
        suspects, self._suspects = self._suspects, []
        return sorted(filter(self.timeline.is_left, set(suspects)))

    def mark(self) -> Mark:
        """A mark to which ``undo`` can go back. Marks nest."""
        return self._journal.mark(self._idle, self._suspects)

    def undo(self, mark: Mark) -> None:
        """Take back all that was changed since the mark was set, and the mark. As costly as the changes were.

        Raises:
            MarkError: if the mark, or one set before it, was used already.
        """
        for kind, where, what in self._journal.since(mark):
            if kind == _USES:
                self.uses[where] -= what
            elif kind == _NOW:
                self.timeline.now[where] = bool(what)
            elif kind == _GAP:
                self._gaps ^= {(where, what)}
            elif kind == _OUT:
                self.timeline.put_back(where)
            else:
                self.timeline.free_front()
        self._idle, self._suspects = map(list, mark.kept)

    def keep(self, mark: Mark) -> None:
        """Forget the mark: what was changed since stays, unless an earlier mark is gone back to. Raises as ``undo``."""
        self._journal.keep(mark)

    # ---- how --------------------------------------------------------------------------------------------------

    def _set(self, literal: int, holds: bool) -> bool:
        """Let the literal hold now, or not; whether that is new. Its readers before its first threat are moved."""
        timeline = self.timeline
        if timeline.now[literal] is holds:
            return False
        self._hold(literal, holds)
        readers = timeline.readers[literal]
        if not readers:
            return True
        threats, makers = timeline.makers[literal ^ 1], timeline.makers[literal]
        end = threats[0] if threats else END
        maker = makers[0] if makers else END
        unmade = bisect_right(readers, min(maker, end))
        if maker < end:
            count = bisect_right(readers, end) - unmade
            self._use(maker, -count if holds else count)
        elif holds and threats:
            self._suspects.append(end)
        (self._end_gaps if holds else self._begin_gaps)(literal, readers[:unmade])
        return True

    def _release(self, place: int) -> None:
        """Let the step at the place give up its needs."""
        support = self.timeline.support
        for literal in self.timeline.codes[place][0]:
            producer = support(literal, place)
            if producer < END:
                self._use(producer, -1)
            elif producer == GAP:
                self._end_gaps(literal, (place,))

    def _take_out(self, places: Iterable[int]) -> list[int]:
        """Remove steps that have given up their needs; their places in order.

        The first go first: so no reader is moved to the support of a step that goes as well.
        """
        timeline = self.timeline
        ordered = sorted(places)
        for place in ordered:
            timeline.stop_reading(place)
            self._journal.note(_OUT, place, 0)
        for place in ordered:
            for literal in timeline.codes[place][1]:
                timeline.stop_making(literal, place)
                self._unmade(literal, place)
        return ordered

    def _unmade(self, literal: int, place: int) -> None:
        """Move readers after a place where the literal was made is no place of that any more."""
        timeline = self.timeline
        served, threatened = timeline.readers[literal], timeline.readers[literal ^ 1]
        is_served = len(served) > 0 and served[-1] > place
        is_threatened = len(threatened) > 0 and threatened[-1] > place
        if not is_served and not is_threatened:
            return
        makers, threats = timeline.makers[literal], timeline.makers[literal ^ 1]
        i, j = bisect_right(makers, place), bisect_right(threats, place)
        maker = makers[i] if i < len(makers) else END
        threat = threats[j] if j < len(threats) else END
        if is_served:
            has_other = i > 0 and makers[i - 1] > threats[j - 1] if j else i > 0 or timeline.now[literal]
            if not has_other:
                self._give(literal, place, maker, threat)
        if is_threatened:
            self._rejoin(literal ^ 1, place, makers[i - 1] if i else None, threat, maker)

    def _give(self, literal: int, place: int, maker: int, end: int) -> None:
        """Move the readers of a literal from its maker, which went, to the next; ``end``: the threat after it."""
        readers = self.timeline.readers[literal]
        unmade = bisect_right(readers, min(maker, end))
        self._begin_gaps(literal, readers[bisect_right(readers, place) : unmade])
        if maker < end:
            self._use(maker, bisect_right(readers, end) - unmade)

    def _rejoin(self, literal: int, place: int, threat: int | None, maker: int, end: int) -> None:
        """Move the readers of a literal behind a threat, which went, to the support that it ended, if there was one.

        ``threat``: the one before it. ``maker``: who makes the literal next. ``end``: the threat after it.
        """
        readers = self.timeline.readers[literal]
        support = self.timeline.support(literal, place)  # of a reader there
        if support == GAP:
            if threat is not None:
                self._suspects.append(threat)
            return
        first, last = bisect_right(readers, place), bisect_right(readers, end)
        unmade = bisect_right(readers, min(maker, end))
        self._end_gaps(literal, readers[first:unmade])
        if maker < end:
            self._use(maker, unmade - last)
        elif end < END:
            self._suspects.append(end)
        if support < END:
            self._use(support, last - first)

    def _put_first(self, step: Step, code: Code, found: list[tuple[int, bool]]) -> None:
        """Put a step before all others.

        What holds now is what it leads to, and becomes what it finds: so nothing changes for the steps behind it.
        """
        timeline = self.timeline
        place = timeline.place_in_front(step, code)
        bound = timeline.bound
        self.uses[bound:bound] = [0] * (len(timeline.steps) - len(self.uses))
        for literal, holds in found:
            self._hold(literal, holds)
        needs, makes = code
        for literal in needs:
            if not timeline.now[literal]:
                self._begin_gaps(literal, (place,))
        self.uses[place] = 0
        for literal in makes:
            if not timeline.now[literal]:
                threats = timeline.makers[literal ^ 1]
                self.uses[place] += bisect_right(timeline.readers[literal], threats[0] if threats else END)
        if not self.uses[place]:
            self._idle.append(place)
        timeline.put_back(place)
        self._journal.note(_IN, place, 0)

    # ---- the smallest changes, as the journal has them -------------------------------------------------------

    def _hold(self, literal: int, holds: bool) -> None:
        self._journal.note(_NOW, literal, self.timeline.now[literal])
        self.timeline.now[literal] = holds

    def _use(self, place: int, change: int) -> None:
        if change:
            self.uses[place] += change
            self._journal.note(_USES, place, change)
            if change < 0:
                (self._suspects if self.uses[place] else self._idle).append(place)

    def _begin_gaps(self, literal: int, readers: Iterable[int]) -> None:
        for reader in readers:
            if (reader, literal) not in self._gaps:
                self._gaps.add((reader, literal))
                self._journal.note(_GAP, reader, literal)

    def _end_gaps(self, literal: int, readers: Iterable[int]) -> None:
        for reader in readers if self._gaps else ():
            if (reader, literal) in self._gaps:
                self._gaps.remove((reader, literal))
                self._journal.note(_GAP, reader, literal)
