"""The radio: facts that robots have seen or brought about, told to those who want to know.

A robot tells what it has learnt by its own senses and what its own actions changed. A message reaches a listener
if the listener watches the fact, is in range, and the message is not lost; it arrives after the delay. What is
lost is drawn from the seed and the number of the message, so that the same run loses the same ones.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.plain import plain_flip, read_flip
from clo_fleet.world.chance import uniform
from clo_fleet.world.model import Point, Radio, RobotId

__all__ = ["Listener", "Message", "RadioChannel"]


@dataclass(frozen=True, slots=True)
class Message:
    """One fact on its way to one robot."""

    due: float
    to: RobotId
    flip: Flip


@dataclass(frozen=True, slots=True)
class Listener:
    """A robot that may hear: where it is [m]."""

    robot: RobotId
    point: Point


class RadioChannel:
    """All messages under way."""

    def __init__(self, radio: Radio, *, seed: int) -> None:
        self._radio = radio
        self._seed = seed
        self._sent = 0
        self._under_way: list[Message] = []

    def tell(self, time: float, sender: Listener, flips: Iterable[Flip], listeners: Iterable[Listener]) -> None:
        """Send each flip to each listener in range."""
        if not self._radio.facts:
            return
        in_range = [listener for listener in listeners if self._reaches(sender, listener)]
        for flip in flips:
            for listener in in_range:
                self._sent += 1
                if self._radio.loss == 0.0 or uniform(self._seed, f"radio/{self._sent}") >= self._radio.loss:
                    self._under_way.append(Message(time + self._radio.delay, listener.robot, flip))

    def due(self, time: float) -> dict[RobotId, list[Flip]]:
        """What arrives by ``time``, by robot, in the order of sending; it is taken from the air."""
        arrived: dict[RobotId, list[Flip]] = {}
        for message in self._under_way:
            if message.due <= time + 1e-9:
                arrived.setdefault(message.to, []).append(message.flip)
        self._under_way = [message for message in self._under_way if message.due > time + 1e-9]
        return arrived

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "sent": self._sent,
            "under_way": [[message.due, message.to, plain_flip(message.flip)] for message in self._under_way],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._sent = state["sent"]
        self._under_way = [Message(due, to, read_flip(flip)) for due, to, flip in state["under_way"]]

    def _reaches(self, sender: Listener, listener: Listener) -> bool:
        reach = self._radio.range
        return sender.robot != listener.robot and (reach is None or math.dist(sender.point, listener.point) <= reach)
