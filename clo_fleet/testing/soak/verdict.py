"""What became of one run of a soak."""

import json
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Self

__all__ = ["Ending", "Verdict"]


class Ending(Enum):
    """How a run ended; all but the first are faults of clo-fleet."""

    OUTCOME = "outcome"  # in a named outcome, whichever
    BROKEN = "broken"  # an invariant was not whole
    CRASHED = "crashed"  # an error, or the end of the process
    HUNG = "hung"  # no end within the limit of real time


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What became of one run.

    Attributes:
        world: the number of the world.
        outcome: the named outcome, where there is one; ``why`` in words, or what went wrong.
        time_s: simulated time at the end.
        wall_s: real time that it took.
    """

    world: int
    building: str
    robots: int
    strategy: str
    ending: Ending
    outcome: str = ""
    why: str = ""
    time_s: float = 0.0
    wall_s: float = 0.0

    @property
    def is_fault(self) -> bool:
        """Whether clo-fleet is to blame."""
        return self.ending is not Ending.OUTCOME

    def to_json(self) -> str:
        """One line of JSON."""
        return json.dumps(asdict(self) | {"ending": self.ending.value}, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The verdict that ``to_json`` wrote."""
        values = json.loads(text)
        return cls(**values | {"ending": Ending(values["ending"])})
