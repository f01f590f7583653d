"""Every world that comes with the package is what its file says."""

from collections import Counter
from pathlib import Path

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.expectations import disappointments
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.events import PlanFailed
from clo_fleet.world.world_file import read_world

WORLDS = sorted(shipped("worlds").glob("*.yaml"))
LARGE = ("campus", "hospital", "warehouse")  # which run with the cheapest strategies only
ALL = [
    (path, name)
    for path in WORLDS
    for name in STRATEGIES
    if path.stem not in LARGE or name in ("clo", "replan-on-failure")
]
WITH_ALL = ("bad_day", "cooking", "hello", "three_rooms")


def usual(path: Path, strategy: str) -> bool:
    """Whether a pair is run at every change: `clo`, all that a file expects something of, and some worlds with all."""
    named = any(key.startswith(f"{strategy}: ") for key, _ in read_world(path).expected)
    return strategy == "clo" or path.stem in WITH_ALL or named


PAIRS = [pytest.param(*pair, marks=() if usual(*pair) else pytest.mark.study) for pair in ALL]


@pytest.mark.parametrize(("path", "strategy"), PAIRS, ids=lambda value: getattr(value, "stem", value))
def test_a_world_is_as_its_file_expects(path: Path, strategy: str, fleet_planners: PlannerPool) -> None:
    """The run reaches the outcome and the figures in the world's table ``expected``, and its counts add up.

    With `clo`, every call of the planner after the first follows a refused repair, or a call without a plan.
    """
    world = read_world(path)
    assert world.expected, "a world says what is expected of it"
    with Run(world, strategy, planners=fleet_planners) as run:
        result = run.finish()
        assert disappointments(world, result) == ()
        assert all(run.mission.robot(robot).executive.tally.adds_up for robot in result.robots)
    if strategy == "clo":
        unanswered = Counter(event.robot for _, _, event in run.log if isinstance(event, PlanFailed))
        for name, robot in result.robots.items():
            assert robot.planner_calls <= 1 + robot.repairs_refused + unanswered[name]
