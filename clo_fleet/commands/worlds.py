"""What the subcommands that run worlds share."""

import argparse
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clo_fleet.study.result import RunResult
    from clo_fleet.study.run import Run
    from clo_fleet.world.model import World

__all__ = ["chosen_world", "finished"]


def chosen_world(chosen: argparse.Namespace) -> "World":
    """The world of the file ``chosen.world``, with the seed and the time limit that were given."""
    from clo_fleet.world.world_file import read_world

    world = read_world(chosen.world)
    if chosen.seed is not None:
        world = replace(world, seed=chosen.seed)
    if chosen.until is not None:
        world = replace(world, until=chosen.until)
    return world


def finished(run: "Run", chosen: argparse.Namespace) -> "RunResult":
    """The result of a run; on a terminal, a line says how far it is."""
    if chosen.json or not sys.stderr.isatty():
        return run.finish()
    from rich.console import Console

    with Console(stderr=True).status("planning") as status:
        return run.finish(
            progress=lambda mission: status.update(
                f"{mission.strategy.name}: {mission.time:.0f} s; "
                + ", ".join(f"{robot.id} {robot.running or robot.mode.value}" for robot in mission.robots[:8])
            )
        )
