"""What changes by itself, as somebody writes it down: facts in PDDL's notation that turn true or false."""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from clo_fleet.clo.task import Condition, Fact, fact_text, parse_fact
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.world.faults import did_you_mean

__all__ = ["Surprise", "SurpriseError", "facts_of", "listed", "predicates", "read_surprise"]

MOST_LISTED = 12  # names in a message
_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")


class SurpriseError(CloFleetError):
    """A fact cannot turn true or false.

    Attributes:
        fact: as given.
    """

    def __init__(self, fact: Fact, why: str) -> None:
        super().__init__(f"{fact_text(fact)}: {why}")
        self.fact = fact


@dataclass(frozen=True, slots=True)
class Surprise:
    """Facts that turn true or false at once, seen in one observation."""

    true: frozenset[Fact] = frozenset()
    false: frozenset[Fact] = frozenset()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """What holds afterwards, the true facts first."""
        return (
            *(Condition(fact) for fact in sorted(self.true)),
            *(Condition(fact, positive=False) for fact in sorted(self.false)),
        )


def read_surprise(
    true: Iterable[str], false: Iterable[str], task: GroundTask, declared: Collection[str] = ()
) -> Surprise:
    """What the texts say, in the task's own spelling.

    Args:
        true: facts, such as ``(holding o2)``.
        false: the same.
        task: what they are about.
        declared: the names of all predicates, static ones as well.

    Raises:
        FactSyntaxError: if a text is no fact.
        SurpriseError: if a name is unknown, the fact static, or it is to turn true and false at once.
    """
    known = {_lower(fact): fact for fact in facts_of(task)}
    names = sorted({name for fact in known.values() for name in fact[1:]} | {n for a in task.actions for n in a.args})
    spelling = {name.lower(): name for name in names}
    turned_true, turned_false = (
        frozenset(_known(parse_fact(text), known, spelling, declared) for text in texts) for texts in (true, false)
    )
    for fact in sorted(turned_true & turned_false):
        raise SurpriseError(fact, "is to turn both true and false, expected one of them")
    return Surprise(turned_true, turned_false)


def predicates(domain: Path) -> frozenset[str]:
    """The names of the predicates that a PDDL domain declares, in lower case."""
    text = domain.read_text(encoding="utf-8-sig", errors="replace").lower()
    depth, begun, found = 0, 0, set()
    words = [word for word in _TOKEN.findall(text) if not word.startswith(";")]
    for before, word in zip(["", *words], words, strict=False):
        depth += (word == "(") - (word == ")")
        if word == ":predicates":
            begun = depth
        elif depth < begun:
            break
        elif begun and before == "(" and depth == begun + 1:
            found.add(word)
    return frozenset(found)


def facts_of(task: GroundTask) -> set[Fact]:
    """Every fact that the task is about."""
    facts = {*task.state, *(goal.fact for goal in task.goals)}
    for action in task.actions:
        facts.update(action.adds, action.deletes, (need.fact for need in action.needs))
    return facts


def listed(name: str, known: Collection[str]) -> str:
    """The names that could stand in the place of ``name``.

    >>> listed("mvoe", {"prepare", "move"})
    'one of move, prepare; did you mean move?'
    """
    more = f" and {len(known) - MOST_LISTED} more" if len(known) > MOST_LISTED else ""
    return f"one of {', '.join(sorted(known)[:MOST_LISTED])}{more}{did_you_mean(name, known)}"


def _known(fact: Fact, known: Mapping[Fact, Fact], spelling: Mapping[str, str], declared: Collection[str]) -> Fact:
    """The fact as the task spells it."""
    if fact in known:
        return known[fact]
    alike = [other for other in known if other[0] == fact[0]]
    if not alike and fact[0] in declared:
        raise SurpriseError(fact, f"{fact[0]} is static: no action of this problem changes it, so no plan waits for it")
    if not alike:
        raise SurpriseError(
            fact, f"unknown predicate {fact[0]}; expected {listed(fact[0], {other[0] for other in known})}"
        )
    lengths = sorted({len(other) - 1 for other in alike})
    if len(fact) - 1 not in lengths:
        raise SurpriseError(
            fact, f"expected {' or '.join(map(str, lengths))} names after {fact[0]}, got {len(fact) - 1}"
        )
    for name in fact[1:]:
        if name not in spelling:
            raise SurpriseError(fact, f"unknown object {name}; expected {listed(name, spelling.keys())}")
    return (known[alike[0]][0], *(spelling[name] for name in fact[1:]))


def _lower(fact: Fact) -> Fact:
    return tuple(name.lower() for name in fact)
