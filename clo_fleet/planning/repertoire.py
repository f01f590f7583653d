"""What one robot of the fleet could do: the ground actions that its executive may put into a plan.

The planner is asked about the objects and places that matter for one task; a repertoire is for all tasks of a robot. It
is made when it is first asked for, and anew when the robot hears of other meeting places.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

from clo_fleet.clo.operators import Operators
from clo_fleet.clo.task import Action, Condition, Fact, State
from clo_fleet.planning.problem import Scene, planning_task
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.schemas import EQUALS, Domain, Schema, bind

__all__ = ["Repertoire", "ground_actions"]


@dataclass(slots=True)
class Repertoire:
    """One robot's actions in one building, for its executive (an ``ActionSource``)."""

    robot: str
    scene: Scene
    _key: frozenset[object] | None = field(default=None, repr=False)
    _operators: Operators | None = field(default=None, repr=False)

    def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
        """All that the robot can do with what there is, and with the meetings that it believes in."""
        given = frozenset(fact for fact in state if fact[0] in self.scene.words.domain.exogenous)
        key: frozenset[object] = given | frozenset(goals)
        if self._operators is None or key != self._key:
            self._key = key
            self._operators = Operators(map(self.scene.guarded, ground_actions(self.robot, self.scene, given)), goals)
        return self._operators


def ground_actions(robot: str, scene: Scene, given: Iterable[Fact]) -> tuple[Action, ...]:
    """The actions of the robot whose static conditions hold; ``given``: what is true that no action changes."""
    words, domain = scene.words, scene.words.domain
    starts = {start for start, _ in scene.travel}
    everywhere = {fact for start in starts for fact in words.facts(SensorKind.PLACE, robot, start)}
    task = planning_task(robot, scene, everywhere, (), given)
    objects = {**dict(domain.constants)} | {name: type_ for type_, group in task.objects for name in group}
    settled = domain.static | domain.exogenous
    facts: dict[str, list[Fact]] = {}
    for fact in sorted(task.facts):
        facts.setdefault(fact[0], []).append(fact)
    costs = dict(task.costs)
    return tuple(
        domain.ground(schema.name, args, costs)
        for schema in domain.schemas
        for args in _bindings(schema, domain, objects, settled, facts)
    )


def _bindings(
    schema: Schema,
    domain: Domain,
    objects: Mapping[str, str],
    settled: frozenset[str],
    facts: Mapping[str, list[Fact]],
) -> Iterator[tuple[str, ...]]:
    """The arguments of the schema for which all settled conditions hold."""
    bound: list[dict[str, str]] = [{}]
    needs = [need for need in schema.needs if need.fact[0] in settled]
    for need in needs:
        if need.positive and need.fact[0] != EQUALS:
            matches = facts.get(need.fact[0], [])
            bound = [more for values in bound for fact in matches if (more := _joined(need.fact, fact, values))]
    types = dict(schema.parameters)
    for values in bound:
        free = [name for name in types if name not in values]
        candidates = [[o for o, type_ in objects.items() if domain.is_a(type_, types[name])] for name in free]
        for choice in product(*candidates):
            whole = values | dict(zip(free, choice, strict=True))
            fitting = all(domain.is_a(objects[whole[name]], type_) for name, type_ in types.items())
            if fitting and all(_met(need, whole, facts) for need in needs):
                yield tuple(whole[name] for name in types)


def _joined(atom: Fact, fact: Fact, values: dict[str, str]) -> dict[str, str] | None:
    """The values with what the fact gives the atom's variables; ``None`` if it does not fit."""
    more = dict(values)
    for term, name in zip(atom[1:], fact[1:], strict=True):
        if term.startswith("?"):
            if more.setdefault(term, name) != name:
                return None
        elif term != name:
            return None
    return more


def _met(need: Condition, values: Mapping[str, str], facts: Mapping[str, list[Fact]]) -> bool:
    fact = bind(need.fact, values)
    if fact[0] == EQUALS:
        return (fact[1] == fact[2]) is need.positive
    return need.positive or fact not in facts.get(fact[0], ())
