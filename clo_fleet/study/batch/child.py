"""The process of one run: ``python -m clo_fleet.study.batch.child FOLDER MEMORY``, its definition on standard input.

Theory of operation. The process leads a group of its own. A thread listens to standard input: when it ends, whoever
asked for the run is gone, and the whole group goes too; the planners, in groups of their own, do the same when their
input ends. So nothing outlives a batch, however it ends. The memory limit holds for each process alone.
"""

import json
import os
import resource
import signal
import sys
import threading
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.study.batch.definition import Definition
from clo_fleet.study.run import Run

__all__ = ["REFUSED", "main"]

REFUSED = 2  # exit code: the run's input cannot be used; standard error says why


def main() -> int:
    """Does the run; its log and result are in the folder when it ends."""
    folder, memory = Path(sys.argv[1]), int(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    definition = Definition.from_json(sys.stdin.readline())
    threading.Thread(target=_listen, daemon=True).start()
    try:
        with Run(definition.read(), definition.strategy, out=folder, force=True) as run:
            run.finish()
    except CloFleetError as error:
        sys.stderr.write(f"{error}\n")
        return REFUSED
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    (folder / "child.json").write_text(json.dumps({"peak_memory": peak}), encoding="utf-8")
    return 0


def _listen() -> None:
    sys.stdin.read()
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # all is on the disk; a regular exit would wait for the thread that listens
