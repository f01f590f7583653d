"""``clo-fleet init``: copy the maps and worlds that come with the package."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "copy the maps and worlds that come with the package"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.shipped import copy_out

    for path in copy_out(chosen.folder):
        print(path)
    return REACHED
