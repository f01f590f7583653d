"""What befell the fleet, in words, and what it cost: which repairs and replans followed from it.

A change of plan is put down to a kind of disturbance if, at the same moment, its robot had learnt a fact about whom the
disturbance befell that no robot's action had brought about, or an action on it had failed, or its planner had died.
"""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from clo_fleet.clo.messages import PlanFailure
from clo_fleet.robot.robot import MISHAP
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.result import DisturbanceResult
from clo_fleet.world import events

__all__ = ["disturbance_told", "disturbances"]

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "corridor_closed": "corridor {} was closed",
        "corridor_opened": "corridor {} was opened again",
        "door_closed": "door {} was closed",
        "door_opened": "door {} was opened again",
        "object_moved": "somebody moved {}",
        "object_taken": "somebody took {} away",
        "object_returned": "somebody brought {} back",
        "object_prepared": "somebody prepared {}",
        "object_dropped": "{} was dropped",
        "fact_turned": "{} changed by itself",
        "robot_slowed": "{} became slow",
        "robot_recovered": "{} is as fast as before",
        "robot_broken": "{} broke down",
        "robot_repaired": "{} was repaired",
        "skill_fails": "from now on skills of {} fail",
        "sensor_blinded": "{} went blind",
        "sensor_restored": "{} sees again",
        "radio_lost": "the radio of {} was lost",
        "radio_restored": "the radio of {} works again",
        "planner_killed": "the planner of {} was killed",
        "planner_slowed": "the planner of {} became slower",
        "planner_recovered": "the planner of {} is as fast as before",
    }
)


def disturbance_told(event: events.Disturbed) -> str:
    """What happened, as a sentence."""
    sentence = SENTENCES.get(event.disturbance, event.disturbance + " {}").format(event.subject)
    return f"{sentence} ({event.detail})" if event.detail else sentence


def disturbances(log: Sequence[Recorded]) -> dict[str, DisturbanceResult]:
    """How often each kind befell the fleet and what followed, sorted by kind."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    latest: dict[str, str] = {}  # whom something befell -> the kind, the last one
    reasons: dict[tuple[str, float], set[str]] = defaultdict(set)  # what a robot had to deal with at a moment
    repaired: set[tuple[str, float]] = set()
    for _, time, event in log:
        if isinstance(event, events.Disturbed):
            counts[event.disturbance][0 if event.effect else 1] += 1
            if event.effect:
                latest[event.subject] = event.disturbance
            continue
        robot = getattr(event, "robot", None)
        if robot is None:
            continue
        moment = (robot, time)
        reasons[moment] |= _reasons(event, latest)
        if isinstance(event, events.StepsLeftOut | events.PlanMended) and moment not in repaired:
            repaired.add(moment)
            for kind in reasons[moment]:
                counts[kind][2] += 1
        elif isinstance(event, events.PlanRequested):
            for kind in reasons[moment]:
                counts[kind][3] += 1
    return {kind: DisturbanceResult(*counts[kind]) for kind in sorted(counts)}


def _reasons(event: events.Event, latest: Mapping[str, str]) -> set[str]:
    """The kinds of disturbances that this is about."""
    match event:
        case events.Sensed(fact=fact, by=None):
            return {latest[name] for name in fact[1:] if name in latest and not _of_robots(latest[name])}
        case events.ActionEnded(ending="failed", reason=reason) if reason == MISHAP:
            return {"skill_fails"}
        case events.ActionEnded(ending="failed", action=action):
            names = re.split(r"[(), ]+", action)[1:]
            return {latest[name] for name in names if name in latest and not _of_robots(latest[name])}
        case events.PlanFailed(reason=reason, detail="killed") if reason == PlanFailure.DIED.value:
            return {"planner_killed"}
        case _:
            return set()


def _of_robots(kind: str) -> bool:
    """Whether the kind befalls robots: that a fact names a robot says nothing about what befell it."""
    return kind.startswith(("robot", "skill", "sensor", "radio", "planner"))
