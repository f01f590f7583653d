"""Reads PDDL domains and problems: STRIPS with types, negative preconditions, equality and action costs.

The executive needs schemas at once and in its own process, where importing unified-planning would cost seconds; the
same values are handed to unified-planning in the planner's process. So this is the only reading.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.resources import files

from clo_fleet.clo.task import Condition, fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.problem import PlanningTask, check
from clo_fleet.planning.schemas import EQUALS, OBJECT, Atom, Domain, Schema, Signatures, Typed

__all__ = ["PddlError", "fleet_domain", "read_domain", "read_problem"]

FLEET_EXOGENOUS = frozenset({"meets"})  # other robots announce new plans
_TOTAL_COST = "total-cost"
_NUMERIC_TYPE = "number"
_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")


class PddlError(CloFleetError):
    """A PDDL text cannot be used.

    Attributes:
        faults: what is wrong, each with its place in the text.
    """

    def __init__(self, faults: Iterable[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("unusable PDDL:\n" + "\n".join(f"  {fault}" for fault in self.faults))


@dataclass(frozen=True, slots=True)
class _Form:
    """A word, or (``word`` empty) a parenthesised list, with the line it starts in."""

    line: int
    word: str = ""
    items: tuple["_Form", ...] = ()

    @property
    def head(self) -> str:
        """The first word of a list."""
        return self.items[0].word if self.items else ""


def fleet_domain() -> Domain:
    """The domain of the fleet, ``domain.pddl``."""
    text = (files("clo_fleet.planning") / "domain.pddl").read_text(encoding="utf-8")
    return read_domain(text, exogenous=FLEET_EXOGENOUS)


def read_domain(text: str, exogenous: Iterable[str] = ()) -> Domain:
    """The domain that ``text`` defines; ``exogenous`` predicates count as changing although no action changes them.

    Raises:
        PddlError: if it is not a PDDL domain, or uses what is not supported.
    """
    form = _parse(text, "domain")
    sections = _sections(form, {":requirements", ":types", ":constants", ":predicates", ":functions", ":action"})
    functions = _signatures(f for f in _rest(sections, ":functions") if f.items)
    domain = Domain(
        name=_word(form.items[1].items[-1]),
        types=tuple(pair for pair in _typed(_rest(sections, ":types")) if pair[0] != OBJECT),
        constants=_typed(_rest(sections, ":constants")),
        predicates=_signatures(_rest(sections, ":predicates")),
        functions=tuple(f for f in functions if f[0] != _TOTAL_COST),
        schemas=tuple(_schema(f, functions != ()) for f in form.items[2:] if f.head == ":action"),
        exogenous=frozenset(exogenous),
        text=text,
    )
    faults = tuple(_faults(domain))
    if faults:
        raise PddlError(faults)
    return domain


def read_problem(text: str, domain: Domain) -> PlanningTask:
    """The task that the PDDL problem ``text`` states, under the problem's name.

    Raises:
        PddlError: if it is not a PDDL problem, or uses what is not supported.
        PlanningTaskError: if it does not fit the domain.
    """
    form = _parse(text, "problem")
    sections = _sections(form, {":domain", ":requirements", ":objects", ":init", ":goal", ":metric"})
    objects: dict[str, list[str]] = {}
    for name, type_ in _typed(_rest(sections, ":objects")):
        objects.setdefault(type_, []).append(name)
    init = _rest(sections, ":init")
    values = [_value(value) for value in init if value.head == EQUALS]
    goals = [_literal(part) for section in _rest(sections, ":goal") for part in _conjuncts(section)]
    if not all(goal.positive for goal in goals):
        raise _fault(sections[":goal"], "a negative goal is not supported")
    task = PlanningTask(
        robot=_word(form.items[1].items[-1]),
        objects=tuple((type_, tuple(names)) for type_, names in objects.items()),
        facts=frozenset(_atom(fact) for fact in init if fact.head != EQUALS),
        goals=tuple(goal.fact for goal in goals),
        costs=tuple(value for value in values if value[0] != (_TOTAL_COST,)),
    )
    check(task, domain)
    return task


def _parse(text: str, kind: str) -> _Form:
    """The form ``(define (kind NAME) ...)`` that the text consists of, lower-cased as PDDL reads it."""
    open_: list[tuple[int, list[_Form]]] = [(1, [])]
    line, seen = 1, 0
    for match in _TOKEN.finditer(text):
        line += text.count("\n", seen, match.start())
        seen = match.start()
        token = match.group().lower()
        if token == "(":
            open_.append((line, []))
        elif token == ")":
            start, items = open_.pop()
            if not open_:
                raise PddlError([f"line {line}: a parenthesis is closed that was never opened"])
            open_[-1][1].append(_Form(start, items=tuple(items)))
        elif not token.startswith(";"):
            open_[-1][1].append(_Form(line, token))
    if len(open_) > 1:
        raise PddlError([f"line {open_[-1][0]}: this parenthesis is never closed"])
    forms = open_[0][1]
    if len(forms) != 1:
        raise PddlError([f"line {line}: expected one form (define ...), got {len(forms)}"])
    form = forms[0]
    if form.head != "define" or len(form.items) < 2 or form.items[1].head != kind:
        raise _fault(form, f"expected (define ({kind} NAME) ...)")
    return form


def _sections(form: _Form, known: set[str]) -> dict[str, _Form]:
    """The parts of a definition by their keyword."""
    for section in form.items[2:]:
        if section.head not in known:
            raise _fault(section, f"{section.head or section.word or '()'} is not supported")
    return {section.head: section for section in form.items[2:]}


def _schema(form: _Form, with_costs: bool) -> Schema:
    if len(form.items) < 2 or len(form.items) % 2:
        raise _fault(form, "expected (:action NAME :parameters (...) :precondition ... :effect ...)")
    parts = {_word(key): value for key, value in zip(form.items[2::2], form.items[3::2], strict=True)}
    unknown = sorted(parts.keys() - {":parameters", ":precondition", ":effect"})
    if unknown:
        raise _fault(form, f"{unknown[0]} is not supported")
    nothing = _Form(form.line)
    costs = []
    literals = []
    for effect in _conjuncts(parts.get(":effect", nothing)):
        if effect.head == "increase":
            costs.append(_cost(effect))
        else:
            literals.append(_literal(effect))
    return Schema(
        name=_word(form.items[1]),
        parameters=_typed(parts.get(":parameters", nothing).items),
        needs=tuple(_literal(part) for part in _conjuncts(parts.get(":precondition", nothing))),
        adds=tuple(literal.fact for literal in literals if literal.positive),
        deletes=tuple(literal.fact for literal in literals if not literal.positive),
        cost=costs[0] if costs else 0 if with_costs else 1,
    )


def _conjuncts(form: _Form) -> Iterator[_Form]:
    if form.head == "and":
        for part in form.items[1:]:
            yield from _conjuncts(part)
    elif form.items or form.word:
        yield form


def _literal(form: _Form) -> Condition:
    positive = form.head != "not"
    inner = form if positive else form.items[-1]
    if inner.head in ("or", "imply", "exists", "forall", "when", "not", "and"):
        raise _fault(inner, f"({inner.head} ...) is not supported here")
    return Condition(_atom(inner), positive)


def _cost(form: _Form) -> int | Atom:
    if len(form.items) != 3 or form.items[1].head != _TOTAL_COST:
        raise _fault(form, "expected (increase (total-cost) COST)")
    amount = form.items[2]
    return _atom(amount) if amount.items else _whole(amount)


def _value(form: _Form) -> tuple[Atom, int]:
    if len(form.items) != 3:
        raise _fault(form, "expected (= (NAME OBJECT ...) VALUE)")
    return _atom(form.items[1]), _whole(form.items[2])


def _whole(form: _Form) -> int:
    if not form.word.isdecimal():
        raise _fault(form, f"expected a whole number, got {form.word or '(...)'}")
    return int(form.word)


def _atom(form: _Form) -> Atom:
    if not form.items:
        raise _fault(form, f"expected (NAME TERM ...), got {form.word or '()'}")
    return tuple(_word(item) for item in form.items)


def _signatures(forms: Iterable[_Form]) -> Signatures:
    """Names with the types of their parameters; ``- number`` after a function is ignored."""
    return tuple(
        (_word(form.items[0]), tuple(type_ for _, type_ in _typed(form.items[1:]))) for form in forms if form.items
    )


def _typed(forms: Iterable[_Form]) -> Typed:
    """The typed list ``a b - t c`` as ``((a, t), (b, t), (c, object))``."""
    result: list[tuple[str, str]] = []
    waiting: list[str] = []
    words = [_word(form) for form in forms]
    while words:
        word = words.pop(0)
        if word == "-" and words:
            type_ = words.pop(0)
            result += [(name, type_) for name in waiting]
            waiting = []
        else:
            waiting.append(word)
    return (*result, *((name, OBJECT) for name in waiting))


def _rest(sections: dict[str, _Form], name: str) -> tuple[_Form, ...]:
    return sections[name].items[1:] if name in sections else ()


def _word(form: _Form) -> str:
    if not form.word:
        raise _fault(form, f"expected a name, got ({form.head} ...)")
    return form.word


def _fault(form: _Form, what: str) -> PddlError:
    return PddlError([f"line {form.line}: {what}"])


def _faults(domain: Domain) -> Iterator[str]:
    """What the parts of the domain say about each other that does not hold."""
    types = {OBJECT, *(name for name, _ in domain.types)}
    predicates = dict(domain.predicates) | {EQUALS: (OBJECT, OBJECT)}
    functions = dict(domain.functions)
    listed = [("type", domain.types), ("constant", domain.constants)]
    listed += [(f"parameter of action {schema.name}", schema.parameters) for schema in domain.schemas]
    for what, pairs in listed:
        yield from (f"{what} {name}: unknown type {type_}" for name, type_ in pairs if type_ not in types)
    supertypes = dict(domain.types)
    for name, above in domain.types:
        for _ in domain.types:
            above = supertypes.get(above, OBJECT)
        if above != OBJECT:
            yield f"type {name} is its own supertype"
    for name, signature in (*predicates.items(), *functions.items()):
        yield from (f"{name}: unknown type {type_}" for type_ in signature if type_ not in types)
    for name in sorted(domain.exogenous - predicates.keys()):
        yield f"exogenous predicate {name} is not declared"
    for schema in domain.schemas:
        names = {name for name, _ in (*schema.parameters, *domain.constants)}
        atoms = [(need.fact, predicates) for need in schema.needs]
        atoms += [(atom, predicates) for atom in (*schema.adds, *schema.deletes)]
        if not isinstance(schema.cost, int):
            atoms.append((schema.cost, functions))
        for atom, declared in atoms:
            place = f"action {schema.name}: {fact_text(atom)}"
            if atom[0] not in declared:
                yield f"{place}: {atom[0]} is not declared"
            elif len(atom) - 1 != len(declared[atom[0]]):
                yield f"{place}: expected {len(declared[atom[0]])} terms, got {len(atom) - 1}"
            yield from (f"{place}: unknown term {term}" for term in atom[1:] if term not in names)
