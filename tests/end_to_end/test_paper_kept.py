"""The study that is kept with the project: its tables and its figure are what its rows say."""

import json
from pathlib import Path

import duckdb

from clo_fleet.paper.rows import Row
from clo_fleet.paper.study import write_files

KEPT = Path(__file__).parents[2] / "runs" / "paper"


def test_the_kept_tables_are_those_of_the_kept_rows(tmp_path: Path) -> None:
    """Made again from ``rows.parquet``, they are the same to the letter."""
    with duckdb.connect() as database:
        table = database.read_parquet(str(KEPT / "rows.parquet"))
        rows = [Row(**dict(zip(table.columns, values, strict=True))) for values in table.fetchall()]
    write_files(rows, json.loads((KEPT / "study.json").read_text(encoding="utf-8")), tmp_path)
    for name in ("table.md", "table.csv"):
        assert (tmp_path / name).read_text(encoding="utf-8") == (KEPT / name).read_text(encoding="utf-8")
