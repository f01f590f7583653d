"""What a batch's report says, from rows whose differences are known."""

import csv
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.study.batch.row import ENDED, Row, write_row
from clo_fleet.study.report.comparing import OVERALL, Setting, differences, outcomes
from clo_fleet.study.report.counting import failures
from clo_fleet.study.report.figures import difference_figure, growth_figure, help_figure
from clo_fleet.study.report.growing import SINGLE, growth
from clo_fleet.study.report.page import NothingToReportError, UnknownBaselineError, report

ROW = Row(run_id="", world="w", strategy="clo", seed=0, changes="{}", ending=ENDED, outcome="goals_reached", robots=2)


def batch() -> Iterator[Row]:
    """Seeds that differ by 100 s among themselves, strategies by 3 to 5 s; one seed is lost by `replan`."""
    for loss in (0, 0.5):
        for seed in range(6):
            for strategy, extra in (("clo", 0.0), ("replan", 3.0 + seed % 3)):
                lost = strategy == "replan" and seed == 5
                yield replace(
                    ROW,
                    run_id=f"{strategy}-{loss}-{seed}",
                    strategy=strategy,
                    seed=seed,
                    changes=json.dumps({"radio.loss": loss}),
                    robots=2 + 2 * (loss > 0),
                    makespan_s=100.0 * seed + extra,
                    ending="out of time" if lost else ENDED,
                    outcome="" if lost else "goals_reached",
                    why="after 600 s" if lost else "all goals hold",
                    helps=int(strategy == "clo" and seed == 0),
                )


def test_strategies_are_compared_on_the_same_seeds() -> None:
    """They are clear though seeds differ thirty times as much; a lost run's pair is left out, and said."""
    found = differences(batch(), ("radio.loss",), "clo")
    makespan = [one for one in found if one.metric == "makespan_s"]
    assert [str(one.setting) for one in makespan] == ["w, radio.loss 0", "w, radio.loss 0.5", "all settings"]
    assert (makespan[-1].seeds, makespan[-1].of) == (10, 12)
    for one in makespan[:-1]:
        assert (one.strategy, one.baseline, one.seeds, one.of) == ("replan", "clo", 5, 6)
        assert one.difference == pytest.approx((3 + 4 + 5 + 3 + 4) / 5)
        assert 3 <= one.low < one.difference < one.high <= 5
    assert all(one.low == one.high == 0 for one in found if one.metric == "executed")


def test_one_setting_is_not_told_twice() -> None:
    """Over all settings only where there are several."""
    assert OVERALL not in {one.setting for one in differences(batch(), (), "clo")}


def test_who_reached_the_goals_is_counted_by_pairs() -> None:
    """The baseline first; a difference over successes alone would hide who failed."""
    clo, replan = outcomes(batch(), ("radio.loss",), "clo")
    assert (clo.strategy, clo.runs, clo.reached, clo.alone) == ("clo", 12, 12, 0)
    assert (replan.runs, replan.reached, replan.both, replan.alone, replan.baseline_alone) == (12, 10, 10, 0, 2)


def test_growth_is_drawn_over_the_runs_in_which_all_strategies_reached_their_goals() -> None:
    """The share that did is of all runs, those included whose process was lost with all of its setting's."""
    rows = [replace(row, changes=json.dumps({"fleet_size": row.robots})) for row in batch()]
    rows += [
        replace(ROW, run_id=f"8-{seed}", seed=seed, changes='{"fleet_size": 8}', ending="crashed", outcome="", robots=0)
        for seed in range(2)
    ]
    found = {(one.figure, one.strategy, one.robots): one for one in growth(rows, ("fleet_size",))}
    for strategy, share in (("clo", 100.0), ("replan", pytest.approx(100 * 5 / 6))):
        assert found["share", strategy, 2].mean == share
        assert (found["makespan_s", strategy, 2].runs, found["makespan_s", strategy, 2].of) == (5, 6)
    assert found["makespan_s", "clo", 2].mean == 200.0
    assert found["makespan_s", "replan", 4].mean == 200.0 + 19 / 5
    assert found["share", "clo", 8].mean == 0.0
    assert ("makespan_s", "clo", 8) not in found


