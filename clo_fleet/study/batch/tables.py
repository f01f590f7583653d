"""A batch's rows and events as tables, kept as Parquet and asked with SQL through DuckDB.

| table     | a row for each                                                                                   |
|-----------|--------------------------------------------------------------------------------------------------|
| `results` | run: the columns of ``row.Row``, and one for each swept key, its dots as ``_`` (`radio_loss`)      |
| `events`  | event of a run that ended: `run_id`, `id`, `t` [s], `kind`, `robot`, and the whole event as JSON  |

The files in `tables/` follow from the runs' folders. They are brought up to date before each question, if runs have
come since: `results` anew, `events` by another part. A part says of each run when its row was written, so that a run
that is done again is not taken for its old self.
"""

import contextlib
import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType

import duckdb

from clo_fleet.errors import CloFleetError
from clo_fleet.study.batch.row import Row, read_row
from clo_fleet.study.batch.running import read_swept

__all__ = ["QueryError", "ask", "open_tables"]

SQL_TYPES: Mapping[object, str] = MappingProxyType({str: "varchar", int: "bigint", float: "double", bool: "boolean"})
MAX_LINE = 1 << 27  # bytes of one event: the poses of thousands of robots
FILES_AT_ONCE = 2000
EVENTS = "run_id varchar, written bigint, id bigint, t double, kind varchar, robot varchar, event json"

Stamps = Mapping[str, int]


class QueryError(CloFleetError):
    """A question that DuckDB cannot answer; it says why."""


def open_tables(folder: Path) -> duckdb.DuckDBPyConnection:
    """The batch's tables, up to date, in a database that reaches no other files.

    ``open_tables(folder).sql("select ...")`` has ``.fetchall()``, and ``.df()`` or ``.pl()`` for a data frame of
    pandas or polars where that is installed.

    Raises:
        NotABatchError: if the folder holds no batch.
    """
    tables = _refreshed(folder)
    database = duckdb.connect()
    database.execute(f"create view results as select * from read_parquet({_quoted(tables / 'results.parquet')})")
    _view_events(database, tables / "events", "events")
    database.execute(f"set allowed_directories = [{_quoted(tables)}]")
    database.execute("set enable_external_access = false")
    database.execute("set lock_configuration = true")
    return database


def ask(folder: Path, question: str) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """The answer to a question in SQL: the names of its columns, and its rows.

    Raises:
        NotABatchError: if the folder holds no batch.
        QueryError: if the question is not one, or is more than one.
    """
    with open_tables(folder) as database:
        try:
            answer = database.execute(question)
            return tuple(name for name, *_ in answer.description or ()), answer.fetchall()
        except duckdb.Error as error:
            raise QueryError(str(error)) from None


def _refreshed(folder: Path) -> Path:
    """The folder of the tables, up to date."""
    swept = read_swept(folder)
    tables = (folder / "tables").resolve()
    (tables / "events").mkdir(parents=True, exist_ok=True)
    with _locked(tables / ".lock"):
        stamps = {
            entry.name: stamp
            for entry in os.scandir(folder / "runs")
            if (stamp := _written(Path(entry.path))) is not None
        }
        state = hashlib.sha256(json.dumps([swept, sorted(stamps.items())]).encode()).hexdigest()
        noted = tables / "state"
        if not noted.exists() or noted.read_text(encoding="utf-8") != state:
            with duckdb.connect() as database:
                _write_results(database, folder / "runs", stamps, swept, tables)
                _write_events(database, folder / "runs", stamps, tables / "events")
            noted.write_text(state, encoding="utf-8")
    return tables


def _write_results(
    database: duckdb.DuckDBPyConnection, runs: Path, stamps: Stamps, swept: Sequence[str], tables: Path
) -> None:
    lines = tables / f".results.{os.getpid()}.draft"
    rows = (read_row(runs / run) for run in sorted(stamps))
    lines.write_text("".join(row.to_json() + "\n" for row in rows if row is not None), encoding="utf-8")
    types = ", ".join(f"{field.name}: '{SQL_TYPES[field.type]}'" for field in fields(Row))
    source = f"read_json({_quoted(lines)}, format = 'newline_delimited', columns = {{{types}}})"
    more = "".join(f", changes::json ->> {_quoted('$.' + json.dumps(key))} as {_column(key)}" for key in swept)
    try:
        database.execute(f"create table found as select *{more} from {source} order by world, strategy, seed, run_id")
    finally:
        lines.unlink()
    for key in map(_column, swept):  # numbers as numbers, where all values are
        whole = f"try_cast({key} as bigint)::varchar = {key}"
        for kind, fits in (("bigint", whole), ("double", f"try_cast({key} as double) is not null")):
            if database.execute(f"select bool_and({fits}) from found where {key} is not null").fetchone() == (True,):
                database.execute(f"alter table found alter {key} type {kind}")
                break
    _copy(database, "select * from found", tables / "results.parquet")


def _write_events(database: duckdb.DuckDBPyConnection, runs: Path, stamps: Stamps, folder: Path) -> None:
    """Add a part for the runs that no part holds; begin anew if one holds a run that has been done again since."""
    _view_events(database, folder, "known", all_columns=True)
    held = set(database.execute("select distinct run_id, written from known").fetchall())
    if held - set(stamps.items()):
        for part in folder.glob("*.parquet"):
            part.unlink()
        held = set()
    new = sorted(run for run, stamp in stamps.items() if (run, stamp) not in held)
    new = [run for run in new if (runs / run / "events.jsonl").exists()]
    for begin in range(0, len(new), FILES_AT_ONCE):
        some = new[begin : begin + FILES_AT_ONCE]
        files = ", ".join(_quoted(runs / run / "events.jsonl") for run in some)
        written = ", ".join(f"('{run}', {stamps[run]})" for run in some)
        question = f"""
            with read as (
                select parse_path(filename)[-2] as run_id, json as event
                from read_json_objects(
                    [{files}], format = 'newline_delimited', filename = true, ignore_errors = true,
                    maximum_object_size = {MAX_LINE})
            )
            select run_id, written, (event ->> 'id')::bigint as id, (event ->> 't')::double as t,
                event ->> 'kind' as kind, event ->> 'robot' as robot, event
            from read join (values {written}) as stamps(run_id, written) using (run_id)
            where event is not null order by run_id, id"""
        _copy(database, question, folder / f"{hashlib.sha256(written.encode()).hexdigest()[:16]}.parquet")


def _view_events(database: duckdb.DuckDBPyConnection, folder: Path, name: str, *, all_columns: bool = False) -> None:
    parts = ", ".join(_quoted(part) for part in sorted(folder.glob("*.parquet")))
    database.execute(f"create table no_{name} ({EVENTS})")
    source = f"read_parquet([{parts}])" if parts else f"no_{name}"
    database.execute(f"create view {name} as select * {'' if all_columns else 'exclude (written)'} from {source}")


def _copy(database: duckdb.DuckDBPyConnection, question: str, path: Path) -> None:
    """Write the answer as a Parquet file, whole or not at all."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    database.execute(f"copy ({question}) to {_quoted(draft)} (format parquet)")
    draft.replace(path)


def _written(run: Path) -> int | None:
    """When the run's row was written [ns]; ``None`` without one."""
    with contextlib.suppress(OSError):
        return (run / "row.json").stat().st_mtime_ns
    return None


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """One process at a time."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _column(key: str) -> str:
    """The name of a swept key's column, quoted."""
    return '"' + key.replace(".", "_").replace('"', '""') + '"'


def _quoted(text: Path | str) -> str:
    """The text as SQL."""
    return "'" + str(text).replace("'", "''") + "'"
