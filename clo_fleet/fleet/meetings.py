"""Where a robot that is to hand something to another can meet it, as far as it has heard."""

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.announcements import meeting_places
from clo_fleet.fleet.hearsay import Hearsay
from clo_fleet.fleet.questions import Questions
from clo_fleet.robot.robot import Robot
from clo_fleet.sim.site import Site
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, PlaceId, RobotId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Meetings"]


class Meetings:
    """Who is to bring what to whom, and where that can be."""

    def __init__(self, site: Site, words: Vocabulary, questions: Questions, hearsay: Hearsay) -> None:
        self._site = site
        self._words = words
        self._questions = questions
        self._hearsay = hearsay

    def gifts(self, robot: Robot) -> dict[RobotId, list[ObjectId]]:
        """What the robot is to bring into the hands of others, by the other."""
        gifts: dict[RobotId, list[ObjectId]] = {}
        for goal in robot.spec.goals:
            taker, item = self._words.read(goal, SensorKind.HOLDING) or (robot.id, "")
            if taker != robot.id:
                gifts.setdefault(RobotId(taker), []).append(ObjectId(item))
        return gifts

    def changes(self, robot: Robot) -> tuple[Flip, ...]:
        """How the places to meet others, as announced, differ from what a giver believes."""
        words = self._words
        now: set[Fact] = {
            fact
            for other, gifts in self.gifts(robot).items()
            if (announced := self._hearsay.known(robot.id, other)) is not None
            for meeting in meeting_places(announced, gifts, words)
            if self._site.premises.is_room(PlaceId(meeting.place))
            and meeting.until >= self._questions.earliest(robot.id, robot.executive.beliefs, gifts, meeting.place)
            for fact in words.facts(SensorKind.MEETS, other, meeting.place)
        }
        believed = {fact: about for fact in robot.executive.beliefs if (about := words.read(fact, SensorKind.MEETS))}
        here = self._site.place(robot.id)
        now |= {fact for fact, (other, at) in believed.items() if at == here == self._site.place(RobotId(other))}
        return tuple(Flip(fact, fact in now) for fact in sorted(now ^ believed.keys()))
