"""A run that saves itself can be stopped at any time: who goes on with it writes what it would have written."""

import json
import random
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.disturbances import FaultRate, RandomFaults
from clo_fleet.world.model import Radio, World
from clo_fleet.world.world_file import read_world

WORLDS = sorted(path.stem for path in shipped("worlds").glob("*.yaml"))
KILLED = -9


def world_file(name: str) -> Path:
    """A world that comes with the package."""
    return shipped("worlds") / f"{name}.yaml"


def command(*arguments: object) -> list[str]:
    """The command, in a process of its own."""
    return [sys.executable, "-m", "clo_fleet", "run", *map(str, arguments), "--json"]


def saved_everywhere(
    world: World, strategy: str, every: float, folder: Path, source: Path | None, planners: PlannerPool
) -> dict[float, Path]:
    """Run a world to its end in ``folder / "whole"``; copies of its files as they were at each checkpoint, by time."""
    copies: dict[float, Path] = {}
    whole = folder / "whole"
    with Run(world, strategy, out=whole, checkpoint_every=every, source=source, planners=planners) as run:
        while not run.done:
            run.step(round(every / 0.2))
            if (whole / f"checkpoints/{run.time:09.1f}.json.gz").exists():
                copies[run.time] = shutil.copytree(whole, folder / f"{run.time:g}")
        run.finish()
    return copies


def assert_goes_on_alike(world: str, strategy: str, every: float, folder: Path, planners: PlannerPool) -> None:
    """From every checkpoint a process of its own, whatever its hash seed, comes to the same log."""
    copies = saved_everywhere(read_world(world_file(world)), strategy, every, folder, world_file(world), planners)
    assert len(copies) >= 2
    going = {
        time: subprocess.Popen(command("--resume", copy), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for time, copy in copies.items()
    }
    for time, process in going.items():
        said, told = process.communicate(timeout=200)
        assert process.returncode in (0, 1), told
        assert f"goes on from {time:g} s" in told
        assert (copies[time] / "events.jsonl").read_bytes() == (folder / "whole/events.jsonl").read_bytes(), time
        whole = json.loads((folder / "whole/result.json").read_text(encoding="utf-8"))
        assert without_wall(json.loads(said)) == without_wall(whole)


def without_wall(value: object) -> object:
    """A result without readings of the real clock."""
    if isinstance(value, dict):
        return {name: without_wall(part) for name, part in value.items() if not name.startswith("wall_")}
    return [without_wall(part) for part in value] if isinstance(value, list) else value


def test_from_every_checkpoint_the_same_log_follows(tmp_path: Path, fleet_planners: PlannerPool) -> None:
    """Byte for byte, in other processes; and the same result but for real times."""
    assert_goes_on_alike("three_rooms", "clo", 11.0, tmp_path, fleet_planners)


@pytest.mark.study
@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("world", WORLDS)
def test_from_every_checkpoint_the_same_log_follows_with_every_strategy(
    world: str, strategy: str, tmp_path: Path, fleet_planners: PlannerPool
) -> None:
    """All worlds, about ten checkpoints each."""
    with Run(read_world(world_file(world)), strategy, planners=fleet_planners) as run:
        makespan = run.finish().makespan_s
    assert_goes_on_alike(world, strategy, max(0.2, round(makespan / 50) * 5 + 0.2), tmp_path, fleet_planners)


def test_what_is_under_way_arrives_after_a_checkpoint(tmp_path: Path, fleet_planners: PlannerPool) -> None:
    """Answers, messages, looks, faults that last, doomed actions: saved very often, and resumed from some."""
    world = read_world(world_file("three_rooms"))
    world = replace(
        world,
        planning=replace(world.planning, fixed=3.1),
        radio=Radio(delay=1.5, loss=0.2),
        perception=replace(world.perception, look=0.1),
        skills=replace(world.skills, spread=0.3, speed_spread=0.2),
        faults=RandomFaults(
            (
                *(
                    FaultRate(kind, 120.0, lasts=(2.0, 8.0))
                    for kind in ("robot_broken", "sensor_blinded", "radio_lost", "corridor_closed", "door_closed")
                ),
                FaultRate("robot_slowed", 120.0, lasts=(2.0, 8.0), amount=0.5),
                FaultRate("skill_fails", 240.0, lasts=(5.0, 15.0), skill="prepare"),
                *(FaultRate(kind, 120.0) for kind in ("planner_killed", "object_moved", "object_dropped")),
            )
        ),
        until=30.0,
    )
    copies = saved_everywhere(world, "clo", 1.0, tmp_path, None, fleet_planners)
    events = (tmp_path / "whole/events.jsonl").read_bytes()
    assert events.count(b'"kind":"disturbed"') > 5
    for time in sorted(copies)[7::11]:
        with Run.resumed(copies[time], world, planners=fleet_planners) as run:
            assert run.resumed_at == time
            run.finish()
        assert (copies[time] / "events.jsonl").read_bytes() == events


def assert_survives(world: str, every: float, kills: int, seed: int, folder: Path, planners: PlannerPool) -> None:
    """A run that is killed so many times, each time it goes on, ends with the log of one that is left alone."""
    chance = random.Random(seed)
    whole, out = folder / "whole", folder / "killed"
    with Run(read_world(world_file(world)), out=whole, checkpoint_every=every, planners=planners) as run:
        run.finish()
    events = (whole / "events.jsonl").read_bytes()
    before = command(world_file(world), "--checkpoint-every", every, "--out", out)
    for share in sorted(chance.uniform(0.0, 0.8) for _ in range(kills)):  # of the log, when the next kill comes
        with subprocess.Popen(before, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
            while not (out / "run.json").exists() or written(out) < share * len(events):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(0.005)
                assert process.poll() is None, process.communicate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(chance.uniform(0.0, 0.05))  # so that it may be doing anything
            process.kill()
        assert process.returncode == KILLED
        before = command("--resume", out)
    last = subprocess.run(before, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=300, check=False)
    assert last.returncode == 0, last.stderr
    assert (out / "events.jsonl").read_bytes() == events


def written(folder: Path) -> int:
    """How much of a run's log is on the disk."""
    log = folder / "events.jsonl"
    return log.stat().st_size if log.exists() else 0


def test_who_is_killed_while_saving_goes_on_as_if_nothing_had_happened(
    tmp_path: Path, fleet_planners: PlannerPool
) -> None:
    """With a checkpoint at every tick, killed again and again: mostly in the middle of saving."""
    assert_survives("hello", 0.2, 3, 1, tmp_path, fleet_planners)


@pytest.mark.study
@pytest.mark.parametrize("seed", range(10))
def test_fifty_kills(seed: int, tmp_path: Path, fleet_planners: PlannerPool) -> None:
    """In the office, five in each of ten runs."""
    assert_survives("office", 1.0, 5, seed, tmp_path, fleet_planners)
