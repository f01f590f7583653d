"""A batch in parts, for arrays of jobs that know only their number."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

__all__ = ["Shard"]

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Shard:
    """The ``number``-th of ``of`` parts of a batch, from 1: every ``of``-th run."""

    number: int = 1
    of: int = 1

    def part(self, runs: Sequence[T]) -> Sequence[T]:
        """Its share of the runs."""
        return runs[self.number - 1 :: self.of]
