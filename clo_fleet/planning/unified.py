"""Problems of unified-planning in ground form, and plans back in the problem's own terms.

| here                | unified-planning                                          |
|---------------------|-----------------------------------------------------------|
| fact                | ground `FluentExp` of a Boolean fluent, when it is true   |
| `Condition`         | such an expression, or `Not` of it                        |
| action              | `ActionInstance`                                          |
| plan                | `SequentialPlan`                                          |
| `Grounded.valid`    | `SequentialPlanValidator`                                 |
"""

import warnings
from collections.abc import Iterable, Sequence, Set
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from unified_planning.engines import SequentialPlanValidator, ValidationResultStatus
from unified_planning.plans import ActionInstance, SequentialPlan

from clo_fleet.clo.task import Action, Condition, Fact, State, unmet
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.environments import as_global
from clo_fleet.planning.first_plan import Limits, first_plan
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.planning.grounding import GroundingError, Name, grounding
from clo_fleet.planning.lifted_task import LiftedTask
from clo_fleet.planning.lifting import UnsupportedProblemError, lifted
from clo_fleet.planning.pddl_files import PddlFileError, problem_of
from clo_fleet.planning.planner import Answer

__all__ = ["ForeignActionError", "Grounded", "ground", "read"]

DEFAULT_LIMITS = Limits()


class ForeignActionError(CloFleetError):
    """A plan holds an action that the problem does not have, or that can never become applicable.

    Attributes:
        name: the action, with its arguments.
    """

    def __init__(self, name: Name) -> None:
        super().__init__(f"the problem has no reachable action {name[0]}({', '.join(name[1])})")
        self.name = name


