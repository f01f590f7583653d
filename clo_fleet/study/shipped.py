"""The maps and worlds that come with the package: in a wheel inside it, in a checkout beside it."""

import shutil
from importlib.resources import files
from pathlib import Path

from clo_fleet.errors import CloFleetError

__all__ = ["FolderInUseError", "copy_out", "shipped"]

FOLDERS = ("maps", "worlds")


class FolderInUseError(CloFleetError):
    """Files that would be copied out exist already; nothing was copied.

    Attributes:
        paths: the files in the way.
    """

    def __init__(self, paths: tuple[Path, ...]) -> None:
        super().__init__("nothing copied, these exist already: " + ", ".join(map(str, paths)))
        self.paths = paths


def shipped(folder: str) -> Path:
    """The folder ``maps`` or ``worlds`` that came with the package."""
    package = Path(str(files("clo_fleet")))
    inside = package / "shipped" / folder
    return inside if inside.is_dir() else package.parent / folder


def copy_out(target: Path) -> tuple[Path, ...]:
    """Copy maps and worlds into ``target``; returns the new files.

    Raises:
        FolderInUseError: if one of the files exists already.
    """
    pairs = [
        (source, target / folder / source.name)
        for folder in FOLDERS
        for source in sorted(shipped(folder).iterdir())
        if source.name.endswith((".yaml", ".pddl", ".net.xml.gz"))
    ]
    if in_the_way := tuple(copy for _, copy in pairs if copy.exists()):
        raise FolderInUseError(in_the_way)
    for source, copy in pairs:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, copy)
    return tuple(copy for _, copy in pairs)
