"""The command ``clo-fleet paper``, typed as a user types it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from clo_fleet.paper.rows import Journal
from clo_fleet.paper.runs import narrowed, quick, runs

FILES = {"study.json", "rows.jsonl", "rows.parquet", "table.csv", "table.md", "figure.svg", "figure.png"}
SMALL = ("--problems", "rooms/p-05,rooms/p-10", "--strategies", "clo,replan", "--seeds", "1")
Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts the command in an empty folder, which holds its temporary files too."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> "subprocess.Popen[str]":
        words = [sys.executable, "-m", "clo_fleet.cli", "paper", *arguments]
        environment = os.environ | {"TMPDIR": str(tmp_path)}
        process = subprocess.Popen(
            words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def rows(folder: Path) -> list[dict[str, object]]:
    """The rows of a study without their readings of the clock, sorted."""
    lines = (folder / "rows.jsonl").read_text(encoding="utf-8").splitlines()
    plain = [{name: value for name, value in json.loads(line).items() if name[:5] != "wall_"} for line in lines]
    return sorted(plain, key=lambda row: [str(value) for value in row.values()])


def processes_of(folder: Path) -> list[str]:
    """The command lines of all processes that were told of the folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = path.read_bytes().replace(b"\0", b" ").decode()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if str(folder) in line:
            found.append(line)
    return found


def test_a_study_killed_in_the_middle_goes_on_where_it_was(start: Start, tmp_path: Path) -> None:
    """Killed outright it loses the runs in flight at most and leaves no process; in the end the rows are the same."""
    cut = start(*SMALL, "--out", "cut")
    journal = tmp_path / "cut" / "rows.jsonl"
    while not journal.exists() or journal.read_bytes().count(b"\n") < 3:
        assert cut.poll() is None, cut.communicate()
    cut.send_signal(signal.SIGKILL)
    cut.wait()
    kept = journal.read_bytes().count(b"\n")
    while processes_of(tmp_path):
        pass
    outputs = [start(*SMALL, "--out", name) for name in ("cut", "whole")]
    for output in outputs:
        said, complaints = output.communicate()
        assert (output.returncode, complaints) == (0, "")
        assert said.startswith("12 of 12 runs reached their goals")
    assert 3 <= kept < 12
    assert rows(tmp_path / "cut") == rows(tmp_path / "whole")
    assert {path.name for path in (tmp_path / "cut").iterdir()} == FILES
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut", "whole"]


def test_control_c_ends_the_study_at_once_and_says_how_to_go_on(start: Start, tmp_path: Path) -> None:
    """Exit code 130, as for every command; nothing is left of the workers."""
    study = start(*SMALL, "--out", "study")
    while not (tmp_path / "study" / "rows.jsonl").exists() or not rows(tmp_path / "study"):
        assert study.poll() is None, study.communicate()
    study.send_signal(signal.SIGINT)
    _, complaints = study.communicate()
    assert study.returncode == 130
    assert complaints == "clo-fleet: interrupted; the same command goes on with study\n"
    assert [path.name for path in tmp_path.iterdir()] == ["study"]
    assert processes_of(tmp_path) == []


def test_quick_runs_every_strategy_and_the_table_says_first_what_differs(start: Start, tmp_path: Path) -> None:
    """One seed of the smallest ROOMS, with REPLAN's three costs."""
    study = start("--quick", "--problems", "rooms/p-05", "--seeds", "1", "--out", "study")
    _, complaints = study.communicate()
    assert (study.returncode, complaints) == (0, "")
    with Journal(tmp_path / "study" / "rows.jsonl") as journal:
        assert {row.run for row in journal.rows} == set(runs(narrowed(quick(), problems=["rooms/p-05"], seeds=1)))
        assert all(row.done for row in journal.rows)
    table = (tmp_path / "study" / "table.md").read_text(encoding="utf-8")
    assert table.index("What did not come out") < table.index("Executed actions") < table.index("three costs")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--problems", "p-06"), "unknown problem 'p-06'"),
        (("--strategies", "clo,guess"), "unknown strategy 'guess'"),
    ],
)
def test_bad_input_is_exit_code_2(start: Start, arguments: tuple[str, str], complaint: str) -> None:
    """Nothing is begun."""
    study = start(*arguments, "--out", "study")
    _, complaints = study.communicate()
    assert study.returncode == 2
    assert complaint in complaints


def test_rows_made_with_other_versions_are_not_mixed_with_new_ones(start: Start, tmp_path: Path) -> None:
    """The folder is refused and left as it is."""
    one = ("--problems", "rooms/p-05", "--strategies", "clo", "--seeds", "1", "--out", "study")
    assert start(*one).wait() == 0
    noted = tmp_path / "study" / "study.json"
    noted.write_text(noted.read_text(encoding="utf-8").replace('"up-fast-downward": "', '"up-fast-downward": "9'))
    before = {path.name: path.read_bytes() for path in (tmp_path / "study").iterdir()}
    again = start(*one)
    _, complaints = again.communicate()
    assert (again.returncode, complaints) == (
        2,
        "clo-fleet: study holds a study made with other versions; choose another folder\n",
    )
    assert {path.name: path.read_bytes() for path in (tmp_path / "study").iterdir()} == before
