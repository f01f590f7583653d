"""``clo-fleet build-network``: build the SUMO network of a map."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "build the SUMO network of a map"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("map", type=Path)


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.sim.network import build_network
    from clo_fleet.world.map_file import read_map

    building = read_map(chosen.map, network_required=False)
    path = building.network or chosen.map.with_suffix(".net.xml.gz")
    build_network(building, path)
    print(f"{path}: {len(building.corridors)} corridors")
    return REACHED
