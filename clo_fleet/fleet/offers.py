"""The offers of objects from robot to robot that are open at present."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from clo_fleet.robot.skill import OfferStatus
from clo_fleet.world.events import OfferAnswered, OfferClosed, OfferMade, Recorder
from clo_fleet.world.model import ObjectId, PlaceId, RobotId

__all__ = ["Offer", "Offers"]


@dataclass(slots=True)
class Offer:
    """One robot offers an object to another at a place. ``told``: the taker has been asked."""

    id: int
    giver: RobotId
    taker: RobotId
    item: ObjectId
    place: PlaceId
    status: OfferStatus = OfferStatus.OPEN
    told: bool = False


class Offers:
    """The exchange that the skills use: makes, answers and closes offers, and records each."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._open: dict[int, Offer] = {}
        self._ended: list[Offer] = []
        self._next = 0
        self.time = 0.0

    def offer(self, giver: RobotId, taker: RobotId, item: ObjectId, place: PlaceId) -> int:
        """Make an offer; returns its id."""
        offer = Offer(self._next, giver, taker, item, place)
        self._open[offer.id] = offer
        self._next += 1
        self._recorder.record(self.time, OfferMade(offer.id, giver, taker, item, place))
        return offer.id

    def status(self, offer: int) -> OfferStatus:
        """How the offer stands; an offer that is no longer open counts as refused."""
        return self._open[offer].status if offer in self._open else OfferStatus.REFUSED

    def close(self, offer: int, *, kept: bool) -> None:
        """The handover took place, or is called off."""
        closed = self._open.pop(offer, None)
        if closed is not None:
            self._ended.append(closed)
            self._recorder.record(self.time, OfferClosed(offer, kept))

    def answer(self, offer: int, *, accepted: bool, why: str = "") -> None:
        """The taker's answer."""
        self._open[offer].status = OfferStatus.ACCEPTED if accepted else OfferStatus.REFUSED
        self._recorder.record(self.time, OfferAnswered(offer, accepted, why))

    def takers(self) -> list[RobotId]:
        """The robots to which there is something to say: an offer not yet told, or one that has ended; sorted."""
        untold = (offer for offer in self._open.values() if not offer.told)
        return sorted({offer.taker for offer in (*untold, *self._ended)})

    def untold(self, taker: RobotId, unheard: Collection[RobotId] = ()) -> tuple[Offer, ...]:
        """The offers to ``taker`` that it has not been asked about; from now on it has.

        ``unheard``: robots that can neither ask nor be asked at present.
        """
        fresh = tuple(
            offer
            for offer in self._open.values()
            if offer.taker == taker and not offer.told and not {taker, offer.giver} & {*unheard}
        )
        for offer in fresh:
            offer.told = True
        return fresh

    def ended(self, taker: RobotId) -> tuple[int, ...]:
        """The accepted offers to ``taker`` that have ended since it was last asked."""
        mine = [offer for offer in self._ended if offer.taker == taker]
        self._ended = [offer for offer in self._ended if offer.taker != taker]
        return tuple(offer.id for offer in mine if offer.status is OfferStatus.ACCEPTED)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "next": self._next,
            "open": [_plain(o) for o in self._open.values()],
            "ended": list(map(_plain, self._ended)),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._next = state["next"]
        self._open = {offer["id"]: _offer(offer) for offer in state["open"]}
        self._ended = [_offer(offer) for offer in state["ended"]]


def _plain(offer: Offer) -> dict[str, Any]:
    return {
        "id": offer.id,
        "giver": offer.giver,
        "taker": offer.taker,
        "item": offer.item,
        "place": offer.place,
        "status": offer.status.value,
        "told": offer.told,
    }


def _offer(plain: dict[str, Any]) -> Offer:
    return Offer(**{**plain, "status": OfferStatus(plain["status"])})
