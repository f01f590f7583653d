"""Which ground actions can ever become applicable: what is found as if nothing were ever deleted.

Theory of operation
-------------------
A fact that is taken up is matched with every positive condition of every action, and the action's other positive
conditions, static ones as well, are joined to it, the one with the fewest matching facts first. What comes out are
bindings that were not possible before: the work is in proportion to the matches.

A bound action has its static conditions decided and falls apart into *variants*, one for each case of its disjunctions
and of its conditional effects. A variant is reached when its positive conditions are, and then adds facts in turn.
Deciding the static conditions first is what keeps the variants few.

The idea of grounding by reachability is that of Helmert 2009, "Concise finite-domain representations for PDDL planning
tasks", section 6; the actions found are the same.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product

from clo_fleet.clo.task import Action, Condition, Fact, fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.formulas import (
    MOST_CASES,
    TRUE,
    AllOf,
    Atom,
    Case,
    Formula,
    Literal,
    TooManyCasesError,
    bound,
    cases,
    merged,
    negated,
)
from clo_fleet.planning.lifted_task import LiftedAction, LiftedTask

__all__ = ["GroundingError", "Name", "Reachability", "conditions"]

MOST_BINDINGS = 3_000_000  # to be looked at, and variants to be made: some minutes, and some gigabytes

Name = tuple[str, tuple[str, ...]]
"""An action's name and its arguments."""


class GroundingError(CloFleetError):
    """A problem has no ground form that could be worked with.

    Attributes:
        place: the action at fault, as ``action move``, or ``the goal``.
    """

    def __init__(self, place: str, why: str) -> None:
        super().__init__(f"{place}: {why}")
        self.place = place


def conditions(case: Case) -> tuple[Condition, ...]:
    """The case as conditions, in order."""
    return tuple(sorted(Condition(fact, value) for fact, value in case.items()))


class _Facts:
    """Facts by predicate and by the values at any of their places. An index is made when it is first asked for."""

    def __init__(self) -> None:
        self._all: dict[str, list[Fact]] = {}
        self._indexes: dict[str, dict[tuple[int, ...], dict[tuple[str, ...], list[Fact]]]] = {}

    def add(self, fact: Fact) -> None:
        """Take the fact in."""
        self._all.setdefault(fact[0], []).append(fact)
        for places, index in self._indexes.get(fact[0], {}).items():
            index.setdefault(tuple([fact[place] for place in places]), []).append(fact)

    def matching(self, atom: Atom, args: tuple[str | None, ...]) -> list[Fact]:
        """The facts that agree with the atom where its terms are bound."""
        predicate = str(atom[0])
        places, values = [], []
        for place, term in enumerate(atom):
            value = args[term] if isinstance(term, int) else term
            if place and value is not None:
                places.append(place)
                values.append(value)
        if not places:
            return self._all.get(predicate, [])
        indexes = self._indexes.setdefault(predicate, {})
        at = tuple(places)
        if at not in indexes:
            index = indexes[at] = {}
            for fact in self._all.get(predicate, ()):
                index.setdefault(tuple([fact[place] for place in at]), []).append(fact)
        return indexes[at].get(tuple(values), [])


class _Schema:
    """A lifted action taken apart for joining."""

    def __init__(self, action: LiftedAction) -> None:
        self.action = action
        self.allowed = tuple(map(frozenset, action.parameters))
        self.atoms = tuple(dict.fromkeys(_certain(action.needs)))
        self.seen: set[tuple[str, ...]] = set()

    def unified(self, atom: Atom, fact: Fact, args: tuple[str | None, ...]) -> tuple[str | None, ...] | None:
        """The arguments when the atom stands for the fact, ``None`` if it cannot."""
        found = list(args)
        for term, value in zip(atom, fact, strict=True):
            if not isinstance(term, int):
                if term != value:
                    return None
            elif found[term] is None:
                if value not in self.allowed[term]:
                    return None
                found[term] = value
            elif found[term] != value:
                return None
        return tuple(found)


def _certain(formula: Formula) -> Iterator[Atom]:
    """Atoms that have to be true for the formula to hold, whatever its case."""
    match formula:
        case Literal(atom, True):
            yield atom
        case AllOf(parts):
            for part in parts:
                yield from _certain(part)


@dataclass(slots=True)
class _Waiting:
    """A variant, and how many of its positive conditions have not been taken up."""

    action: Action
    missing: int


