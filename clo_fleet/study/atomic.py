"""Files that are there as a whole or not at all, also after a crash or a power failure."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["PARTIAL", "sync_folder", "write_whole", "written_whole"]

PARTIAL = ".partial-"  # begins the names of files that are being written; who is killed leaves one behind


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A name in the same folder to write to; the file takes its place when it is closed and on the disk."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=PARTIAL, suffix="".join(path.suffixes[-2:]))
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    sync_folder(path.parent)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file, or leave what was there."""
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
