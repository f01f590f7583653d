"""What defines a run of a batch, and the id that follows from it.

Two runs with one id would write the same log: the id is a hash of the world as it is read, with its network and all
changes, of strategy and seed, and of the version of this package. A comment in a world file changes no id.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self

from clo_fleet import __version__
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world
from clo_fleet.world.yaml_file import Value

__all__ = ["Definition", "world_digest"]

ID_LENGTH = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """One run.

    Attributes:
        id: 16 hexadecimal digits.
        world: the world's file.
        strategy: its name.
        seed: of the run.
        changes: what is read in place of the file's values (`clo_fleet.world.changes`).
    """

    id: str
    world: Path
    strategy: str
    seed: int
    changes: Mapping[str, Value]

    @classmethod
    def of(cls, world: Path, digest: str, strategy: str, seed: int, changes: Mapping[str, Value]) -> Self:
        """The run of a world whose ``world_digest`` is known."""
        text = json.dumps([__version__, digest, strategy, seed])
        return cls(
            id=hashlib.sha256(text.encode()).hexdigest()[:ID_LENGTH],
            world=world,
            strategy=strategy,
            seed=seed,
            changes=dict(changes),
        )

    def read(self) -> World:
        """The world to run.

        Raises:
            FileFaultsError: if the file has become faulty.
        """
        return replace(read_world(self.world, self.changes), seed=self.seed)

    def to_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self) | {"world": str(self.world)})

    @classmethod
    def from_json(cls, line: str) -> Self:
        """The definition that ``to_json`` wrote."""
        values: dict[str, Any] = json.loads(line)
        values["changes"] = {key: _frozen(value) for key, value in values["changes"].items()}
        return cls(**values | {"world": Path(values["world"])})


def world_digest(world: World) -> str:
    """A hash of all that a world says but its seed, the content of its network included."""
    network = world.map.network
    content = asdict(replace(world, seed=0))
    content["map"]["network"] = None if network is None else hashlib.sha256(network.read_bytes()).hexdigest()
    return hashlib.sha256(json.dumps(content, default=str, sort_keys=True).encode()).hexdigest()


def _frozen(value: Any) -> Value:
    """Lists as tuples, as YAML is read."""
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
