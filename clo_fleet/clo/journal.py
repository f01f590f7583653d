"""A journal of small changes, and marks in it to go back to."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from clo_fleet.errors import CloFleetError

__all__ = ["Entry", "Journal", "Mark", "MarkError"]

Entry = tuple[int, int, int]  # the kind of a change, where, and what it takes to take it back


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """A moment to go back to.

    Attributes:
        length: the entries of the journal at that time.
        kept: lists as they were at that time, for the owner of the journal.
    """

    length: int
    kept: tuple[tuple[int, ...], ...] = ()


class MarkError(CloFleetError):
    """A mark was used that is not set: it, or one set before it, was used already.

    Attributes:
        mark: the mark.
    """

    def __init__(self, mark: Mark) -> None:
        super().__init__(f"the mark at entry {mark.length} of the journal is not set any more")
        self.mark = mark


class Journal:
    """What was changed since the oldest mark; nothing is noted while there is none.

    >>> journal = Journal()
    >>> journal.note(0, 1, 2)
    >>> mark = journal.mark()
    >>> journal.note(3, 4, 5), journal.note(6, 7, 8)
    (None, None)
    >>> list(journal.since(mark))
    [(6, 7, 8), (3, 4, 5)]
    """

    __slots__ = ("_entries", "_marks")

    def __init__(self) -> None:
        self._entries: list[Entry] = []
        self._marks: list[Mark] = []

    def note(self, kind: int, where: int, what: int) -> None:
        """Note a change, if there is a mark."""
        if self._marks:
            self._entries.append((kind, where, what))

    def mark(self, *kept: Iterable[int]) -> Mark:
        """A new mark, with copies of these lists."""
        mark = Mark(len(self._entries), tuple(map(tuple, kept)))
        self._marks.append(mark)
        return mark

    def since(self, mark: Mark) -> Iterator[Entry]:
        """The changes since the mark, the last first. The mark and the changes are forgotten at once.

        Raises:
            MarkError: if the mark is not set any more.
        """
        self._drop(mark)
        entries = self._entries[mark.length :]
        del self._entries[mark.length :]
        return reversed(entries)

    def keep(self, mark: Mark) -> None:
        """Forget the mark; the changes since then stay.

        Raises:
            MarkError: if the mark is not set any more.
        """
        self._drop(mark)
        if not self._marks:
            self._entries.clear()

    def _drop(self, mark: Mark) -> None:
        if mark not in self._marks:
            raise MarkError(mark)
        del self._marks[self._marks.index(mark) :]
