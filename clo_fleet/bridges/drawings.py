"""What importers of other people's buildings have in common: new names, and what is left out."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["Names", "Skipped", "folded", "slug"]

MOST = 5  # of a kind are told one by one


@dataclass(frozen=True, slots=True)
class Skipped:
    """Something of the building that the map does not have, or has differently.

    Attributes:
        kind: what it is, such as ``door``, ``lane``, ``lift``, ``model`` or ``room``.
        name: what it is called.
        reason: why it is left out, or what was changed.
        count: how many there are of it.
    """

    kind: str
    name: str
    reason: str
    count: int = 1

    def __str__(self) -> str:
        times = f" ({self.count} times)" if self.count > 1 else ""
        return f"{self.kind} {self.name!r}{times}: {self.reason}"


def folded(skipped: Iterable[Skipped]) -> tuple[Skipped, ...]:
    """The same, but many of one kind that are left out for one reason are one entry."""
    groups: dict[tuple[str, str], list[Skipped]] = {}
    for item in skipped:
        groups.setdefault((item.kind, item.reason), []).append(item)
    found: list[Skipped] = []
    for (kind, reason), items in groups.items():
        if len(items) <= MOST:
            found += items
        else:
            name = f"{', '.join(item.name for item in items[: MOST - 1])}, ..."
            found.append(Skipped(kind, name, reason, sum(item.count for item in items)))
    return tuple(found)


class Names:
    """Names that are given once: rooms, doors and junctions share one set."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def new(self, wish: str) -> str:
        """The wish, with a number behind it if it is taken."""
        number, name = 1, wish
        while name in self._taken:
            number += 1
            name = f"{wish}_{number}"
        self._taken.add(name)
        return name


def slug(name: str) -> str:
    """The name as an id: lower-case letters, digits, ``_`` and ``-``, a letter first; empty if nothing is left.

    >>> slug("tinyRobot1 charger"), slug("2nd floor"), slug("é")
    ('tinyrobot1_charger', 'p2nd_floor', '')
    """
    text = re.sub(r"[^a-z0-9_-]+", "_", name.lower())[:60].strip("_-")
    text = re.sub(r"^zone-(?=[0-9]+$)", "zone_", text)  # zones have such names
    return f"p{text}" if text[:1].isdigit() else text
