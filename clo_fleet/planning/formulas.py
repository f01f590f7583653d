"""Conditions with parameters, connectives and all, and the cases in which they hold once the parameters are bound.

A formula is in negation normal form: signs stand at its leaves. Quantifiers are gone; there are finitely many objects.
"""

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass

from clo_fleet.clo.task import Fact
from clo_fleet.errors import CloFleetError

__all__ = [
    "FALSE",
    "MOST_CASES",
    "TRUE",
    "AllOf",
    "AnyOf",
    "Atom",
    "Case",
    "Formula",
    "Literal",
    "Same",
    "Term",
    "TooManyCasesError",
    "bound",
    "cases",
    "merged",
    "negated",
]

MOST_CASES = 4096  # of one condition; beyond, a search over them would be hopeless anyway

Term = str | int
"""An object's name, or a parameter by its place."""
Atom = tuple[Term, ...]
Case = Mapping[Fact, bool]
"""Facts that are all to have the values given."""


class TooManyCasesError(CloFleetError):
    """A condition has more cases than can be told apart as actions of their own.

    Attributes:
        limit: how many are allowed.
    """

    def __init__(self, limit: int) -> None:
        super().__init__(f"its conditions have more than {limit} cases")
        self.limit = limit


@dataclass(frozen=True, slots=True)
class Literal:
    """The atom is true, or (``positive=False``) false."""

    atom: Atom
    positive: bool = True


@dataclass(frozen=True, slots=True)
class Same:
    """Both terms stand for one object, or (``positive=False``) they do not."""

    left: Term
    right: Term
    positive: bool = True


@dataclass(frozen=True, slots=True)
class AllOf:
    """Every part holds."""

    parts: tuple["Formula", ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """At least one part holds."""

    parts: tuple["Formula", ...]


Formula = Literal | Same | AllOf | AnyOf
TRUE = AllOf(())
FALSE = AnyOf(())


def negated(formula: Formula) -> Formula:
    """The formula that holds where the given one does not.

    >>> negated(AllOf((Literal(("at", 0)), Same(0, "b"))))
    AnyOf(parts=(Literal(atom=('at', 0), positive=False), Same(left=0, right='b', positive=False)))
    """
    match formula:
        case Literal(atom, positive):
            return Literal(atom, not positive)
        case Same(left, right, positive):
            return Same(left, right, not positive)
        case AllOf(parts):
            return AnyOf(tuple(map(negated, parts)))
        case AnyOf(parts):
            return AllOf(tuple(map(negated, parts)))


def bound(atom: Atom, args: tuple[str, ...]) -> Fact:
    """The atom with objects for its parameters.

    >>> bound(("at", 1, "hub"), ("r1", "l3"))
    ('at', 'l3', 'hub')
    """
    return tuple([args[term] if isinstance(term, int) else term for term in atom])


def cases(formula: Formula, args: tuple[str, ...], static: Set[str], facts: Set[Fact]) -> tuple[Case, ...]:
    """The cases in which the formula holds: none if it never does, one that asks for nothing if it always does.

    What the ``static`` predicates say is decided by ``facts``.

    Raises:
        TooManyCasesError: if they are more than ``MOST_CASES``.
    """
    match formula:
        case Literal(atom, positive):
            fact = bound(atom, args)
            if fact[0] not in static:
                return ({fact: positive},)
            return ({},) if (fact in facts) is positive else ()
        case Same(left, right, positive):
            terms = bound((left, right), args)
            return ({},) if (terms[0] == terms[1]) is positive else ()
        case AllOf(parts):
            found: tuple[Case, ...] = ({},)
            for part in parts:
                found = merged(found, cases(part, args, static, facts))
            return found
        case AnyOf(parts):
            every = [case for part in parts for case in cases(part, args, static, facts)]
            return ({},) if {} in every else _distinct(every)


def merged(left: Iterable[Case], right: Iterable[Case]) -> tuple[Case, ...]:
    """The cases in which one of ``left`` and one of ``right`` holds.

    >>> rain, dry = {("rain",): True}, {("rain",): False}
    >>> merged([rain], [dry]), merged([rain], [{("wind",): False}])
    ((), ({('rain',): True, ('wind',): False},))

    Raises:
        TooManyCasesError: if they are more than ``MOST_CASES``.
    """
    right = tuple(right)
    if right == ({},):
        return tuple(left)
    found: list[Case] = []
    for one in left:
        found += (
            {**one, **other} for other in right if all(one.get(fact, value) is value for fact, value in other.items())
        )
        if len(found) > MOST_CASES:
            raise TooManyCasesError(MOST_CASES)
    return _distinct(found)


def _distinct(found: list[Case]) -> tuple[Case, ...]:
    if len(found) > MOST_CASES:
        raise TooManyCasesError(MOST_CASES)
    return tuple({frozenset(case.items()): case for case in found}.values()) if len(found) > 1 else tuple(found)
