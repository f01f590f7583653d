"""What a run depends on, as hashes: who goes on with a run learns which part of it is not the same any more.

A hash follows the values, not the files: a comment in a world file changes nothing. Where a value is a path, what
counts is the content of the file.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from pathlib import Path

from clo_fleet import __version__
from clo_fleet.world.model import World

__all__ = ["fingerprint"]


def fingerprint(world: World) -> dict[str, str]:
    """The version of clo-fleet, and hashes of the world without its map, of the map, and of its corridor network."""
    building = world.map
    return {
        "version": __version__,
        "world": _hash([_plain(getattr(world, field.name)) for field in fields(world) if field.name != "map"]),
        "map": _hash(_plain(replace(building, network=None))),
        "network": _hash(_plain(building.network)),
    }


def _hash(plain: object) -> str:
    return hashlib.sha256(json.dumps(plain).encode()).hexdigest()


def _plain(value: object) -> object:
    """The value as JSON; equal values give the same, in any process."""
    if is_dataclass(value):
        return [type(value).__name__, *(_plain(getattr(value, field.name)) for field in fields(value))]
    if isinstance(value, Mapping):
        return sorted(([_plain(key), _plain(item)] for key, item in value.items()), key=json.dumps)
    if isinstance(value, set | frozenset):
        return sorted(map(_plain, value), key=json.dumps)
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Enum):
        return [type(value).__name__, value.name]
    if isinstance(value, Path):
        return hashlib.sha256(value.read_bytes()).hexdigest()
    return value
