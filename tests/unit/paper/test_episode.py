"""Runs of the study with the real planner: what they find, and that they repeat."""

from collections.abc import Iterator
from dataclasses import asdict, replace

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.paper.catalogue import SETTINGS, SIZES
from clo_fleet.paper.crew import Crew
from clo_fleet.paper.episode import PAPER_LIMITS
from clo_fleet.paper.reference import PLAN_LENGTHS
from clo_fleet.paper.rows import Row, Run

RUN = Run("rooms", 5, 0.5, "clo", "in-process", 0)


@pytest.fixture(scope="module")
def crew() -> Iterator[Crew]:
    """Two workers, shared for their start takes seconds."""
    with Crew(PAPER_LIMITS) as found:
        yield found


def timeless(row: Row) -> dict[str, object]:
    """The row without its readings of the clock."""
    return {name: value for name, value in asdict(row).items() if not name.startswith("wall_")}


def by_run(crew: Crew, *runs: Run) -> dict[Run, Row]:
    """The rows of the runs."""
    return {row.run: row for row in crew.rows(runs)}


def test_first_plans_are_as_long_as_the_papers(crew: Crew) -> None:
    """Fast Downward's ``lama-first`` finds 14, 29, 59, 119; 30, 60, 120, 240; 35, 85, 185, 385 actions."""
    runs = [replace(RUN, domain=domain, size=size) for domain in SETTINGS for size in SIZES]
    rows = by_run(crew, *runs)
    for domain, lengths in PLAN_LENGTHS.items():
        assert tuple(rows[replace(RUN, domain=domain, size=size)].first_plan for size in SIZES) == lengths


@pytest.mark.parametrize("domain", SETTINGS)
def test_every_strategy_reaches_the_goals(crew: Crew, domain: str) -> None:
    """All in the same world: as long as they do the same, they get the same help."""
    runs = [replace(RUN, domain=domain, strategy=name) for name in STRATEGIES]
    rows = by_run(crew, *runs)
    assert {row.outcome for row in rows.values()} == {"goals reached"}
    clo, replan = rows[runs[0]], rows[replace(runs[0], strategy="replan")]
    assert clo.planner_calls == 1
    assert replan.planner_calls == replan.executed  # one before each action: each shows something new
    assert clo.looked_at < replan.looked_at
    assert clo.noticed < replan.noticed
    assert rows[replace(runs[0], strategy="clo-improve")].executed <= clo.executed


def test_the_same_run_gives_the_same_row_on_either_route(crew: Crew) -> None:
    """Clock readings apart; both routes find the same plans, so that what they cost can be compared."""
    run = replace(RUN, strategy="replan")
    (one,), (again,) = by_run(crew, run).values(), by_run(crew, run).values()
    assert timeless(one) == timeless(again)
    through_up = replace(run, route="unified-planning")
    (slow,) = by_run(crew, through_up).values()
    assert timeless(slow) | {"route": run.route} == timeless(one)
    assert 0 < one.wall_search < one.wall_planning < slow.wall_planning
