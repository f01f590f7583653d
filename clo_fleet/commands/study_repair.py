"""``clo-fleet study-repair``: break plans and count how they are repaired."""

import argparse
from pathlib import Path

from clo_fleet.commands.arguments import count, counts
from clo_fleet.commands.exit_codes import OTHER_OUTCOME, REACHED

__all__ = ["HELP", "command", "options"]

HELP = "break plans of any PDDL domains and count how they are repaired"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument(
        "folders", type=Path, nargs="+", metavar="FOLDER", help="holds domain.pddl and problems, or folders that do"
    )
    parser.add_argument("--episodes", type=count, default=200, help="for each problem (default: 200)")
    parser.add_argument("--actions", type=counts, default=(1, 5), metavar="1,5", help="how many others do at once")
    parser.add_argument("--seed", type=count, default=0)
    parser.add_argument("--only", metavar="NAME", help="one domain's folder, or one problem, such as gripper/prob01")
    parser.add_argument("--explain-left", action="store_true", help="ask Fast Downward for a plan where repair failed")
    parser.add_argument("--episode", metavar="PROBLEM:N", help="tell one episode, such as gripper/prob01:17")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write episodes.csv and summary.csv")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from rich.console import Console

    from clo_fleet.study.repair_story import retold
    from clo_fleet.study.repair_study import Settings, study
    from clo_fleet.study.repair_tables import tables, write_study
    from clo_fleet.study.summary import show

    settings = Settings(
        episodes=chosen.episodes, sizes=chosen.actions, seed=chosen.seed, explain_left=chosen.explain_left
    )
    if chosen.episode is not None:
        print("\n".join(retold(chosen.folders, chosen.episode, settings)))
        return REACHED
    with Console(stderr=True).status("reading") as status:  # shows nothing where that is no terminal
        result = study(chosen.folders, settings, chosen.only, progress=status.update)
    show(tables(result))
    if chosen.out is not None:
        for path in write_study(result, chosen.out):
            print(f"written to {path}")
    return OTHER_OUTCOME if any(trial.valid is False for trial in result.trials) else REACHED
