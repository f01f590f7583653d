"""``clo-fleet compare``: run a world with several strategies, one table."""

import argparse
from pathlib import Path

from clo_fleet.commands.arguments import count, seconds
from clo_fleet.commands.exit_codes import OTHER_OUTCOME, REACHED
from clo_fleet.commands.worlds import chosen_world, finished

__all__ = ["HELP", "command", "options"]

HELP = "run a world with several strategies: one table"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("world", type=Path)
    parser.add_argument("--strategies", default="clo,replan", help="names, separated by commas")
    parser.add_argument("--seed", type=count, help="overrides the world's seed")
    parser.add_argument("--until", type=seconds, metavar="SECONDS", help="longest simulated time")
    parser.add_argument("--json", action="store_true", help="print the results as a JSON list")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    import json

    from clo_fleet.study.run import Run, planner_pool, strategy_named
    from clo_fleet.study.summary import comparison, show

    strategies = [strategy_named(name.strip()) for name in chosen.strategies.split(",")]
    world = chosen_world(chosen)
    results = []
    with planner_pool() as planners:
        for strategy in strategies:
            with Run(world, strategy, planners=planners) as run:
                results.append(finished(run, chosen))
    if chosen.json:
        print(json.dumps([json.loads(result.to_json()) for result in results], indent=2))
    else:
        show(comparison(results))
    return REACHED if all(result.outcome == "goals_reached" for result in results) else OTHER_OUTCOME
