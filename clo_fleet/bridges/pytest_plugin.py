"""A plugin for pytest: the fixtures ``fleet_world`` and ``run_fleet``, for tests of worlds, strategies and robots.

It is loaded by itself in every pytest run where clo-fleet is installed. So it imports nothing of clo-fleet before a
test asks for a fixture: neither engines nor what others may want to measure from the first line on.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from clo_fleet.testing import FleetWorld, RunFleet

__all__ = ["fleet_world", "run_fleet"]


@pytest.fixture
def fleet_world(tmp_path: Path) -> "FleetWorld":
    """Empty worlds to put robots and objects in: ``fleet_world("kitchen", "office").robot(...).thing(...)``."""
    from clo_fleet.testing import FleetWorld

    return FleetWorld(tmp_path)


@pytest.fixture
def run_fleet() -> "Iterator[RunFleet]":
    """Starts runs, ``run_fleet(world, strategy="clo")``; closes SUMO and ends the planners when the test is over."""
    from clo_fleet.testing import RunFleet

    with RunFleet() as runs:
        yield runs
