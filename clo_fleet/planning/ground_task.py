"""A planning problem in ground form: what the repair, its search and its studies work on. Plain values."""

from dataclasses import dataclass

from clo_fleet.clo.task import Action, Condition, Fact

__all__ = ["GroundTask"]


@dataclass(frozen=True, slots=True)
class GroundTask:
    """A problem without variables.

    Facts that no action can change are left out: they decided which actions there are.

    Attributes:
        name: the problem's name.
        state: the facts that are true at the start; all others are false.
        goals: what must hold in the end.
        actions: those that can ever become applicable, as far as delete relaxation tells, in sorted order; no two of
            them have both schema and arguments in common.
    """

    name: str
    state: frozenset[Fact]
    goals: tuple[Condition, ...]
    actions: tuple[Action, ...]
