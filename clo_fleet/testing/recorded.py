"""What a run has written down, for assertions of one's own."""

from typing import TypeVar

from clo_fleet.study.run import Run

__all__ = ["events_of"]

E = TypeVar("E")


def events_of(run: Run, kind: type[E], **fields: object) -> list[tuple[float, E]]:
    """The events of a kind with these fields, in order, each with its time [s]."""
    return [
        (time, event)
        for _, time, event in run.log
        if isinstance(event, kind) and all(getattr(event, name) == value for name, value in fields.items())
    ]
