"""Random worlds with random faults end in a named outcome with every invariant whole, and what does not is kept."""

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from clo_fleet.cli import main
from clo_fleet.study.run import Run
from clo_fleet.testing import RunFleet, WorldBuilder, rooms_in_a_row
from clo_fleet.testing.soak import Ending, Limits, Verdict, soak, write_soak_world
from clo_fleet.testing.soak.child import seen
from clo_fleet.world.events import ActionEnded
from clo_fleet.world.world_file import read_world

SAMPLE = (0, 2, 3, 5, 6, 10)  # an office, a corridor, rings, a grid, a row of rooms; 2 to 9 robots


def test_a_sample_of_soak_worlds_ends_well(tmp_path: Path) -> None:
    """Buildings of all kinds, with and without SUMO: every run ends in a named outcome with nothing broken."""
    verdicts = list(soak(SAMPLE, tmp_path, Limits(wall=100)))
    assert [verdict.why for verdict in verdicts if verdict.is_fault] == []
    assert all(verdict.outcome for verdict in verdicts)
    assert [Verdict.from_json(line) for line in (tmp_path / "soak.jsonl").read_text().splitlines()] == verdicts
    kept = {f"world-{verdict.world}" for verdict in verdicts if verdict.outcome != "goals_reached"}
    assert {path.name for path in tmp_path.iterdir()} == kept | {"soak.jsonl"}


def test_the_number_of_a_world_says_all_about_it(tmp_path: Path) -> None:
    """The same number gives the same files byte for byte, another number another world; all are sound."""
    for number in range(20, 26):
        one, again = (write_soak_world(number, tmp_path / f"{number}{copy}") for copy in "ab")
        assert replace(again, path=one.path) == one
        assert one.path.read_bytes() == again.path.read_bytes()
        world = read_world(one.path)
        assert (world.seed, len(world.robots)) == (number, one.robots)
        assert 2 <= one.robots <= 20


def test_a_run_that_hangs_or_crashes_is_kept_and_the_next_goes_on(tmp_path: Path) -> None:
    """No end within the limit of real time; an end of the process: both are faults, with the world beside them."""
    (hung,) = soak([3], tmp_path / "hung", Limits(wall=0.2))
    assert (hung.ending, hung.is_fault) == (Ending.HUNG, True)
    assert hung.why.startswith("no end within 0.2 s")
    crashed, again = soak([3, 3], tmp_path / "crashed", Limits(memory=1 << 20))
    assert (crashed.ending, again.ending) == (Ending.CRASHED, Ending.CRASHED)
    assert crashed.why.startswith("exit code ")
    kept = tmp_path / "hung" / "world-3"
    assert Verdict.from_json((kept / "verdict.json").read_text()) == hung
    out = tmp_path / "played"
    assert main(["run", str(kept / "world.yaml"), "--strategy", hung.strategy, "--out", str(out), "--json"]) in (0, 1)
    assert json.loads((out / "result.json").read_text())["seed"] == 3


def test_a_broken_invariant_ends_a_run_and_is_told(run_fleet: RunFleet) -> None:
    """What, who and when."""
    run: Run = run_fleet(WorldBuilder(rooms_in_a_row("a", "b")).robot("r1", "a", wants="(at-robot r1 b)"))
    run.step()
    run.mission._recorder.record(run.time, ActionEnded("r1", 9, "dance(r1)", "finished", "", 0))
    told = seen(run)
    assert (told["ending"], told["time_s"]) == ("broken", 0.4)
    assert told["why"].startswith("at 0.2 s: r1: event ")


def test_nothing_outlives_a_soak_that_is_killed(tmp_path: Path) -> None:
    """The process of runs ends with whoever asked it, in the middle of a run."""
    code = (
        f"from clo_fleet.testing.soak import soak; from pathlib import Path; list(soak([15], Path({str(tmp_path)!r})))"
    )
    with subprocess.Popen([sys.executable, "-c", code]) as parent:
        children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
        while not (child := children.read_text().split()) or not (tmp_path / "errors.txt").exists():
            assert parent.poll() is None, "it ended before it began"
        parent.kill()
    ended = time.monotonic() + 60.0
    while Path(f"/proc/{child[0]}").exists():
        assert time.monotonic() < ended, "the process of runs goes on"
