"""Checkpoints: a run saved between two ticks, so that another process can go on with it.

A checkpoint is two files in the run's folder ``checkpoints``: the traffic as SUMO saves it, and plain data as gzipped
JSON, versioned by ``CHECKPOINT_FORMAT``, which names the other by its hash and says how far the event log had come.
Each is written whole or not at all, the JSON last. The last two are kept: should the newest be damaged, the one before
it serves.
"""

import gzip
import hashlib
import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from clo_fleet.errors import CloFleetError
from clo_fleet.fleet.mission import Mission
from clo_fleet.fleet.saved import Saved
from clo_fleet.study.atomic import PARTIAL, write_whole, written_whole
from clo_fleet.study.event_log import LogMark, reaches

__all__ = ["CHECKPOINT_FORMAT", "Checkpoint", "CheckpointError", "Checkpoints"]

CHECKPOINT_FORMAT = "clo-fleet/checkpoint/1"
KEPT = 2
LARGEST = 1 << 30  # bytes of JSON in a checkpoint; a hundred robots take 2 MB
DATA, TRAFFIC = ".json.gz", ".traffic.xml.gz"


class CheckpointError(CloFleetError):
    """A run cannot go on from a checkpoint.

    Attributes:
        path: the checkpoint, or the folder that holds some.
        reason: what is wrong with it.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path
        self.reason = reason


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkpoint:
    """A run as it was saved.

    Attributes:
        path: its file.
        time: simulated [s].
        log: how far the event log had come.
        saved: the mission.
        wall_run: real time that the run had taken [s].
    """

    path: Path
    time: float
    log: LogMark
    saved: Saved
    wall_run: float


class Checkpoints:
    """The checkpoints of one run, in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keep(self, mission: Mission, log: LogMark, wall_run: float) -> Saved:
        """Save the mission, and take away all but the last two; returns what another process would read."""
        self._folder.mkdir(parents=True, exist_ok=True)
        name = f"{mission.time:09.1f}"
        traffic = self._folder / f"{name}{TRAFFIC}" if mission.world.map.corridors else None
        if traffic is not None:
            with written_whole(traffic) as temporary:
                mission.save_traffic(temporary)
        text = json.dumps(
            {
                "format": CHECKPOINT_FORMAT,
                "time": mission.time,
                "log": asdict(log),
                "traffic": _hash(traffic) if traffic else None,
                "wall_run": wall_run,
                "wall": mission.wall(),
                "state": mission.state(),
            },
            ensure_ascii=False,
            allow_nan=False,
            separators=(",", ":"),
        )
        write_whole(self._folder / f"{name}{DATA}", gzip.compress(text.encode(), compresslevel=1, mtime=0))
        self._tidy()
        return _checkpoint(self._folder / f"{name}{DATA}", json.loads(text)).saved

    def last(self, log: Path) -> Checkpoint | None:
        """The newest checkpoint that is whole and that the event log ``log`` reaches; ``None`` if there is none at all.

        Raises:
            CheckpointError: if there are some, but none that can be used.
        """
        faults = []
        for path in reversed(self._files()):
            try:
                found = _read(path)
            except CheckpointError as error:
                faults.append(str(error))
                continue
            if reaches(log, found.log):
                return found
            faults.append(f"{path}: {log} is not the log that was written up to then")
        if faults:
            raise CheckpointError(self._folder, "; ".join(faults))
        return None

    def clear(self) -> None:
        """Take all away."""
        for path in self._folder.glob("*.gz"):
            path.unlink()

    def _files(self) -> list[Path]:
        return sorted(path for path in self._folder.glob(f"*{DATA}") if not path.name.startswith(PARTIAL))

    def _tidy(self) -> None:
        """Take away old checkpoints, and what was being written when somebody was killed."""
        kept = {path.name.removesuffix(DATA) for path in self._files()[-KEPT:]}
        for path in self._folder.glob("*.gz"):
            if path.name.removesuffix(DATA).removesuffix(TRAFFIC) not in kept:
                path.unlink()


def _read(path: Path) -> Checkpoint:
    try:
        with gzip.open(path) as file:
            text = file.read(LARGEST + 1)
        plain = json.loads(text) if len(text) <= LARGEST else None
    except (OSError, EOFError, zlib.error, ValueError) as error:
        raise CheckpointError(path, f"damaged ({error})") from error
    if not isinstance(plain, dict) or plain.get("format") != CHECKPOINT_FORMAT:
        raise CheckpointError(path, f"expected a checkpoint of format {CHECKPOINT_FORMAT}")
    try:
        found = _checkpoint(path, plain)
        whole = found.saved.traffic is None or _hash(found.saved.traffic) == plain["traffic"]
    except (OSError, KeyError, TypeError, AttributeError) as error:
        raise CheckpointError(path, f"damaged ({error})") from error
    if not whole:
        raise CheckpointError(path, "its traffic is damaged")
    return found


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _checkpoint(path: Path, plain: Mapping[str, Any]) -> Checkpoint:
    traffic = path.with_name(path.name.removesuffix(DATA) + TRAFFIC) if plain["traffic"] else None
    return Checkpoint(
        path=path,
        time=plain["time"],
        log=LogMark(**plain["log"]),
        saved=Saved(state=plain["state"], traffic=traffic, wall=plain["wall"]),
        wall_run=plain["wall_run"],
    )
