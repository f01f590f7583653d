"""``clo-fleet validate``: check world and map files."""

import argparse
import sys
from pathlib import Path

from clo_fleet.commands.exit_codes import BAD_INPUT, REACHED
from clo_fleet.errors import CloFleetError

__all__ = ["HELP", "command", "options"]

HELP = "check world and map files"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.sim.network_check import check_network
    from clo_fleet.world.any_file import read_any
    from clo_fleet.world.disturbances import summed_up
    from clo_fleet.world.model import World
    from clo_fleet.world.random_faults import schedule

    faulty = False
    for path in chosen.files:
        try:
            found = read_any(path)
        except CloFleetError as error:
            print(error, file=sys.stderr)
            faulty = True
            continue
        building = found.map if isinstance(found, World) else found
        differences = check_network(building, building.network) if building.network else ()
        for difference in differences:
            print(f"{building.network}: {difference}; build it anew with clo-fleet build-network", file=sys.stderr)
        faulty = faulty or bool(differences)
        if not differences:
            print(f"{path}: a sound {'world' if isinstance(found, World) else 'map'}")
        if isinstance(found, World) and not differences:
            for disturbance in schedule(found):
                print(f"  {disturbance.time:7.1f} s: {summed_up(disturbance)}")
    return BAD_INPUT if faulty else REACHED
