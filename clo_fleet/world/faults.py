"""What is wrong with a file that somebody wrote: where it stands, what was found, what was expected.

Two values, because two people know the two halves. A check knows only the setting, so it makes a `Finding`:
the key path that it is about and what was expected there. The reader of the file knows the lines, so it turns
a finding into a `Fault`. All texts from the file are shown through ``repr``: the file may be a stranger's, and
its control characters must not reach a terminal.
"""

import difflib
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from clo_fleet.errors import CloFleetError

__all__ = ["Fault", "FileFaultsError", "Finding", "KeyPath", "did_you_mean", "key_text", "point_text", "value_text"]

T = TypeVar("T")
KeyPath = tuple[str | int, ...]

MAX_SHOWN = 60  # characters of a value: enough to recognise it, short enough for one line
MAX_COMPARED = 2000  # names: past this, looking for the nearest one costs more than it helps


@dataclass(frozen=True, slots=True)
class Finding:
    """Something wrong at a key of the setting, before its place in a file is known.

    Attributes:
        key: the path of keys and list indices, as in the file.
        expected: what should stand there, in plain words.
        value: what was found, where the value itself does not say it; ``None``: the value as written.
    """

    key: KeyPath
    expected: str
    value: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Fault:
    """One thing wrong in a file. Lines and columns count from 1."""

    file: Path
    line: int
    column: int
    key: str
    value: str
    expected: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.key}: got {self.value}, expected {self.expected}"


class FileFaultsError(CloFleetError):
    """A file cannot be used.

    Attributes:
        faults: everything that is wrong with it (and with files that it names), file by file, in the order of lines.
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        super().__init__(self.faults)

    def __str__(self) -> str:
        return "\n".join(map(str, self.faults))


def key_text(path: KeyPath) -> str:
    """The key path as one writes it.

    >>> key_text(("robots", "r1", "goals", 0))
    'robots.r1.goals[0]'
    """
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += "." * bool(text) + (part if re.fullmatch(r"[\w-]{1,80}", part) else value_text(part))
    return text or "(the file)"


def value_text(value: object) -> str:
    """The value on one short line, as the file writes it.

    >>> value_text({"at_m": (1.5, True), "room": "l1"})
    "{at_m: [1.5, true], room: 'l1'}"
    """
    text = _text(value)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


def point_text(point: tuple[float, float]) -> str:
    """The point as a file writes it, to six digits.

    >>> point_text((1.0, 2.5))
    '[1, 2.5]'
    """
    return f"[{point[0]:g}, {point[1]:g}]"


def did_you_mean(name: str, known: Collection[str]) -> str:
    """The end of a sentence that suggests the known name nearest to ``name``; empty if none is near.

    >>> did_you_mean("corridor", ["rooms", "doors", "corridors"])
    '; did you mean corridors?'
    """
    if len(known) > MAX_COMPARED or len(name) > MAX_SHOWN:
        return ""
    near = difflib.get_close_matches(name, sorted(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _text(value: object) -> str:
    match value:
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
        case str():
            return repr(value[: MAX_SHOWN + 1])
        case dict():
            return "{" + ", ".join(f"{key_text((str(k),))}: {_text(v)}" for k, v in _first(value.items())) + "}"
        case tuple() | list():
            return "[" + ", ".join(map(_text, _first(value))) + "]"
        case int() if abs(value) > 10**MAX_SHOWN:
            return "a number too large to show"
        case _:
            return str(value)


def _first(values: Iterable[T]) -> list[T]:
    return [value for value, _ in zip(values, range(MAX_SHOWN), strict=False)]
