"""What executives decide, as events of the log."""

from clo_fleet.clo.messages import Command, Finished, PlanAdopted, PlanMended, RepairRefused, StepsDropped, Waits
from clo_fleet.clo.plan import Plan, cost
from clo_fleet.clo.task import fact_text
from clo_fleet.robot.robot import Robot
from clo_fleet.world import events
from clo_fleet.world.events import credit
from clo_fleet.world.model import RobotId

__all__ = ["changes_plan", "decision_told", "plan_linked"]


def changes_plan(command: Command) -> bool:
    """Whether the plan is another one by this decision."""
    return isinstance(command, PlanAdopted | StepsDropped | PlanMended)


def decision_told(robot: RobotId, decision: Command, expansions: int) -> events.Event:
    """The event that says what an executive has decided. ``expansions``: the planner's, if it answered just now."""
    match decision:
        case PlanAdopted(plan, superseded, _):
            gone = tuple(step.action.name for step in superseded)
            return events.PlanFollowed(robot, _named(plan), gone, expansions, cost(plan))
        case StepsDropped(plan, reason, fact, cause):
            return events.StepsLeftOut(robot, _named(plan), reason, fact, *credit(cause))
        case PlanMended(added, plan, means):
            return events.PlanMended(robot, _named(added), _named(plan), means)
        case RepairRefused(why):
            return events.RepairFailed(robot, why)
        case Waits(why):
            return events.Waiting(robot, why)
        case Finished(outcome, why):
            return events.GaveUp(robot, outcome, why)
        case _:
            return events.GoalsReached(robot)


def plan_linked(robot: Robot) -> events.PlanLinked:
    """The event that says what holds the robot's plan together."""
    executive = robot.executive
    watch = executive.watch
    return events.PlanLinked(
        robot.id,
        tuple(
            (link.producer, str(link.condition), link.consumer if isinstance(link.consumer, int) else None)
            for link in executive.links.links
        ),
        tuple(sorted(map(fact_text, watch))) if isinstance(watch, frozenset) else None,
    )


def _named(plan: Plan) -> tuple[tuple[int, str], ...]:
    return tuple((step.id, step.action.name) for step in plan)
