"""One question to the engine, a plan to be made good for the present, and its answers in unified-planning's terms."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from unified_planning.engines import PlanGenerationResult
from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.engines.results import LogLevel, LogMessage
from unified_planning.exceptions import UPUsageError
from unified_planning.plans import ActionInstance, SequentialPlan

from clo_fleet.bridges.unified_planning.groundings import Present
from clo_fleet.clo.links import Links, Unsupported
from clo_fleet.clo.plan import Plan, Step, first_fault
from clo_fleet.clo.repair import Refusal, Refused, Repaired
from clo_fleet.clo.task import fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.grounding import Name

__all__ = ["ForeignPlanError", "Question", "names_of"]

ENGINE = "clo"
GONE = "it can never be done from now on, or changes nothing"
PLANNED_ANEW = "the new plan does without it"


class ForeignPlanError(CloFleetError, UPUsageError):  # type: ignore[misc]  # ships no types
    """A plan is not made of the problem's actions and objects.

    Attributes:
        step: the first step at fault, as written; empty if it is the plan as a whole.
    """

    def __init__(self, step: str, why: str) -> None:
        super().__init__(f"the plan does not fit the problem: {step + ': ' if step else ''}{why}")
        self.step = step


def names_of(problem: Any, plan: Any) -> tuple[Name, ...]:
    """The steps of a ``SequentialPlan`` by name, once it is clear that the problem means the same by them.

    Raises:
        ForeignPlanError: if it does not.
    """
    if plan.actions and plan.environment is not problem.environment:
        raise ForeignPlanError("", "it belongs to another environment")
    found = []
    for instance in plan.actions:
        name = instance.action.name
        if not problem.has_action(name):
            raise ForeignPlanError(str(instance), f"there is no action {name}")
        if problem.action(name) != instance.action:
            raise ForeignPlanError(str(instance), f"the action {name} is another one")
        things = [term.object() for term in instance.actual_parameters]
        for thing in things:
            if not problem.has_object(thing.name) or problem.object(thing.name) != thing:
                raise ForeignPlanError(str(instance), f"there is no object {thing.name}")
        found.append((name, tuple(thing.name for thing in things)))
    return tuple(found)


class Question:
    """A plan to be made good for the present.

    Attributes:
        steps: the plan in ground form, without what can never be done from now on. A step's id is its place in the
            plan as given.
        next_id: the id for the first new step.
    """

    def __init__(self, problem: Any, plan: Any, names: Sequence[Name], present: Present) -> None:
        self._problem = problem
        self._given = tuple(plan.actions)
        self._names = tuple(names)
        self._present = present
        self.steps = self._ground(names)
        self.next_id = len(self._given) + 1  # the one before may be that of an action which notes that the goal holds

    def repaired(self, found: Repaired, before: Links) -> Any:
        """The result with the repaired plan; ``before``: the links of ``steps``."""
        if first_fault(self._present.state, found.plan, self._present.goals):
            return self._failed("the repaired plan does not run through")
        reasons = {
            drop.step.id: "".join((drop.reason.value, *(f", {fact_text(fact)}" for fact in drop.because)))
            for drop in found.dropped
        }
        result = self._solved(Status.SOLVED_SATISFICING, found.plan, reasons)
        result.metrics |= {
            "means": found.means.value,
            "effort": str(found.effort),
            "touched_conditions": str(len(found.certificate(before))),
        }
        return result

    def refused(self, found: Refused) -> Any:
        """The result without a plan."""
        proven = found.why is Refusal.UNSOLVABLE
        status = Status.UNSOLVABLE_PROVEN if proven else Status.UNSOLVABLE_INCOMPLETELY
        metrics = {"refused": found.why.value, "effort": str(found.effort)}
        return PlanGenerationResult(status, None, ENGINE, metrics, _log(map(self._gap, found.missing)))

    def planned(self, found: Any) -> Any:
        """The result with the plan that a planner has found, or with what it says in place of one."""
        if found.plan is None:
            return PlanGenerationResult(found.status, None, ENGINE, {}, found.log_messages)
        names = names_of(self._problem, found.plan)
        plan = self._ground(names, first=self.next_id)
        if len(plan) < len(names) or first_fault(self._present.state, plan, self._present.goals):
            return self._failed(f"the plan of {found.engine_name} does not run through")
        result = self._solved(found.status, plan, dict.fromkeys(range(len(self._given)), PLANNED_ANEW))
        result.metrics["means"] = "planner"
        return result

    def _ground(self, names: Sequence[Name], first: int = 0) -> Plan:
        """The reachable ones among the steps; their ids, from ``first`` on, count the others as well."""
        places = [place for place, name in enumerate(names) if self._present.reachable(name)]
        actions = self._present.actions_of(names[place] for place in places)
        ids = [*places, len(names)]  # for one action more, which may note that the goal is reached
        return tuple(Step(first + id_, action) for id_, action in zip(ids, actions, strict=False))

    def _gap(self, gap: Unsupported) -> str:
        place = gap.consumer
        consumer = self._given[place] if isinstance(place, int) and place < len(self._given) else "the goal"
        return f"nothing makes {gap.condition} hold for {consumer}"

    def _solved(self, status: Any, steps: Plan, reasons: Mapping[int, str]) -> Any:
        """A result with a plan made of the very instances of the given one, as far as it has them.

        Args:
            status: of the result.
            steps: the plan; ids below the length of the given plan are places in it.
            reasons: why steps were dropped, by their ids.
        """
        kept = {step.id for step in steps}
        spare: dict[Name, list[int]] = {}
        for place, name in reversed(tuple(enumerate(self._names))):
            if place not in kept:
                spare.setdefault(name, []).append(place)
        plan, added = [], []
        for step in steps:
            step_name = self._present.original(step.action)
            if step_name is None:
                continue
            if step.id < len(self._given):
                plan.append(self._given[step.id])
            elif places := spare.get(step_name):  # a new step, yet one that the given plan had in another place
                plan.append(self._given[places.pop()])
            else:
                added.append(self._instance(step_name))
                plan.append(added[-1])
        dropped = sorted(place for places in spare.values() for place in places)
        story = [f"dropped {self._given[place]}: {reasons.get(place, GONE)}" for place in dropped]
        story += [f"added {instance}" for instance in added]
        metrics = {
            "steps_kept": str(len(plan) - len(added)),
            "steps_dropped": str(len(dropped)),
            "steps_added": str(len(added)),
        }
        environment = self._problem.environment
        return PlanGenerationResult(status, SequentialPlan(plan, environment), ENGINE, metrics, _log(story))

    def _instance(self, name: Name) -> Any:
        return ActionInstance(self._problem.action(name[0]), [self._problem.object(arg) for arg in name[1]])

    def _failed(self, why: str) -> Any:
        status = Status.INTERNAL_ERROR
        return PlanGenerationResult(status, None, ENGINE, {}, [LogMessage(LogLevel.ERROR, why)])


def _log(lines: Iterable[str]) -> list[Any]:
    return [LogMessage(LogLevel.INFO, line) for line in lines]
