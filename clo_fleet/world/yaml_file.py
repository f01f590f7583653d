"""YAML that strangers wrote, read into plain values whose places in the file are known.

ruamel.yaml only parses the text into events here. We build the values ourselves, from the event stream, so that
no tag can name an object to construct, every value keeps its line and column, and all faults come at once.

Refused, because a building or a world needs none of it: anchors and aliases altogether (a few lines of them expand
to gigabytes), tags of any kind, several documents, keys that stand twice, nesting deeper than `MAX_DEPTH`, files
above `MAX_BYTES`. Scalars follow the core schema of YAML 1.2 without its octal and hexadecimal numbers, so ``no``
and ``2024-01-01`` are text.
"""

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from clo_fleet.errors import CloFleetError
from clo_fleet.world.faults import Fault, FileFaultsError, Finding, KeyPath, key_text, value_text

__all__ = ["MAX_BYTES", "MAX_DEPTH", "FileWriteError", "Place", "Value", "YamlFile", "read_yaml", "write_yaml"]

MAX_BYTES = 5_000_000
MAX_DEPTH = 50

NULLS = {"", "~", "null", "Null", "NULL"}
BOOLS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
INT = re.compile(r"[-+]?[0-9]{1,400}")  # past this it is no double either: infinite
FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
CONTROL = re.compile(r"[^\t\n\r\x20-\x7e\x85\xa0-\ufffd\U00010000-\U0010ffff]")  # what YAML forbids in a file

Place = tuple[int, int]
Value = None | bool | int | float | str | tuple["Value", ...] | dict[str, "Value"]


class FileWriteError(CloFleetError):
    """A file could not be written.

    Attributes:
        path: the file.
        reason: what the operating system says.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(path, reason)
        self.path = path
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.path}: cannot be written: {self.reason}"


@dataclass(frozen=True, slots=True)
class YamlFile:
    """The content of a YAML file with the places of its values.

    Attributes:
        path: the file.
        content: its top level; lists are tuples, so that nobody mistakes them for text to edit.
        places: line and column, from 1, by key path: of the key in a mapping, of the item in a list. Lists
            of numbers have none for their items, as maps are full of coordinates; they are where their list is.
        faults: what is wrong with the file as YAML. Refused parts are missing from the content, or ``None``.
    """

    path: Path
    content: dict[str, Value]
    places: Mapping[KeyPath, Place]
    faults: tuple[Fault, ...]

    def value(self, key: KeyPath) -> Value:
        """The value at the key path; ``None`` where there is none."""
        value: Value = self.content
        for part in key:
            if isinstance(value, dict) and isinstance(part, str):
                value = value.get(part)
            elif isinstance(value, tuple) and isinstance(part, int) and part < len(value):
                value = value[part]
            else:
                return None
        return value

    def fault(self, finding: Finding) -> Fault:
        """The finding with its place: that of its key, or of the nearest key around it that the file has."""
        key = finding.key
        while key and key not in self.places:
            key = key[:-1]
        line, column = self.places.get(key, (1, 1))
        value = value_text(self.value(finding.key)) if finding.value is None else finding.value
        return Fault(
            file=self.path,
            line=line,
            column=column,
            key=key_text(finding.key),
            value=value,
            expected=finding.expected,
        )


def read_yaml(path: Path) -> YamlFile:
    """The file's content, a mapping, with the place of every key.

    Raises:
        FileFaultsError: if there is no such file, or it is not one YAML mapping within the limits.
    """
    builder = _Builder(path, _text(path))
    content = builder.document()
    if not isinstance(content, dict):
        expected = "keys with values, such as 'format: ...'"
        builder.stop((1, 1), "an empty file" if content is None else value_text(content), expected)
    assert isinstance(content, dict)
    return YamlFile(path, content, builder.places, tuple(builder.faults))


def write_yaml(path: Path, content: Mapping[str, object]) -> None:
    """Write the content, an entry of a section to a line, so that a reader sees the old file or the whole new one.

    Raises:
        FileWriteError: if the file cannot be written; what was there before is still there.
    """
    document = CommentedMap()
    for key, section in content.items():
        document[key] = _lines(section) if isinstance(section, Mapping) else section
    yaml = YAML()
    yaml.width = 1 << 20
    text = StringIO()
    yaml.dump(document, text)
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        try:
            draft.write_text(text.getvalue(), encoding="utf-8")
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)
    except (OSError, ValueError) as error:
        raise FileWriteError(path, str(error)) from error


def _lines(section: Mapping[str, object]) -> CommentedMap:
    lines = CommentedMap()
    for key, entry in section.items():
        if isinstance(entry, Mapping):
            lines[key] = CommentedMap(entry)
            lines[key].fa.set_flow_style()
        else:
            lines[key] = entry
    return lines


def _text(path: Path) -> str:
    """The file's text."""
    expected = f"a YAML file in UTF-8 of at most {MAX_BYTES // 1_000_000} MB"

    def refuse(value: str, line: int = 1, column: int = 1) -> FileFaultsError:
        fault = Fault(file=path, line=line, column=column, key="(the file)", value=value, expected=expected)
        return FileFaultsError([fault])

    try:
        if path.is_dir():
            raise refuse("a folder")
        if not path.exists():
            raise refuse("no such file")
        if not path.is_file():  # a device or a pipe may never end
            raise refuse("something that is not a file")
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise refuse(f"an unreadable file ({getattr(error, 'strerror', None) or error})") from error
    if len(raw) > MAX_BYTES:
        raise refuse("a larger file")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise refuse("bytes that are not UTF-8 text", *_place(raw[: error.start].decode("utf-8", "replace"))) from error
    control = CONTROL.search(text)
    if control:
        raise refuse(f"the character {control[0]!r}", *_place(text[: control.start()]))
    return text


