"""A process that does runs of the study: ``python -m clo_fleet.paper.worker``. Runs come in and rows go out as JSON.

Theory of operation. The process leads a group of its own, which holds whatever its planner starts. A thread listens to
standard input: it hands on the runs, and when the input ends, the study is over or was killed, and the thread ends the
whole group at once. So nothing outlives the study, however it ends.
"""

import gc
import json
import os
import queue
import shutil
import signal
import sys
import threading
from dataclasses import asdict
from pathlib import Path

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.paper.calls import Route
from clo_fleet.paper.catalogue import SETTINGS
from clo_fleet.paper.episode import Episode, Limits
from clo_fleet.paper.rows import Row, Run
from clo_fleet.paper.symbolic import SymbolicWorld
from clo_fleet.planning.light_import import stand_in_for_config_space

__all__ = ["main", "row_of"]

STDOUT, STDERR = 1, 2


def main() -> None:
    """Does runs until standard input ends. Arguments: a directory of its own, the three limits [s]."""
    directory, *limits = sys.argv[1:]
    run_limit, call_limit, links_limit = map(float, limits)
    rows = os.dup(STDOUT)
    os.dup2(STDERR, STDOUT)  # whatever a library prints must not get between the rows
    signal.signal(signal.SIGTERM, lambda *_: None)  # meant for the planner: see `_listen`
    runs: queue.SimpleQueue[Run] = queue.SimpleQueue()
    over = threading.Event()
    listener = threading.Thread(target=_listen, args=(runs, over, Path(directory)), daemon=True)
    listener.start()
    stand_in_for_config_space()
    import clo_fleet.paper.planner  # noqa: F401  # before the first run's clock starts

    gc.freeze()  # what the imports left is here to stay, and need not be looked through during a run
    try:
        while True:
            row = row_of(runs.get(), Path(directory), Limits(run=run_limit, call=call_limit, links=links_limit))
            line = row.to_json().encode() + b"\n"
            while line:
                line = line[os.write(rows, line) :]
    except BrokenPipeError:  # nobody is there to read the row: input has ended too
        listener.join()
    finally:
        if over.is_set():  # whatever went wrong, went wrong because our files are being taken away
            listener.join()


def _listen(runs: "queue.SimpleQueue[Run]", over: threading.Event, directory: Path) -> None:
    for line in sys.stdin:
        runs.put(Run(*json.loads(line)))
    over.set()
    os.killpg(0, signal.SIGTERM)  # the planner first: it may still be writing files
    while directory.exists():
        shutil.rmtree(directory, ignore_errors=True)
    os.killpg(0, signal.SIGKILL)


def row_of(run: Run, directory: Path, limits: Limits) -> Row:
    """Does the run. ``directory`` is for the planner's files; the process has to lead its group."""
    from clo_fleet.paper.planner import FastDownward

    setting = SETTINGS[run.domain]
    world = SymbolicWorld(setting=setting, task=setting.task(run.size), probability=run.probability, seed=run.seed)
    planner = FastDownward(setting.domain(), Route(run.route), directory)
    episode = Episode(world, STRATEGIES[run.strategy], planner, limits)
    outcome = episode.finish()
    tally, meters = episode.executive.tally, episode.meters
    return Row(
        **asdict(run),
        outcome=outcome,
        executed=tally.executed,
        failed=tally.failed,
        first_plan=meters.first_plan,
        planned_again=tally.planned_again,
        added=tally.added,
        dropped=tally.dropped,
        superseded=tally.superseded,
        planner_calls=meters.calls,
        expansions=meters.expansions,
        helped=world.helped,
        looked_at=meters.looked_at,
        noticed=meters.noticed,
        repairs=meters.repairs,
        wall_planning=round(meters.wall_planning, 6),
        wall_search=round(meters.wall_search, 6),
        wall_deciding=round(meters.wall_deciding, 6),
        wall_first_planning=round(meters.wall_first_planning, 6),
        wall_first_search=round(meters.wall_first_search, 6),
        wall_first_deciding=round(meters.wall_first_deciding, 6),
    )


if __name__ == "__main__":
    main()
