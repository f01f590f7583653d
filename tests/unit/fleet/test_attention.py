"""A robot that has looked need not look again while nothing changes; what it believes in the end is the same."""

import pytest

from clo_fleet.fleet.attention import Attention
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world


@pytest.mark.parametrize("world", ["hello", "three_rooms"])
def test_resting_changes_nothing(world: str, monkeypatch: pytest.MonkeyPatch, fleet_planners: PlannerPool) -> None:
    """The log, and the count of facts looked at, are those of robots that look in every tick."""
    ends = []
    for rests in (True, False):
        if not rests:
            monkeypatch.setattr(Attention, "rest", lambda *_: None)
        with Run(read_world(shipped("worlds") / f"{world}.yaml"), "clo", planners=fleet_planners) as run:
            result = run.finish()
            ends.append((run.log, [robot.facts_looked_at for robot in result.robots.values()]))
    assert ends[0] == ends[1]


def test_who_rests_is_not_asked_to_look(fleet_planners: PlannerPool) -> None:
    """Most robots in most ticks of a run."""
    with Run(read_world(shipped("worlds") / "hello.yaml"), "clo", planners=fleet_planners) as run:
        run.step(40)
        attention = run.mission._conversation._attention
        assert len(attention.looking()) < len(run.mission.robots)
