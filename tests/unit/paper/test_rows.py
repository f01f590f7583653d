"""The journal of rows: what is in it stays, whatever happens to who writes it."""

from pathlib import Path

import pytest

from clo_fleet.paper.rows import Journal, JournalError, Row, write_parquet

ROW = Row(
    domain="rooms",
    size=5,
    probability=0.1,
    strategy="clo",
    route="in-process",
    seed=0,
    outcome="goals reached",
    executed=12,
    wall_planning=0.25,
)
OTHER = Row(domain="dialog", size=40, probability=0.5, strategy="replan", route="in-process", seed=1, outcome="limit")


def test_rows_come_back_as_they_were_written(tmp_path: Path) -> None:
    """Opened again, a journal holds its rows, and takes more."""
    for row in (ROW, OTHER):
        with Journal(tmp_path / "rows.jsonl") as journal:
            journal.append(row)
    with Journal(tmp_path / "rows.jsonl") as journal:
        assert journal.rows == [ROW, OTHER]


def test_half_a_row_of_a_killed_study_is_taken_away(tmp_path: Path) -> None:
    """The row is done again; the ones before it are kept, and the file is whole."""
    path = tmp_path / "rows.jsonl"
    path.write_text(ROW.to_json() + "\n" + OTHER.to_json()[:50], encoding="utf-8")
    with Journal(path) as journal:
        assert journal.rows == [ROW]
        journal.append(OTHER)
    assert path.read_text(encoding="utf-8") == f"{ROW.to_json()}\n{OTHER.to_json()}\n"


def test_two_studies_cannot_write_to_one_file(tmp_path: Path) -> None:
    """The second is refused, and the first does not notice."""
    with Journal(tmp_path / "rows.jsonl") as journal:
        with pytest.raises(JournalError, match="another study is being written here"):
            Journal(tmp_path / "rows.jsonl")
        journal.append(ROW)
    with Journal(tmp_path / "rows.jsonl") as again:
        assert again.rows == [ROW]


@pytest.mark.parametrize("text", ["{}\n", "[1]\n", "no rows\n", '{"domain": "rooms"}\n'])
def test_a_file_that_holds_something_else_is_refused_and_left_alone(tmp_path: Path, text: str) -> None:
    """The error names the file."""
    path = tmp_path / "rows.jsonl"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(JournalError, match="not the rows of a study") as caught:
        Journal(path)
    assert caught.value.path == path
    assert path.read_text(encoding="utf-8") == text


def test_parquet_holds_the_rows_sorted(tmp_path: Path) -> None:
    """Every column has the type of its field."""
    duckdb = pytest.importorskip("duckdb")
    write_parquet([ROW, OTHER], tmp_path / "rows.parquet")
    with duckdb.connect() as database:
        table = database.read_parquet(str(tmp_path / "rows.parquet"))
        rows = [Row(**dict(zip(table.columns, values, strict=True))) for values in table.fetchall()]
    assert rows == [OTHER, ROW]
