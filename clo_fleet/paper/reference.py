"""What the paper reports: executed actions, and what it says of time. Numbers as printed; ``None`` is its dash."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["PLAN_LENGTHS", "TABLE", "Reported", "reported"]

SOURCE = "Borrajo and Veloso 2024, Table V"
PLAN_LENGTHS: Mapping[str, tuple[int, ...]] = MappingProxyType(  # Section VI: "the initial length of the plans"
    {"rooms": (14, 29, 59, 119), "dialog": (30, 60, 120, 240), "cooking": (35, 85, 185, 385)}
)


@dataclass(frozen=True, slots=True)
class Reported:
    """A cell of the paper's table, and where it stands."""

    executed: float | None
    cell: str


# Table V, row by row: size and probability, then CLO and REPLAN for ROOMS, DIALOG and COOKING.
TABLE: Mapping[tuple[int, float], tuple[float | None, ...]] = MappingProxyType(
    {
        (5, 0.1): (12, 12, 23, 23, 28, 28),
        (5, 0.2): (9, 9, 26, 26, 30, 29),
        (5, 0.5): (8, 8, 14, 14, 23, 22),
        (10, 0.1): (27, 26, 48, 48, 68, 68),
        (10, 0.2): (24, 23, 41, 39, 44, 43),
        (10, 0.5): (20, 18, 35, 33, 39, 36),
        (20, 0.1): (51, 49, 95, 93, 96, 96),
        (20, 0.2): (53, 49, 86, 82, 80, 80),
        (20, 0.5): (41, 33, 66, 61, 50, 46),
        (40, 0.1): (110, 103, 197, None, 176, 174),
        (40, 0.2): (96, 92, 167, None, 162, 162),
        (40, 0.5): (71, 69, 127, 123, 92, 88),
    }
)
_DOMAINS = ("rooms", "dialog", "cooking")
_STRATEGIES = ("clo", "replan")
# What each of our strategies is to be compared with.
_COUNTERPARTS = {"clo": "clo", "clo-improve": "clo", "clo-as-printed": "clo", "replan": "replan"}


def reported(domain: str, size: int, probability: float, strategy: str) -> Reported | None:
    """The paper's number for a strategy that it has; ``None`` for one that it has not."""
    counterpart = _COUNTERPARTS.get(strategy)
    if counterpart is None or (size, probability) not in TABLE:
        return None
    column = 2 * _DOMAINS.index(domain) + _STRATEGIES.index(counterpart)
    name = f"{SOURCE}, p-{size:02} {probability:g}, {domain.upper()} {counterpart.upper()}"
    return Reported(TABLE[size, probability][column], name)
