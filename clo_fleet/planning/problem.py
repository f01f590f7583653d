"""The task that a robot hands to the planner: what it believes, what it wants, what things cost.

| here             | PDDL problem                                |
|------------------|---------------------------------------------|
| `objects`        | `:objects`                                  |
| `facts`          | `:init`, the literals                       |
| `costs`          | `:init`, the values of the cost functions   |
| `goals`          | `:goal`                                     |
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from clo_fleet.clo.task import Action, Condition, Fact, State, fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import SkillSettings
from clo_fleet.world.schemas import OBJECT, Domain, bind
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["BLOCKED", "PlanningTask", "PlanningTaskError", "Scene", "check", "planning_task"]

BLOCKED = "blocked"  # (blocked a b): no way from room to room is open; no fact of a domain, and not the planner's
TENTHS_PER_SECOND = 10


class PlanningTaskError(CloFleetError):
    """A planning task does not fit its domain.

    Attributes:
        robot: whose task it is.
        faults: what is wrong.
    """

    def __init__(self, robot: str, faults: Iterable[str]) -> None:
        self.robot = robot
        self.faults = tuple(faults)
        super().__init__(f"planning task of {robot}:\n" + "\n".join(f"  {fault}" for fault in self.faults))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningTask:
    """A question to the planner. Equal tasks get equal plans.

    Attributes:
        robot: who asks.
        objects: the names of the objects of each type.
        facts: what is true, static facts included; everything else is false.
        goals: what must be true in the end.
        costs: the values of the domain's cost terms, whole numbers.
    """

    robot: str
    objects: tuple[tuple[str, tuple[str, ...]], ...]
    facts: frozenset[Fact]
    goals: tuple[Fact, ...]
    costs: tuple[tuple[Fact, int], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What stays the same from one plan to the next.

    Attributes:
        words: the domain, and its words for what is in the building.
        travel: how long the way from one place to the next takes [0.1 s], for each pair of rooms that share a door
            or a zone, and from each zone to its rooms.
        skills: how long the skills take.
        closable: whether ways may be closed: then drives need that theirs is not.
    """

    words: Vocabulary
    travel: Mapping[tuple[str, str], int]
    skills: SkillSettings
    closable: bool = False

    def guarded(self, action: Action) -> Action:
        """The action with what it needs beside the domain's conditions: a drive, that its way is not blocked."""
        if not self.closable or not self.words.is_drive(action.schema):
            return action
        roles = self.words.deed(action).roles
        way = Condition((BLOCKED, roles["from"], roles["to"]), positive=False)
        return replace(action, needs=(*action.needs, way))

    def open_in(self, state: State) -> "Scene":
        """The scene without the ways that are blocked in ``state``."""
        blocked = {fact[1:] for fact in state if fact[0] == BLOCKED}
        if not blocked:
            return self
        return replace(self, travel={pair: cost for pair, cost in self.travel.items() if pair not in blocked})


def planning_task(
    robot: str, scene: Scene, beliefs: State, goals: Iterable[Fact], given: Iterable[Fact] = ()
) -> PlanningTask:
    """What ``robot`` asks the planner of the fleet's domain.

    Zones other than the one that the robot is in are left out, with all that is believed about them: it cannot plan
    to go there.

    Args:
        robot: who plans.
        scene: the building, and who and what is in it.
        beliefs: the facts that the robot believes true.
        goals: the facts that it is to bring about.
        given: what else is true and changed by no action, as where others can be met; its own meetings are left out.
    """
    words = scene.words
    zones = sorted({start for start, _ in scene.travel}.difference(words.names.rooms))
    here = [zone for zone in zones if not beliefs.isdisjoint(words.facts(SensorKind.PLACE, robot, zone))]
    elsewhere = frozenset(zones).difference(here)
    travel = {pair: cost for pair, cost in scene.travel.items() if pair[0] not in elsewhere}
    static = {*words.given, *words.facts(SensorKind.SELF, robot)}
    static.update(fact for room in words.names.rooms for fact in words.facts(SensorKind.ROOM, room))
    static.update(fact for pair in travel for fact in words.facts(SensorKind.CONNECTED, *pair))
    static.update(fact for fact in given if words.read(fact, SensorKind.MEETS)[:1] != (robot,))
    return PlanningTask(
        robot=robot,
        objects=words.objects(here),
        facts=frozenset(fact for fact in beliefs if elsewhere.isdisjoint(fact[1:])) | static,
        goals=tuple(goals),
        costs=tuple(sorted(_costs(scene, travel).items())),
    )