class Grounded:
    """A problem in ground form, and its way back. Made by ``ground``.

    Attributes:
        task: the ground task.
    """

    def __init__(self, problem: Any, task: LiftedTask) -> None:
        found = grounding(task)
        self.task: GroundTask = found.task
        self._lifted = task
        self._origins = found.origins
        self._variants: dict[Name | None, list[Action]] = {}
        for action in found.task.actions:
            self._variants.setdefault(self.original(action), []).append(action)
        self._notes = frozenset().union(*(action.adds for action in self._variants.get(None, ())))
        self._problem = problem
        self._judged = problem.clone()  # its start and goals are those of the last question
        self._judged.clear_quality_metrics()  # a plan may cost what it likes
        self._judged_state = found.task.state
        self._validator = SequentialPlanValidator(environment=problem.environment)
        self._validator.skip_checks = True  # all questions are of one kind

    def task_with(self, facts: Set[Fact]) -> GroundTask:
        """The task, with the actions as well that could be done if these facts came true by themselves.

        Raises:
            GroundingError: if they are too many.
        """
        if facts <= {fact for action in self.task.actions for fact in action.adds} | self.task.state:
            return self.task
        further = grounding(replace(self._lifted, facts=self._lifted.facts | facts)).task
        return replace(self.task, actions=further.actions)

    def original(self, action: Action) -> Name | None:
        """Name and arguments of the problem's action; ``None`` for one that only notes that a goal is reached.

        One action of the problem may be several here: one for each case of its conditions.
        """
        return self._origins[action.schema, action.args]

    def actions_of(self, names: Iterable[Name], state: State | None = None) -> tuple[Action, ...]:
        """The actions of a plan in the problem's terms; of each, the variant that is applicable by then.

        Where none is, the first is taken: plans are not judged here. If the plan reaches a goal that has to be noted,
        the note is added.

        Args:
            names: the actions of the problem, with their arguments.
            state: where the plan starts, if not at the task's start.

        Raises:
            ForeignActionError: if the problem has no such action.
        """
        value = set(self.task.state if state is None else state)
        found = []
        for name in names:
            if name not in self._variants:
                raise ForeignActionError(name)
            variants = self._variants[name]
            found.append(next((action for action in variants if not unmet(action, value)), variants[0]))
            value -= found[-1].deletes
            value |= found[-1].adds
        notes = (note for note in self._variants.get(None, ()) if not unmet(note, value) and not note.adds <= value)
        return (*found, *islice(notes, 1))

    def actions_of_plan(self, plan: Any, state: State | None = None) -> tuple[Action, ...]:
        """The actions of a ``SequentialPlan``; see ``actions_of``."""
        steps = (
            (step.action.name, tuple(term.object().name for term in step.actual_parameters)) for step in plan.actions
        )
        return self.actions_of(steps, state)

    def plan_of(self, actions: Iterable[Action]) -> Any:
        """The ``SequentialPlan`` that the actions amount to."""
        names = (self.original(action) for action in actions)
        return SequentialPlan([self._instance(*name) for name in names if name], self._problem.environment)

    def valid(self, state: State, actions: Iterable[Action], goals: Iterable[Condition] | None = None) -> bool:
        """Whether the actions lead from the state to the goals, as unified-planning's own validator judges.

        Half a millisecond for each action, about.

        Args:
            state: the facts that are true, static ones left out.
            actions: the plan.
            goals: other goals than the problem's.
        """
        now = frozenset(state) - self._notes
        self._set(self._judged, self._judged_state ^ now, now, goals)
        self._judged_state = now
        with as_global(self._problem.environment), warnings.catch_warnings(action="ignore"):
            # PDDL may leave costs without a value where no action needs one, and the validator would warn of that
            result = self._validator.validate(self._judged, self.plan_of(actions))
        return bool(result.status is ValidationResultStatus.VALID)

    def plan(
        self, state: State | None = None, goals: Iterable[Condition] | None = None, limits: Limits = DEFAULT_LIMITS
    ) -> Answer:
        """What Fast Downward answers when asked for a plan from the state to the goals, the task's if none are given.

        ``actions_of`` makes actions of the answer's steps.
        """
        asked = self._problem.clone()
        now = self.task.state if state is None else frozenset(state) - self._notes
        self._set(asked, self.task.state ^ now, now, goals)
        return first_plan(asked, limits)

    def _set(self, problem: Any, changed: Iterable[Fact], state: State, goals: Iterable[Condition] | None) -> None:
        """Give the problem another start, and other goals if there are any."""
        for fact in changed:
            problem.set_initial_value(self._expression(fact), fact in state)
        goals = self.task.goals if goals is None else tuple(goals)
        problem.clear_goals()
        for goal in self._problem.goals if goals == self.task.goals else map(self._goal, goals):
            problem.add_goal(goal)

    def _instance(self, name: str, args: Sequence[str]) -> Any:
        terms = [self._problem.environment.expression_manager.ObjectExp(self._problem.object(arg)) for arg in args]
        return ActionInstance(self._problem.action(name), terms)

    def _expression(self, fact: Sequence[str]) -> Any:
        return self._problem.fluent(fact[0])(*(self._problem.object(name) for name in fact[1:]))

    def _goal(self, goal: Condition) -> Any:
        expression = self._expression(goal.fact)
        return expression if goal.positive else self._problem.environment.expression_manager.Not(expression)


def ground(problem: Any) -> Grounded:
    """A ``unified_planning.model.Problem`` in ground form. It must not be changed while the result is in use.

    Raises:
        UnsupportedProblemError: if it uses more than Boolean fluents and action costs.
        GroundingError: if its ground form would be too large.
    """
    return Grounded(problem, lifted(problem))


def read(domain: Path, problem: Path) -> Grounded:
    """The problem that two PDDL files define, in ground form.

    Raises:
        PddlFileError: if they cannot be read, or the problem has no ground form.
    """
    try:
        return ground(problem_of(domain, problem))
    except (UnsupportedProblemError, GroundingError) as error:
        raise PddlFileError(problem, f"with {domain}: {error}") from error
