"""The event log: written to ``events.jsonl`` line by line as things happen, and kept for whoever looks.

A run that is cut short leaves whole lines and at most one torn one, which ``read_events`` leaves out. A run that goes
on from a checkpoint cuts the log back to what had been written then.
"""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from clo_fleet.study.event_reading import EventLogError, Recorded, read_events, recorded
from clo_fleet.world.events import Event, kind, plain

__all__ = ["EventLog", "EventLogError", "LogMark", "Recorded", "json_of", "line", "reaches", "read_events"]

WRITE_AFTER = 1 << 16  # bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class LogMark:
    """How far a log had come: so many events, so many bytes, and the hash of those."""

    events: int
    size: int
    sha256: str


class EventLog:
    """Takes the events of one run; writes them to ``path`` if one is given. A context manager."""

    def __init__(self, path: Path | None = None) -> None:
        self.events: list[Recorded] = []
        self._file: BinaryIO | None = None
        self._size = 0
        self._hash = hashlib.sha256()
        if path is not None:
            self.write_to(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write_to(self, path: Path) -> None:
        """From now on, write what happens to a new file."""
        self._file = path.open("wb", buffering=WRITE_AFTER)

    def go_on(self, path: Path, mark: LogMark) -> None:
        """Take up the events of a file up to a mark, cut off what was written after it, and write on from there.

        Raises:
            EventLogError: if the file is not what it was at the mark; it is left as it is then.
        """
        written = _written(path, mark.size)
        lines = written.splitlines()
        if hashlib.sha256(written).hexdigest() != mark.sha256 or len(lines) != mark.events:
            raise EventLogError(path, len(lines))
        self.events = recorded(path, lines)
        os.truncate(path, mark.size)
        self._file = path.open("ab", buffering=WRITE_AFTER)
        self._size, self._hash = mark.size, hashlib.sha256(written)

    def record(self, time: float, event: Event) -> int:
        """Keep the event; returns its id."""
        number = len(self.events)
        self.events.append((number, time, event))
        if self._file:
            written = line(number, time, event).encode() + b"\n"
            self._file.write(written)
            self._size += len(written)
            self._hash.update(written)
        return number

    def flush(self) -> None:
        """Hand what has been written so far to the system."""
        if self._file:
            self._file.flush()

    def mark(self) -> LogMark:
        """How far the log has come; so far it is on the disk, whatever happens next."""
        if self._file:
            self._file.flush()
            os.fsync(self._file.fileno())
        return LogMark(events=len(self.events), size=self._size, sha256=self._hash.hexdigest())

    def close(self) -> None:
        """Close the file."""
        if self._file:
            self._file.close()
            self._file = None


def reaches(path: Path, mark: LogMark) -> bool:
    """Whether a log was written at least as far as the mark, and is up to there what it was."""
    return path.is_file() and hashlib.sha256(_written(path, mark.size)).hexdigest() == mark.sha256


def json_of(number: int, time: float, event: Event) -> dict[str, Any]:
    """The event as a JSON object."""
    return {"id": number, "t": time, "kind": kind(event), **plain(event)}


def line(number: int, time: float, event: Event) -> str:
    """The event as one line of JSON; the same event always gives the same bytes."""
    return json.dumps(json_of(number, time, event), ensure_ascii=False, separators=(",", ":"))


def _written(path: Path, size: int) -> bytes:
    with path.open("rb") as file:
        return file.read(size)
