"""Standard error, also of foreign code that writes to it past Python."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

__all__ = ["stderr_into"]


@contextmanager
def stderr_into(file: IO[bytes]) -> Iterator[None]:
    """Catch what is written to standard error: SUMO's exceptions do not say what its messages there say."""
    kept = os.dup(2)
    try:
        os.dup2(file.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
