"""Whether a binding fits its domain: every action has a skill, every predicate a sensor, every type its objects.

Findings are at keys of a world file's section ``domain``. What an action says of bodies must be what its skill does to
them: that is for `deed_checks`.
"""

from collections import Counter
from collections.abc import Iterable, Iterator

from clo_fleet.clo.task import fact_text
from clo_fleet.world.binding import (
    SENSOR_ROLES,
    DomainBinding,
    SensorBinding,
    SensorKind,
    SkillKind,
    Source,
)
from clo_fleet.world.faults import Finding, KeyPath, did_you_mean, value_text
from clo_fleet.world.vocabulary import Names, Vocabulary

__all__ = ["binding_findings"]

PHYSICAL = frozenset({SensorKind.PLACE, SensorKind.POSITION, SensorKind.HOLDING})
STATED = frozenset({SensorKind.GIVEN, SensorKind.EFFECTS})


def binding_findings(binding: DomainBinding, names: Names) -> Iterator[Finding]:
    """Everything that does not fit, but for what the actions do and what the facts say."""
    domain = binding.domain
    types = tuple(name for name, _ in domain.types)
    schemas = tuple(schema.name for schema in domain.schemas)
    predicates = tuple(name for name, _ in domain.predicates)
    above = {parent for _, parent in domain.types}
    faulty = [
        *_keys("types", "type", [name for name, _ in binding.types], types, [t for t in types if t not in above]),
        *_keys("skills", "action", [name for name, _ in binding.skills], schemas, schemas),
        *_keys("sensors", "predicate", [name for name, _ in binding.sensors], predicates, predicates),
    ]
    faulty = faulty or [*_skill_findings(binding), *_sensor_findings(binding)]
    yield from faulty
    yield from _type_findings(binding, names)
    if faulty:
        return
    words = Vocabulary(binding, names)
    yield from _role_findings(binding, words)
    yield from _overlaps(binding, words)


def _keys(
    section: str, what: str, bound: Iterable[str], known: tuple[str, ...], needed: Iterable[str]
) -> Iterator[Finding]:
    bound = tuple(bound)
    for name in bound:
        if name not in known:
            expected = f"the name of one of the domain's {what}s{did_you_mean(name, known)}"
            yield Finding(("domain", section, name), expected, value_text(name))
    if missing := [name for name in needed if name not in bound]:
        yield Finding(("domain", section), f"an entry for every {what} of the domain", f"none for {missing[0]}")


def _skill_findings(binding: DomainBinding) -> Iterator[Finding]:
    """Roles played by what is no parameter of the action."""
    schemas = {schema.name: schema for schema in binding.domain.schemas}
    for name, skill in binding.skills:
        yield from _variables(("domain", "skills", name), skill.roles, [v for v, _ in schemas[name].parameters])


def _sensor_findings(binding: DomainBinding) -> Iterator[Finding]:
    """Roles played by what is no parameter of the predicate, and parameters that play none."""
    variables = dict(binding.domain.variables)
    for name, sensor in binding.sensors:
        key: KeyPath = ("domain", "sensors", name)
        own = variables[name]
        yield from _variables(key, _all_roles(sensor), own)
        if len(set(own)) < len(own):
            yield Finding(key, "parameters with names of their own in the PDDL file", fact_text((name, *own)))
        elif sensor.kind not in STATED:
            times = Counter(variable for _, variable in sensor.roles)
            if odd := [variable for variable in own if times[variable] != 1]:
                roles = ", ".join(SENSOR_ROLES[sensor.kind])
                expected = f"each parameter in one of the roles {roles}"
                yield Finding(key, expected, f"{odd[0]} in {times[odd[0]]}")


def _all_roles(sensor: SensorBinding) -> tuple[tuple[str, str], ...]:
    more = (("seen", sensor.seen), ("lost_when_moved", sensor.lost))
    return (*sensor.roles, *((role, variable) for role, variable in more if variable.startswith("?")))


