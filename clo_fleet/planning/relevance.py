"""What a robot's question to the planner has to hold; left out are others' errands, and most of the building.

Theory of operation. From the goals backwards, an action matters if it adds something that matters (or deletes what is
not to be), and then all of its conditions matter. This is worked out on *patterns*, facts with holes: a hole is a
parameter that neither the pattern nor the robot's own name fills. A name that no pattern mentions is left out with all
facts about it; a hole lets in whatever the state has there. Rooms are let in by name, where things lie that matter,
and on the shortest ways between those. So a plan of the full task has its like here, at no greater cost: steps that
serve no goal fall away, and what lay between two stops is replaced by a shortest way. Where a condition asks for
something of which a fact is *not* true, or no condition says what a parameter is, all of that type stay in.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import permutations

import numpy as np
import numpy.typing as npt

from clo_fleet.clo.task import Fact, State
from clo_fleet.planning.problem import PlanningTask, Scene, planning_task
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.schemas import EQUALS, Atom, Schema

__all__ = ["Travels", "narrow_task"]

Pattern = tuple[str, ...]  # a fact, with HOLE where anything may stand
HOLE = ""

_BUILDING = frozenset({SensorKind.SELF, SensorKind.ROOM, SensorKind.CONNECTED})


class Travels:
    """The shortest ways over the places of a scene; searched once from each place that is asked for."""

    def __init__(self, travel: Mapping[tuple[str, str], int]) -> None:
        self._names = tuple(sorted({name for pair in travel for name in pair}))
        self._number = {name: number for number, name in enumerate(self._names)}
        self._cost = np.full((len(self._names), len(self._names)), np.inf)
        for (start, end), cost in travel.items():
            self._cost[self._number[start], self._number[end]] = cost
        self._found: dict[int, tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]]] = {}

    def cost(self, start: str, end: str) -> float:
        """What the shortest way costs; infinite if there is none."""
        if start == end:
            return 0.0
        if start not in self._number or end not in self._number:
            return float(np.inf)
        return float(self._search(self._number[start])[0][self._number[end]])

    def way(self, start: str, end: str) -> tuple[str, ...]:
        """The places on the shortest way, both ends included; of equally short ones a direct one. Empty: none."""
        if start == end or not np.isfinite(self.cost(start, end)):
            return (start,) if start == end else ()
        before = self._search(self._number[start])[1]
        way, here = [end], self._number[end]
        while here != self._number[start]:
            here = int(before[here])
            way.append(self._names[here])
        return tuple(reversed(way))

    def _search(self, start: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]]:
        """Dijkstra over a full matrix, from one place: the costs, and each place's last but one."""
        if start not in self._found:
            cost = self._cost[start].copy()
            cost[start] = 0.0
            before = np.full(len(cost), start, dtype=np.intp)
            left = np.ones(len(cost), dtype=bool)
            while left.any():
                here = int(np.argmin(np.where(left, cost, np.inf)))
                if not np.isfinite(cost[here]) or not left[here]:
                    break
                left[here] = False
                over = cost[here] + self._cost[here]
                nearer = over < cost
                cost[nearer], before[nearer] = over[nearer], here
            self._found[start] = cost, before
        return self._found[start]


def narrow_task(robot: str, scene: Scene, travels: Travels, beliefs: State, goals: Iterable[Fact]) -> PlanningTask:
    """The task of ``robot`` without what cannot matter to it; see the module."""
    goals, words = tuple(goals), scene.words
    patterns, open_types = _backwards(robot, scene, goals)
    names = {name for _, atom in patterns for name in atom[1:]} | {robot, *(name for name, _ in words.domain.constants)}
    by_predicate: dict[str, list[Pattern]] = {}
    for _, atom in patterns:
        by_predicate.setdefault(atom[0], []).append(atom)
    for fact in (*beliefs, *words.given):
        if any(_fits(atom, fact) for atom in by_predicate.get(fact[0], ())):
            names.update(fact[1:])
    names.update(name for type_ in open_types for name in words.admitted(type_))
    rooms = frozenset(words.names.rooms)
    starts = {about[1] for fact in beliefs if (about := words.read(fact, SensorKind.PLACE))[:1] == (robot,)}
    stops = starts | (names & rooms)
    places = {place for start in stops for end in stops & rooms for place in travels.way(start, end)} | stops
    narrow = replace(scene, travel={pair: cost for pair in _pairs(places) if (cost := scene.travel.get(pair))})
    task = planning_task(robot, narrow, beliefs, goals)
    everything = frozenset((*words.names.robots, *words.names.objects, *rooms, *words.names.zones))
    out = everything - names - places
    return replace(
        task,
        objects=tuple((type_, tuple(name for name in group if name not in out)) for type_, group in task.objects),
        facts=frozenset(fact for fact in task.facts if out.isdisjoint(fact[1:])),
    )


def _pairs(places: Iterable[str]) -> Iterator[tuple[str, str]]:
    return permutations(sorted(places), 2)


def _backwards(robot: str, scene: Scene, goals: Iterable[Fact]) -> tuple[set[tuple[bool, Pattern]], set[str]]:
    """The patterns that matter, each to be true or to be false, and the types of which anything may matter."""
    found: set[tuple[bool, Pattern]] = set()
    open_types: set[str] = set()
    left = [(True, goal) for goal in goals]
    while left:
        pattern = left.pop()
        if pattern in found:
            continue
        found.add(pattern)
        for schema in scene.words.domain.schemas:
            for effect in schema.adds if pattern[0] else schema.deletes:
                values = _joined(schema, effect, pattern[1], robot, scene)
                if values is not None:
                    left += _needs(schema, values, scene)
                    open_types |= _open(schema, values)
    return found, open_types


def _joined(schema: Schema, effect: Atom, pattern: Pattern, robot: str, scene: Scene) -> dict[str, str] | None:
    """The values of the schema's parameters, as far as the robot and what the effect is to be settle them."""
    values = {need.fact[1]: robot for need in schema.needs if scene.words.kind_of(need.fact[0]) is SensorKind.SELF}
    if effect[0] != pattern[0]:
        return None
    for term, name in zip(effect[1:], pattern[1:], strict=True):
        if name == HOLE:
            continue
        if (values.setdefault(term, name) if term.startswith("?") else term) != name:
            return None
    return values


def _needs(schema: Schema, values: Mapping[str, str], scene: Scene) -> list[tuple[bool, Pattern]]:
    """The conditions of the schema as patterns, but for those that the building settles."""
    return [
        (need.positive, (need.fact[0], *(values.get(t, HOLE) if t.startswith("?") else t for t in need.fact[1:])))
        for need in schema.needs
        if need.fact[0] != EQUALS and scene.words.kind_of(need.fact[0]) not in _BUILDING
    ]


def _open(schema: Schema, values: Mapping[str, str]) -> set[str]:
    """The types of the parameters that anything may fill: no condition says what; of rooms one is as good as another.

    Where a condition says what must not be, any room may be the one of which that is true.
    """
    types = dict(schema.parameters)
    positive = {t for need in schema.needs if need.positive and need.fact[0] != EQUALS for t in need.fact[1:]}
    denied = {t for need in schema.needs if not need.positive and need.fact[0] != EQUALS for t in need.fact[1:]}
    found = {types[v] for v in types if v not in values and v in denied}
    found |= {types[v] for v in types if v not in values and v not in positive}
    return found


def _fits(pattern: Pattern, fact: Fact) -> bool:
    return len(pattern) == len(fact) and all(want in (HOLE, name) for want, name in zip(pattern, fact, strict=True))
