"""Values of a world file changed before it is read: for whoever runs one world in many ways.

A change names a key as the file nests it, ``radio.loss`` or ``disturbances.0.at_s``; a key that the file leaves out
is put in. ``fleet_size`` stands for no key of the file: it keeps that many robots, the first ones.
"""

from collections.abc import Mapping
from dataclasses import replace

from clo_fleet.world.faults import FileFaultsError, Finding
from clo_fleet.world.yaml_file import Value, YamlFile

__all__ = ["FLEET_SIZE", "changed"]

FLEET_SIZE = "fleet_size"


def changed(file: YamlFile, changes: Mapping[str, Value]) -> YamlFile:
    """The file as if it said what the changes say.

    Raises:
        FileFaultsError: if a change leads through a value that has no keys, or the fleet is not that large.
    """
    content = file.content
    for key, value in changes.items():
        if key == FLEET_SIZE:
            content = {**content, "robots": _first(file, content.get("robots"), value)}
        else:
            content = _entries(_with(file, content, key.split("."), value, key))
    return replace(file, content=content)


def _first(file: YamlFile, robots: Value, size: Value) -> Value:
    number = len(robots) if isinstance(robots, dict) else 0
    if not isinstance(robots, dict) or not isinstance(size, int) or isinstance(size, bool) or not 0 < size <= number:
        expected = f"a fleet_size from 1 to the file's {number} robots"
        raise FileFaultsError([file.fault(Finding(("robots",), expected, str(size)))])
    return dict(list(robots.items())[:size])


def _with(file: YamlFile, value: Value, path: list[str], new: Value, key: str) -> Value:
    """The value with ``new`` at the end of the path."""
    if not path:
        return new
    first, *rest = path
    if isinstance(value, tuple) and first.isdigit() and int(first) < len(value):
        index = int(first)
        return (*value[:index], _with(file, value[index], rest, new, key), *value[index + 1 :])
    if value is None or isinstance(value, dict):
        entries = _entries(value or {})
        return {**entries, first: _with(file, entries.get(first), rest, new, key)}
    expected = f"keys below it, for the change of {key}"
    raise FileFaultsError([file.fault(Finding(tuple(key.split(".")[: -len(path)]), expected))])


def _entries(value: Value) -> dict[str, Value]:
    assert isinstance(value, dict)
    return value
