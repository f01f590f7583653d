"""From a mission and its events to its result. Every figure is counted from the events or read off the robots."""

from collections import Counter
from collections.abc import Iterator, Sequence

from clo_fleet import __version__
from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.fleet.mission import Mission
from clo_fleet.study.befallen import disturbances
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.result import RESULT_FORMAT, Help, RobotResult, RunResult
from clo_fleet.world import events

__all__ = ["helps", "measure"]

KINDS = {"prepare": "prepared", "place": "delivered", "give": "handed_over"}


Timed = tuple[float, events.Event]


def measure(mission: Mission, log: Sequence[Recorded], wall_run: float) -> RunResult:
    """The result of the mission as it stands."""
    world = mission.world
    given = helps(log)
    own: dict[str, list[Timed]] = {spec.id: [] for spec in world.robots}
    for _, time, event in log:
        if (robot := getattr(event, "robot", None)) in own:
            own[robot].append((time, event))
    return RunResult(
        format=RESULT_FORMAT,
        version=__version__,
        world=world.name,
        map=world.map.name,
        strategy=mission.strategy.name,
        seed=world.seed,
        outcome=mission.outcome.value if mission.outcome else "running",
        why=mission.why,
        makespan_s=mission.time,
        robots={robot: _robot(mission, own[robot], robot) for robot in sorted(own)},
        helps=given,
        disturbances=disturbances(log),
        contacts=mission.contacts,
        events=len(log),
        wall_limited=mission.questions.wall_limited,
        wall_run_s=round(wall_run, 3),
    )


def helps(log: Sequence[Recorded]) -> tuple[Help, ...]:
    """Who helped whom: steps left out of a plan, or stopped under way, because of what another's action changed."""
    found: dict[tuple[str, float, Fact, str], Help] = {}  # one for each fact that a robot learns of
    for time, event in spared([(time, event) for _, time, event in log]):
        if event.fact is None or event.by in (None, event.robot):
            continue
        cause = log[event.cause][2] if event.cause is not None else None
        action = cause.action if isinstance(cause, events.ActionStarted | events.AlsoHappened) else ""
        steps = event.steps if isinstance(event, events.StepsLeftOut) else ((event.step, event.action),)
        key = (event.robot, time, event.fact, str(event.by))
        found[key] = Help(
            by=str(event.by),
            robot=event.robot,
            fact=fact_text(event.fact),
            kind=KINDS.get(action.partition("(")[0], "other"),
            action=action,
            dropped=(*(found[key].dropped if key in found else ()), *(name for _, name in steps)),
            time_s=time,
        )
    return tuple(found.values())


def spared(told: Sequence[Timed]) -> Iterator[tuple[float, events.StepsLeftOut | events.ActionCalledOff]]:
    """The steps left out of plans, and the actions that were called off in time."""
    stopped = {
        (event.robot, event.step)
        for _, event in told
        if isinstance(event, events.ActionEnded) and event.ending == "cancelled"
    }
    for time, event in told:
        if isinstance(event, events.StepsLeftOut) or (
            isinstance(event, events.ActionCalledOff) and (event.robot, event.step) in stopped
        ):
            yield time, event


def _robot(mission: Mission, mine: Sequence[Timed], robot: str) -> RobotResult:
    known = mission.robot(robot)
    tally, meters = known.executive.tally, known.meters
    desk = mission.questions.desks[known.id]
    sensed = [event for _, event in mine if isinstance(event, events.Sensed)]
    seen = {event.fact: event.by for event in sensed if event.opportunity and event.by is not None}
    used: set[Fact] = {event.fact for _, event in spared(mine) if event.fact}
    repairs = {time for time, event in mine if isinstance(event, events.StepsLeftOut | events.PlanMended)}
    return RobotResult(
        goals=tuple(fact_text(goal) for goal in known.spec.goals),
        goals_reached=all(goal in mission.facts for goal in known.spec.goals),
        planned=tally.planned,
        planned_again=tally.planned_again,
        added=tally.added,
        executed=tally.executed,
        dropped=tally.dropped,
        cancelled=tally.cancelled,
        failed=tally.failed,
        superseded=tally.superseded,
        pending=tally.pending,
        planner_calls=tally.planner_calls,
        repairs=len(repairs),
        repairs_refused=sum(isinstance(event, events.RepairFailed) for _, event in mine),
        opportunities_seen=len(seen),
        opportunities_used=len(used & set(seen)),
        opportunities_by=dict(sorted(Counter(seen.values()).items())),
        facts_looked_at=mission.looked(robot),
        facts_seen=sum(event.source == "sight" for event in sensed),
        facts_heard=sum(event.source == "radio" for event in sensed),
        expansions=desk.expansions,
        planning_s=round(desk.seconds, 3),
        travelling_s=round(meters.travelling, 1),
        working_s=round(meters.working, 1),
        waiting_s=round(meters.waiting, 1),
        waiting_for_s=dict(sorted(mission.waits.seconds.get(known.id, {}).items())),
        distance_m=round(meters.distance, 2),
        wall_planning_s=round(desk.wall_seconds, 3),
        wall_deciding_s=round(mission.wall_deciding[known.id], 6),
    )
