"""Every world that comes with the package is what its file says, with every strategy."""

from collections import Counter
from pathlib import Path

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.study.expectations import disappointments
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.events import PlanFailed
from clo_fleet.world.world_file import read_world

WORLDS = sorted(shipped("worlds").glob("*.yaml"))
CHEAP = "replan-on-failure"
LARGE = ("campus", "hospital", "warehouse")  # which run with the cheapest strategies only
PAIRS = [(path, name) for path in WORLDS for name in STRATEGIES if path.stem not in LARGE or name in ("clo", CHEAP)]


@pytest.mark.parametrize(("path", "strategy"), PAIRS, ids=lambda value: getattr(value, "stem", value))
def test_a_world_is_as_its_file_expects(path: Path, strategy: str) -> None:
    """The run reaches the outcome and the figures in the world's table ``expected``, and its counts add up.

    With `clo`, every call of the planner after the first follows a refused repair, or a call without a plan.
    """
    world = read_world(path)
    assert world.expected, "a world says what is expected of it"
    with Run(world, strategy) as run:
        result = run.finish()
        assert disappointments(world, result) == ()
        assert all(run.mission.robot(robot).executive.tally.adds_up for robot in result.robots)
    if strategy == "clo":
        unanswered = Counter(event.robot for _, _, event in run.log if isinstance(event, PlanFailed))
        for name, robot in result.robots.items():
            assert robot.planner_calls <= 1 + robot.repairs_refused + unanswered[name]
