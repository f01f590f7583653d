"""Batch files: which runs there are to be, as people write it in YAML.

```yaml
format: clo-fleet/batch/1
worlds: [../worlds/office.yaml, ../worlds/hello.yaml]   # relative to this file
strategies: [clo, replan]
seeds: 20                                                # 0 to 19; or a list of seeds
sweep:                                                   # each key with its values; all combinations are run
  radio.loss: [0, 0.2, 0.5]
  fleet_size: [2, 4]                                     # the first robots of the world
until_s: 600                                             # in place of the worlds' own
limits: {wall_s: 600, memory_mb: 4096}                   # of each run, its planners included
```

Only ``format`` and ``worlds`` are required. The keys of ``sweep`` are those of world files.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.study.batch.definition import Definition, world_digest
from clo_fleet.world.faults import Fault, FileFaultsError, Finding, KeyPath, did_you_mean
from clo_fleet.world.sections import Parsed, Positive, Section, Text, json_schema, parse
from clo_fleet.world.world_file import read_world
from clo_fleet.world.yaml_file import Value, read_yaml

__all__ = ["BATCH_FORMAT", "Batch", "Limits", "batch_schema", "read_batch"]

BATCH_FORMAT = "clo-fleet/batch/1"
MAX_RUNS = 100_000
MEGABYTE = 1 << 20


@dataclass(frozen=True, slots=True)
class Limits:
    """What each run may take: real time [s], and memory of each of its processes [bytes]."""

    wall: float = 600.0
    memory: int = 4 << 30


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """The runs of a batch, in their order, each once, with the keys that are swept."""

    runs: tuple[Definition, ...]
    swept: tuple[str, ...]
    limits: Limits


def _seeds(value: Any) -> int | tuple[int, ...]:
    values = value if isinstance(value, tuple) else (value,)
    least = 0 if isinstance(value, tuple) else 1
    if not values or not all(type(number) is int and least <= number < 1 << 63 for number in values):
        raise PydanticCustomError("seeds", "how many seeds, from 1, or a list of seeds")
    return value if isinstance(value, tuple) else int(value)


class LimitsSection(Section):
    """What each run may take, its planners included."""

    wall_s: Positive = Limits().wall
    memory_mb: Positive = Limits().memory / MEGABYTE


class BatchSection(Section):
    """A batch file."""

    format: Literal["clo-fleet/batch/1"]
    worlds: tuple[Text, ...] = Field(min_length=1, max_length=1000, description="World files, relative to this file.")
    strategies: tuple[Text, ...] = Field(("clo",), min_length=1, max_length=100)
    seeds: Annotated[Any, AfterValidator(_seeds)] = Field(1, description="How many, from seed 0; or a list of seeds.")
    sweep: dict[Text, Annotated[tuple[Any, ...], Field(min_length=1)]] = Field(
        {}, max_length=20, description="Keys of world files, such as radio.loss, or fleet_size; each with its values."
    )
    until_s: Positive | None = None
    limits: LimitsSection = LimitsSection()


def batch_schema() -> dict[str, object]:
    """The JSON schema of batch files, for editors."""
    return json_schema(BatchSection, "A clo-fleet batch")


def read_batch(path: Path) -> Batch:
    """The batch that the file describes. Every world has been read with every combination of what is swept.

    Raises:
        FileFaultsError: with everything that is wrong with the file, then with its worlds.
    """
    parsed = parse(read_yaml(path), BatchSection, {"format": BATCH_FORMAT, "worlds": ("-",)})
    sections = parsed.sections
    findings = list(_findings(parsed, path))
    if findings or parsed.faults:
        raise FileFaultsError(parsed.located(findings))
    seeds = sections.seeds if isinstance(sections.seeds, tuple) else tuple(range(sections.seeds))
    until: dict[str, Value] = {} if sections.until_s is None else {"until_s": sections.until_s}
    faults: list[Fault] = []
    runs: dict[str, Definition] = {}
    named: dict[str, Path] = {}
    for index, world in enumerate((path.parent / name).resolve() for name in sections.worlds):
        for values in product(*sections.sweep.values()):
            swept = dict(zip(sections.sweep, values, strict=True))
            try:
                read = read_world(world, until | swept)
            except FileFaultsError as error:
                faults += [*_swept_faults(parsed, swept), *error.faults]
                continue
            if named.setdefault(read.name, world) != world:
                expected = f"a world with another name than {read.name!r}, which {named[read.name].name} has"
                faults.append(parsed.file.fault(Finding(("worlds", index), expected)))
                break
            digest = world_digest(read)
            for strategy, seed in product(sections.strategies, seeds):
                run = Definition.of(world, digest, strategy, seed, until | swept)
                runs.setdefault(run.id, run)
    if faults:
        raise FileFaultsError(faults)
    limits = Limits(float(sections.limits.wall_s), int(sections.limits.memory_mb * MEGABYTE))
    return Batch(runs=tuple(runs.values()), swept=tuple(sections.sweep), limits=limits)


def _findings(parsed: Parsed[BatchSection], path: Path) -> Iterator[Finding]:
    sections = parsed.sections
    for index, name in enumerate(sections.worlds if ("worlds",) not in parsed.unsound else ()):
        outside = PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor or "\\" in name
        if outside or not (path.parent / name).is_file():
            expected = "a world file that exists, named relative to this file, with '/' between folders"
            yield Finding(("worlds", index), expected)
    for index, name in enumerate(sections.strategies):
        if name not in STRATEGIES:
            yield Finding(("strategies", index), f"one of {', '.join(STRATEGIES)}{did_you_mean(name, STRATEGIES)}")
    number = len(sections.worlds) * len(sections.strategies)
    number *= len(sections.seeds) if isinstance(sections.seeds, tuple) else sections.seeds
    for values in sections.sweep.values():
        number *= len(values)
    if number > MAX_RUNS:
        yield Finding((), f"at most {MAX_RUNS:,} runs", f"{number:,} runs")


def _swept_faults(parsed: Parsed[BatchSection], swept: Mapping[str, Value]) -> tuple[Fault, ...]:
    """Where the values stand with which a world is faulty; its own faults follow."""
    keys: list[KeyPath] = [("sweep", key, parsed.sections.sweep[key].index(value)) for key, value in swept.items()]
    return tuple(parsed.file.fault(Finding(key, "a value with which the world is sound (see below)")) for key in keys)
