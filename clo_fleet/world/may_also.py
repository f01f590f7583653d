"""What an action may bring about beyond its effects, as a world's binding says it: its facts, and whether they fit.

A rule is a pattern such as ``(answered ?p ?other)``. The action's parameters stand in it for what they stand for in the
action; any other variable for everything of its type, or for what makes the rule's ``where`` facts that are given.
"""

from collections.abc import Iterator, Mapping
from itertools import product

from clo_fleet.clo.task import Action, Fact
from clo_fleet.world.binding import DomainBinding, MayAlso, SensorKind
from clo_fleet.world.fact_checks import Known, fact_findings
from clo_fleet.world.faults import Finding, KeyPath
from clo_fleet.world.schemas import Atom, bind
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["may_also_facts", "may_also_findings"]

Values = Mapping[str, str]  # what variables stand for


def may_also_facts(rule: MayAlso, action: Action, words: Vocabulary) -> tuple[Fact, ...]:
    """The facts that the rule is about when this action is done, sorted."""
    types = dict(words.domain.predicates)[rule.fact[0]]
    things = {term: words.admitted(type_) for term, type_ in zip(rule.fact[1:], types, strict=True)}
    found: set[Fact] = set()
    for known in _matches(rule.where, words.values(action), words):
        free = {term: sorted(names) for term, names in things.items() if _is_variable(term) and term not in known}
        for names in product(*free.values()):
            values = {**known, **dict(zip(free, names, strict=True))}
            if all(values.get(term, term) in names for term, names in things.items()):
                found.add(bind(rule.fact, values))
    return tuple(sorted(found))


def may_also_findings(binding: DomainBinding, words: Vocabulary, known: Known) -> Iterator[Finding]:
    """What is wrong with the rules of a binding that fits otherwise."""
    parameters = {schema.name: dict(schema.parameters) for schema in binding.domain.schemas}
    for name, skill in binding.skills:
        for index, rule in enumerate(skill.may_also):
            key: KeyPath = ("domain", "skills", name, "may_also", index)
            own = parameters[name]
            if rule.by not in own:
                listed = ", ".join(variable.removeprefix("?") for variable in own)
                yield Finding((*key, "by"), f"one of the action's parameters in the PDDL file ({listed})")
            yield from _pattern_findings((*key, "fact"), rule.fact, SensorKind.EFFECTS, own, words, known)
            for number, atom in enumerate(rule.where):
                yield from _pattern_findings((*key, "where", number), atom, SensorKind.GIVEN, own, words, known)


def _pattern_findings(
    key: KeyPath, atom: Atom, kind: SensorKind, own: Values, words: Vocabulary, known: Known
) -> Iterator[Finding]:
    """Whether the atom is one of a predicate with this sensor. ``own``: the types of the action's parameters."""
    faulty = tuple(fact_findings(key, atom, known, (kind,), lifted=True))
    yield from faulty
    types = dict(words.domain.predicates).get(atom[0], ())
    for term, type_ in () if faulty else zip(atom[1:], types, strict=True):
        if term in own and words.admitted(own[term]).isdisjoint(words.admitted(type_)):
            yield Finding(key, f"for {term} a parameter that stands for something of type {type_}, not {own[term]}")


def _matches(where: tuple[Atom, ...], values: Values, words: Vocabulary) -> Iterator[Values]:
    """Every way to make these atoms facts that are given."""
    if not where:
        yield values
        return
    (predicate, *terms), *others = where
    for fact in words.given:
        if fact[0] == predicate:
            known = dict(values)
            pairs = zip(terms, fact[1:], strict=True)
            if all((known.setdefault(term, name) if _is_variable(term) else term) == name for term, name in pairs):
                yield from _matches(tuple(others), known, words)


def _is_variable(term: str) -> bool:
    return term.startswith("?")
