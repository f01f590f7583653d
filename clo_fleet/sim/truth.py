"""The truth: the facts that hold, derived from poses and from the state of the objects, and whose doing they are.

No skill asserts where something is. A robot is at the place where its centre is; an object is at the place where its
body lies, or in the hand that its joint is tied to. The *effects* of an action, which leave no trace in the poses,
happen when its skill has been carried out to the end, and may happen by themselves. Some are lost when an object is
shoved: what was prepared and has slid across the floor has to be prepared again.

Which predicates say so the world's vocabulary knows. A change is attributed to the action that brought it about or
handled the object in that tick, or to the action of the robot that pushed it; what nobody did has no cause.
"""

import math
from collections.abc import Mapping
from typing import Any

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.plain import plain_cause, plain_facts, read_cause, read_facts
from clo_fleet.clo.task import Action, Condition, Fact
from clo_fleet.sim.site import Site
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, PlaceId, Point, RobotId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["SHOVED", "Truth"]

SHOVED = 0.3  # [m] what was done to an object is lost when it lies further from where that was done


class Truth:
    """All facts of one site, renewed every tick. ``words``: which facts say what."""

    def __init__(self, site: Site, words: Vocabulary) -> None:
        self.words = words
        self._site = site
        self._robots = tuple(map(RobotId, words.names.robots))
        self._effects: set[Fact] = set()
        # where the object lay at the end of the tick in which an effect that it may lose came about, or in which it was
        # put down; None until then, and while it is carried
        self._anchors: dict[Fact, Point | None] = {}
        self._doings: dict[Fact, Cause | None] = {}
        self._handled: dict[ObjectId, Cause | None] = {}
        self._causes: dict[Fact, Cause | None] = {}
        for fact in sorted(words.beginning):
            self._set(fact, True)
        for fact in list(self._anchors):
            self._follow(fact)
        self._known: dict[str, tuple[Fact, ...]] = {}  # where each robot and each object is
        self._last_place: dict[RobotId, PlaceId] = {}
        self._stirred = site.rooms.watch()
        self._seen_effects: frozenset[Fact] = frozenset()
        self._facts: frozenset[Fact] = frozenset()
        self._renew()

    @property
    def facts(self) -> frozenset[Fact]:
        """The facts that hold."""
        return self._facts

    @property
    def of_all(self) -> frozenset[Fact]:
        """The facts that hold, but for where robots are: that matters to each of itself alone. Linear in the facts."""
        return frozenset(fact for fact in self._facts if not self.words.read(fact, SensorKind.PLACE))

    @property
    def effects(self) -> frozenset[Fact]:
        """The effects that hold at this moment."""
        return frozenset(self._effects)

    def cause(self, fact: Fact) -> Cause | None:
        """The action that last changed the fact, if one did."""
        return self._causes.get(fact)

    def look(self, fact: Fact) -> Flip:
        """Whether a fact about an object, or an effect, holds at this moment, and whose doing that is.

        ``facts`` is as of the end of the last tick; since then other robots may have acted.
        """
        holds = self._holds(fact)
        return Flip(fact, holds, self._causes.get(fact) if holds is (fact in self._facts) else self._cause_of(fact, {}))

    def lacking(self, action: Action) -> Condition | None:
        """The first condition of the action about objects, hands and effects that is not met at this moment."""
        for need in action.needs:
            if self.words.kind(need.fact) in _OF_THINGS and self._holds(need.fact) is not need.positive:
                return need
        return None

    def come_about(self, changes: Mapping[Fact, bool], cause: Cause | None) -> None:
        """These effects happen in this tick; ``cause``: whose action it was, ``None``: nobody's."""
        for fact, value in sorted(changes.items()):
            if self.words.kind(fact) is SensorKind.EFFECTS:
                self._set(fact, value)
                self._doings[fact] = cause

    def handle(self, item: ObjectId, cause: Cause | None) -> None:
        """The object is being taken, put down or passed on in this tick by that action, or by nobody's."""
        self._handled[item] = cause

    def step(self, running: Mapping[RobotId, Cause]) -> tuple[Flip, ...]:
        """Derive the facts anew; the changes, sorted. ``running``: the action of each robot that has one."""
        for fact in list(self._anchors):
            self._follow(fact)
        flips = []
        for fact in sorted(self._renew()):
            cause = self._cause_of(fact, running)
            self._causes[fact] = cause
            flips.append(Flip(fact, fact in self._facts, cause))
        self._handled.clear()
        self._doings.clear()
        return tuple(flips)

    def state(self) -> dict[str, Any]:
        """What is not derived, as plain data."""
        return {
            "effects": plain_facts(self._effects),
            "anchors": [[list(fact), list(at) if at else None] for fact, at in sorted(self._anchors.items())],
            "causes": [[list(fact), plain_cause(cause)] for fact, cause in sorted(self._causes.items())],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._effects = set(read_facts(state["effects"]))
        self._anchors = {tuple(fact): (at[0], at[1]) if at else None for fact, at in state["anchors"]}
        self._causes = {tuple(fact): read_cause(cause) for fact, cause in state["causes"]}
        self._renew()

    def _renew(self) -> frozenset[Fact]:
        """Derive the facts anew; those that have changed. Only what moved or came about costs more than a look."""
        changed: set[Fact] = set()
        if self._effects != self._seen_effects:
            changed |= self._effects ^ self._seen_effects
            self._seen_effects = frozenset(self._effects)
        for robot in self._robots:
            place = self._site.place(robot)
            if place != self._last_place.get(robot):
                self._last_place[robot] = place
                self._place(robot, self.words.facts(SensorKind.PLACE, robot, place), changed)
        for item in self._stirred:
            self._place(item, self._whereabouts(item), changed)
        self._stirred.clear()
        if changed:
            self._facts ^= changed
        return frozenset(changed)

    def _place(self, name: str, now: tuple[Fact, ...], changed: set[Fact]) -> None:
        """Note where something is now, and which facts have changed by that."""
        before = self._known.get(name, ())
        if now != before:
            self._known[name] = now
            changed.symmetric_difference_update({*before} ^ {*now})

    def _whereabouts(self, item: ObjectId) -> tuple[Fact, ...]:
        """Where the object is at this moment: on a floor or in a hand; nothing if it is gone."""
        if self._site.rooms.gone(item):
            return ()
        carrier = self._site.rooms.carrier(item)
        if carrier is None:
            return self.words.facts(SensorKind.POSITION, item, str(self._site.items.place(item)))
        return self.words.facts(SensorKind.HOLDING, carrier, item)

    def _holds(self, fact: Fact) -> bool:
        item = self.words.item(fact)
        return fact in (self._whereabouts(ObjectId(item)) if item else self._effects)

    def _set(self, fact: Fact, value: bool) -> None:
        if not value:
            self._effects.discard(fact)
            self._anchors.pop(fact, None)
            return
        self._effects.add(fact)
        if self.words.lost_with(fact):
            self._anchors[fact] = None

    def _follow(self, fact: Fact) -> None:
        """Forget what an object that was shoved or taken away has lost; keep it while it is carried."""
        item = ObjectId(self.words.lost_with(fact))
        if self._site.rooms.carrier(item) is not None:
            self._anchors[fact] = None
            return
        position, anchor = self._site.rooms.item_position(item), self._anchors[fact]
        if anchor is None and position is not None:
            self._anchors[fact] = position
        elif anchor is None or position is None or math.dist(anchor, position) > SHOVED:
            self._set(fact, False)

    def _cause_of(self, fact: Fact, running: Mapping[RobotId, Cause]) -> Cause | None:
        if about := self.words.read(fact, SensorKind.PLACE):
            return running.get(RobotId(about[0]))
        if fact in self._doings:
            return self._doings[fact]
        item = ObjectId(self.words.item(fact) or self.words.lost_with(fact))
        if item in self._handled:
            return self._handled[item]
        pusher = self._site.rooms.pusher(item) if item else None
        return running.get(pusher) if pusher is not None else None


_OF_THINGS = frozenset({SensorKind.POSITION, SensorKind.HOLDING, SensorKind.EFFECTS})
