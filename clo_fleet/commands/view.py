"""``clo-fleet view``: make a page of a run, to be opened in a browser."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "write a replay of a run, one page that opens from disk"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("folder", type=Path, metavar="RUN", help="a run's folder")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.replay.page import view

    print(view(chosen.folder))
    return REACHED