def test_worlds_of_one_fleet_size_grow_together() -> None:
    """Each has one point, and a line needs two."""
    rows = [replace(row, world=f"of {row.robots}", changes="{}") for row in batch()]
    assert {one.setting for one in growth(rows, ())} == {Setting(SINGLE, "")}
    assert growth([row for row in rows if row.robots == 2], ()) == ()


def test_equal_batches_give_equal_intervals() -> None:
    """The resampling is seeded."""
    assert differences(batch(), (), "clo") == differences(batch(), (), "clo")


def test_failures_are_counted_with_a_reason_and_an_example() -> None:
    """By setting, strategy and kind of end."""
    (first, second) = failures(batch(), ("radio.loss",))
    assert (first.setting, first.strategy, first.ending) == (Setting("w", "radio.loss 0"), "replan", "out of time")
    assert (first.runs, first.of, first.why, first.example) == (1, 6, "after 600 s", "replan-0-5")
    assert second.setting.swept == "radio.loss 0.5"


def test_figures_say_the_same_each_time_and_are_left_out_where_there_is_nothing_to_see() -> None:
    """As SVG whose texts are texts."""
    found = differences(batch(), ("radio.loss",), "clo")
    drawn = difference_figure(found, "makespan_s")
    assert drawn is not None
    assert drawn == difference_figure(found, "makespan_s")
    assert ">w, radio.loss 0.5</text>" in drawn
    assert difference_figure((), "makespan_s") is None
    assert difference_figure(found, "planner_calls") is None
    grown = growth_figure(growth([replace(row, changes="{}") for row in batch()], ()), Setting("w", ""))
    assert ">makespan [s]</text>" in grown
    assert ">planner calls</text>" not in grown
    lost = growth([replace(row, changes="{}", outcome="out_of_time") for row in batch()], ())
    assert ">goals reached [%]</text>" in growth_figure(lost, Setting("w", ""))
    assert help_figure(()) is None


def test_a_report_is_one_page_with_failures_first_and_its_tables_as_files(tmp_path: Path) -> None:
    """Nothing in it is loaded from elsewhere, and a name that is markup stays text."""
    folder = tmp_path / "<b>batch"
    for row in batch():
        own = folder / "runs" / row.run_id
        own.mkdir(parents=True)
        write_row(row, own)
        given = {"by": "r2", "robot": "r1", "kind": "prepared", "dropped": ["prepare(r1, o1, l1)"]}
        (own / "result.json").write_text(json.dumps({"helps": [given] * row.helps}))
    (folder / "batch.json").write_text(json.dumps({"swept": ["radio.loss"]}))
    stale = folder / "report" / "growth_old.svg"
    stale.parent.mkdir()
    stale.touch()
    page = report(folder).read_text()
    assert not stale.exists()
    assert page.index("What failed") < page.index("Strategies on the same seeds") < page.index("Who helped whom")
    assert "<b>batch" not in page
    assert "22 of 24 runs reached their goals" in page
    assert "src=" not in page
    with (folder / "report" / "comparison.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["figure"] for row in rows} >= {"makespan [s]", "planner calls"}
    assert (folder / "report" / "helps.md").read_text().count("| r2 | r1 | prepared | 2 | 2 | 12 |") == 1
    overview = (folder / "report" / "overview.md").read_text()
    assert "| replan | 12 | 10 | 10 | 0 | 2 | +3.8 [" in overview
    assert {path.suffix for path in (folder / "report").iterdir()} == {".csv", ".md", ".svg"}


def test_a_report_about_nothing_is_refused(tmp_path: Path) -> None:
    """No run has ended, or the baseline was never run."""
    (tmp_path / "runs").mkdir()
    (tmp_path / "batch.json").write_text('{"swept": []}')
    with pytest.raises(NothingToReportError):
        report(tmp_path)
    own = tmp_path / "runs" / "one"
    own.mkdir()
    write_row(replace(ROW, run_id="one"), own)
    with pytest.raises(UnknownBaselineError, match="expected one of clo"):
        report(tmp_path, "replan")
    assert "Only one strategy was run" in report(tmp_path).read_text()
