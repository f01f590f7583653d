"""Reads PDDL domains: STRIPS with types, constants, negative preconditions, equality and action costs.

The executive needs schemas at once and in its own process, where importing unified-planning would cost seconds; the
same values are handed to unified-planning in the planner's process. So this is the only reading.
"""

from collections.abc import Iterable, Iterator, Mapping
from importlib.resources import files

from clo_fleet.clo.task import fact_text
from clo_fleet.world.pddl_forms import Form, PddlError, atom, conjuncts, literal, parse, sections, typed, whole
from clo_fleet.world.schemas import EQUALS, OBJECT, Atom, Domain, Schema

__all__ = ["TOTAL_COST", "fleet_domain", "read_domain"]

FLEET_EXOGENOUS = frozenset({"meets"})  # other robots announce new plans
TOTAL_COST = "total-cost"
SECTIONS = (":requirements", ":types", ":constants", ":predicates", ":functions", ":action")

Fault = tuple[str, str]
"""The section or action that something is wrong with, and what."""


def fleet_domain() -> Domain:
    """The domain of the fleet, ``domain.pddl``."""
    text = (files("clo_fleet.world") / "domain.pddl").read_text(encoding="utf-8")
    return read_domain(text, exogenous=FLEET_EXOGENOUS)


def read_domain(text: str, exogenous: Iterable[str] = ()) -> Domain:
    """The domain that ``text`` defines; ``exogenous`` predicates count as changing although no action changes them.

    Raises:
        PddlError: if it is not a PDDL domain, or uses what is not supported.
    """
    form = parse(text, "domain")
    parts = sections(form, set(SECTIONS))
    predicates = tuple(_signature(part) for part in _rest(parts, ":predicates"))
    functions = tuple(_signature(part) for part in _rest(parts, ":functions") if part.items)
    actions = [part for part in form.items[2:] if part.head == ":action"]
    domain = Domain(
        name=form.items[1].items[-1].name,
        types=tuple(pair for pair in typed(_rest(parts, ":types")) if pair[0] != OBJECT),
        constants=typed(_rest(parts, ":constants")),
        predicates=tuple((name, tuple(type_ for _, type_ in signature)) for name, signature in predicates),
        functions=tuple((n, tuple(type_ for _, type_ in signature)) for n, signature in functions if n != TOTAL_COST),
        schemas=tuple(_schema(action, functions != ()) for action in actions),
        exogenous=frozenset(exogenous),
        variables=tuple((name, tuple(variable for variable, _ in signature)) for name, signature in predicates),
        text=text,
    )
    places: Mapping[str, Form] = parts | {f"action {action.items[1].name}": action for action in actions}
    faults = sorted(places.get(where, form).fault(what) for where, what in _faults(domain))
    if faults:
        raise PddlError(faults)
    return domain


def _schema(form: Form, with_costs: bool) -> Schema:
    if len(form.items) < 2 or len(form.items) % 2:
        raise form.error("expected (:action NAME :parameters (...) :precondition ... :effect ...)")
    parts = {key.name: value for key, value in zip(form.items[2::2], form.items[3::2], strict=True)}
    unknown = sorted(parts.keys() - {":parameters", ":precondition", ":effect"})
    if unknown:
        raise form.error(f"{unknown[0]} is not supported")
    nothing = Form(form.line, form.column)
    effects = list(conjuncts(parts.get(":effect", nothing)))
    costs = [_cost(effect) for effect in effects if effect.head == "increase"]
    literals = [literal(effect) for effect in effects if effect.head != "increase"]
    return Schema(
        name=form.items[1].name,
        parameters=typed(parts.get(":parameters", nothing).items),
        needs=tuple(literal(part) for part in conjuncts(parts.get(":precondition", nothing))),
        adds=tuple(literal.fact for literal in literals if literal.positive),
        deletes=tuple(literal.fact for literal in literals if not literal.positive),
        cost=costs[0] if costs else 0 if with_costs else 1,
    )


def _cost(form: Form) -> int | Atom:
    if len(form.items) != 3 or form.items[1].head != TOTAL_COST:
        raise form.error("expected (increase (total-cost) COST)")
    amount = form.items[2]
    return atom(amount) if amount.items else whole(amount)


def _signature(form: Form) -> tuple[str, tuple[tuple[str, str], ...]]:
    """A name with its parameters and their types."""
    if not form.items:
        raise form.error(f"expected (NAME ?X - TYPE ...), got {form.word or '()'}")
    return form.items[0].name, typed(form.items[1:])


def _rest(parts: Mapping[str, Form], name: str) -> tuple[Form, ...]:
    """What a section holds; ``- number`` after a function is no part of it."""
    return parts[name].items[1:] if name in parts else ()


def _faults(domain: Domain) -> Iterator[Fault]:
    """What the parts of the domain say about each other that does not hold."""
    yield from _type_faults(domain)
    predicates, functions = dict(domain.predicates), dict(domain.functions)
    for name in sorted(domain.exogenous - predicates.keys()):
        yield ":predicates", f"exogenous predicate {name} is not declared"
    names = [schema.name for schema in domain.schemas]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"action {name}", f"action {name} is defined {names.count(name)} times"
    for schema in domain.schemas:
        where = f"action {schema.name}"
        for variable, type_ in schema.parameters:
            if not domain.has_type(type_):
                yield where, f"parameter of {where} {variable}: unknown type {type_}"
        atoms = [(need.fact, predicates | {EQUALS: (OBJECT, OBJECT)}) for need in schema.needs]
        atoms += [(effect, predicates) for effect in (*schema.adds, *schema.deletes)]
        if not isinstance(schema.cost, int):
            atoms.append((schema.cost, functions))
        terms = {name for name, _ in (*schema.parameters, *domain.constants)}
        for atom_, declared in atoms:
            yield from ((where, f"{where}: {fact_text(atom_)}: {fault}") for fault in _misfits(atom_, declared, terms))


def _type_faults(domain: Domain) -> Iterator[Fault]:
    for section, what, pairs in ((":types", "type", domain.types), (":constants", "constant", domain.constants)):
        yield from ((section, f"{what} {n}: unknown type {type_}") for n, type_ in pairs if not domain.has_type(type_))
    supertypes = dict(domain.types)
    for name, above in domain.types:
        for _ in domain.types:
            above = supertypes.get(above, OBJECT)
        if above != OBJECT:
            yield ":types", f"type {name} is its own supertype"
    for section, signatures in ((":predicates", domain.predicates), (":functions", domain.functions)):
        for name, types in signatures:
            yield from ((section, f"{name}: unknown type {type_}") for type_ in types if not domain.has_type(type_))


def _misfits(atom_: Atom, declared: Mapping[str, tuple[str, ...]], terms: set[str]) -> Iterator[str]:
    signature = declared.get(atom_[0])
    if signature is None:
        yield f"{atom_[0]} is not declared"
    elif len(atom_) - 1 != len(signature):
        yield f"expected {len(signature)} terms, got {len(atom_) - 1}"
    yield from (f"unknown term {term}" for term in atom_[1:] if term not in terms)
