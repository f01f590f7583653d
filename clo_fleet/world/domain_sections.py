"""The keys of a world file's section ``domain``: a PDDL domain, and what its parts stand for in the fleet."""

from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from clo_fleet.world.sections import FactText, Fraction, Id, NonNegative, Section, Text, Variable, is_id

__all__ = ["DomainSection", "SensorSection", "SkillSection", "roles", "variable"]

MOST_NAMES = 10_000
SOURCES = ("robots", "objects", "rooms", "places")


class AlsoSection(Section):
    """What may come along with an action's effects."""

    fact: FactText = Field(description="A fact with ?variables: the action's parameters, or others: anything.")
    chance: Fraction = Field(description="With which each such fact comes about when the action is done.")
    by: Variable | None = Field(None, description="Whose doing that is; by default the robot's.")
    where: tuple[FactText, ...] = Field((), max_length=100, description="Given facts, with ?variables, that must be.")


MayAlso = Annotated[tuple[AlsoSection, ...], Field((), max_length=100, description="What may come along, by chance.")]
Takes = Annotated[NonNegative | None, Field(None, description="How long it takes; by default as `skills` says.")]


def _members(value: Any) -> Any:
    """``robots``, ``objects``, ``rooms``, ``places``, or names."""
    if value in SOURCES or (isinstance(value, tuple) and len(value) <= MOST_NAMES and all(map(is_id, value))):
        return value
    raise PydanticCustomError("members", "robots, objects, rooms, places, or a list of names")


Members = Annotated[
    str | tuple[str, ...],
    PlainValidator(_members),
    WithJsonSchema({"anyOf": [{"enum": list(SOURCES)}, {"type": "array", "items": {"type": "string"}}]}),
]


class DriveSection(Section):
    """Drive from one room to another."""

    skill: Literal["drive"]
    robot: Variable
    start: Variable = Field(alias="from")
    to: Variable
    may_also: MayAlso


class WorkSection(Section):
    """Stay within reach of an object, or anywhere in the room, for some time."""

    skill: Literal["work"]
    robot: Variable
    at: Variable | None = Field(None, description="An object; by default the room will do.")
    within: Variable = Field(alias="in")
    takes_s: Takes
    may_also: MayAlso


class GraspSection(Section):
    """Take an object up."""

    skill: Literal["grasp"]
    robot: Variable
    object: Variable
    within: Variable = Field(alias="in")
    takes_s: Takes
    may_also: MayAlso


class PlaceSection(Section):
    """Put an object down."""

    skill: Literal["place"]
    robot: Variable
    object: Variable
    within: Variable = Field(alias="in")
    takes_s: Takes
    may_also: MayAlso


class GiveSection(Section):
    """Pass an object on to another robot."""

    skill: Literal["give"]
    robot: Variable
    to: Variable
    object: Variable
    within: Variable = Field(alias="in")
    takes_s: Takes
    may_also: MayAlso


class SelfSection(Section):
    """True of the robot that plans."""

    sensor: Literal["self"]
    robot: Variable


class RoomSection(Section):
    """True of rooms, not of corridor zones."""

    sensor: Literal["room"]
    place: Variable


class ConnectedSection(Section):
    """A robot can drive from the one place to the other without passing a third room."""

    sensor: Literal["connected"]
    start: Variable = Field(alias="from")
    to: Variable


class GivenSection(Section):
    """True as listed under facts, for good."""

    sensor: Literal["given"]


class MeetsSection(Section):
    """Another robot will come by the place, according to its announced plan."""

    sensor: Literal["meets"]
    robot: Variable
    place: Variable


class PlaceOfSection(Section):
    """Where a robot is."""

    sensor: Literal["place"]
    robot: Variable
    place: Variable


class PositionSection(Section):
    """Where an object lies."""

    sensor: Literal["position"]
    object: Variable
    place: Variable


class HoldingSection(Section):
    """Which robot carries an object."""

    sensor: Literal["holding"]
    robot: Variable
    object: Variable


class EffectsSection(Section):
    """Changed by the effects of finished skills, and by what happens by itself."""

    sensor: Literal["effects"]
    seen: Variable = Field(
        "everywhere", description="Seen by whoever sees this; or known everywhere; or to nobody but the doer."
    )
    lost_when_moved: Variable | None = Field(None, description="An object: shoved away, it has to be done again.")


SkillSection = Annotated[
    DriveSection | WorkSection | GraspSection | PlaceSection | GiveSection, Field(discriminator="skill")
]
SensorSection = Annotated[
    SelfSection
    | RoomSection
    | ConnectedSection
    | GivenSection
    | MeetsSection
    | PlaceOfSection
    | PositionSection
    | HoldingSection
    | EffectsSection,
    Field(discriminator="sensor"),
]


class DomainSection(Section):
    """A domain of the world's own, and what its parts stand for in the fleet."""

    file: Text = Field(description="The PDDL domain, beside this file or in a folder below.")
    types: dict[Id, Members] = Field(max_length=1000)
    skills: dict[Id, SkillSection] = Field(max_length=1000)
    sensors: dict[Id, SensorSection] = Field(max_length=1000)
    facts: tuple[FactText, ...] = Field((), max_length=100_000, description="What is true at the start.")


def roles(section: Section) -> tuple[tuple[str, str], ...]:
    """Which variable plays which role of the skill or the sensor: the roles are the section's keys."""
    others = {"skill", "sensor", "takes_s", "may_also", "seen", "lost_when_moved"}
    named = section.model_dump(by_alias=True, exclude=others, exclude_none=True)
    return tuple((role, variable(name)) for role, name in named.items())


def variable(name: str) -> str:
    """The parameter as PDDL writes it; the question mark may be left out.

    >>> variable("r"), variable("?r")
    ('?r', '?r')
    """
    return "?" + name.removeprefix("?")