def _place(before: str) -> Place:
    """The line and column just after the text."""
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1


class _Builder:
    """Values from YAML events, with places and faults; one use for one file."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.events = _events(text)
        self.places: dict[KeyPath, Place] = {}
        self.faults: list[Fault] = []

    def document(self) -> Value:
        """The value of the only document; ``None`` for an empty file."""
        content: Value = None
        documents = 0
        while (event := self.next()) is not None:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.stop(_start(event), "a second document", "one document in a file, so no further line '---'")
            elif isinstance(event, ScalarEvent | SequenceStartEvent | MappingStartEvent | AliasEvent):
                self.places[()] = _start(event)
                content = self.value(event, ())
        return content

    def next(self) -> Event | None:
        """The next event, ``None`` at the end of the text."""
        found = next(self.events)
        if isinstance(found, _SyntaxFault):
            self.stop(found.place, found.value, f"YAML ({found.problem})")
        return found if isinstance(found, Event) else None

    def must(self) -> Event:
        """The next event inside a list or mapping: the parser closes what it opens."""
        event = self.next()
        assert event is not None
        return event

    def stop(self, place: Place, value: str, expected: str) -> None:
        """End reading with a fault after which nothing more can be told."""
        self.report((), place, value, expected)
        raise FileFaultsError(sorted(self.faults))

    def report(self, key: KeyPath, place: Place, value: str, expected: str) -> None:
        """Keep a fault and go on."""
        line, column = place
        fault = Fault(file=self.path, line=line, column=column, key=key_text(key), value=value, expected=expected)
        self.faults.append(fault)

    def value(self, event: Event, key: KeyPath) -> Value:
        """The value that begins with the event; its place is noted by the caller, who knows which counts."""
        place = _start(event)
        if isinstance(event, AliasEvent):
            name = value_text(event.anchor)
            self.report(key, place, f"the alias {name}", "the value itself: anchors and aliases are not read here")
            return None
        assert isinstance(event, ScalarEvent | SequenceStartEvent | MappingStartEvent)
        if event.anchor is not None:
            name = value_text(event.anchor)
            self.report(key, place, f"the anchor {name}", "no anchor: anchors and aliases are not read here")
        if event.tag is not None:
            tag = value_text(str(event.tag))
            self.report(key, place, f"the tag {tag}", "a value without a tag: files cannot name objects to make")
        if isinstance(event, ScalarEvent):
            return self.scalar(event, key)
        if len(key) >= MAX_DEPTH:
            self.stop(place, f"values nested more than {MAX_DEPTH} deep", f"at most {MAX_DEPTH} levels")
        return self.mapping(key) if isinstance(event, MappingStartEvent) else self.sequence(key)

    def scalar(self, event: ScalarEvent, key: KeyPath) -> Value:
        """The scalar by the core schema."""
        text: str = event.value
        if _unpaired(text):
            self.report(key, _start(event), value_text(text), "characters that exist in Unicode")
            return None
        if event.style is not None:  # quoted or a block: text
            return text
        if text in NULLS:
            return None
        if text in BOOLS:
            return BOOLS[text]
        if INT.fullmatch(text):
            return int(text)
        if FLOAT.fullmatch(text):
            return float(text)
        if NOT_FINITE.fullmatch(text):
            return float(text.replace(".", ""))
        return text

    def sequence(self, key: KeyPath) -> Value:
        """The items up to the end of the list."""
        items: list[Value] = []
        places: dict[KeyPath, Place] = {}
        while not isinstance(event := self.must(), SequenceEndEvent):
            item = (*key, len(items))
            places[item] = _start(event)
            items.append(self.value(event, item))
        if not all(map(_is_finite, items)):
            self.places.update(places)
        return tuple(items)

    def mapping(self, key: KeyPath) -> Value:
        """The entries up to the end of the mapping; of a key that stands twice, the first."""
        entries: dict[str, Value] = {}
        while not isinstance(event := self.must(), MappingEndEvent):
            place = _start(event)
            self.value(event, (*key, "?"))  # reports anchors and tags on a key, and passes one that is not a scalar
            name = str(event.value) if isinstance(event, ScalarEvent) and not _unpaired(event.value) else "?"
            if not isinstance(event, ScalarEvent):
                self.report(key, place, "a key that is not plain text", "a name as the key")
            entry: KeyPath = (*key, name)
            if name in entries:
                first = self.places[entry][0]
                self.report(entry, place, "the key twice", f"a key once; it already stands on line {first}")
                entry = (*key, f"{name} (again)")
            value = self.value(self.must(), entry)
            if name not in entries:
                self.places[entry] = place
                entries[name] = value
        return entries


@dataclass(frozen=True, slots=True)
class _SyntaxFault:
    place: Place
    value: str
    problem: str


def _events(text: str) -> Iterator[Event | _SyntaxFault | None]:
    """The events of ruamel, then ``None``; its exceptions, whatever their kind, become a last value."""
    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except Exception as error:  # noqa: BLE001  # on odd input it raises AssertionError, OverflowError and others
        yield _syntax_fault(error, text)
    yield None


def _syntax_fault(error: Any, text: str) -> _SyntaxFault:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    line, column = (mark.line, mark.column) if mark is not None else (0, 0)
    lines = text.split("\n")
    shown = value_text(lines[line].strip()) if line < len(lines) and lines[line].strip() else "the end of the file"
    problem = getattr(error, "problem", None) or "the text cannot be parsed"
    return _SyntaxFault((line + 1, column + 1), shown, value_text(str(problem)).strip("'\""))


def _is_finite(value: Value) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and -math.inf < value < math.inf


def _unpaired(text: str) -> bool:
    """Whether half of a surrogate pair stands in the text, written as an escape: no file can hold such text."""
    return any("\ud800" <= character <= "\udfff" for character in text)


def _start(event: Event) -> Place:
    return event.start_mark.line + 1, event.start_mark.column + 1
