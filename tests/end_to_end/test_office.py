"""In the office, help of every kind arises from the robots' own work, and it is worth something."""

from collections import Counter
from dataclasses import replace

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world

SEEDS = 3
MANY_SEEDS = 20


@pytest.fixture(scope="module")
def office() -> World:
    """The world as shipped."""
    return read_world(shipped("worlds") / "office.yaml")


@pytest.fixture(scope="module")
def together(office: World, fleet_planners: PlannerPool) -> list[RunResult]:
    """Of the world as shipped, with a few seeds."""
    return [finished(office, seed, fleet_planners) for seed in range(SEEDS)]


def finished(world: World, seed: int, planners: PlannerPool) -> RunResult:
    """The world run to its end with one seed."""
    with Run(replace(world, seed=seed), "clo", planners=planners) as run:
        return run.finish()


def assert_help_of_every_kind(results: list[RunResult]) -> None:
    """All runs reach the goals, and in at least 80% of them each kind of help makes steps needless."""
    assert {result.outcome for result in results} == {"goals_reached"}
    shown = Counter(kind for result in results for kind in {given.kind for given in result.helps})
    assert all(shown[kind] >= 0.8 * len(results) for kind in ("prepared", "delivered", "handed_over")), shown


def test_objects_prepared_delivered_and_handed_over_by_others_are_used(
    office: World, together: list[RunResult]
) -> None:
    """Each kind makes steps needless, though no disturbance is in the world."""
    assert office.disturbances == ()
    assert_help_of_every_kind(together)


@pytest.mark.study
def test_help_of_every_kind_is_usual(office: World, fleet_planners: PlannerPool) -> None:
    """The same with many seeds."""
    assert_help_of_every_kind([finished(office, seed, fleet_planners) for seed in range(MANY_SEEDS)])


@pytest.mark.parametrize("seed", range(SEEDS))
def test_without_the_helpers_a_robot_has_more_to_do(
    office: World, together: list[RunResult], seed: int, fleet_planners: PlannerPool
) -> None:
    """With the other robots taken out, the collector carries out more actions."""
    alone = replace(office, robots=tuple(spec for spec in office.robots if spec.id == "r1"))
    assert finished(alone, seed, fleet_planners).robots["r1"].executed > together[seed].robots["r1"].executed
