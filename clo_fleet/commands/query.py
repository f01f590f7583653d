"""``clo-fleet query``: ask a batch's tables with SQL."""

import argparse
from pathlib import Path

from clo_fleet.commands.exit_codes import REACHED

__all__ = ["HELP", "command", "options"]

HELP = "ask a batch's tables `results` and `events` with SQL"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a batch's folder")
    parser.add_argument("question", metavar="SQL", help='such as "select strategy, avg(makespan_s) from results ..."')
    parser.add_argument("--csv", action="store_true", help="print CSV instead of a table")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    import csv
    import sys

    from clo_fleet.study.batch.tables import ask
    from clo_fleet.study.summary import plain_table, show

    columns, rows = ask(chosen.folder, chosen.question)
    if chosen.csv:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
    else:
        show(plain_table(columns, rows))
    return REACHED
