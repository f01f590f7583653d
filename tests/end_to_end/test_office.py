"""In the office, help of every kind arises from the robots' own work, and it is worth something."""

from collections import Counter
from dataclasses import replace

import pytest

from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world

SEEDS = 20


@pytest.fixture(scope="module")
def office() -> World:
    """The world as shipped."""
    return read_world(shipped("worlds") / "office.yaml")


def finished(world: World, seed: int) -> RunResult:
    """The world run to its end with one seed."""
    with Run(replace(world, seed=seed), "clo") as run:
        return run.finish()


@pytest.mark.timeout(500)
def test_objects_prepared_delivered_and_handed_over_by_others_are_used(office: World) -> None:
    """Each kind makes steps needless in at least 80% of the runs, though no disturbance is in the world."""
    assert office.disturbances == ()
    results = [finished(office, seed) for seed in range(SEEDS)]
    assert {result.outcome for result in results} == {"goals_reached"}
    shown = Counter(kind for result in results for kind in {given.kind for given in result.helps})
    assert all(shown[kind] >= 0.8 * SEEDS for kind in ("prepared", "delivered", "handed_over")), shown


@pytest.mark.parametrize("seed", range(3))
def test_without_the_helpers_a_robot_has_more_to_do(office: World, seed: int) -> None:
    """With the other robots taken out, the collector carries out more actions."""
    alone = replace(office, robots=tuple(spec for spec in office.robots if spec.id == "r1"))
    assert finished(alone, seed).robots["r1"].executed > finished(office, seed).robots["r1"].executed
