"""A batch's tables, from folders as runs leave them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from clo_fleet.study.batch.row import ENDED, Row, read_row, write_row
from clo_fleet.study.batch.running import NotABatchError, rows
from clo_fleet.study.batch.tables import QueryError, ask, open_tables

ROW = Row(run_id="", world="w", strategy="clo", seed=0, changes="{}", ending=ENDED, outcome="goals_reached")


def add(folder: Path, number: int, **values: Any) -> Row:
    """A run in the batch's folder: its row and two events."""
    row = replace(ROW, run_id=f"{number:016x}", seed=number, makespan_s=10.0 * number, **values)
    own = folder / "runs" / row.run_id
    own.mkdir(parents=True, exist_ok=True)
    events = [
        {"id": 0, "t": 0.0, "kind": "run_started", "robots": ["r1"]},
        {"id": 1, "t": 1.5, "kind": "waiting", "robot": "r1", "why": 'it\'s "so"'},
    ]
    (own / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events) + '{"id": 2, "t')
    write_row(row, own)
    return row


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A batch with three runs that have ended, and one that has not."""
    own = tmp_path / "it's a batch"
    for number, loss in enumerate((0, 0.5, 0.5)):
        add(own, number, changes=json.dumps({"radio.loss": loss, "map": f"m{number}", "fleet_size": 2}))
    (own / "runs" / "unfinished").mkdir()
    (own / "batch.json").write_text(json.dumps({"swept": ["radio.loss", "map", "fleet_size"]}))
    return own


def test_results_have_a_column_for_each_figure_and_each_swept_key(folder: Path) -> None:
    """Numbers are numbers, also those that are swept."""
    question = "select radio_loss, count(*) as runs, avg(makespan_s) as mean from results group by 1 order by 1"
    assert ask(folder, question) == (("radio_loss", "runs", "mean"), [(0.0, 1, 0.0), (0.5, 2, 15.0)])
    assert ask(folder, "select map from results where seed = 2")[1] == [("m2",)]
    assert ask(folder, "select distinct typeof(fleet_size) from results")[1] == [("BIGINT",)]


def test_events_are_those_of_all_runs_and_a_torn_line_is_left_out(folder: Path) -> None:
    """With the whole event as JSON."""
    question = "select run_id, id, t, kind, robot, event ->> 'why' from events where kind = 'waiting' order by run_id"
    _, found = ask(folder, question)
    assert found == [(f"{number:016x}", 1, 1.5, "waiting", "r1", 'it\'s "so"') for number in range(3)]
    assert ask(folder, "select count(*) from events")[1] == [(6,)]


def test_tables_follow_the_runs(folder: Path) -> None:
    """A run that has come is there at the next question; one done again replaces its old self, and counts once."""
    assert ask(folder, "select count(*) from results")[1] == [(3,)]
    add(folder, 3)
    assert ask(folder, "select count(*), sum(makespan_s) from results")[1] == [(4, 60.0)]
    assert ask(folder, "select count(*), count(distinct run_id) from events")[1] == [(8, 4)]
    own = folder / "runs" / f"{3:016x}"
    (own / "row.json").unlink()
    (own / "events.jsonl").write_text('{"id": 0, "t": 0.0, "kind": "run_started"}\n')
    write_row(replace(ROW, run_id=own.name, seed=3, ending="crashed"), own)
    assert ask(folder, "select ending, makespan_s from results where seed = 3")[1] == [("crashed", 0.0)]
    assert ask(folder, "select count(*), count(distinct run_id) from events")[1] == [(7, 4)]


def test_a_batch_without_runs_has_empty_tables(tmp_path: Path) -> None:
    """They can be asked all the same."""
    (tmp_path / "runs").mkdir()
    (tmp_path / "batch.json").write_text(json.dumps({"swept": ["radio.loss"]}))
    assert ask(tmp_path, "select count(*) from results")[1] == [(0,)]
    assert ask(tmp_path, "select count(*) from events")[1] == [(0,)]


def test_a_question_reaches_no_other_file(folder: Path, tmp_path: Path) -> None:
    """Neither to read nor to write; and a question that is none is told."""
    secret = tmp_path / "secret.csv"
    secret.write_text("a\n1\n")
    for question in (f"select * from '{secret}'", f"copy results to '{tmp_path}/stolen.csv'", "selec"):
        with pytest.raises(QueryError):
            ask(folder, question)
    with pytest.raises(QueryError):
        ask(folder, "set enable_external_access = true")
    assert not (tmp_path / "stolen.csv").exists()


def test_the_database_can_be_used_from_python(folder: Path) -> None:
    """As a relation of DuckDB, with all that it can do."""
    with open_tables(folder) as database:
        assert database.sql("from results select seed").order("seed").fetchall() == [(0,), (1,), (2,)]


def test_a_folder_without_a_batch_is_told(tmp_path: Path) -> None:
    """With what to do."""
    with pytest.raises(NotABatchError, match="clo-fleet batch SPEC"):
        ask(tmp_path, "select 1")


def test_a_row_survives_its_file(folder: Path) -> None:
    """And what a later version would add is left out."""
    own = folder / "runs" / f"{1:016x}"
    row = read_row(own)
    assert row in rows(folder)
    (own / "row.json").write_text(json.dumps(json.loads((own / "row.json").read_text()) | {"novelty": 1}))
    assert read_row(own) == row
