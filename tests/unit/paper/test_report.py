"""From rows to the table beside the paper's, and to the figure."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.paper.figure import draw
from clo_fleet.paper.report import report
from clo_fleet.paper.rows import Row
from clo_fleet.paper.summary import cells, write_csv

CLO = Row(
    domain="rooms",
    size=10,
    probability=0.1,
    strategy="clo",
    route="in-process",
    seed=0,
    outcome="goals reached",
    executed=27,
    planner_calls=1,
    looked_at=270,
    wall_planning=0.5,
    wall_deciding=0.1,
    wall_first_planning=0.5,
)
REPLAN = replace(CLO, strategy="replan", executed=26, planner_calls=26, wall_planning=6.0)


def rows(row: Row, *executed: int) -> list[Row]:
    """A row for each seed."""
    return [replace(row, seed=seed, executed=count) for seed, count in enumerate(executed)]


@pytest.mark.parametrize(
    ("executed", "inside"), [((20, 24, 28, 32), True), ((28, 29, 30), False), ((27,), True), ((20, 21, 26), False)]
)
def test_the_papers_number_is_held_against_the_percentiles(executed: tuple[int, ...], inside: bool) -> None:
    """27 actions for CLO in ROOMS p-10 at 0.1."""
    (cell,) = cells(rows(CLO, *executed)).values()
    assert cell.inside is inside


def test_a_dash_is_met_by_a_dash() -> None:
    """DIALOG p-40 at 0.1 has a dash for REPLAN: it takes most runs over a limit."""
    late = replace(REPLAN, domain="dialog", size=40, outcome="limit of the run, 1800 s")
    (cell,) = cells([late, replace(late, seed=1)]).values()
    assert cell.dash
    assert cell.inside is True
    assert cell.why == "limit of the run, 1800 s (2 of 2)"
    (done,) = cells([replace(late, outcome="goals reached")]).values()
    assert done.inside is False


def test_strategies_the_paper_lacks_and_other_routes_are_not_compared() -> None:
    """Neither has a number to be compared with."""
    others = [replace(REPLAN, strategy="replan-on-failure"), replace(REPLAN, route="unified-planning")]
    assert [cell.inside for cell in cells(others).values()] == [None, None]


def test_what_did_not_come_out_is_said_first() -> None:
    """The first section names each number that lies outside, and the claims that do not hold here."""
    text = report(cells(rows(CLO, 28, 29, 30) + rows(REPLAN, 31, 24, 26)), ["date: today"])
    first = text.split("## ")[1]
    assert first.startswith("What did not come out as in the paper")
    assert "1 of 2 of the paper's numbers" in first
    assert "p-10 0.1, ROOMS CLO: the paper has 27, we have 29.0 [28, 30]" in first
    assert "REPLAN takes at most 10 times CLO's total time" in first
    assert "- date: today" in text
    assert "| p-10 | 0.1 | 29.0 [28, 30] (27)! | 27.0 [24, 31] (26) |" in text


def test_cells_with_fewer_seeds_say_so() -> None:
    """One seed's percentiles are itself."""
    text = report(cells(rows(CLO, *range(16, 28)) + rows(REPLAN, 31)), [])
    assert "1 are of cells with fewer than 10 seeds, which say little; 1 of these lie outside." in text
    assert "the paper has 26, we have 31.0 [31, 31] n=1." in text
    assert "| 31.0 [31, 31] n=1 (26)! |" in text
    assert "n=12" not in text


def test_a_strategy_that_was_not_run_is_left_out() -> None:
    """A report of one strategy has no empty comparisons, and no ratio to nothing."""
    text = report(cells(rows(CLO, 27)), [])
    assert "| ROOMS | p | clo |" in text
    assert "REPLAN takes" not in text


def test_the_csv_has_a_line_for_each_cell(tmp_path: Path) -> None:
    """With the paper's number, where it stands, and whether it lies inside."""
    write_csv(cells([*rows(CLO, 26, 28), replace(REPLAN, outcome="stuck")]), tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
        clo, replan = csv.DictReader(file)
    assert (clo["problem"], clo["executed_mean"], clo["paper_executed"], clo["inside"]) == ("p-10", "27", "27", "yes")
    assert clo["paper_cell"] == "Borrajo and Veloso 2024, Table V, p-10 0.1, ROOMS CLO"
    assert (replan["done"], replan["executed_mean"], replan["why_not_done"]) == ("0", "", "stuck (1 of 1)")


def test_the_figure_is_drawn_alike_from_equal_rows(tmp_path: Path) -> None:
    """As SVG and as PNG; a cell that is not there leaves a gap."""
    found = cells(rows(CLO, 26, 28) + rows(REPLAN, 26))
    for name in ("one", "two"):
        draw(found, (tmp_path / f"{name}.svg", tmp_path / f"{name}.png"))
    for suffix in (".svg", ".png"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
