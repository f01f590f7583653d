"""The symbolic world: facts that one robot's actions change, and others' help and newcomers change with it.

Chance depends on the seed, the problem and how many actions the robot has tried, never on a generator's state: every
strategy meets the same newcomers, and the same help after the same number of actions.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Action, Condition, Fact, apply, unmet
from clo_fleet.paper.settings import Newcomer, Setting
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.chance import uniform

__all__ = ["NEWCOMERS", "Happened", "SymbolicWorld"]

NEWCOMERS = 5  # objects perceived with each action (Borrajo and Veloso 2024)


@dataclass(frozen=True, slots=True)
class Happened:
    """What came of an action.

    Attributes:
        missing: the preconditions that did not hold in truth; if there are any, the action changed nothing.
        flips: what changed besides: help and newcomers.
    """

    missing: tuple[Condition, ...]
    flips: tuple[Flip, ...]


@dataclass(slots=True, kw_only=True)
class SymbolicWorld:
    """The truth of one run.

    Attributes:
        setting, task: the paper's domain and problem.
        probability: that an opportunity appears after an action.
        seed: of the run.
        facts: what is true.
        tried: how many actions the robot has carried out or failed at.
    """

    setting: Setting
    task: PlanningTask
    probability: float
    seed: int
    facts: frozenset[Fact] = field(init=False)
    tried: int = field(default=0, init=False)
    helped: int = field(default=0, init=False)
    _newcomers: list[Newcomer] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.facts = self.task.facts

    def execute(self, action: Action) -> Happened:
        """Carry out an action, if it can be; then others act, and the robot comes to see more of the world."""
        missing = unmet(action, self.facts)
        if not missing:
            self.facts = apply(self.facts, action)
        self.tried += 1
        draw = partial(uniform, self.seed)
        moment = f"{self.setting.name}/{self.task.robot}/{self.tried}"
        flips: tuple[Flip, ...] = ()
        if draw(f"{moment}/appears") < self.probability:
            flips = self.setting.opportunity(self.task, self.facts, lambda what: draw(f"{moment}/{what}"))
            self.helped += bool(flips)
        for _ in range(NEWCOMERS):
            self._newcomers.append(self.setting.newcomer(self.facts, len(self._newcomers) + 1))
            flips += tuple(Flip(fact, True) for fact in self._newcomers[-1].facts)
        self.facts = (self.facts - {flip.fact for flip in flips if not flip.value}) | {
            flip.fact for flip in flips if flip.value
        }
        return Happened(missing, flips)

    def question(self, state: frozenset[Fact]) -> PlanningTask:
        """The problem as a robot has to put it that believes ``state``: with the newcomers that it knows of."""
        known = {name for fact in state for name in fact[1:]}
        objects: Mapping[str, list[str]] = {type_: list(names) for type_, names in self.task.objects}
        for newcomer in self._newcomers:
            for name, type_ in newcomer.objects:
                if name in known:
                    objects[type_].append(name)
        return PlanningTask(
            robot=self.task.robot,
            objects=tuple((type_, tuple(names)) for type_, names in objects.items()),
            facts=state,
            goals=self.task.goals,
        )
