"""``clo-fleet make-world``: make a random world on a map."""

import argparse
from pathlib import Path

from clo_fleet.commands.arguments import count
from clo_fleet.commands.exit_codes import BAD_INPUT, REACHED

__all__ = ["HELP", "command", "options"]

HELP = "make a random world on a map: robots, objects, goals that overlap"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("map", type=Path)
    parser.add_argument("--robots", type=count, default=4, metavar="N", help="default: 4")
    parser.add_argument("--objects", type=count, default=6, metavar="M", help="default: 6")
    parser.add_argument("--seed", type=count, default=0, metavar="S", help="of the draw, and of the world (default: 0)")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FILE.yaml", help="the world file")
    parser.add_argument("--force", action="store_true", help="overwrite FILE.yaml")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    import sys

    from clo_fleet.world.map_file import read_map
    from clo_fleet.world.random_worlds import random_world
    from clo_fleet.world.world_writing import write_world

    if chosen.out.exists() and not chosen.force:
        print(f"clo-fleet: {chosen.out} exists already; nothing was overwritten", file=sys.stderr)
        return BAD_INPUT
    building = read_map(chosen.map)
    world = random_world(building, robots=chosen.robots, objects=chosen.objects, seed=chosen.seed, name=chosen.out.stem)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    write_world(world, chosen.out, chosen.map)
    goals = sum(len(robot.goals) for robot in world.robots)
    print(f"{chosen.out}: {len(world.robots)} robots, {len(world.objects)} objects, {goals} goals")
    return REACHED
