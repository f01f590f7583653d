"""When a run ends, and how: on the truth, all goals at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.fleet.waits import Waits
from clo_fleet.world.model import Radio

__all__ = ["Judge", "Verdict", "patience"]

PATIENCE = 30.0  # [s] for which nobody has had anything to do before the run ends
REPEATS = 12  # so much longer where messages are lost: the chance that all of these are lost too is small
CIRCLE_AFTER = 30.0  # [s] for which the same robots have waited for one another before the run ends
GRIDLOCK_AFTER = 180.0  # [s] for which no action has ended and nobody has moved before the run ends
WORKING = (Mode.ACTING, Mode.ACTING_AND_PLANNING, Mode.PLANNING)

Verdict = tuple[Outcome, str]
GIVEN_UP = {outcome.value: outcome for outcome in Outcome}


def patience(radio: Radio) -> float:
    """How long nobody must have had anything to do before a run ends [s]."""
    return PATIENCE + (REPEATS * radio.repeat if 0.0 < radio.loss < 1.0 else 0.0)


@dataclass(slots=True)
class Judge:
    """Looks on, tick by tick. ``lively_at``: when something last happened; ``idle_since``: when nobody had work."""

    goals: frozenset[Fact]
    lively_at: float = 0.0
    idle_since: float | None = None
    patience: float = PATIENCE

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {"lively_at": self.lively_at, "idle_since": self.idle_since}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.lively_at, self.idle_since = state["lively_at"], state["idle_since"]

    def verdict(
        self,
        time: float,
        until: float,
        facts: frozenset[Fact],
        executives: Mapping[str, Executive],
        standing: Mapping[str, str],
        waits: Waits | None = None,
    ) -> Verdict | None:
        """How the run has ended, and why in words; ``None`` while it goes on.

        Args:
            time: now [s].
            until: the longest that the run may last [s].
            facts: the truth.
            executives: by robot.
            standing: what each robot stands for, empty if it does not.
            waits: who waits for whom.
        """
        satisfied = all(executive.mode is Mode.SATISFIED for executive in executives.values())
        if satisfied and executives and self.goals <= facts:
            return Outcome.GOALS_REACHED, "all goals hold"
        if time >= until - 1e-9:
            return Outcome.OUT_OF_TIME, f"{until:g} s are over"
        if waits is not None and waits.circle and time - waits.circle_since > CIRCLE_AFTER:
            return Outcome.GRIDLOCK, waits.circle_text()
        if any(executive.mode in WORKING for executive in executives.values()):
            self.idle_since = None
            if time - self.lively_at > GRIDLOCK_AFTER:
                stand = [f"{robot} waits for {why}" for robot, why in sorted(standing.items()) if why]
                return Outcome.GRIDLOCK, ", ".join(stand) or "nobody gets on"
        elif self.idle_since is None:
            self.idle_since = time
        elif time - self.idle_since > self.patience:
            return _standstill(executives)
        return None


def _standstill(executives: Mapping[str, Executive]) -> Verdict:
    """Why nobody has anything left to do, though not all goals hold."""
    for robot, executive in executives.items():
        if executive.outcome:
            return GIVEN_UP.get(executive.outcome, Outcome.PLANNER_FAILED), f"{robot}: {executive.outcome}"
    waiting = [robot for robot, executive in executives.items() if executive.mode is not Mode.SATISFIED]
    if waiting:
        return Outcome.NO_PLAN, f"no plan exists for {', '.join(waiting)}, as things are believed"
    return Outcome.MISTAKEN, "every robot believes that its goals hold, but not all do"
