"""The planner's desk: takes the robots' questions, hands out the answers when they are due.

The simulation waits for the planner's processes, so that an answer is the same and is due at the same simulated
time however busy the machine is. What a call costs in simulated time is the world's to say.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Self

from clo_fleet.clo.messages import PlanFailure
from clo_fleet.clo.plain import plain_action, read_action
from clo_fleet.clo.task import Action, Fact
from clo_fleet.planning.planner import (
    NoPlan,
    PlanFound,
    PlannerDied,
    PlannerOutOfMemory,
    PlannerOutOfTime,
    PlanReply,
)
from clo_fleet.planning.planner_faults import PlannerFaults
from clo_fleet.planning.pool import KILLED, PlannerPool
from clo_fleet.planning.problem import BLOCKED, Scene
from clo_fleet.planning.relevance import Travels, narrow_task
from clo_fleet.world.binding import SensorKind, SkillKind
from clo_fleet.world.disturbances import CorridorClosed, DoorClosed
from clo_fleet.world.model import RobotId, World
from clo_fleet.world.places import travel_time
from clo_fleet.world.random_faults import schedule
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Desk", "Questions", "Reply"]

CLOSING = CorridorClosed | DoorClosed
TENTHS = 10  # costs are whole tenths of a second


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """An answer of the planner. ``actions`` is ``None`` if there is no plan, for the reason ``failure``."""

    robot: RobotId
    due: float
    actions: tuple[Action, ...] | None
    failure: PlanFailure = PlanFailure.NO_PLAN
    expansions: int = 0
    detail: str = ""

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "robot": self.robot,
            "due": self.due,
            "actions": None if self.actions is None else list(map(plain_action, self.actions)),
            "failure": self.failure.value,
            "expansions": self.expansions,
            "detail": self.detail,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The answer that ``state()`` was taken from."""
        actions = None if state["actions"] is None else tuple(map(read_action, state["actions"]))
        return cls(**{**state, "actions": actions, "failure": PlanFailure(state["failure"])})


@dataclass(slots=True, kw_only=True)
class Desk:
    """What one robot's questions cost: calls, expanded states, simulated and real seconds."""

    calls: int = 0
    expansions: int = 0
    seconds: float = 0.0
    wall_seconds: float = 0.0


