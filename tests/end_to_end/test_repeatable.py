"""A run depends on its world, strategy and seed alone: not on hash seeds, and not on how busy the machine is."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

WORLDS = ("hello", "three_rooms", "office")
USUAL = ("hello", "office")  # run at every change
HASH_SEEDS = ("0", "1", "random")


@pytest.fixture
def busy() -> Iterator[None]:
    """A process that keeps another core busy meanwhile."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as spinning:
        yield
        spinning.kill()


def run(world: str, hash_seed: str, out: Path) -> tuple[bytes, object]:
    """Run a world with the command, in a process of its own; its log, and what its result says but for real time."""
    subprocess.run(
        [sys.executable, "-m", "clo_fleet.cli", "run", str(shipped("worlds") / f"{world}.yaml"), "--out", str(out)],
        env=os.environ | {"PYTHONHASHSEED": hash_seed},
        capture_output=True,
        check=True,
        timeout=100,
    )
    return written(out)


def written(out: Path) -> tuple[bytes, object]:
    """The log of a run, and what its result says but for real time."""
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    return (out / "events.jsonl").read_bytes(), simulated(result)


def simulated(value: object) -> object:
    """The same without readings of the real clock, which fields named ``wall_*`` hold."""
    if isinstance(value, dict):
        return {name: simulated(part) for name, part in value.items() if not name.startswith("wall_")}
    if isinstance(value, list):
        return [simulated(part) for part in value]
    return value


@pytest.mark.parametrize("world", USUAL)
def test_a_run_is_the_same_in_another_process_on_a_busy_machine(
    world: str, tmp_path: Path, fleet_planners: PlannerPool, request: pytest.FixtureRequest
) -> None:
    """Here, with planners that have planned for others, and with the command, under another hash seed."""
    with Run(read_world(shipped("worlds") / f"{world}.yaml"), out=tmp_path / "here", planners=fleet_planners) as here:
        here.finish()
    request.getfixturevalue("busy")
    log, result = written(tmp_path / "here")
    assert log.count(b"\n") > 10
    assert run(world, "0", tmp_path / "there") == (log, result)


@pytest.mark.study
@pytest.mark.usefixtures("busy")
@pytest.mark.parametrize("world", WORLDS)
def test_a_run_is_the_same_whatever_the_hash_seed_and_the_load(world: str, tmp_path: Path) -> None:
    """Three runs under different hash seeds, the machine being busy, give the same log byte for byte, and results."""
    (log, result), *others = (run(world, hash_seed, tmp_path / hash_seed) for hash_seed in HASH_SEEDS)
    assert log.count(b"\n") > 10
    for other_log, other_result in others:
        assert other_log == log
        assert other_result == result
