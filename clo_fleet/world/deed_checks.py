"""Whether the actions of a domain say of bodies what the skills do to them.

| skill   | the action needs                                          | makes true          | makes false           |
|---------|-----------------------------------------------------------|---------------------|-----------------------|
| `drive` | robot `place` from, `connected` from to                   | robot `place` to    | robot `place` from    |
| `work`  | robot `place` in, object `position` in, if there is one   |                     |                       |
| `grasp` | robot `place` in, object `position` in                    | robot `holding`     | object `position` in  |
| `place` | robot `place` in, robot `holding`                         | object `position` in| robot `holding`       |
| `give`  | robot `place` in, robot `holding`, the other `meets` in   | other `holding`     | robot `holding`       |

Every action also needs `self` robot, and in a room unless its parameter stands for rooms only. Effects with the sensor
`effects` are free. An action that says less would be planned where it cannot be done; one that says more is not done.
"""

from collections.abc import Iterator, Mapping

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.world.binding import DomainBinding, SensorKind, SkillBinding, SkillKind
from clo_fleet.world.faults import Finding, KeyPath
from clo_fleet.world.schemas import Schema
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["deed_findings"]

S = SensorKind
Terms = tuple[SensorKind, tuple[str, ...]]
"""A sensor, and the roles of the skill that stand in its own."""

NEEDS: Mapping[SkillKind, tuple[Terms, ...]] = {
    SkillKind.DRIVE: ((S.PLACE, ("robot", "from")), (S.CONNECTED, ("from", "to"))),
    SkillKind.WORK: ((S.PLACE, ("robot", "in")), (S.POSITION, ("at", "in"))),
    SkillKind.GRASP: ((S.PLACE, ("robot", "in")), (S.POSITION, ("object", "in"))),
    SkillKind.PLACE: ((S.PLACE, ("robot", "in")), (S.HOLDING, ("robot", "object"))),
    SkillKind.GIVE: ((S.PLACE, ("robot", "in")), (S.HOLDING, ("robot", "object")), (S.MEETS, ("to", "in"))),
}
ADDS: Mapping[SkillKind, tuple[Terms, ...]] = {
    SkillKind.DRIVE: ((S.PLACE, ("robot", "to")),),
    SkillKind.WORK: (),
    SkillKind.GRASP: ((S.HOLDING, ("robot", "object")),),
    SkillKind.PLACE: ((S.POSITION, ("object", "in")),),
    SkillKind.GIVE: ((S.HOLDING, ("to", "object")),),
}
DELETES: Mapping[SkillKind, tuple[Terms, ...]] = {
    SkillKind.DRIVE: ((S.PLACE, ("robot", "from")),),
    SkillKind.WORK: (),
    SkillKind.GRASP: ((S.POSITION, ("object", "in")),),
    SkillKind.PLACE: ((S.HOLDING, ("robot", "object")),),
    SkillKind.GIVE: ((S.HOLDING, ("robot", "object")),),
}
BODILY = frozenset({S.PLACE, S.POSITION, S.HOLDING})


def deed_findings(binding: DomainBinding, words: Vocabulary) -> Iterator[Finding]:
    """Every action that says too little or too much. The binding fits otherwise."""
    skills = dict(binding.skills)
    for schema in binding.domain.schemas:
        key: KeyPath = ("domain", "skills", schema.name)
        deed = _Deed(schema, skills[schema.name], words)
        yield from deed.lacks(key)
        yield from deed.oddities(key)
        yield from _cost_findings(key, schema, skills[schema.name])
    for name, sensor in binding.sensors:
        changers = [s.name for s in binding.domain.schemas if name in {e[0] for e in (*s.adds, *s.deletes)}]
        if changers and sensor.kind not in BODILY | {S.EFFECTS}:
            expected = f"the sensor effects, or no action that changes it: {changers[0]} does"
            yield Finding(("domain", "sensors", name, "sensor"), expected)


class _Deed:
    """One action, with the atoms that its skill brings about."""

    def __init__(self, schema: Schema, skill: SkillBinding, words: Vocabulary) -> None:
        self.schema, self.skill, self.words = schema, skill, words
        self.roles, self.types = dict(skill.roles), dict(schema.parameters)

    def atoms(self, kind: SensorKind, roles: tuple[str, ...]) -> frozenset[Fact]:
        """What says this of the action's parameters, one atom for each predicate that can."""
        variables = tuple(self.roles[role] for role in roles)
        things = [self.words.admitted(self.types[variable]) for variable in variables]
        return frozenset(self.words.atoms(kind, variables, things))

    def lacks(self, key: KeyPath) -> Iterator[Finding]:
        """Preconditions that are missing."""
        given = {need.fact for need in self.schema.needs if need.positive}
        needs: list[Terms] = [(S.SELF, ("robot",)), *NEEDS[self.skill.kind]]
        room = self.roles.get("in", "")
        if room and not self.words.admitted(self.types[room]).issubset(self.words.names.rooms):
            needs.append((S.ROOM, ("in",)))
        for kind, roles in needs:
            if all(role in self.roles for role in roles):
                atoms = self.atoms(kind, roles)
                if not atoms:
                    said = " ".join(self.roles[role] for role in roles)
                    yield Finding(key, f"a predicate with the sensor {kind.value} for {said}", "none that fits")
                elif atoms.isdisjoint(given):
                    yield Finding(key, f"the precondition {fact_text(min(atoms))} in the PDDL file", "none such")

    def oddities(self, key: KeyPath) -> Iterator[Finding]:
        """Effects on bodies that are missing, and such as the skill does not have."""
        made = (("effect", self.schema.adds, ADDS), ("effect not", self.schema.deletes, DELETES))
        for what, effects, table in made:
            due = frozenset().union(*(self.atoms(kind, roles) for kind, roles in table[self.skill.kind]))
            said = frozenset(effect for effect in effects if self.words.kind(effect) in BODILY)
            for atom in sorted(due - said):
                yield Finding(
                    key, f"the {what} {fact_text(atom)} in the PDDL file: {self.skill.kind.value} has it", "none"
                )
            for atom in sorted(said - due):
                yield Finding(key, f"a skill with the {what} {fact_text(atom)}", self.skill.kind.value)


def _cost_findings(key: KeyPath, schema: Schema, skill: SkillBinding) -> Iterator[Finding]:
    """Costs written in the domain other than as a number, travel or a duration."""
    roles = dict(skill.roles)
    terms = (roles["from"], roles["to"]) if skill.kind is SkillKind.DRIVE else ()
    if not isinstance(schema.cost, int) and schema.cost[1:] != terms:
        expected = f"the cost {fact_text(('NAME', *terms))}, a number, or no costs in the PDDL file at all"
        yield Finding(key, expected, fact_text(schema.cost))
