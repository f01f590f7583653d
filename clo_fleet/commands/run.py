"""``clo-fleet run``: run a world and say what happened."""

import argparse
from pathlib import Path

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.commands.arguments import count, seconds
from clo_fleet.commands.exit_codes import OTHER_OUTCOME, REACHED
from clo_fleet.commands.worlds import chosen_world, finished

__all__ = ["HELP", "command", "options"]

HELP = "run a world and say what happened"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("world", type=Path, help="a world file (YAML)")
    parser.add_argument("--strategy", default="clo", help=f"default: clo; also {', '.join(sorted(STRATEGIES))}")
    parser.add_argument("--seed", type=count, help="overrides the world's seed")
    parser.add_argument("--until", type=seconds, metavar="SECONDS", help="longest simulated time")
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: runs/<world>-<strategy>-<seed>/")
    parser.add_argument("--force", action="store_true", help="overwrite an earlier run in DIR")
    parser.add_argument("--json", action="store_true", help="print result.json instead of tables")
    parser.add_argument("--explain", metavar="ROBOT", help="tell the story of one robot")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.run import Run, UnknownRobotError, strategy_named

    strategy = strategy_named(chosen.strategy)
    world = chosen_world(chosen)
    if chosen.explain is not None and chosen.explain not in {spec.id for spec in world.robots}:
        raise UnknownRobotError(chosen.explain, tuple(spec.id for spec in world.robots))
    out = chosen.out or Path("runs") / f"{world.name}-{strategy.name}-{world.seed}"
    with Run(world, strategy, out=out, force=chosen.force) as run:
        result = finished(run, chosen)
        log = run.log
    from clo_fleet.study.expectations import disappointments
    from clo_fleet.study.story import story
    from clo_fleet.study.summary import show, summary

    if chosen.json:
        print(result.to_json(), end="")
    else:
        if chosen.explain is not None:
            print("\n".join(story(log, chosen.explain)))
        show(summary(result))
        for disappointment in disappointments(world, result):
            print(f"not as the world expects: {disappointment}")
        print(f"written to {out}/events.jsonl and {out}/result.json")
    return REACHED if result.outcome == "goals_reached" else OTHER_OUTCOME
