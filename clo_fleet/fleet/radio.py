"""The radio: what robots have seen, brought about and mean to do, told to the others.

A robot tells what it has learnt by its own senses and what its own actions changed, and announces its plans. A message
reaches a robot if that robot is in range when it is sent, and the message is not lost; it arrives after the delay, in
the order of time, sender and number. What is lost is drawn from the seed and the numbers of the messages, one for each
piece of news and each robot in range, so that the same run loses the same ones. One message is kept for all whom it may
reach; who takes it from the air knows whom it concerns.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.plain import plain_flip, read_flip
from clo_fleet.fleet.announcements import Announcement
from clo_fleet.world.chance import uniform
from clo_fleet.world.model import Point, Radio, RobotId

__all__ = ["Message", "RadioChannel"]


@dataclass(frozen=True, slots=True)
class Message:
    """A piece of news on its way.

    Attributes:
        due: when it arrives [s].
        to: who was in range when it was sent, sorted; ``None``: everybody else.
        first: the number of the message to the first of them.
    """

    due: float
    sender: RobotId
    news: Flip | Announcement
    first: int
    to: tuple[RobotId, ...] | None


class RadioChannel:
    """All messages under way. ``lost``: the robots whose radio does not work: they neither tell nor hear.

    Args:
        radio: how far and how well it carries.
        robots: all robots.
        seed: of what is lost.
    """

    def __init__(self, radio: Radio, robots: Iterable[RobotId], *, seed: int) -> None:
        self._radio = radio
        self._robots = tuple(sorted(robots))
        self._seed = seed
        self._sent = 0
        self._under_way: list[Message] = []
        self.lost: set[RobotId] = set()

    def tell(self, time: float, sender: RobotId, flips: Iterable[Flip], point: Callable[[RobotId], Point]) -> None:
        """Send each flip to each robot in range. ``point``: where a robot is [m]."""
        flips = tuple(flips)
        if not self._radio.facts or not flips or sender in self.lost:
            return
        self._send(time, sender, flips, point)

    def announce(self, time: float, announcement: Announcement, point: Callable[[RobotId], Point]) -> None:
        """Send what a robot means to do to each robot in range."""
        if announcement.robot not in self.lost:
            self._send(time, announcement.robot, (announcement,), point)

    def due(self, time: float) -> tuple[Message, ...]:
        """What arrives by ``time``, in the order of time, sender and number; it is taken from the air."""
        arrived = [message for message in self._under_way if message.due <= time + 1e-9]
        if arrived:
            self._under_way = [message for message in self._under_way if message.due > time + 1e-9]
        return tuple(sorted(arrived, key=lambda message: (message.due, message.sender, message.first)))

    def reaches(self, message: Message, robot: RobotId) -> bool:
        """Whether the robot hears the message."""
        if robot == message.sender or robot in self.lost:
            return False
        listeners = self._robots if message.to is None else message.to
        rank = bisect_left(listeners, robot)
        if listeners[rank : rank + 1] != (robot,):
            return False
        if self._radio.loss == 0.0:
            return True
        number = message.first + rank - (message.to is None and message.sender < robot)
        return uniform(self._seed, f"radio/{number}") >= self._radio.loss

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "sent": self._sent,
            "lost": sorted(self.lost),
            "under_way": [
                [message.due, message.sender, _plain(message.news), message.first, message.to and [*message.to]]
                for message in self._under_way
            ],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._sent = state["sent"]
        self.lost = set(state["lost"])
        self._under_way = [
            Message(due, sender, _news(news), first, to and tuple(to))
            for due, sender, news, first, to in state["under_way"]
        ]

    def _send(
        self, time: float, sender: RobotId, news: Iterable[Flip | Announcement], point: Callable[[RobotId], Point]
    ) -> None:
        to = None if self._radio.range is None else self._in_range(sender, self._radio.range, point)
        for piece in news:
            self._under_way.append(Message(time + self._radio.delay, sender, piece, self._sent + 1, to))
            self._sent += len(self._robots) - 1 if to is None else len(to)

    def _in_range(self, sender: RobotId, reach: float, point: Callable[[RobotId], Point]) -> tuple[RobotId, ...]:
        here = point(sender)
        return tuple(robot for robot in self._robots if robot != sender and math.dist(here, point(robot)) <= reach)


def _plain(news: Flip | Announcement) -> dict[str, Any]:
    return {"fact": plain_flip(news)} if isinstance(news, Flip) else {"plan": news.state()}


def _news(plain: Mapping[str, Any]) -> Flip | Announcement:
    return read_flip(plain["fact"]) if "fact" in plain else Announcement.from_state(plain["plan"])
