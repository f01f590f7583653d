"""What a witness raises."""

from clo_fleet.errors import CloFleetError

__all__ = ["BrokenInvariantError"]


class BrokenInvariantError(CloFleetError):
    """Something is not as it must be at any time, in any world: a fault of clo-fleet, not of the world.

    Attributes:
        what: what is not as it must be.
        who: the robots and objects concerned.
        time: when it was seen [s].
    """

    def __init__(self, what: str, who: tuple[str, ...], time: float) -> None:
        super().__init__(what, who, time)
        self.what, self.who, self.time = what, who, time

    def __str__(self) -> str:
        return f"at {self.time:.1f} s{': ' + ', '.join(self.who) if self.who else ''}: {self.what}"
