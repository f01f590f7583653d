"""What can go wrong with the corridors."""

from pathlib import Path

from clo_fleet.errors import CloFleetError

__all__ = ["CorridorsFailedError", "CorridorsMisuseError", "CorridorsOpenError", "NetworkRefusedError"]


class NetworkRefusedError(CloFleetError):
    """SUMO cannot simulate the map's network, or it is not the map's.

    Attributes:
        path: the network file, ``None`` if the map names none.
        reason: what is wrong with it.
    """

    def __init__(self, path: Path | None, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = path, reason

    def __str__(self) -> str:
        return f"corridor network {self.path}: {self.reason}; build it anew with clo-fleet build-network MAP"


class CorridorsOpenError(CloFleetError):
    """The process simulates corridors already, and SUMO can do so only once at a time."""


class CorridorsMisuseError(CloFleetError):
    """A call that does not fit where a robot is, or whether the corridors are open; nothing has changed."""


class CorridorsFailedError(CloFleetError):
    """SUMO failed to do something that it should do.

    Attributes:
        task: what it was to do.
        reason: its own message.
    """

    def __init__(self, task: str, reason: str) -> None:
        super().__init__(task, reason)
        self.task, self.reason = task, reason

    def __str__(self) -> str:
        return f"SUMO could not {self.task}: {self.reason}"