class Reachability:
    """Delete relaxation over a lifted problem. See the module's docstring.

    Args:
        lifted: the problem.
        static: the predicates that no action changes.
    """

    def __init__(self, lifted: LiftedTask, static: frozenset[str]) -> None:
        self._lifted = lifted
        self._static = static
        self._facts = _Facts()
        self._taken: set[Fact] = set()
        self._reached = {fact for fact in lifted.facts if fact[0] not in static}
        self._queue = deque(sorted(self._reached))
        self._waiting: dict[Fact, list[_Waiting]] = {}
        self._variants: dict[Name, list[Action]] = {}
        self._counted = 0
        self._schemas = [_Schema(action) for action in lifted.actions]
        for fact in sorted(lifted.facts - self._reached):
            self._facts.add(fact)

    def variants(self) -> dict[Name, list[Action]]:
        """The reachable variants of each bound action, by its name and arguments.

        Raises:
            GroundingError: if there are too many, or an action has too many cases, or its cost no value.
        """
        triggers: dict[str, list[tuple[_Schema, int]]] = {}
        for schema in self._schemas:
            places = [place for place, atom in enumerate(schema.atoms) if atom[0] not in self._static]
            for place in places:
                triggers.setdefault(str(schema.atoms[place][0]), []).append((schema, place))
            if not places:
                self._bind(schema, schema.atoms, (None,) * len(schema.allowed))
        while self._queue:
            fact = self._queue.popleft()
            self._facts.add(fact)
            self._taken.add(fact)
            for waiting in self._waiting.pop(fact, ()):
                waiting.missing -= 1
                if not waiting.missing:
                    self._reach(waiting.action)
            for schema, place in triggers.get(fact[0], ()):
                args = schema.unified(schema.atoms[place], fact, (None,) * len(schema.allowed))
                if args is not None:
                    self._bind(schema, schema.atoms[:place] + schema.atoms[place + 1 :], args)
        return self._variants

    def _bind(self, schema: _Schema, atoms: tuple[Atom, ...], args: tuple[str | None, ...]) -> None:
        """Take up every binding that makes the atoms facts already taken up."""
        for binding in self._bindings(schema, atoms, args):
            if binding not in schema.seen:
                schema.seen.add(binding)
                self._count(schema.action)
                for action in self._bound(schema.action, binding):
                    self._count(schema.action)
                    self._await(action)

    def _bindings(
        self, schema: _Schema, atoms: tuple[Atom, ...], args: tuple[str | None, ...]
    ) -> Iterable[tuple[str, ...]]:
        if not atoms:
            yield from product(
                *((arg,) if arg is not None else of for arg, of in zip(args, schema.action.parameters, strict=True))
            )
            return
        found = [self._facts.matching(atom, args) for atom in atoms]
        best = min(range(len(atoms)), key=lambda place: len(found[place]))
        rest = atoms[:best] + atoms[best + 1 :]
        for fact in found[best]:
            extended = schema.unified(atoms[best], fact, args)
            if extended is not None:
                yield from self._bindings(schema, rest, extended)

    def _bound(self, lifted: LiftedAction, args: tuple[str, ...]) -> Iterator[Action]:
        """The action for these objects: one variant for each case."""
        try:
            yield from self._split(lifted, args)
        except TooManyCasesError as error:
            raise GroundingError(f"action {lifted.name}", str(error)) from error

    def _split(self, lifted: LiftedAction, args: tuple[str, ...]) -> Iterator[Action]:
        found = self._cases(lifted.needs, args)
        if not found:
            return
        always: list[tuple[Fact, bool]] = []
        sometimes: dict[Formula, list[tuple[Fact, bool]]] = {}
        for change in lifted.changes:
            effect = (bound(change.atom, args), change.value)
            (sometimes.setdefault(change.when, []) if change.when != TRUE else always).append(effect)
        branches = [(case, always) for case in found]
        for when, effects in sometimes.items():
            holds, fails = self._cases(when, args), self._cases(negated(when), args)
            branches = [
                (both, done + more)
                for case, done in branches
                for more, other in ((effects, holds), ([], fails))
                for both in merged((case,), other)
            ]
            if len(branches) > MOST_CASES:
                raise TooManyCasesError(MOST_CASES)
        cost = lifted.cost if isinstance(lifted.cost, int) else self._cost(lifted, bound(lifted.cost, args))
        for case, effects in branches:
            adds = frozenset(fact for fact, value in effects if value)
            deletes = frozenset(fact for fact, value in effects if not value)
            if adds or deletes:
                yield Action(
                    schema=lifted.name, args=args, needs=conditions(case), adds=adds, deletes=deletes, cost=cost
                )

    def _cases(self, formula: Formula, args: tuple[str, ...]) -> tuple[Case, ...]:
        return cases(formula, args, self._static, self._lifted.facts)

    def _cost(self, lifted: LiftedAction, term: Fact) -> int:
        if term not in self._lifted.costs:
            raise GroundingError(f"action {lifted.name}", f"the cost {fact_text(term)} has no value")
        return self._lifted.costs[term]

    def _count(self, action: LiftedAction) -> None:
        self._counted += 1
        if self._counted > MOST_BINDINGS:
            raise GroundingError(f"action {action.name}", f"more than {MOST_BINDINGS:,} bindings to be looked at")

    def _await(self, action: Action) -> None:
        missing = {need.fact for need in action.needs if need.positive and need.fact not in self._taken}
        if not missing:
            self._reach(action)
        waiting = _Waiting(action, len(missing))
        for fact in missing:
            self._waiting.setdefault(fact, []).append(waiting)

    def _reach(self, action: Action) -> None:
        """The variant can become applicable: so can its facts become true."""
        self._variants.setdefault((action.schema, action.args), []).append(action)
        new = action.adds - self._reached
        self._reached |= new
        self._queue.extend(sorted(new))
