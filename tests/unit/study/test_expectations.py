"""What a world expects of its runs."""

from dataclasses import replace

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.expectations import disappointments
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


def test_each_disappointment_names_path_value_and_expectation(fleet_planners: PlannerPool) -> None:
    """A value that differs, a path that leads nowhere, and what concerns another strategy."""
    world = read_world(shipped("worlds") / "hello.yaml")
    with Run(world, planners=fleet_planners) as run:
        run.step()
        result = run.result()
    expected = (
        ("outcome", "goals_reached"),
        ("clo: robots.r9.executed", "1"),
        ("replan: outcome", "stuck"),
        ("clo: robots.r1.planned", "3"),
    )
    assert disappointments(replace(world, expected=expected), result) == (
        "outcome is running, expected goals_reached",
        "robots.r9.executed is missing, expected 1",
    )
