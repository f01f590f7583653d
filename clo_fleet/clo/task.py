"""Facts, ground actions and what an action does to a state: the words everything else is said in.

A fact is a tuple of names, predicate first: ``("holding", "r1", "o2")``, written ``(holding r1 o2)``.
A state is the set of the facts that are true; a fact that is not in it is false (closed world).
"""

from collections.abc import Iterable, Set
from dataclasses import dataclass

from clo_fleet.errors import CloFleetError

__all__ = [
    "Action",
    "Condition",
    "Fact",
    "FactSyntaxError",
    "State",
    "apply",
    "fact_text",
    "holds",
    "parse_fact",
    "unmet",
]

Fact = tuple[str, ...]
State = Set[Fact]


class FactSyntaxError(CloFleetError):
    """A text that should be one fact, as ``(holding r1 o2)``, is not.

    Attributes:
        text: the text as given.
    """

    def __init__(self, text: str) -> None:
        super().__init__(f"expected one fact such as (holding r1 o2), got {text!r}")
        self.text = text


@dataclass(frozen=True, slots=True, order=True)
class Condition:
    """A literal that a step or the goal needs: ``fact`` is true, or (``positive=False``) false."""

    fact: Fact
    positive: bool = True

    def __str__(self) -> str:
        text = fact_text(self.fact)
        return text if self.positive else f"(not {text})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """A ground action. What it deletes and adds at once, it adds.

    Attributes:
        schema: the name of the action schema, such as ``move``.
        args: the objects that its parameters stand for.
        needs: its preconditions, positive and negative.
        adds: facts that it makes true.
        deletes: facts that it makes false.
        cost: its cost, a whole number (tenths of a second in the fleet).
    """

    schema: str
    args: tuple[str, ...]
    needs: tuple[Condition, ...]
    adds: frozenset[Fact]
    deletes: frozenset[Fact]
    cost: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "deletes", self.deletes - self.adds)

    @property
    def name(self) -> str:
        """The action as one writes it: ``move(r1, l3, l1)``."""
        return f"{self.schema}({', '.join(self.args)})"


def fact_text(fact: Fact) -> str:
    """The fact in PDDL's notation.

    >>> fact_text(("holding", "r1", "o2"))
    '(holding r1 o2)'
    """
    return f"({' '.join(fact)})"


def parse_fact(text: str) -> Fact:
    """The fact that ``text`` writes in PDDL's notation, lower-cased as PDDL reads it.

    >>> parse_fact("(holding R1 o2)")
    ('holding', 'r1', 'o2')

    Raises:
        FactSyntaxError: if it is not one parenthesised list of names.
    """
    inner = text.strip()
    if not (inner.startswith("(") and inner.endswith(")")):
        raise FactSyntaxError(text)
    names = tuple(inner[1:-1].lower().split())
    if not names or any(set(name) & set("(),;\"'") for name in names):
        raise FactSyntaxError(text)
    return names


def holds(condition: Condition, state: State) -> bool:
    """Whether the condition is met in the state."""
    return (condition.fact in state) is condition.positive


def unmet(action: Action, state: State) -> tuple[Condition, ...]:
    """The preconditions of ``action`` that the state does not meet, in their written order."""
    return tuple(c for c in action.needs if not holds(c, state))


def apply(state: Iterable[Fact], action: Action) -> frozenset[Fact]:
    """The state after the action."""
    return (frozenset(state) - action.deletes) | action.adds
