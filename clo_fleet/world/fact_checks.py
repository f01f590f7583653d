"""Facts that people write, goals and others: that they are facts of the domain, about what there is."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.world.binding import DomainBinding, SensorKind, Source
from clo_fleet.world.faults import Finding, KeyPath, did_you_mean
from clo_fleet.world.references import MAX_LISTED, Unsound, unknown

__all__ = ["Known", "fact_findings"]

SECTIONS: Mapping[Source, str] = MappingProxyType(
    {Source.ROBOTS: "robots", Source.OBJECTS: "objects", Source.ROOMS: "rooms", Source.PLACES: "rooms"}
)


@dataclass(frozen=True, slots=True)
class Known:
    """What facts may be about.

    Attributes:
        binding: the domain.
        names: the names of ``robots``, ``objects`` and ``rooms``, as far as they are known.
        unsound: what could not be read in full.
    """

    binding: DomainBinding
    names: Mapping[str, Collection[str]]
    unsound: Unsound

    def stands_for(self, type_: str) -> tuple[tuple[str, ...], frozenset[str]]:
        """The sections of the file that have objects of the type, and the names that the binding lists for it."""
        fits = [source for name, source in self.binding.types if self.binding.domain.is_a(name, type_)]
        sections = tuple(dict.fromkeys(SECTIONS[source] for source in fits if isinstance(source, Source)))
        constants = [name for name, of in self.binding.domain.constants if self.binding.domain.is_a(of, type_)]
        return sections, frozenset(constants).union(*(source for source in fits if isinstance(source, tuple)))


def fact_findings(
    key: KeyPath, fact: Fact, known: Known, kinds: Collection[SensorKind], *, lifted: bool = False
) -> Iterator[Finding]:
    """Whether the fact is one with one of these sensors, about things of the right types; ``lifted``: or variables."""
    sensors = dict(known.binding.sensors)
    forms = {name: types for name, types in known.binding.domain.predicates if sensors[name].kind in kinds}
    predicate, *names = fact
    value = repr(fact_text(fact))
    if predicate not in forms:
        listed = ", ".join(_form(name, types, known) for name, types in forms.items())
        yield Finding(key, f"one of {listed or 'no facts at all'}{did_you_mean(predicate, forms)}", value)
    elif len(names) != len(forms[predicate]):
        yield Finding(key, _form(predicate, forms[predicate], known), value)
    else:
        for name, type_ in zip(names, forms[predicate], strict=True):
            if lifted and name.startswith("?"):
                continue
            for expected in _misnomers(name, type_, known, key):
                yield Finding(key, f"for {name!r} {expected}", value)


def _misnomers(name: str, type_: str, known: Known, key: KeyPath) -> Iterator[str]:
    sections, listed = known.stands_for(type_)
    if name in listed or not all(section in known.names for section in sections):
        return
    if sections:
        names = frozenset(name for section in sections for name in known.names[section])
        yield from (finding.expected for finding in unknown(key, name, names, sections, known.unsound))
    else:
        choice = f" ({', '.join(sorted(listed)) or 'there is none'})" if len(listed) <= MAX_LISTED else ""
        yield f"a name of type {type_}{did_you_mean(name, listed) or choice}"


def _form(predicate: str, types: tuple[str, ...], known: Known) -> str:
    """The predicate with what its parameters stand for, as ``(holding ROBOT OBJECT)``."""
    sections = ((known.stands_for(type_)[0] or (type_,))[0] for type_ in types)
    return fact_text((predicate, *(section.removesuffix("s").upper() for section in sections)))
