"""``run.json``: what a run that saves itself is a run of, for whoever goes on with it."""

import fcntl
import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from clo_fleet.errors import CloFleetError
from clo_fleet.study.atomic import write_whole
from clo_fleet.study.fingerprint import fingerprint
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world

__all__ = ["RUN_FORMAT", "ResumeError", "RunFile", "RunInUseError", "held", "read_run_file"]

RUN_FORMAT = "clo-fleet/run/1"
LARGEST = 1 << 20  # bytes


class ResumeError(CloFleetError):
    """Nobody can go on with a run.

    Attributes:
        folder: the run's folder.
        reason: why not.
    """

    def __init__(self, folder: Path, reason: str) -> None:
        super().__init__(f"{folder}: cannot go on with this run: {reason}")
        self.folder = folder
        self.reason = reason


class RunInUseError(CloFleetError):
    """Another process is at the run.

    Attributes:
        folder: the run's folder.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder}: another process is at this run")
        self.folder = folder


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFile:
    """What is run.

    Attributes:
        format: the version of this file.
        source: the world's file; ``None`` if it was made in code.
        strategy: its name.
        seed, until: as they were in the end, whatever the world's file says.
        checkpoint_every: how often the run is saved [s].
        prints: the run's fingerprint.
    """

    format: str
    source: str | None
    strategy: str
    seed: int
    until: float
    checkpoint_every: float
    prints: Mapping[str, str]

    @classmethod
    def of(cls, world: World, source: Path | None, strategy: str, checkpoint_every: float) -> "RunFile":
        """What is about to be run."""
        return cls(
            format=RUN_FORMAT,
            source=None if source is None else str(source.resolve()),
            strategy=strategy,
            seed=world.seed,
            until=world.until,
            checkpoint_every=checkpoint_every,
            prints=fingerprint(world),
        )

    def write(self, folder: Path) -> None:
        """Write it into the run's folder, whole or not at all."""
        write_whole(folder / "run.json", (json.dumps(asdict(self), indent=2) + "\n").encode())

    def world(self, folder: Path, world: World | Path | None = None) -> World:
        """The world that was run.

        Args:
            folder: the run's folder.
            world: a world made in code, or where the world's file is now.

        Raises:
            ResumeError: if it is not the same any more, or was made in code and is not given.
            FileFaultsError: if its file is not sound any more.
        """
        if world is None and self.source is None:
            raise ResumeError(folder, "its world was made in code and has to be given")
        if not isinstance(world, World):
            world = read_world(Path(self.source or "") if world is None else world)
        world = replace(world, seed=self.seed, until=self.until)
        now = fingerprint(world)
        if now["version"] != self.prints.get("version"):
            was = self.prints.get("version")
            raise ResumeError(folder, f"it was begun with clo-fleet {was}, and this is {now['version']}")
        changed = [f"its {part}" for part in now if now[part] != self.prints.get(part)]
        if changed:
            raise ResumeError(folder, f"{' and '.join(changed)} changed since it was begun")
        return world


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold ``run.json``, if there is one, so that no two processes write to one run.

    Raises:
        RunInUseError: if another process holds it.
    """
    with ExitStack() as stack:
        with suppress(FileNotFoundError):
            file = stack.enter_context((folder / "run.json").open("rb"))
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise RunInUseError(folder) from error
        yield


def read_run_file(folder: Path) -> RunFile:
    """What the run in the folder is a run of.

    Raises:
        ResumeError: if there is none that saves itself, or if it has ended.
    """
    path = folder / "run.json"
    if (folder / "result.json").exists():
        raise ResumeError(folder, "it has ended; result.json says how")
    if not path.is_file():
        raise ResumeError(folder, "there is no run.json: it was not run with --checkpoint-every")
    with path.open("rb") as file:
        text = file.read(LARGEST)
    try:
        found = TypeAdapter(RunFile).validate_json(text)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"]))
        raise ResumeError(folder, f"run.json is damaged ({where}: {fault['msg']})") from error
    if found.format != RUN_FORMAT:
        raise ResumeError(folder, f"run.json is of format {found.format}, expected {RUN_FORMAT}")
    return found
