"""Types of arguments that several subcommands take. argparse shows their names in its errors."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clo_fleet.study.batch.shard import Shard

__all__ = ["count", "counts", "seconds", "shard"]


def count(text: str) -> int:
    """A whole number from 0 (else ``ValueError``)."""
    number = int(text)
    if number < 0:
        raise ValueError(text)
    return number


def seconds(text: str) -> float:
    """A time above 0 [s] (else ``ValueError``)."""
    value = float(text)
    if not 0 < value < 1e7:
        raise ValueError(text)
    return value


def counts(text: str) -> tuple[int, ...]:
    """Whole numbers from 1, separated by commas (else ``ValueError``)."""
    numbers = tuple(map(count, text.split(",")))
    if not all(numbers):
        raise ValueError(text)
    return numbers


def shard(text: str) -> "Shard":
    """A part such as ``2/8``, from ``1/8`` to ``8/8`` (else ``ValueError``)."""
    from clo_fleet.study.batch.shard import Shard

    number, _, of = text.partition("/")
    found = Shard(int(number), int(of))
    if not 1 <= found.number <= found.of:
        raise ValueError(text)
    return found


count.__name__, seconds.__name__ = "count from 0", "number of seconds above 0"
counts.__name__, shard.__name__ = "list of counts such as 1,5", "part such as 1/8"
