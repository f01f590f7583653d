"""What a mission is saved as: plain data, and beside it SUMO's half of the traffic in a file of its own."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clo_fleet.world.model import RobotId

__all__ = ["Saved"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Saved:
    """A mission between two ticks.

    Attributes:
        state: all that it remembers, as it reads back from JSON.
        traffic: SUMO's half of the state; ``None`` if the building has no corridors.
        wall: real time that planning and deciding have taken each robot [s].
    """

    state: Mapping[str, Any]
    traffic: Path | None
    wall: Mapping[str, Mapping[RobotId, float]]
