"""What a skill is: a small state machine that carries out one action through wheels and hands.

A skill is stepped once a tick and says how far it is. What it needs of the world it finds in its ``Body``: the
site, its own robot, the clock, and the exchange through which objects are offered to other robots. A skill's
state is plain data: it can be saved between any two ticks.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.task import Action, Condition
from clo_fleet.robot.rest import Arrival, Rest
from clo_fleet.robot.wait import Wait
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, PlaceId, RobotId, RobotSpec, SkillSettings

__all__ = [
    "Body",
    "Cancelled",
    "Done",
    "Exchange",
    "Failed",
    "OfferStatus",
    "Progress",
    "Skill",
    "Under",
    "lacks",
    "looks",
    "standing",
]


@dataclass(frozen=True, slots=True)
class Under:
    """Still at it; wants to move at ``velocity`` [m/s]. ``standing_for``, ``wait``: why it stands, if it does.

    ``rerouted``: why it goes another way from now on, if it does.
    """

    velocity: tuple[float, float] = (0.0, 0.0)
    standing_for: str = ""
    direct: bool = False  # the way is reserved: drive exactly so, without avoidance
    wait: Wait | None = None
    rerouted: str = ""
    rest: Rest | Arrival | None = None  # there is nothing to do before that is over


def standing(
    wait: Wait,
    velocity: tuple[float, float] = (0.0, 0.0),
    *,
    direct: bool = False,
    rest: Rest | None = None,
) -> Under:
    """Still at it, but standing, and why."""
    return Under(velocity, wait.text, direct, wait, rest=rest)


@dataclass(frozen=True, slots=True)
class Done:
    """The action ended as its model says."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The action ended otherwise: the reason, and what was learnt."""

    reason: str
    learnt: tuple[Flip, ...] = ()


@dataclass(frozen=True, slots=True)
class Cancelled:
    """The action was stopped as asked, before its effects."""


Progress = Under | Done | Failed | Cancelled


class OfferStatus(Enum):
    """How an offer stands."""

    OPEN = "open"
    ACCEPTED = "accepted"
    REFUSED = "refused"


class Exchange(Protocol):
    """Where objects are offered to other robots."""

    def offer(self, giver: RobotId, taker: RobotId, item: ObjectId, place: PlaceId) -> int:
        """Make an offer; returns its id."""

    def status(self, offer: int) -> OfferStatus:
        """How the offer stands."""

    def close(self, offer: int, *, kept: bool) -> None:
        """The handover took place, or is called off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """What a skill works with.

    Attributes:
        cause: the action that it carries out, as the log knows it.
        action: the action itself.
        takes: how long it takes once the robot is there [s].
    """

    spec: RobotSpec
    site: Site
    truth: Truth
    exchange: Exchange
    settings: SkillSettings
    time: float
    cause: Cause
    action: Action
    takes: float = 0.0

    @property
    def id(self) -> RobotId:
        """The robot's id."""
        return self.spec.id


def lacks(need: Condition) -> str:
    """Why a skill failed that was carried out in vain: what its action needs was not so."""
    return f"not {need.fact[0]}" if need.positive else f"{need.fact[0]} already"


def looks(body: Body, item: ObjectId) -> tuple[Flip, ...]:
    """Whether the robot has the object in hand, as it finds at this moment."""
    return tuple(map(body.truth.look, body.truth.words.facts(SensorKind.HOLDING, body.id, item)))


class Skill(Protocol):
    """One action being carried out."""

    def step(self, body: Body) -> Progress:
        """Go on for one tick."""

    def cancel(self) -> None:
        """Stop where that is safe; the next step then returns ``Cancelled``, or else the skill goes on."""

    def release(self, body: Body) -> None:
        """Give back what it holds of shared things (doors, offers), after any end but ``Done``."""

    def state(self) -> dict[str, Any]:
        """Plain data."""
