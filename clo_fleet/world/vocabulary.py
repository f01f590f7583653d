"""What facts say about bodies: the one place that knows which predicate stands for what.

The truth, the senses, the skills and the planner ask it for "the fact that this robot is at this place" and for "the
object and the place that this fact is about". So none of them knows a predicate's name, and a world may bring a domain
of its own.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from clo_fleet.clo.task import Action, Fact
from clo_fleet.world.binding import (
    DOER,
    EVERYWHERE,
    SENSOR_ROLES,
    DomainBinding,
    MayAlso,
    SensorBinding,
    SensorKind,
    SkillKind,
    Source,
)
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import SkillSettings, World
from clo_fleet.world.places import zones
from clo_fleet.world.schemas import OBJECT, Domain, Schema

__all__ = ["PREPARED", "Deed", "Names", "Vocabulary", "vocabulary"]

PREPARED = "prepared"  # the predicate of what the world file calls prepared


@dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    """The names of all there is. ``prepared``: the objects that the world file calls so."""

    robots: tuple[str, ...]
    objects: tuple[str, ...]
    rooms: tuple[str, ...]
    zones: tuple[str, ...] = ()
    prepared: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Deed:
    """An action in terms of bodies: the skill, and what plays which of its roles."""

    kind: SkillKind
    roles: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class _Sensor:
    """A predicate as its sensor takes it.

    Attributes:
        order: the places in its facts of the sensor's roles; of effects, all places.
        admits: what may stand there.
        seen: the place of what has to be in sight; 0: ``reach`` says who knows.
        lost: the place of the object that must not be shoved; 0: none.
    """

    predicate: str
    kind: SensorKind
    order: tuple[int, ...]
    admits: tuple[frozenset[str], ...]
    seen: int = 0
    reach: str = EVERYWHERE
    lost: int = 0


class Vocabulary:
    """The words of one domain for the things of one world.

    Attributes:
        domain: the domain.
        names: what there is in the world.
        types: each type with its objects, in the order of the binding.
        given: the facts that hold for good.
        beginning: the effects that hold at the start.
        effects: the predicates of effects.
        shown: what one can see effects at.
    """

    def __init__(self, binding: DomainBinding, names: Names) -> None:
        self.domain: Domain = binding.domain
        self.names = names
        self.types = tuple((type_, members(source, names, _named(binding))) for type_, source in binding.types)
        self._skills = dict(binding.skills)
        self._schemas = {schema.name: schema for schema in binding.domain.schemas}
        self._sensors = {name: self._sensor(name, sensor) for name, sensor in binding.sensors}
        by_kind: dict[SensorKind, list[_Sensor]] = {kind: [] for kind in SensorKind}
        for sensor in self._sensors.values():
            by_kind[sensor.kind].append(sensor)
        self._by_kind = {kind: tuple(sensors) for kind, sensors in by_kind.items()}
        effects = self._by_kind[SensorKind.EFFECTS]
        self.effects = frozenset(sensor.predicate for sensor in effects)
        self.shown = frozenset(name for s in effects if s.seen for name in s.admits[s.seen - 1])
        self._known: dict[tuple[SensorKind, tuple[str, ...]], tuple[Fact, ...]] = {}
        kinds = {name: sensor.kind for name, sensor in binding.sensors}
        self.given = frozenset(fact for fact in binding.facts if kinds.get(fact[0]) is SensorKind.GIVEN)
        prepared = {(PREPARED, name) for name in names.prepared if PREPARED in self._sensors}
        self.beginning = (binding.facts | prepared) - self.given

    # ---- facts -----------------------------------------------------------------------------------------------

    def kind(self, fact: Fact) -> SensorKind:
        """Where the truth of the fact comes from."""
        return self._sensors[fact[0]].kind

    def kind_of(self, predicate: str) -> SensorKind:
        """Where the truth of the predicate's facts comes from."""
        return self._sensors[predicate].kind

    def is_effect(self, fact: Fact) -> bool:
        """Whether the fact is an effect: one that the poses do not show."""
        return fact[0] in self.effects

    def sensed(self, fact: Fact) -> bool:
        """Whether the fact is one about the state of bodies, or an effect: whether senses can tell."""
        return fact[0] in self._sensors and self._sensors[fact[0]].kind in _SENSED

    def read(self, fact: Fact, kind: SensorKind) -> tuple[str, ...]:
        """What plays the roles of the sensor in this fact, in the order of ``SENSOR_ROLES``; empty: it is another's."""
        sensor = self._sensors.get(fact[0])
        return tuple([fact[place] for place in sensor.order]) if sensor is not None and sensor.kind is kind else ()

    def orders(self, kind: SensorKind) -> dict[str, tuple[int, ...]]:
        """The predicates of this kind, each with where the roles of ``SENSOR_ROLES`` stand in its facts, from 1."""
        return {sensor.predicate: sensor.order for sensor in self._by_kind[kind]}

    def facts(self, kind: SensorKind, *values: str) -> tuple[Fact, ...]:
        """The facts that say this of these, one for each predicate that can: usually one, none if no type fits."""
        found = self._known.get((kind, values))
        if found is None:
            found = tuple(
                _fact(sensor, values)
                for sensor in self._by_kind[kind]
                if all(value in admits for value, admits in zip(values, sensor.admits, strict=True))
            )
            self._known[kind, values] = found
        return found

    def atoms(self, kind: SensorKind, terms: tuple[str, ...], things: Sequence[frozenset[str]]) -> tuple[Fact, ...]:
        """The same of variables that may stand for any of these things."""
        return tuple(
            _fact(sensor, terms)
            for sensor in self._by_kind[kind]
            if all(some <= admits for some, admits in zip(things, sensor.admits, strict=True))
        )

    def item(self, fact: Fact) -> str:
        """The object whose place the fact tells, on a floor or in a hand; empty: it tells another thing."""
        about = self.read(fact, SensorKind.POSITION)
        return about[0] if about else (self.read(fact, SensorKind.HOLDING) or ("", ""))[1]

    def seen_at(self, fact: Fact) -> str:
        """What has to be in sight to see this effect; ``EVERYWHERE`` or ``DOER``; empty: it is no effect."""
        sensor = self._sensors.get(fact[0])
        if sensor is None or sensor.kind is not SensorKind.EFFECTS:
            return ""
        return fact[sensor.seen] if sensor.seen else sensor.reach

    def effects_on(self, name: str) -> tuple[Fact, ...]:
        """The effects that are about nothing but this, and seen where it is."""
        return tuple(
            (sensor.predicate, name)
            for sensor in self._by_kind[SensorKind.EFFECTS]
            if len(sensor.order) == 1 and sensor.seen and name in sensor.admits[0]
        )

    def told(self, fact: Fact) -> bool:
        """Whether robots tell one another of the fact: not where they are, and not what is for the doer alone."""
        return not self.read(fact, SensorKind.PLACE) and self.seen_at(fact) != DOER

    def lost_with(self, fact: Fact) -> str:
        """The object that must stay where it is for the fact to stay true; empty: none."""
        place = self._sensors[fact[0]].lost
        return fact[place] if place else ""

    # ---- actions ---------------------------------------------------------------------------------------------

    def deed(self, action: Action) -> Deed:
        """What a body does for the action."""
        skill, values = self._skills[action.schema], self.values(action)
        return Deed(skill.kind, {role: values[variable] for role, variable in skill.roles})

    def values(self, action: Action) -> dict[str, str]:
        """What the schema's parameters stand for in the action."""
        variables = [variable for variable, _ in self._schemas[action.schema].parameters]
        return dict(zip(variables, action.args, strict=True))

    def may_also(self, schema: str) -> tuple[MayAlso, ...]:
        """What may come along with the effects of the schema's actions."""
        return self._skills[schema].may_also

    def variable(self, schema: str, role: str) -> str:
        """The schema's parameter that plays the role."""
        return dict(self._skills[schema].roles)[role]

    def is_drive(self, schema: str) -> bool:
        """Whether the schema's actions are ones of driving."""
        return self._skills[schema].kind is SkillKind.DRIVE

    def schemas(self, kind: SkillKind) -> tuple[Schema, ...]:
        """The action schemas that this skill carries out."""
        return tuple(schema for schema in self.domain.schemas if self._skills[schema.name].kind is kind)

    def duration(self, schema: str, settings: SkillSettings) -> float:
        """How long the skill of an action takes, once it is within reach [s]."""
        skill = self._skills[schema]
        if skill.takes is not None:
            return skill.takes
        times = {
            SkillKind.DRIVE: 0.0,
            SkillKind.WORK: settings.prepare,
            SkillKind.GRASP: settings.grasp,
            SkillKind.PLACE: settings.place,
            SkillKind.GIVE: settings.give,
        }
        return times[skill.kind]

    def objects(self, zones: Iterable[str]) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The names of each type for a planning task; of the zones only these."""
        away = set(self.names.zones).difference(zones)
        return tuple((type_, tuple(name for name in names if name not in away)) for type_, names in self.types)

    def _sensor(self, predicate: str, binding: SensorBinding) -> _Sensor:
        variables = dict(self.domain.variables)[predicate]
        types = dict(self.domain.predicates)[predicate]
        roles = dict(binding.roles)
        order = tuple(variables.index(roles[role]) + 1 for role in SENSOR_ROLES[binding.kind])
        if binding.kind is SensorKind.EFFECTS:
            order = tuple(range(1, len(variables) + 1))
        return _Sensor(
            predicate=predicate,
            kind=binding.kind,
            order=order,
            admits=tuple(self.admitted(types[place - 1]) for place in order),
            seen=variables.index(binding.seen) + 1 if binding.seen in variables else 0,
            reach=binding.seen,
            lost=variables.index(binding.lost) + 1 if binding.lost else 0,
        )

    def admitted(self, type_: str) -> frozenset[str]:
        """The names of all that is of this type, or of one below it."""
        fits = [names for name, names in self.types if self.domain.is_a(name, type_) or type_ == OBJECT]
        constants = [name for name, of in self.domain.constants if self.domain.is_a(of, type_)]
        return frozenset(name for names in (*fits, constants) for name in names)


_SENSED = frozenset({SensorKind.PLACE, SensorKind.POSITION, SensorKind.HOLDING, SensorKind.EFFECTS})


def vocabulary(world: World) -> Vocabulary:
    """The words of the world's domain for what is in the world."""
    names = Names(
        robots=tuple(sorted(spec.id for spec in world.robots)),
        objects=tuple(sorted(spec.id for spec in world.objects)),
        rooms=tuple(sorted(room.id for room in world.map.rooms)),
        zones=tuple(sorted(zones(world.map))),
        prepared=tuple(sorted(spec.id for spec in world.objects if spec.prepared)),
    )
    return Vocabulary(world.domain or fleet_binding(), names)


def members(source: Source | tuple[str, ...], names: Names, named: frozenset[str]) -> tuple[str, ...]:
    """The names that a type has by its source. ``named``: those that some type names itself."""
    match source:
        case Source.ROBOTS:
            return tuple(name for name in names.robots if name not in named)
        case Source.OBJECTS:
            return tuple(name for name in names.objects if name not in named)
        case Source.ROOMS:
            return tuple(name for name in names.rooms if name not in named)
        case Source.PLACES:
            return (*(name for name in names.rooms if name not in named), *names.zones)
        case listed:
            return listed


def _named(binding: DomainBinding) -> frozenset[str]:
    return frozenset(name for _, source in binding.types if isinstance(source, tuple) for name in source)


def _fact(sensor: _Sensor, values: tuple[str, ...]) -> Fact:
    placed = dict(zip(sensor.order, values, strict=True))
    return (sensor.predicate, *(placed[place] for place in range(1, len(values) + 1)))
