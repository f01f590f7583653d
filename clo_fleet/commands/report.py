"""``clo-fleet report``: what a batch shows, on one page."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "write a batch's report: strategies compared on the same seeds"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a batch's folder")
    parser.add_argument("--baseline", default="", metavar="STRATEGY", help="compare with it (default: clo)")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.report.page import report

    print(report(chosen.folder, chosen.baseline))
    return REACHED
