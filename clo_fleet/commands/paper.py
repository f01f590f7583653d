"""``clo-fleet paper``: the paper's study, run again."""

import argparse
import sys
from pathlib import Path

from clo_fleet.commands.arguments import count
from clo_fleet.commands.exit_codes import INTERRUPTED, REACHED

__all__ = ["HELP", "command", "options"]

HELP = "run the paper's study again: rows, tables and a figure beside its own"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("--quick", action="store_true", help="p-05 and p-10, 3 seeds: minutes instead of hours")
    parser.add_argument("--problems", default="", help="such as rooms,p-05,cooking/p-40; default: all")
    parser.add_argument("--seeds", type=count, metavar="N", help="runs a cell; costly ones fewer (default: 20)")
    parser.add_argument("--strategies", default="", help="names, separated by commas; default: all")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="goes on with a study begun in DIR")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.paper.progress import bar
    from clo_fleet.paper.runs import Selection, narrowed, quick
    from clo_fleet.paper.study import study

    def named(names: str) -> list[str]:
        return [name.strip() for name in names.split(",") if name.strip()]

    selected = narrowed(
        quick() if chosen.quick else Selection(),
        problems=named(chosen.problems),
        strategies=named(chosen.strategies),
        seeds=chosen.seeds,
    )
    try:
        with bar() as progress:
            rows = study(selected, chosen.out, progress=progress)
    except KeyboardInterrupt:
        print(f"clo-fleet: interrupted; the same command goes on with {chosen.out}", file=sys.stderr)
        return INTERRUPTED
    done = sum(row.done for row in rows)
    print(f"{done} of {len(rows)} runs reached their goals; written to {chosen.out}/table.md and beside it")
    return REACHED
