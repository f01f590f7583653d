"""The domain of a world file: read, bound and checked against what is in the world."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from clo_fleet.clo.task import Fact, parse_fact
from clo_fleet.world.binding import DomainBinding, SensorKind
from clo_fleet.world.deed_checks import deed_findings
from clo_fleet.world.domain_checks import binding_findings
from clo_fleet.world.domain_file import binding, domain_in, fleet_binding
from clo_fleet.world.fact_checks import Known, fact_findings
from clo_fleet.world.faults import Fault, Finding
from clo_fleet.world.may_also import may_also_findings
from clo_fleet.world.model import BuildingMap
from clo_fleet.world.places import zones
from clo_fleet.world.references import Unsound
from clo_fleet.world.vocabulary import PREPARED, Names, Vocabulary
from clo_fleet.world.world_sections import WorldSection

__all__ = ["Speech", "speech"]


@dataclass(frozen=True, slots=True)
class Speech:
    """What a world's facts mean, as far as its file says so.

    Attributes:
        own: the domain, if it is the world's own.
        known: what facts may be about; ``None``, as ``words``: the domain is not sound.
        words: the domain's words.
        faults: what is wrong with the PDDL file.
        findings: what is wrong with the section ``domain``.
    """

    own: DomainBinding | None = None
    known: Known | None = None
    words: Vocabulary | None = None
    faults: tuple[Fault, ...] = ()
    findings: tuple[Finding, ...] = ()


def speech(sections: WorldSection, path: Path, building: BuildingMap | None, unsound: Unsound) -> Speech:
    """The domain that the world file at ``path`` names, or the fleet's."""
    if any(key[0] == "domain" for key in unsound):
        return Speech()
    rooms = () if building is None else tuple(sorted(room.id for room in building.rooms))
    names = Names(
        robots=tuple(sorted(sections.robots)),
        objects=tuple(sorted(sections.objects)),
        rooms=rooms,
        zones=() if building is None else tuple(sorted(zones(building))),
        prepared=tuple(sorted(name for name, thing in sections.objects.items() if thing.prepared)),
    )
    section = sections.domain
    if section is None:
        bound = fleet_binding()
        return Speech(None, _known(bound, names, building, unsound), Vocabulary(bound, names))
    domain, faults, findings = domain_in(section.file, path)
    if domain is None:
        return Speech(faults=faults, findings=tuple(findings))
    bound = binding(section, domain)
    if findings := list(binding_findings(bound, names)):
        return Speech(findings=tuple(findings))
    words, known = Vocabulary(bound, names), _known(bound, names, building, unsound)
    if building is not None:
        findings += deed_findings(bound, words)
    findings += may_also_findings(bound, words, known)
    findings += _begin_findings(tuple(map(parse_fact, section.facts)), names, known)
    return Speech(bound, known, words, findings=tuple(findings))


def _known(bound: DomainBinding, names: Names, building: BuildingMap | None, unsound: Unsound) -> Known:
    things: Mapping[str, tuple[str, ...]] = {"robots": names.robots, "objects": names.objects}
    return Known(bound, things if building is None else {**things, "rooms": names.rooms}, unsound)


def _begin_findings(facts: tuple[Fact, ...], names: Names, known: Known) -> Iterator[Finding]:
    """What is wrong with what the file says is true at the start."""
    for index, fact in enumerate(facts):
        yield from fact_findings(("domain", "facts", index), fact, known, (SensorKind.GIVEN, SensorKind.EFFECTS))
    for name in names.prepared:
        for finding in fact_findings(("objects", name, "prepared"), (PREPARED, name), known, (SensorKind.EFFECTS,)):
            yield Finding(finding.key, f"false: this domain has no effect ({PREPARED} {name})", "true")
