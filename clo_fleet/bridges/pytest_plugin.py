"""A plugin for pytest: the fixtures ``fleet_world`` and ``run_fleet``, for tests of worlds, strategies and robots.

It is loaded by itself in every pytest run where clo-fleet is installed. So it imports nothing of clo-fleet before a
test asks for a fixture: neither engines nor what others may want to measure from the first line on.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from clo_fleet.planning.pool import PlannerPool
    from clo_fleet.testing import FleetWorld, RunFleet

__all__ = ["fleet_planners", "fleet_world", "run_fleet"]


@pytest.fixture
def fleet_world(tmp_path: Path) -> "FleetWorld":
    """Empty worlds to put robots and objects in: ``fleet_world("kitchen", "office").robot(...).thing(...)``."""
    from clo_fleet.testing import FleetWorld

    return FleetWorld(tmp_path)


@pytest.fixture(scope="session")
def fleet_planners() -> "Iterator[PlannerPool]":
    """Planners that wait for the next run: starting them takes longer than most tests. They end with the session."""
    from clo_fleet.study.run import planner_pool

    with planner_pool() as planners:
        yield planners


@pytest.fixture
def run_fleet(fleet_planners: "PlannerPool") -> "Iterator[RunFleet]":
    """Starts runs, ``run_fleet(world, strategy="clo")``; when the test is over, SUMO is closed and nobody plans."""
    from clo_fleet.testing import RunFleet

    with RunFleet(fleet_planners) as runs:
        yield runs
