"""What a batch costs beside its runs, and how quick its tables are. Run with ``make bench``; nothing is asserted."""

import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import duckdb
import pytest

from clo_fleet.study.batch.row import ENDED, Row
from clo_fleet.study.batch.running import local, run_batch
from clo_fleet.study.batch.spec import read_batch
from clo_fleet.study.batch.tables import ask
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import copy_out

pytestmark = [pytest.mark.bench, pytest.mark.timeout(1800)]

RUNS = 8
ROWS, EVENTS = 10_000, 100  # rows, and events of each: a million
QUESTIONS = (
    "select strategy, count(*), avg(makespan_s), quantile_cont(makespan_s, 0.9) from results group by 1",
    "select kind, count(*) from events group by 1 order by 2 desc",
    "select r.strategy, avg(e.t) from events e join results r using (run_id) where e.kind = 'kind-3' group by 1",
)


def say(line: str) -> None:
    """A line of the report."""
    sys.stdout.write(line + "\n")


def test_a_run_in_a_process_of_its_own_against_a_bare_loop(tmp_path: Path) -> None:
    """The same runs: one after another in this process, by one worker, and by two."""
    copy_out(tmp_path)
    spec = tmp_path / "batch.yaml"
    spec.write_text(f"format: clo-fleet/batch/1\nworlds: [worlds/office.yaml]\nseeds: {RUNS}\n")
    batch = read_batch(spec)
    begin = time.perf_counter()
    for number, run in enumerate(batch.runs):
        with Run(run.read(), run.strategy, out=tmp_path / f"bare-{number}") as bare:
            bare.finish()
    taken = {"bare loop": time.perf_counter() - begin}
    for workers in (1, 2):
        begin = time.perf_counter()
        rows = run_batch(batch, tmp_path / f"out-{workers}", local(workers))
        taken[f"{workers} workers"] = time.perf_counter() - begin
        assert all(row.ending == ENDED for row in rows)
    say(f"\n{RUNS} runs of office on {os.cpu_count()} cores")
    for name, seconds in taken.items():
        ratio = seconds / taken["bare loop"]
        say(f"  {name:10} {seconds:6.1f} s, {seconds / RUNS:5.2f} s a run, {ratio:.2f} times the loop")
    efficiency = taken["1 workers"] / taken["2 workers"] / 2
    say(f"  overhead of a process: {(taken['1 workers'] - taken['bare loop']) / RUNS:.2f} s a run")
    say(f"  efficiency of two workers: {efficiency:.0%}")


def test_tables_of_ten_thousand_rows_and_a_million_events(tmp_path: Path) -> None:
    """Making them once, and asking them, beside DuckDB on the same files."""
    row = Row(run_id="", world="w", strategy="clo", seed=0, changes="{}", ending=ENDED, outcome="goals_reached")
    for number in range(ROWS):
        own = tmp_path / "runs" / f"{number:016x}"
        own.mkdir(parents=True)
        strategy = ("clo", "replan")[number % 2]
        values = replace(row, run_id=own.name, strategy=strategy, seed=number // 2, makespan_s=float(number % 97))
        (own / "row.json").write_text(values.to_json() + "\n")
        lines = ({"id": i, "t": 0.2 * i, "kind": f"kind-{i % 7}", "robot": f"r{i % 5}"} for i in range(EVENTS))
        (own / "events.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (tmp_path / "batch.json").write_text('{"swept": []}')
    say(f"\n{ROWS:,} rows and {ROWS * EVENTS:,} events")
    begin = time.perf_counter()
    ask(tmp_path, "select count(*) from results")
    say(f"  the first question, which makes the tables: {time.perf_counter() - begin:.2f} s")
    files = tmp_path / "tables"
    for question in QUESTIONS:
        begin = time.perf_counter()
        ask(tmp_path, question)
        ours = time.perf_counter() - begin
        with duckdb.connect() as database:
            database.execute(f"create view results as from '{files}/results.parquet'")
            database.execute(f"create view events as from '{files}/events/*.parquet'")
            begin = time.perf_counter()
            database.execute(question).fetchall()
            bare = time.perf_counter() - begin
        say(f"  {ours:6.3f} s, DuckDB alone {bare:6.3f} s: {question[:70]}")
