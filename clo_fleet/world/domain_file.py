"""A world's domain: its PDDL file, and the section that binds it, as one value.

The fleet's own domain lies beside this file and is read in the same way.
"""

from importlib.resources import files
from pathlib import Path, PurePosixPath, PureWindowsPath

from clo_fleet.clo.task import parse_fact
from clo_fleet.world.binding import (
    DOER,
    EVERYWHERE,
    DomainBinding,
    MayAlso,
    SensorBinding,
    SensorKind,
    SkillBinding,
    SkillKind,
    Source,
    priced,
)
from clo_fleet.world.domain_sections import DomainSection, EffectsSection, SensorSection, SkillSection, roles, variable
from clo_fleet.world.faults import Fault, Finding, value_text
from clo_fleet.world.pddl import read_domain
from clo_fleet.world.pddl_forms import PddlError, PddlFault
from clo_fleet.world.schemas import Domain
from clo_fleet.world.sections import parse
from clo_fleet.world.yaml_file import read_yaml

__all__ = ["binding", "domain_in", "fleet_binding"]

MAX_BYTES = 1_000_000


def fleet_binding() -> DomainBinding:
    """The fleet's own domain, as ``domain.yaml`` binds it."""
    path = Path(str(files("clo_fleet.world") / "domain.yaml"))
    section = parse(read_yaml(path), DomainSection, {"format": None}).sections
    return binding(section, read_domain(path.with_name(section.file).read_text(encoding="utf-8")))


def domain_in(name: str, world: Path) -> tuple[Domain | None, tuple[Fault, ...], list[Finding]]:
    """The domain in the PDDL file of this name beside a world file, or what is wrong with the file or its name."""
    key = ("domain", "file")
    way = PurePosixPath(name)
    if way.is_absolute() or PureWindowsPath(name).anchor or "\\" in name or ".." in way.parts:
        return None, (), [Finding(key, "a PDDL file in the world file's folder or below, with '/' between folders")]
    path = world.parent / name
    try:
        exists = path.is_file() and path.resolve().is_relative_to(world.parent.resolve())
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1) if exists else b""
    except OSError:
        exists = False
    if not exists or way.suffix != ".pddl":
        return None, (), [Finding(key, "a PDDL file (.pddl) that exists, named relative to the world file")]
    if len(raw) > MAX_BYTES:
        return None, (), [Finding(key, f"a PDDL file of at most {MAX_BYTES // 1_000_000} MB")]
    try:
        text = raw.decode("utf-8-sig")
        return read_domain(text), (), []
    except UnicodeDecodeError:
        return None, (), [Finding(key, "a PDDL file in UTF-8")]
    except PddlError as error:
        return None, tuple(_fault(path, text, fault) for fault in error.faults), []


def binding(section: DomainSection, domain: Domain) -> DomainBinding:
    """What the section says of the domain, unchecked."""
    skills = {schema: _skill(entry) for schema, entry in section.skills.items()}
    sensors = {predicate: _sensor(entry) for predicate, entry in section.sensors.items()}
    return DomainBinding(
        domain=priced(domain, skills, sensors),
        skills=tuple(skills.items()),
        sensors=tuple(sensors.items()),
        types=tuple((t, Source(of) if isinstance(of, str) else of) for t, of in section.types.items()),
        facts=frozenset(map(parse_fact, section.facts)),
    )


def _skill(entry: SkillSection) -> SkillBinding:
    takes, played = getattr(entry, "takes_s", None), roles(entry)
    more = tuple(
        MayAlso(
            parse_fact(also.fact),
            float(also.chance),
            variable(also.by or dict(played)["robot"]),
            tuple(map(parse_fact, also.where)),
        )
        for also in entry.may_also
    )
    return SkillBinding(SkillKind(entry.skill), played, None if takes is None else float(takes), more)


def _sensor(entry: SensorSection) -> SensorBinding:
    kind = SensorKind(entry.sensor)
    if isinstance(entry, EffectsSection):
        seen = {"everywhere": EVERYWHERE, "doer": DOER}.get(entry.seen) or variable(entry.seen)
        return SensorBinding(kind, seen=seen, lost=variable(entry.lost_when_moved) if entry.lost_when_moved else "")
    return SensorBinding(kind, roles(entry))


def _fault(path: Path, text: str, fault: PddlFault) -> Fault:
    line = text.split("\n")[fault.line - 1].strip()
    return Fault(
        file=path,
        line=fault.line,
        column=fault.column,
        key="(the file)",
        value=value_text(line) if line else "the end of the file",
        expected=f"PDDL ({fault.what})",
    )
