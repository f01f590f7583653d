"""``clo-fleet run``: run a world and say what happened."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.commands.arguments import count, seconds
from clo_fleet.commands.exit_codes import OTHER_OUTCOME, REACHED
from clo_fleet.commands.worlds import chosen_world, finished
from clo_fleet.errors import CloFleetError

if TYPE_CHECKING:
    from clo_fleet.study.run import Run

__all__ = ["HELP", "command", "options"]

OF_THE_BEGINNING = ("strategy", "seed", "until", "out", "force", "checkpoint_every")
HELP = "run a world and say what happened"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("world", type=Path, nargs="?", help="a world file (YAML)")
    parser.add_argument("--strategy", help=f"default: clo; also {', '.join(sorted(STRATEGIES))}")
    parser.add_argument("--seed", type=count, help="overrides the world's seed")
    parser.add_argument("--until", type=seconds, metavar="SECONDS", help="longest simulated time")
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: runs/<world>-<strategy>-<seed>/")
    parser.add_argument("--force", action="store_true", help="overwrite an earlier run in DIR")
    parser.add_argument("--checkpoint-every", type=seconds, metavar="S", help="save the run every S simulated seconds")
    parser.add_argument("--resume", type=Path, metavar="DIR", help="go on with the run saved in DIR")
    parser.add_argument("--json", action="store_true", help="print result.json instead of tables")
    parser.add_argument("--explain", metavar="ROBOT", help="tell the story of one robot")
    parser.add_argument("--view", action="store_true", help="write a replay, run.html, as well")
    parser.add_argument(
        "--live", action="store_true", help="show the run in a browser while it goes on (loopback only)"
    )


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.study.run import UnknownRobotError

    run, out = _begun(chosen) if chosen.resume is None else _resumed(chosen)
    world = run.mission.world
    if chosen.explain is not None and chosen.explain not in {spec.id for spec in world.robots}:
        raise UnknownRobotError(chosen.explain, tuple(spec.id for spec in world.robots))
    with run:
        if chosen.live:
            from clo_fleet.study.replay.live import serving

            with serving(run) as server:
                print(f"watch it at {server.url}", file=sys.stderr)
                result = finished(run, chosen)
                print("the run has ended; Ctrl-C ends the server", file=sys.stderr)
                server.wait()
        else:
            result = finished(run, chosen)
        log = run.log
    if chosen.view:
        from clo_fleet.study.replay.page import view

        view(out)
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
        if chosen.view:
            print(f"to look at: {out}/run.html")
    return REACHED if result.outcome == "goals_reached" else OTHER_OUTCOME


class RunOptionsError(CloFleetError):
    """Options that do not go together."""


def _begun(chosen: argparse.Namespace) -> "tuple[Run, Path]":
    """A new run, and its folder."""
    from clo_fleet.study.run import Run, strategy_named

    if chosen.world is None:
        raise RunOptionsError("expected a world file, or --resume DIR")
    strategy = strategy_named(chosen.strategy or "clo")
    world = chosen_world(chosen)
    out = chosen.out or Path("runs") / f"{world.name}-{strategy.name}-{world.seed}"
    every = chosen.checkpoint_every
    return Run(world, strategy, out=out, force=chosen.force, checkpoint_every=every, source=chosen.world), out


def _resumed(chosen: argparse.Namespace) -> "tuple[Run, Path]":
    """A run that was stopped, and its folder."""
    from clo_fleet.study.run import Run

    given = [f"--{name.replace('_', '-')}" for name in OF_THE_BEGINNING if getattr(chosen, name)]
    if given:
        raise RunOptionsError(f"--resume goes on with a run as it was begun: leave out {', '.join(given)}")
    run = Run.resumed(chosen.resume, chosen.world)
    at = "has no checkpoint yet: begins anew" if run.resumed_at is None else f"goes on from {run.resumed_at:g} s"
    print(f"{chosen.resume}: {at}", file=sys.stderr if chosen.json else sys.stdout, flush=True)
    return run, chosen.resume
