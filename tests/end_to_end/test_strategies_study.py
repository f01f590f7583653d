"""A longer study (``make study``): every strategy in the office, on the same seeds."""

from collections.abc import Callable
from dataclasses import replace
from statistics import mean

import pytest

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

SEEDS = 20
FIGURES: dict[str, Callable[[RunResult], float]] = {
    "makespan s": lambda result: result.makespan_s,
    "actions executed": lambda result: result.executed,
    "planner calls": lambda result: result.planner_calls,
    "waiting s": lambda result: sum(robot.waiting_s for robot in result.robots.values()),
    "real s planning": lambda result: sum(robot.wall_planning_s for robot in result.robots.values()),
    "real s deciding": lambda result: sum(robot.wall_deciding_s for robot in result.robots.values()),
}


@pytest.mark.study
def test_clo_calls_its_planner_least(capsys: pytest.CaptureFixture[str]) -> None:
    """All strategies reach the goals; ``clo`` asks its planner less often than ``replan``. Prints the means."""
    world = read_world(shipped("worlds") / "office.yaml")
    results: dict[str, list[RunResult]] = {}
    for name in STRATEGIES:
        results[name] = []
        for seed in range(SEEDS):
            with Run(replace(world, seed=seed), name) as run:
                results[name].append(run.finish())
    with capsys.disabled():
        print(f"\noffice, means of {SEEDS} seeds: {', '.join(FIGURES)}, runs that reached the goals")
        for name, runs in results.items():
            reached = sum(result.outcome == "goals_reached" for result in runs)
            print(f"{name:18}", *(f"{mean(map(figure, runs)):10.2f}" for figure in FIGURES.values()), f"{reached:4}")
    calls = {name: mean(result.planner_calls for result in runs) for name, runs in results.items()}
    assert {result.outcome for result in results["clo"]} == {"goals_reached"}
    assert calls["clo"] < calls["replan"]
