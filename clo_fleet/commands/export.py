"""``clo-fleet export``: a run for the tools of robotics."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "write a run as an MCAP file, for Foxglove and its kin (extra mcap)"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("folder", type=Path, metavar="RUN", help="a run's folder")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.mcap", help="default: run.mcap in RUN")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.bridges.mcap_export import export

    target = chosen.out or chosen.folder / "run.mcap"
    print(f"{target}: {export(chosen.folder, target)} messages")
    return REACHED
