"""The event log: written to ``events.jsonl`` line by line as things happen, and kept for whoever looks.

A run that is cut short leaves whole lines and at most one torn one, which ``read_events`` leaves out.
"""

import json
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

from clo_fleet.errors import CloFleetError
from clo_fleet.world.events import Event, kind, plain

__all__ = ["EventLog", "EventLogError", "Recorded", "read_events"]

Recorded = tuple[int, float, Event]


class EventLogError(CloFleetError):
    """A line of an event log is no event.

    Attributes:
        path: the file.
        line: its number, from 1.
    """

    def __init__(self, path: Path, line: int) -> None:
        super().__init__(f"{path}:{line}: expected one event as a JSON object")
        self.path = path
        self.line = line


class EventLog:
    """Takes the events of one run; writes them to ``path`` if one is given. A context manager."""

    def __init__(self, path: Path | None = None) -> None:
        self.events: list[Recorded] = []
        self._file: TextIO | None = None
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
        self._file = path.open("w", encoding="utf-8", newline="\n")

    def record(self, time: float, event: Event) -> int:
        """Keep the event; returns its id."""
        number = len(self.events)
        self.events.append((number, time, event))
        if self._file:
            self._file.write(line(number, time, event) + "\n")
        return number

    def flush(self) -> None:
        """Bring what has been written so far to the disk."""
        if self._file:
            self._file.flush()

    def close(self) -> None:
        """Close the file."""
        if self._file:
            self._file.close()
            self._file = None


def line(number: int, time: float, event: Event) -> str:
    """The event as one line of JSON; the same event always gives the same bytes."""
    values: dict[str, Any] = {"id": number, "t": time, "kind": kind(event), **plain(event)}
    return json.dumps(values, ensure_ascii=False, separators=(",", ":"))


def read_events(path: Path) -> list[dict[str, Any]]:
    """The events of a log file as JSON objects; a torn last line is left out.

    Raises:
        EventLogError: if another line is no JSON object.
    """
    lines = path.read_text(encoding="utf-8").split("\n")
    events: list[dict[str, Any]] = []
    for number, text in enumerate(lines, start=1):
        if not text and number == len(lines):
            break
        try:
            event = json.loads(text)
        except json.JSONDecodeError:
            event = None
        if not isinstance(event, dict):
            if number == len(lines):
                break
            raise EventLogError(path, number)
        events.append(event)
    return events