def _variables(key: KeyPath, roles: tuple[tuple[str, str], ...], known: Iterable[str]) -> Iterator[Finding]:
    known = tuple(known)
    for role, variable in roles:
        if variable not in known:
            listed = ", ".join(name.removeprefix("?") for name in known) or "it has none"
            yield Finding((*key, role), f"one of its parameters in the PDDL file ({listed})")


def _type_findings(binding: DomainBinding, names: Names) -> Iterator[Finding]:
    """Things without a type, with two, or with the name of a constant."""
    owners: dict[str, str] = {name: "a constant of the domain" for name, _ in binding.domain.constants}
    for type_, source in binding.types:
        for name in source if isinstance(source, tuple) else ():
            if name in owners:
                yield Finding(("domain", "types", type_), f"each name once; {name} is {owners[name]}")
            owners[name] = f"listed as {type_}"
    taken: dict[Source, str] = {}
    for type_, source in binding.types:
        if isinstance(source, Source):
            same = Source.ROOMS if source is Source.PLACES else source
            if same in taken:
                yield Finding(("domain", "types", type_), f"a list of names: {taken[same]} has all that are not listed")
            taken[same] = type_
    for section, source, all_ in (("robots", Source.ROBOTS, names.robots), ("objects", Source.OBJECTS, names.objects)):
        if source not in taken:
            for name in all_:
                if name not in owners:
                    yield Finding((section, name), f"a type for {name} under domain.types", "none")


def _role_findings(binding: DomainBinding, words: Vocabulary) -> Iterator[Finding]:
    """Roles played by what cannot play them: a robot is no object, and a question is neither."""
    names = words.names
    everything: dict[str, tuple[frozenset[str], str]] = {
        "robot": (frozenset(names.robots), "robots"),
        "object": (frozenset(names.objects), "objects"),
        "place": (frozenset((*names.rooms, *names.zones)), "rooms or places"),
        "anything": (frozenset((*names.robots, *names.objects, *names.rooms)), "robots, objects or rooms"),
    }
    roles = {"from": "place", "in": "place", "at": "object", "lost_when_moved": "object", "seen": "anything"}
    parameters = {schema.name: dict(schema.parameters) for schema in binding.domain.schemas}
    signatures = {
        name: dict(zip(own, dict(binding.domain.predicates)[name], strict=True))
        for name, own in binding.domain.variables
    }
    entries = [("skills", name, skill.roles, parameters[name]) for name, skill in binding.skills]
    entries += [("sensors", name, _all_roles(sensor), signatures[name]) for name, sensor in binding.sensors]
    gives = {name for name, skill in binding.skills if skill.kind is SkillKind.GIVE}
    for section, name, played, types in entries:
        for role, variable in played:
            to = "robot" if name in gives and section == "skills" else "place"
            allowed, what = everything[to if role == "to" else roles.get(role, role)]
            if odd := sorted(words.admitted(types[variable]) - allowed):
                expected = f"a parameter that stands for {what}; {types[variable]} has {odd[0]} as well"
                yield Finding(("domain", section, name, role), expected)


def _overlaps(binding: DomainBinding, words: Vocabulary) -> Iterator[Finding]:
    """Two predicates that tell the same of the same thing: what holds of one thing is one fact."""
    signatures, variables = dict(binding.domain.predicates), dict(binding.domain.variables)
    told: dict[tuple[SensorKind, str], str] = {}
    for name, sensor in binding.sensors:
        if sensor.kind in PHYSICAL:
            role = "robot" if sensor.kind is SensorKind.PLACE else "object"
            type_ = signatures[name][variables[name].index(dict(sensor.roles)[role])]
            same = {told.get((sensor.kind, thing)) for thing in words.admitted(type_)} - {None}
            if same:
                yield Finding(
                    ("domain", "sensors", name), f"one predicate for each {role}; {min(map(str, same))} has it"
                )
            told.update(((sensor.kind, thing), name) for thing in words.admitted(type_))
