"""A planning problem with variables, as plain values: what grounding starts from."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from clo_fleet.clo.task import Fact
from clo_fleet.planning.formulas import Atom, Formula

__all__ = ["Change", "LiftedAction", "LiftedTask"]


@dataclass(frozen=True, slots=True)
class Change:
    """An effect: the atom becomes true, or false (``value``), if ``when`` holds before the action."""

    atom: Atom
    value: bool
    when: Formula


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftedAction:
    """An action with parameters.

    Attributes:
        parameters: for each parameter the objects that it may stand for.
        cost: a whole number, or a cost term.
    """

    name: str
    parameters: tuple[tuple[str, ...], ...]
    needs: Formula
    changes: tuple[Change, ...]
    cost: int | Atom = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftedTask:
    """A problem with variables.

    Attributes:
        predicates: all there are.
        facts: what is true at the start, static facts included.
        goal: a formula without parameters.
        costs: the values of the cost terms.
    """

    name: str
    predicates: frozenset[str]
    facts: frozenset[Fact]
    goal: Formula
    actions: tuple[LiftedAction, ...]
    costs: Mapping[Fact, int] = field(default_factory=dict)
