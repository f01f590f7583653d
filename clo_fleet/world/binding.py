"""How a PDDL domain is bound to the fleet: what a body does for each action, and where each fact comes from.

| PDDL             | here                                                                       |
|------------------|----------------------------------------------------------------------------|
| action schema    | `SkillBinding`: a skill, and which of the schema's parameters is its what  |
| predicate        | `SensorBinding`: where the truth of its facts comes from                   |
| type             | `Source`, or the names of the objects of that type                         |
| cost             | none is written: travel from the map, skills by their duration (`priced`)  |
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from types import MappingProxyType

from clo_fleet.clo.task import Fact
from clo_fleet.world.schemas import Atom, Domain, Schema

__all__ = [
    "DOER",
    "EVERYWHERE",
    "SENSOR_ROLES",
    "SKILL_ROLES",
    "DomainBinding",
    "MayAlso",
    "SensorBinding",
    "SensorKind",
    "SkillBinding",
    "SkillKind",
    "Source",
    "priced",
]

EVERYWHERE = "(everywhere)"  # no name, so that nothing can be called so
DOER = "(doer)"


class SkillKind(Enum):
    """What a body can do."""

    DRIVE = "drive"  # from room to room
    WORK = "work"  # be within reach of an object, or in a room, for a while
    GRASP = "grasp"
    PLACE = "place"  # put down
    GIVE = "give"  # pass on to another robot


class SensorKind(Enum):
    """Where the truth of a fact comes from."""

    SELF = "self"  # of the robot that plans; never changes
    ROOM = "room"  # of the rooms, not of corridor zones; never changes
    CONNECTED = "connected"  # of two places with a way between them that passes no third room; never changes
    GIVEN = "given"  # the world file says it; never changes
    MEETS = "meets"  # another robot will come by, according to its announced plan
    PLACE = "place"  # where a robot's centre is
    POSITION = "position"  # where an object lies
    HOLDING = "holding"  # who carries an object
    EFFECTS = "effects"  # the effects of finished skills, and what happens by itself


class Source(Enum):
    """Where the objects of a type come from: all there are, but for those that other types name."""

    ROBOTS = "robots"
    OBJECTS = "objects"
    ROOMS = "rooms"
    PLACES = "places"  # rooms and corridor zones


SKILL_ROLES: Mapping[SkillKind, tuple[str, ...]] = MappingProxyType(
    {
        SkillKind.DRIVE: ("robot", "from", "to"),
        SkillKind.WORK: ("robot", "at", "in"),
        SkillKind.GRASP: ("robot", "object", "in"),
        SkillKind.PLACE: ("robot", "object", "in"),
        SkillKind.GIVE: ("robot", "to", "object", "in"),
    }
)
SENSOR_ROLES: Mapping[SensorKind, tuple[str, ...]] = MappingProxyType(
    {
        SensorKind.SELF: ("robot",),
        SensorKind.ROOM: ("place",),
        SensorKind.CONNECTED: ("from", "to"),
        SensorKind.GIVEN: (),
        SensorKind.MEETS: ("robot", "place"),
        SensorKind.PLACE: ("robot", "place"),
        SensorKind.POSITION: ("object", "place"),
        SensorKind.HOLDING: ("robot", "object"),
        SensorKind.EFFECTS: (),
    }
)


@dataclass(frozen=True, slots=True)
class MayAlso:
    """What an action may bring about beyond its effects, when its skill is done.

    Attributes:
        fact: an atom with variables: parameters of the action, and others that stand for anything.
        chance: with which each such fact comes about, from 0 to 1.
        by: the parameter that stands for whose doing it is.
        where: atoms that have to be given facts.
    """

    fact: Atom
    chance: float
    by: str
    where: tuple[Atom, ...] = ()


@dataclass(frozen=True, slots=True)
class SkillBinding:
    """What a body does for an action.

    Attributes:
        kind: the skill.
        roles: which variable of the schema plays which role of the skill.
        takes: how long it takes [s]; ``None``: what the world's skills say.
        may_also: what may come along with its effects.
    """

    kind: SkillKind
    roles: tuple[tuple[str, str], ...]
    takes: float | None = None
    may_also: tuple[MayAlso, ...] = ()


@dataclass(frozen=True, slots=True)
class SensorBinding:
    """Where the facts of a predicate come from.

    Attributes:
        kind: the sensor.
        roles: which variable of the predicate plays which role of the sensor.
        seen: of ``effects``: who has this variable's object in sight sees the fact; or ``EVERYWHERE``, or ``DOER``:
            only whose action brought it about knows it.
        lost: of ``effects``: the variable of an object; the fact ends when the object is shoved away.
    """

    kind: SensorKind
    roles: tuple[tuple[str, str], ...] = ()
    seen: str = EVERYWHERE
    lost: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class DomainBinding:
    """A domain and what its parts stand for in the fleet. Checked: nothing is missing, and everything fits.

    Attributes:
        domain: the domain, priced.
        skills, sensors: by action schema, by predicate.
        types: for each type where its objects come from, or their names.
        facts: what is true at the start, of predicates with the sensors ``given`` and ``effects``.
    """

    domain: Domain
    skills: tuple[tuple[str, SkillBinding], ...]
    sensors: tuple[tuple[str, SensorBinding], ...]
    types: tuple[tuple[str, Source | tuple[str, ...]], ...]
    facts: frozenset[Fact] = frozenset()


def priced(domain: Domain, skills: Mapping[str, SkillBinding], sensors: Mapping[str, SensorBinding]) -> Domain:
    """The domain with a cost term for each action, if it writes no costs; and with its exogenous predicates.

    What a plan needs and no action changes may change all the same if it is sensed.
    """
    settled = {SensorKind.SELF, SensorKind.ROOM, SensorKind.CONNECTED, SensorKind.GIVEN}
    changed = {effect[0] for schema in domain.schemas for effect in (*schema.adds, *schema.deletes)}
    exogenous = {name for name, sensor in sensors.items() if sensor.kind not in settled} - changed
    domain = replace(domain, exogenous=frozenset(exogenous))
    if domain.functions:
        return domain
    costs = {schema.name: _cost(schema, skills[schema.name]) for schema in domain.schemas if schema.name in skills}
    return domain.with_costs(costs)


def _cost(schema: Schema, skill: SkillBinding) -> Atom:
    roles = dict(skill.roles)
    ends = (roles["from"], roles["to"]) if skill.kind is SkillKind.DRIVE else ()
    return (f"{schema.name}-time", *ends)
