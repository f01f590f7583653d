"""Offers of objects from hand to hand."""

import json

from clo_fleet.fleet.offers import Offers
from clo_fleet.robot.skill import OfferStatus
from clo_fleet.study.event_log import EventLog
from clo_fleet.world.events import OfferAnswered, OfferClosed, OfferMade
from clo_fleet.world.model import ObjectId, PlaceId, RobotId

R1, R2, CUP, L1 = RobotId("r1"), RobotId("r2"), ObjectId("cup"), PlaceId("l1")


def test_offer_is_made_told_once_answered_and_closed() -> None:
    """Each step of an offer's life is in the log; the taker of an accepted offer hears of its end."""
    log = EventLog()
    offers = Offers(log)
    number = offers.offer(R2, R1, CUP, L1)
    assert offers.status(number) is OfferStatus.OPEN
    assert [offer.id for offer in offers.untold(R1)] == [number]
    assert offers.untold(R1) == ()
    offers.answer(number, accepted=True)
    assert offers.status(number) is OfferStatus.ACCEPTED
    offers.close(number, kept=True)
    assert offers.ended(R1) == (number,)
    assert offers.ended(R1) == ()
    assert [type(event) for _, _, event in log.events] == [OfferMade, OfferAnswered, OfferClosed]


def test_offer_that_is_gone_counts_as_refused() -> None:
    """A giver that asks about an old offer starts anew; closing it twice changes nothing."""
    offers = Offers(EventLog())
    number = offers.offer(R2, R1, CUP, L1)
    offers.close(number, kept=False)
    offers.close(number, kept=False)
    assert offers.status(number) is OfferStatus.REFUSED
    assert offers.ended(R1) == ()


def test_offers_survive_being_saved() -> None:
    """Restored from plain data, they go on as they stood."""
    offers = Offers(EventLog())
    number = offers.offer(R2, R1, CUP, L1)
    offers.answer(number, accepted=True)
    other = Offers(EventLog())
    other.restore(json.loads(json.dumps(offers.state())))
    assert other.status(number) is OfferStatus.ACCEPTED
    assert other.offer(R2, R1, CUP, L1) == number + 1