@dataclass(slots=True)
class Questions:
    """All open questions. A context manager: it ends the planner's processes.

    Attributes:
        planners: planners to ask, which are left to whoever made them; without any that suit the world, it has its own.
        desks: what each robot's questions have cost.
        wall_limited: whether some answer depended on the machine's speed.
        scene: what stays the same from one question to the next.
        faults: what befalls the robots' planners.
    """

    world: World
    words: Vocabulary
    planners: PlannerPool | None = None
    desks: dict[RobotId, Desk] = field(init=False)
    wall_limited: bool = False
    _pool: PlannerPool = field(init=False, repr=False)
    scene: Scene = field(init=False, repr=False)
    _travels: Travels = field(init=False, repr=False)
    _asked: dict[RobotId, float] = field(default_factory=dict, repr=False)
    _answered: list[Reply] = field(default_factory=list, repr=False)
    faults: PlannerFaults = field(default_factory=PlannerFaults)

    def __post_init__(self) -> None:
        world = self.world
        self.desks = {spec.id: Desk() for spec in world.robots}
        own = PlannerPool(
            self.words.domain, wall_limit=world.planning.wall_limit, memory_limit=world.planning.memory_limit
        )
        if self.planners is not None and not self.planners.like(own):
            self.planners = None
        self._pool = self.planners or own
        self.scene = Scene(
            words=self.words,
            travel={pair: max(1, round(seconds * TENTHS)) for pair, seconds in travel_time(world.map).items()},
            skills=world.skills,
            closable=any(isinstance(disturbance, CLOSING) for disturbance in schedule(world)),
        )
        self._travels = Travels(self.scene.travel)

    def __enter__(self) -> Self:
        self._pool.warm()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the planner's processes, or let go of those that are others' to end."""
        (self._pool.close if self.planners is None else self._pool.forget)()

    def ask(self, robot: RobotId, state: frozenset[Fact], goals: Iterable[Fact], time: float) -> None:
        """Ask for a plan from ``state`` to ``goals``, at simulated ``time`` [s]."""
        self._asked[robot] = time
        scene = self.scene.open_in(state)
        travels = self._travels if scene is self.scene else Travels(scene.travel)
        known = frozenset(fact for fact in state if fact[0] != BLOCKED)
        self._pool.submit(robot, narrow_task(robot, scene, travels, known, goals))
        if self.faults.strikes(robot):
            self._pool.kill(robot)

    def kill(self, robot: RobotId, time: float) -> bool:
        """Have the robot's planner die, now [s] or over the next question; whether it is now."""
        pending = next((reply for reply in self._answered if reply.robot == robot), None)
        if pending is None:
            self.faults.doomed.add(robot)
            return False
        self._answered.remove(pending)
        died = Reply(robot=robot, due=time, actions=None, failure=PlanFailure.DIED, detail=KILLED)
        self._answered.append(died)
        return True

    def earliest(self, robot: RobotId, state: frozenset[Fact], items: Iterable[str], place: str) -> float:
        """The least that it costs ``robot`` to bring one of ``items`` to ``place`` [0.1 s], as it believes."""
        here = self._where(state, SensorKind.PLACE, robot) or place
        costs = []
        for item in items:
            lies = self._where(state, SensorKind.POSITION, item)
            handling = 0.0 if lies is None else self._handling(state, item)
            costs.append(self._travel(here, lies or here) + handling + self._travel(lies or here, place))
        return min(costs, default=0.0)

    def due(self, time: float) -> tuple[Reply, ...]:
        """The answers that are due by ``time`` [s], in the order of the robots' ids. Waits for the planner."""
        for robot in sorted(self._asked):
            self._answered.append(self._answer(robot, self._asked[robot], self._pool.result(robot)))
        self._asked.clear()
        due = sorted((reply for reply in self._answered if reply.due <= time + 1e-9), key=lambda reply: reply.robot)
        self._answered = [reply for reply in self._answered if reply not in due]
        return tuple(due)

    def state(self) -> dict[str, Any]:
        """Plain data, without real times; between ticks every question has its answer, due now or later."""
        return {
            "answered": [reply.state() for reply in self._answered],
            "desks": {robot: [desk.calls, desk.expansions, desk.seconds] for robot, desk in self.desks.items()},
            "wall_limited": self.wall_limited,
            "faults": self.faults.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._answered = list(map(Reply.from_state, state["answered"]))
        for robot, (calls, expansions, seconds) in state["desks"].items():
            desk = self.desks[robot]
            desk.calls, desk.expansions, desk.seconds = calls, expansions, seconds
        self.wall_limited = state["wall_limited"]
        self.faults.restore(state["faults"])

    def restore_wall(self, seconds: Mapping[RobotId, float]) -> None:
        """Count on from these real times [s]."""
        for robot, desk in self.desks.items():
            desk.wall_seconds = seconds[robot]

    def _where(self, state: frozenset[Fact], kind: SensorKind, name: str) -> str | None:
        """Where the robot or object is believed to be."""
        about = (self.words.read(fact, kind) for fact in sorted(state))
        return next((at[1] for at in about if at and at[0] == name), None)

    def _handling(self, state: frozenset[Fact], item: str) -> int:
        """The least that it costs to take the object up: the grasp, and what its effects still lack [0.1 s]."""
        words = self.words
        costs = []
        for schema in words.schemas(SkillKind.GRASP):
            variable = words.variable(schema.name, "object")
            lacks = [
                n.fact for n in schema.needs if n.positive and n.fact[1:] == (variable,) and words.is_effect(n.fact)
            ]
            before = [self._cheapest(fact[0]) for fact in lacks if (fact[0], item) not in state]
            costs.append(self._duration(schema.name) + sum(before))
        return min(costs, default=0)

    def _cheapest(self, predicate: str) -> int:
        """The least that it costs to bring such an effect about [0.1 s]."""
        schemas = self.words.domain.schemas
        makers = (schema.name for schema in schemas if any(effect[0] == predicate for effect in schema.adds))
        return min(map(self._duration, makers), default=0)

    def _duration(self, schema: str) -> int:
        return round(self.words.duration(schema, self.world.skills) * TENTHS)

    def _travel(self, start: str, goal: str) -> float:
        """The cost of the way, over other rooms if it must be; a lower bound where the start is a zone."""
        if start == goal or start not in self.words.names.rooms:
            return 0.0
        return self._travels.cost(start, goal)

    def _answer(self, robot: RobotId, asked: float, reply: PlanReply) -> Reply:
        planning, desk = self.world.planning, self.desks[robot]
        expansions = 0 if isinstance(reply, PlannerDied) else reply.expansions or 0
        seconds = planning.fixed + planning.per_expansion * expansions + self.faults.delay(robot)
        desk.calls += 1
        desk.expansions += expansions
        desk.seconds += seconds
        desk.wall_seconds += reply.wall_seconds
        due = asked + seconds
        match reply:
            case PlanFound():
                actions = tuple(map(self.scene.guarded, reply.actions))
                return Reply(robot=robot, due=due, actions=actions, expansions=expansions)
            case NoPlan(proven=proven):
                detail = "proven" if proven else "the search ended without one"
                return Reply(robot=robot, due=due, actions=None, expansions=expansions, detail=detail)
            case PlannerOutOfTime():
                self.wall_limited = True
                detail = f"wall limit {planning.wall_limit:g} s"
                return Reply(robot=robot, due=due, actions=None, failure=PlanFailure.OUT_OF_TIME, detail=detail)
            case PlannerOutOfMemory():
                detail = f"memory limit {planning.memory_limit >> 20} MB"
                return Reply(robot=robot, due=due, actions=None, failure=PlanFailure.OUT_OF_MEMORY, detail=detail)
            case PlannerDied(reason=reason):
                return Reply(robot=robot, due=due, actions=None, failure=PlanFailure.DIED, detail=reason)
