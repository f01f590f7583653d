"""The process of runs: a line of JSON in (a world file, a strategy), a line out (what became of it), one after another.

What it is not made for ends it, with a traceback on standard error; whoever asked starts another. A thread listens to
standard input: when that ends, whoever asked is gone, and the process ends in the middle of whatever it does. Its
planners do the same.
"""

import json
import os
import resource
import sys
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any

from clo_fleet.study.run import Run, planner_pool
from clo_fleet.study.witness import BrokenInvariantError, watched
from clo_fleet.testing.soak.verdict import Ending
from clo_fleet.world.world_file import read_world

__all__ = ["main", "seen"]


def seen(run: Run) -> dict[str, Any]:
    """What becomes of a run under a witness."""
    try:
        for _ in watched(run):
            pass
    except BrokenInvariantError as broken:
        return {"ending": Ending.BROKEN.value, "why": str(broken), "time_s": run.time}
    outcome = run.mission.outcome
    assert outcome is not None, "a run that is done has ended somehow"
    return {"ending": Ending.OUTCOME.value, "outcome": outcome.value, "why": run.mission.why, "time_s": run.time}


def main() -> None:
    """Do runs for ever. The first argument: bytes of memory for each process."""
    memory = int(sys.argv[1])
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    asked: SimpleQueue[str] = SimpleQueue()
    Thread(target=_listen, args=(asked,), daemon=True).start()
    with planner_pool() as planners:
        while True:
            wanted = json.loads(asked.get())
            with Run(read_world(Path(wanted["world"])), wanted["strategy"], planners=planners) as run:
                verdict = seen(run)
            sys.stdout.write(json.dumps(verdict) + "\n")
            sys.stdout.flush()


def _listen(asked: "SimpleQueue[str]") -> None:
    for line in sys.stdin:
        asked.put(line)
    os._exit(0)


if __name__ == "__main__":
    main()
