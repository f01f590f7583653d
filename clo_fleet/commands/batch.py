"""``clo-fleet batch``: worlds x strategies x seeds x whatever is swept."""

import argparse
import sys
from pathlib import Path

from clo_fleet.commands.arguments import count, shard
from clo_fleet.commands.exit_codes import INTERRUPTED, OTHER_OUTCOME, REACHED

__all__ = ["HELP", "command", "options"]

HELP = "run worlds with several strategies, seeds and settings"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("spec", type=Path, metavar="SPEC", help="a batch file (YAML)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="goes on with a batch begun in DIR")
    parser.add_argument("--workers", type=count, default=2, metavar="N", help="runs at a time (default: 2)")
    parser.add_argument("--shard", type=shard, metavar="I/N", help="only the I-th of N parts, for job arrays")
    parser.add_argument("--rerun", choices=("failed", "all"), help="do again what was lost, or everything")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that sees DIR too (extra `cluster`)")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.batch.progress import bar
    from clo_fleet.study.batch.running import local, run_batch
    from clo_fleet.study.batch.spec import read_batch

    batch = read_batch(chosen.spec)
    if chosen.scheduler:
        from clo_fleet.study.batch.cluster import on_cluster

        executor = on_cluster(chosen.scheduler)
    else:
        executor = local(max(1, chosen.workers))
    try:
        with bar() as progress:
            rows = run_batch(batch, chosen.out, executor, shard=chosen.shard, rerun=chosen.rerun, progress=progress)
    except KeyboardInterrupt:
        print(f"clo-fleet: interrupted; the same command goes on with {chosen.out}", file=sys.stderr)
        return INTERRUPTED
    reached = sum(row.outcome == "goals_reached" for row in rows)
    lost = [row for row in rows if row.lost]
    for row in lost[:10]:
        print(f"lost: {row.world} {row.strategy} seed {row.seed} ({row.run_id}): {row.ending} {row.why}")
    if len(lost) > 10:
        print(f"and {len(lost) - 10} more")
    print(f"{reached} of {len(rows)} runs reached their goals, {len(lost)} were lost; written to {chosen.out}")
    return OTHER_OUTCOME if lost else REACHED
