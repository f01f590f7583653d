"""Planning tasks: built from beliefs, and checked against their domain."""

from dataclasses import replace
from typing import Any

import pytest

from clo_fleet.clo.task import Fact
from clo_fleet.planning import wire
from clo_fleet.planning.problem import PlanningTask, PlanningTaskError, Scene, check, planning_task
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import SkillSettings
from clo_fleet.world.pddl import fleet_domain
from clo_fleet.world.vocabulary import Names, Vocabulary

SCENE = Scene(
    words=Vocabulary(
        fleet_binding(), Names(robots=("r1", "r2"), objects=("o1",), rooms=("l1", "l2"), zones=("z1", "z2"))
    ),
    travel={("l1", "l2"): 70, ("l2", "l1"): 80, ("z1", "l1"): 30, ("z2", "l1"): 40},
    skills=SkillSettings(prepare=1.26),
)
IN_ROOM = frozenset({("at-robot", "r1", "l1"), ("at-robot", "r2", "z1"), ("at-object", "o1", "l2")})
IN_ZONE = frozenset({("at-robot", "r1", "z2"), ("at-robot", "r2", "z1"), ("at-object", "o1", "l2")})
GOAL: Fact = ("holding", "r1", "o1")


def test_a_robot_in_a_room_plans_among_rooms() -> None:
    """Zones, and what is believed of them, stay out of the task."""
    task = planning_task("r1", SCENE, IN_ROOM, [GOAL])
    check(task, fleet_domain())
    assert dict(task.objects)["place"] == ("l1", "l2")
    assert ("at-robot", "r2", "z1") not in task.facts
    assert {fact for fact in task.facts if fact[0] == "connected"} == {
        ("connected", "l1", "l2"),
        ("connected", "l2", "l1"),
    }
    assert {("self", "r1"), ("room", "l1"), ("room", "l2")} <= task.facts


def test_a_robot_on_its_way_plans_from_its_zone() -> None:
    """Its own zone is a place that leads out, and no room."""
    task = planning_task("r1", SCENE, IN_ZONE, [GOAL])
    check(task, fleet_domain())
    assert dict(task.objects)["place"] == ("l1", "l2", "z2")
    assert ("connected", "z2", "l1") in task.facts
    assert ("room", "z2") not in task.facts


def test_costs_are_whole_tenths_of_a_second() -> None:
    """Skills cost their duration, moves the travel time."""
    costs = dict(planning_task("r1", SCENE, IN_ROOM, [GOAL]).costs)
    assert costs[("prepare-time",)] == 13
    assert costs[("travel-time", "l2", "l1")] == 80


def test_nobody_meets_itself() -> None:
    """Of the announced places, the planning robot's own are left out."""
    meets = [("meets", "r1", "l1"), ("meets", "r2", "l1")]
    task = planning_task("r1", SCENE, IN_ROOM, [GOAL], meets)
    assert {fact for fact in task.facts if fact[0] == "meets"} == {("meets", "r2", "l1")}


def test_a_task_comes_back_from_json_as_it_was() -> None:
    """The worker plans exactly what was asked."""
    task = planning_task("r1", SCENE, IN_ZONE, [GOAL])
    assert wire.task_of(wire.task_json(task)) == task


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"goals": (("holding", "r1", "o9"),)}, "goals: (holding r1 o9): unknown object o9"),
        ({"goals": (("holding", "o1", "r1"),)}, "goals: (holding o1 r1): o1 is a item, expected a robot"),
        ({"goals": (("holds", "r1", "o1"),)}, "goals: (holds r1 o1): holds is not declared"),
        ({"facts": frozenset({("prepared", "o1", "o1")})}, "facts: (prepared o1 o1): expected 1 arguments, got 2"),
        ({"objects": (("robot", ("r1", "r1")),)}, "objects: r1 is named 2 times"),
        ({"objects": (("car", ("r1",)),)}, "objects: unknown type car"),
        ({"costs": ((("give-time",), -1),)}, "costs: (give-time): -1 is below zero"),
        ({"costs": ()}, "costs: (give-time) has no value"),
        ({"costs": ()}, "costs: (travel-time l1 l2) has no value"),
    ],
)
def test_a_task_that_does_not_fit_is_refused_with_every_fault(change: dict[str, Any], fault: str) -> None:
    """Each fault says where and what."""
    task: PlanningTask = replace(planning_task("r1", SCENE, IN_ROOM, [GOAL]), **change)
    with pytest.raises(PlanningTaskError) as caught:
        check(task, fleet_domain())
    assert fault in caught.value.faults
