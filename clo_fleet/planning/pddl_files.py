"""Reads PDDL files as problems of unified-planning: any it can be made to take.

For our own domain there is a reader of our own (``pddl``); this one is for whatever a user brings along.
"""

import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

from unified_planning.environment import Environment
from unified_planning.io import PDDLReader

from clo_fleet.errors import CloFleetError
from clo_fleet.planning.environments import as_global
from clo_fleet.planning.pddl_text import regular

__all__ = ["PddlFileError", "problem_of"]

MOST_BYTES = 8 << 20  # unified-planning reads some 30 kB a second


class PddlFileError(CloFleetError):
    """A PDDL file, or the two of a problem together, cannot be used.

    Attributes:
        path: the file.
        reason: why.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path
        self.reason = reason


def problem_of(domain: Path, problem: Path) -> Any:
    """The ``unified_planning.model.Problem`` that the two files define.

    Raises:
        PddlFileError: if a file is missing or too large, or unified-planning cannot read it.
    """
    texts = _text(domain), _text(problem)
    try:
        return _read(*texts)
    except _UnreadableError as first:
        again = [text for text in map(regular, texts) if text is not None]
        if len(again) == len(texts):
            with suppress(_UnreadableError):
                return _read(*again)
        raise PddlFileError(problem, f"unified-planning cannot read it with {domain}: {first}") from first.__cause__


class _UnreadableError(Exception):
    """unified-planning did not take a text."""


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise PddlFileError(path, error.strerror or str(error)) from error
    if len(content) > MOST_BYTES:
        raise PddlFileError(path, f"has more than the {MOST_BYTES:,} bytes that are read")
    return content.decode("utf-8-sig", errors="replace")


def _read(domain: str, problem: str) -> Any:
    environment = Environment()
    environment.credits_stream = None
    environment.error_used_name = False  # PDDL has a name space each for types, actions and predicates
    try:
        with as_global(environment), warnings.catch_warnings(action="ignore"):
            return PDDLReader(environment).parse_problem_string(domain, problem)
    except Exception as error:  # whatever a foreign reader makes of a faulty file
        what = " ".join(str(error).split()) or type(error).__name__
        raise _UnreadableError(what) from error
