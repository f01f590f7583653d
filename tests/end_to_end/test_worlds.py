"""Every world that comes with the package is what its file says, with every strategy."""

from pathlib import Path

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.study.expectations import disappointments
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

WORLDS = sorted(shipped("worlds").glob("*.yaml"))
CHEAP = "replan-on-failure"
LARGE = ("campus", "hospital", "warehouse")  # which run with the cheapest strategies only
PAIRS = [(path, name) for path in WORLDS for name in STRATEGIES if path.stem not in LARGE or name in ("clo", CHEAP)]


@pytest.mark.parametrize(("path", "strategy"), PAIRS, ids=lambda value: getattr(value, "stem", value))
def test_a_world_is_as_its_file_expects(path: Path, strategy: str) -> None:
    """The run reaches the outcome and the figures in the world's table ``expected``, and its counts add up."""
    world = read_world(path)
    assert world.expected, "a world says what is expected of it"
    with Run(world, strategy) as run:
        result = run.finish()
        assert disappointments(world, result) == ()
        assert all(run.mission.robot(robot).executive.tally.adds_up for robot in result.robots)


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_with_clo_a_robot_plans_once_unless_the_log_says_why(path: Path) -> None:
    """Every call of the planner after the first follows a refused repair in the log."""
    with Run(read_world(path), "clo") as run:
        result = run.finish()
    for robot in result.robots.values():
        assert robot.planner_calls <= 1 + robot.repairs_refused
