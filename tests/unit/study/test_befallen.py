"""What befell a fleet, in words, and what followed from it."""

import typing

from clo_fleet.robot.robot import MISHAP
from clo_fleet.study.befallen import SENTENCES, disturbance_told, disturbances
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.result import DisturbanceResult
from clo_fleet.world.disturbances import Disturbance, kind_of
from clo_fleet.world.events import (
    ActionEnded,
    Disturbed,
    Event,
    PlanFailed,
    PlanMended,
    PlanRequested,
    Sensed,
    StepsLeftOut,
)


def log(*events: tuple[float, Event]) -> list[Recorded]:
    """A log of these events."""
    return [(number, time, event) for number, (time, event) in enumerate(events)]


def test_every_kind_has_its_sentence() -> None:
    """A new kind of disturbance cannot be forgotten here."""
    kinds = {kind_of(object.__new__(kind)) for kind in typing.get_args(Disturbance)}
    assert kinds == SENTENCES.keys()
    assert disturbance_told(Disturbed("object_moved", "cup", "to 3 4")) == "somebody moved cup (to 3 4)"


def test_a_repair_is_put_down_to_what_its_robot_has_just_learnt() -> None:
    """A fact about the object, which no robot brought about; what a robot did is no disturbance's."""
    fact = ("at-object", "cup", "a")
    dropped = StepsLeftOut("r1", (), "why", fact, None, None)
    events = log(
        (1.0, Disturbed("object_moved", "cup", "")),
        (2.0, Sensed("r1", fact, True, "sight", False, None, None)),
        (2.0, dropped),
        (2.0, PlanMended("r1", (), (), "a bridge")),
        (3.0, Sensed("r1", fact, False, "sight", False, "r2", 7)),
        (3.0, dropped),
        (4.0, Sensed("r2", fact, False, "sight", False, None, None)),
        (4.0, PlanRequested("r2", "the repair was refused")),
        (4.0, dropped),
    )
    assert disturbances(events) == {"object_moved": DisturbanceResult(1, 0, 1, 1)}


def test_failed_actions_and_dead_planners_cost_as_well() -> None:
    """A mishap, a failure over an object that was taken, and a killed planner; what had no effect costs none."""
    events = log(
        (1.0, Disturbed("skill_fails", "r1", "grasp")),
        (1.0, Disturbed("object_taken", "cup", "")),
        (1.0, Disturbed("object_taken", "mug", "no effect: it is gone", effect=False)),
        (1.0, Disturbed("planner_killed", "r2", "")),
        (2.0, ActionEnded("r1", 1, "grasp(r1, pen, a)", "failed", MISHAP, 0)),
        (2.0, PlanMended("r1", (), (), "a bridge")),
        (3.0, ActionEnded("r1", 2, "grasp(r1, cup, a)", "failed", "not there", 0)),
        (3.0, PlanRequested("r1", "the repair was refused")),
        (3.0, PlanFailed("r2", "the planner died", "killed")),
        (3.0, PlanRequested("r2", "the planner died: once more")),
    )
    assert disturbances(events) == {
        "object_taken": DisturbanceResult(1, 1, 0, 1),
        "planner_killed": DisturbanceResult(1, 0, 0, 1),
        "skill_fails": DisturbanceResult(1, 0, 1, 0),
    }