def check(task: PlanningTask, domain: Domain) -> None:
    """Refuses a task that does not fit the domain, with every fault at once.

    Raises:
        PlanningTaskError: if a name, type or number of arguments is wrong, or a cost is missing or below zero.
    """
    faults = tuple(_faults(task, domain))
    if faults:
        raise PlanningTaskError(task.robot, faults)


def _costs(scene: Scene, travel: Mapping[tuple[str, str], int]) -> dict[Fact, int]:
    """What the cost terms of the domain's actions are worth: ways what they take, other skills their duration."""
    costs: dict[Fact, int] = {}
    for schema in scene.words.domain.schemas:
        if isinstance(schema.cost, int):
            continue
        if scene.words.is_drive(schema.name):
            costs |= {(schema.cost[0], *pair): time for pair, time in travel.items()}
        else:
            seconds = scene.words.duration(schema.name, scene.skills)
            costs[schema.cost[0],] = round(seconds * TENTHS_PER_SECOND)
    return costs


def _faults(task: PlanningTask, domain: Domain) -> Iterator[str]:
    known = {name for name, _ in domain.types} | {OBJECT}
    yield from (f"objects: unknown type {type_}" for type_, _ in task.objects if type_ not in known)
    names = [*domain.constants, *((name, type_) for type_, group in task.objects for name in group if type_ in known)]
    types = dict(names)
    for name, times in sorted(Counter(name for name, _ in names).items()):
        if times > 1:
            yield f"objects: {name} is named {times} times"
    predicates, functions = dict(domain.predicates), dict(domain.functions)
    atoms = [("facts", fact, predicates) for fact in sorted(task.facts)]
    atoms += [("goals", goal, predicates) for goal in task.goals]
    atoms += [("costs", term, functions) for term, _ in task.costs]
    for place, atom, declared in atoms:
        yield from (f"{place}: {fact_text(atom)}: {fault}" for fault in _misfits(atom, declared, types, domain))
    yield from (f"costs: {fact_text(term)}: {cost} is below zero" for term, cost in task.costs if cost < 0)
    yield from (f"costs: {fact_text(term)} has no value" for term in _missing_costs(task, domain))


def _misfits(
    atom: Fact, declared: Mapping[str, tuple[str, ...]], types: Mapping[str, str], domain: Domain
) -> Iterator[str]:
    signature = declared.get(atom[0])
    if signature is None:
        yield f"{atom[0]} is not declared"
    elif len(signature) != len(atom) - 1:
        yield f"expected {len(signature)} arguments, got {len(atom) - 1}"
    else:
        for name, type_ in zip(atom[1:], signature, strict=True):
            if name not in types:
                yield f"unknown object {name}"
            elif not domain.is_a(types[name], type_):
                yield f"{name} is a {types[name]}, expected a {type_}"


def _missing_costs(task: PlanningTask, domain: Domain) -> Iterator[Fact]:
    """Cost terms without a value, as far as one static precondition tells which bindings there can be."""
    given = {term for term, _ in task.costs}
    for schema in domain.schemas:
        if isinstance(schema.cost, int):
            continue
        variables = {term for term in schema.cost[1:] if term.startswith("?")}
        for need in (need.fact for need in schema.needs if need.positive and need.fact[0] in domain.static):
            if variables and variables <= set(need):
                same = (fact for fact in sorted(task.facts) if fact[0] == need[0] and len(fact) == len(need))
                terms = [bind(schema.cost, dict(zip(need[1:], fact[1:], strict=True))) for fact in same]
                break
        else:
            terms = [] if variables else [schema.cost]
        yield from (term for term in terms if term not in given)
