"""Event logs read back: as JSON objects for whoever looks, or as the events that were written."""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import TypeAdapter, ValidationError

from clo_fleet.errors import CloFleetError
from clo_fleet.world.events import Event, kind_of

__all__ = ["EventLogError", "Recorded", "read_events", "recorded"]

Recorded = tuple[int, float, Event]
FACT = re.compile(r"\(([^\s()]+(?: [^\s()]+)*)\)")


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


def recorded(path: Path, lines: Iterable[bytes]) -> list[Recorded]:
    """The events that were written as these lines of the log ``path``, one and all.

    Raises:
        EventLogError: if a line is no event, or not the one of its place.
    """
    readers: Mapping[str, TypeAdapter[Event]] = {kind_of(event): TypeAdapter(event) for event in get_args(Event)}
    found: list[Recorded] = []
    for number, text in enumerate(lines):
        try:
            values = json.loads(text)
            if values.pop("id") != number:
                raise EventLogError(path, number + 1)
            time, reader = float(values.pop("t")), readers[values.pop("kind")]
            if isinstance(values.get("fact"), str):
                values["fact"] = _fact(values["fact"])
            found.append((number, time, reader.validate_python(values)))
        except (ValueError, KeyError, TypeError, AttributeError, ValidationError) as error:
            raise EventLogError(path, number + 1) from error
    return found


def _fact(text: str) -> tuple[str, ...]:
    match = FACT.fullmatch(text)
    if match is None:
        raise ValueError(text)
    return tuple(match[1].split(" "))
