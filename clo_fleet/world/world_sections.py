"""The keys of world files, with their defaults from the model."""

from dataclasses import fields
from typing import Any, Literal

from pydantic import Field

from clo_fleet.world.disturbance_sections import DisturbanceSection, FaultsSection
from clo_fleet.world.domain_sections import DomainSection
from clo_fleet.world.model import (
    ObjectSpec,
    Perception,
    PlanningTime,
    Radio,
    RobotSpec,
    SkillSettings,
    World,
)
from clo_fleet.world.sections import Coordinate, FactText, Fraction, Id, NonNegative, PointM, Positive, Section, Text

__all__ = [
    "MEGABYTE",
    "ObjectSection",
    "PerceptionSection",
    "PlanningSection",
    "RadioSection",
    "RobotSection",
    "SkillsSection",
    "WorldSection",
]

MEGABYTE = 1 << 20
SKILLS, PERCEPTION, RADIO, PLANNING = SkillSettings(), Perception(), Radio(), PlanningTime()
ROBOT: dict[str, Any] = {field.name: field.default for field in fields(RobotSpec)}
OBJECT: dict[str, Any] = {field.name: field.default for field in fields(ObjectSpec)}
WORLD: dict[str, Any] = {field.name: field.default for field in fields(World)}


class RobotSection(Section):
    """A robot: at a spawn point, or at a point of a room."""

    at: Id | None = Field(None, description="A spawn point of the map, in place of room and at_m.")
    room: Id | None = None
    at_m: PointM | None = None
    heading_rad: Coordinate | None = None
    goals: tuple[FactText, ...] = Field(
        (), max_length=1000, description="Facts to bring about, such as (holding r1 o2)."
    )
    radius_m: Positive = ROBOT["radius"]
    max_speed_m_s: Positive = ROBOT["max_speed"]
    max_acceleration_m_s2: Positive = ROBOT["max_acceleration"]


class ObjectSection(Section):
    """An object: at a spawn point, or at a point of a room."""

    at: Id | None = Field(None, description="A spawn point of the map, in place of room and at_m.")
    room: Id | None = None
    at_m: PointM | None = None
    prepared: bool = OBJECT["prepared"]
    radius_m: Positive = OBJECT["radius"]
    mass_kg: Positive = OBJECT["mass"]


class PerceptionSection(Section):
    """How robots sense."""

    mode: Literal["watch", "sight", "full"] = "sight"
    range_m: Positive = PERCEPTION.range
    look_s: NonNegative = Field(default=PERCEPTION.look, description="For each fact looked at; then it looks again.")


class RadioSection(Section):
    """What robots tell each other."""

    facts: bool = RADIO.facts
    range_m: Positive | None = Field(default=RADIO.range, description="By default everywhere.")
    delay_s: NonNegative = RADIO.delay
    loss: Fraction = RADIO.loss
    repeat_s: Positive = Field(default=RADIO.repeat, description="How often plans are repeated if messages get lost.")
    promise_s: Positive = Field(default=RADIO.promise, description="How long a promise counts that is not repeated.")


class PlanningSection(Section):
    """How much simulated time planning takes, the planner's own limits, and what to do without a plan."""

    fixed_s: NonNegative = PLANNING.fixed
    per_expansion_s: NonNegative = PLANNING.per_expansion
    wall_limit_s: Positive = PLANNING.wall_limit
    memory_limit_mb: Positive = PLANNING.memory_limit / MEGABYTE
    partly: bool = PLANNING.partly


class SkillsSection(Section):
    """How long the skills take and how far they reach."""

    prepare_s: NonNegative = SKILLS.prepare
    grasp_s: NonNegative = SKILLS.grasp
    place_s: NonNegative = SKILLS.place
    give_s: NonNegative = SKILLS.give
    reach_m: Positive = SKILLS.reach
    partner_wait_s: NonNegative = SKILLS.partner_wait
    spread: float = Field(default=SKILLS.spread, ge=0, lt=1)
    speed_spread: float = Field(default=SKILLS.speed_spread, ge=0, lt=1)


class WorldSection(Section):
    """A world file."""

    format: Literal["clo-fleet/world/1"]
    name: Text | None = Field(None, description="By default the file's name.")
    map: Text = Field(description="The map file, relative to this file.")
    seed: int = Field(WORLD["seed"], ge=0, lt=1 << 63)
    until_s: Positive = WORLD["until"]
    perception: PerceptionSection = PerceptionSection()
    radio: RadioSection = RadioSection()
    planning: PlanningSection = PlanningSection()
    skills: SkillsSection = SkillsSection()
    domain: DomainSection | None = Field(None, description="A PDDL domain of its own; by default the fleet's.")
    robots: dict[Id, RobotSection] = Field(max_length=10_000)
    objects: dict[Id, ObjectSection] = Field({}, max_length=10_000)
    disturbances: tuple[DisturbanceSection, ...] = Field((), max_length=10_000)
    faults: FaultsSection = FaultsSection()
    expected: dict[Text, str] = Field({})
