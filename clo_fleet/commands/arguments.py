"""Types of arguments that several subcommands take. argparse shows their names in its errors."""

__all__ = ["count", "counts", "seconds"]


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


count.__name__, seconds.__name__ = "count from 0", "number of seconds above 0"
counts.__name__ = "list of counts such as 1,5"
