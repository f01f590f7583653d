"""What each robot has heard of the others' plans, and how long it may count on it.

Theory of operation
-------------------
Messages can be lost, or somebody may be out of range; then a robot must neither wait for ever for what nobody will
bring nor take an old tale for the news. Three rules see to it. A robot *repeats* itself: its plan, what it has in
hand, and what it last did with each object. A *promise* of which nothing is heard for a while counts no more, though
the plan that it stood in is still the best guess at where its robot can be met. And of what is told about an object the
latest counts: a deed is believed if it is later than all that the listener saw, did or heard about that object itself.

With a radio that loses nothing, nobody repeats and nothing lapses; if it is prompt as well, all know the same, and one
book serves for all.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.plain import plain_facts, plain_flip, read_facts, read_flip
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.announcements import Announcement, Deed, promises
from clo_fleet.world.model import Radio, RobotId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Hearsay"]

Topic = tuple[str, ...]  # an object: where it is; or any other fact
Heard = tuple[Announcement, float]


class Hearsay:
    """Who has said what, who has heard it, and when."""

    def __init__(self, radio: Radio, words: Vocabulary) -> None:
        self._radio, self._words = radio, words
        self._said: dict[RobotId, Heard] = {}
        self._promises: dict[RobotId, frozenset[Fact]] = {}  # what each robot that has something in hand has promised
        self._heard: dict[RobotId, dict[RobotId, Heard]] = {}
        self._counted: dict[RobotId, frozenset[Fact]] = {}  # the promises that each robot was told to count on
        self._deeds: dict[RobotId, dict[Topic, Deed]] = {}
        self._known: dict[RobotId, dict[Topic, float]] = {}  # when each robot itself learnt of something [s]
        self._deaf: dict[RobotId, float] = {}  # since when robots have had no radio [s]

    # ---- saying --------------------------------------------------------------------------------------------

    def said(self, robot: RobotId) -> Announcement | None:
        """What the robot last announced."""
        return self._said[robot][0] if robot in self._said else None

    def say(self, announcement: Announcement, time: float) -> Announcement:
        """Note what a robot announces; returns it with all that belongs to it."""
        deeds = self._deeds.get(announcement.robot, {})
        full = replace(announcement, deeds=tuple(deeds[topic] for topic in sorted(deeds))) if deeds else announcement
        self._said[announcement.robot] = (full, time)
        if self._radio.perfect:
            self._promise(full)
        return full

    def to_repeat(self, time: float) -> tuple[Announcement, ...]:
        """What robots have not said for a while, where messages can be lost."""
        if self._radio.reliable:
            return ()
        return tuple(said for said, at in self._said.values() if time - at >= self._radio.repeat - 1e-9)

    def to_say_again(self, listener: RobotId) -> tuple[Announcement, ...]:
        """What others have said that one who could not hear for a while may have missed: nobody repeats it by itself.

        With a perfect radio the listener need not wait for it (see ``sayings``).
        """
        missed = self._said.values() if self._radio.reliable and not self._radio.perfect else ()
        return tuple(announcement for announcement, _ in missed if announcement.robot != listener)

    # ---- hearing -------------------------------------------------------------------------------------------

    def heard(self, listener: RobotId, announcement: Announcement, time: float) -> bool:
        """Note what a robot has heard another announce; whether that differs from what it heard of it before."""
        if self._radio.perfect:
            return True
        heard = self._heard.setdefault(listener, {})
        before = heard.get(announcement.robot)
        heard[announcement.robot] = (announcement, time)
        return before is None or before[0] != announcement

    def sayings(self, listener: RobotId) -> tuple[Announcement, ...]:
        """What the others have said that all know; nothing where one has to hear it for oneself."""
        said = self._said.values() if self._radio.perfect else ()
        return tuple(announcement for announcement, _ in said if announcement.robot != listener)

    def known(self, listener: RobotId, other: RobotId) -> Announcement | None:
        """What the robot last heard of another."""
        found = (self._said if self._radio.perfect else self._heard.get(listener, {})).get(other)
        return found[0] if found is not None else None

    @property
    def open(self) -> bool:
        """Whether anything may be promised, or may have lapsed."""
        return bool(self._promises) or not self._radio.perfect

    def promised(self, listener: RobotId, time: float) -> frozenset[Fact]:
        """What others have promised, as far as the robot has heard and that still counts."""
        if self._radio.perfect:
            return frozenset().union(*(facts for robot, facts in self._promises.items() if robot != listener))
        self._counted[listener] = self._count(listener, time)
        return self._counted[listener]

    def promises_of(self, robot: RobotId) -> frozenset[Fact]:
        """What the robot has promised to all."""
        return self._promises.get(robot, frozenset())

    def lapsed(self, time: float) -> tuple[RobotId, ...]:
        """The robots who counted on something that does not count any more."""
        if self._radio.reliable:
            return ()
        return tuple(robot for robot, facts in self._counted.items() if facts and self._count(robot, time) != facts)

    def cut_off(self, lost: Iterable[RobotId], time: float) -> tuple[RobotId, ...]:
        """Who has had no radio for so long that no promise counts any more. Every tick; ``lost``: who has none now."""
        self._deaf = {robot: self._deaf.get(robot, time) for robot in sorted(lost)}
        return tuple(robot for robot, since in self._deaf.items() if time - since >= self._radio.promise - 1e-9)

    # ---- what became of objects ----------------------------------------------------------------------------

    def did(self, robot: RobotId, flips: Iterable[Flip], time: float) -> None:
        """Note what a robot has changed, to be repeated."""
        if self._radio.reliable or not self._radio.facts:
            return
        fresh: dict[Topic, tuple[Flip, ...]] = {}
        for flip in flips:
            fresh[self._topic(flip.fact)] = (*fresh.get(self._topic(flip.fact), ()), flip)
        self._deeds.setdefault(robot, {}).update({topic: Deed(time, both) for topic, both in fresh.items()})
        self.learnt(robot, (flip.fact for deed in fresh.values() for flip in deed), time)

    def learnt(self, robot: RobotId, facts: Iterable[Fact], time: float) -> None:
        """Note that a robot has itself seen, done or been told how things are, as of ``time`` [s]."""
        if not self._radio.perfect:
            self._known.setdefault(robot, {}).update(dict.fromkeys((self._topic(fact) for fact in facts), time))

    def fresh(self, robot: RobotId, flips: Iterable[Flip], told_at: float) -> list[Flip]:
        """Those of the flips told at that time [s] of which the robot knows nothing later."""
        known = self._known.get(robot, {})
        return [flip for flip in flips if known.get(self._topic(flip.fact), -1.0) <= told_at + 1e-9]

    def news(self, listener: RobotId) -> tuple[Flip, ...]:
        """What others say that they have done, where that is the latest that the robot knows of."""
        known = self._known.get(listener, {})
        latest: dict[Topic, Deed] = {}
        for said, _ in self._heard.get(listener, {}).values():
            for deed in said.deeds:
                topic = self._topic(deed.flips[0].fact)
                if deed.time > max(known.get(topic, -1.0), latest[topic].time if topic in latest else -1.0):
                    latest[topic] = deed
        return tuple(flip for topic in sorted(latest) for flip in latest[topic].flips)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "said": [[said.state(), at] for said, at in self._said.values()],
            "heard": {to: [[said.state(), at] for said, at in heard.values()] for to, heard in self._heard.items()},
            "deaf": dict(self._deaf),
            "counted": {robot: plain_facts(facts) for robot, facts in self._counted.items()},
            "deeds": {
                robot: [[deed.time, list(map(plain_flip, deed.flips))] for deed in deeds.values()]
                for robot, deeds in self._deeds.items()
            },
            "known": {
                robot: [[list(topic), at] for topic, at in known.items()] for robot, known in self._known.items()
            },
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._said, self._promises = _read_heard(state["said"]), {}
        for said, _ in self._said.values() if self._radio.perfect else ():
            self._promise(said)
        self._heard = {to: _read_heard(heard) for to, heard in state["heard"].items()}
        self._counted = {robot: read_facts(facts) for robot, facts in state["counted"].items()}
        self._deaf = dict(state["deaf"])
        self._deeds, self._known = {}, {}
        for robot, deeds in state["deeds"].items():
            read = [Deed(time, tuple(map(read_flip, flips))) for time, flips in deeds]
            self._deeds[robot] = {self._topic(deed.flips[0].fact): deed for deed in read}
        for robot, known in state["known"].items():
            self._known[robot] = {tuple(topic): at for topic, at in known}

    def _promise(self, announcement: Announcement) -> None:
        self._promises.pop(announcement.robot, None)
        if facts := promises([announcement]):
            self._promises[announcement.robot] = facts

    def _topic(self, fact: Fact) -> Topic:
        item = self._words.item(fact)
        return (item,) if item else fact

    def _count(self, listener: RobotId, time: float) -> frozenset[Fact]:
        heard = self._heard.get(listener, {}).values()
        limit = -1.0 if self._radio.reliable else time - self._radio.promise
        return promises(said for said, at in heard if at > limit)


def _read_heard(plain: Iterable[tuple[Any, float]]) -> dict[RobotId, Heard]:
    return {said["robot"]: (Announcement.from_state(said), at) for said, at in plain}
