"""``python -m clo_fleet.testing.soak``: soak, and say what came of it."""

import argparse
import sys
from collections import Counter
from pathlib import Path

from clo_fleet.testing.soak.running import Limits, soak


def main() -> int:
    """Run the worlds that are asked for; 0 if clo-fleet stood it."""
    parser = argparse.ArgumentParser(prog="python -m clo_fleet.testing.soak", description="random worlds, watched")
    parser.add_argument("--worlds", type=int, default=500, help="how many (default: 500)")
    parser.add_argument("--first", type=int, default=0, help="the number of the first (default: 0)")
    parser.add_argument("--out", type=Path, default=Path("runs/soak"), metavar="DIR", help="default: runs/soak")
    parser.add_argument("--wall", type=float, default=Limits().wall, metavar="SECONDS", help="for each run")
    options = parser.parse_args()
    endings: Counter[str] = Counter()
    faults = 0
    numbers = range(options.first, options.first + options.worlds)
    for verdict in soak(numbers, options.out, Limits(wall=options.wall)):
        faults += verdict.is_fault
        endings[verdict.outcome or verdict.ending.value] += 1
        sys.stdout.write(
            f"{verdict.world:5}  {verdict.building:14} {verdict.robots:3} robots  {verdict.strategy:22} "
            f"{verdict.time_s:6.1f} s in {verdict.wall_s:6.1f} s  {verdict.outcome or verdict.ending.value}"
            f"{': ' + verdict.why if verdict.outcome != 'goals_reached' else ''}\n"
        )
        sys.stdout.flush()
    total = ", ".join(f"{count} {ending}" for ending, count in endings.most_common())
    sys.stdout.write(f"{options.worlds} worlds: {total}; {faults} faults. Kept in {options.out}\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
