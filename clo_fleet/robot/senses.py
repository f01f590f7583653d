"""What a robot looks at and sees, and which beliefs follow from it.

A robot knows its own place and its own hands at any time. What else there is it has to look at: in its room, the
objects that lie there within range and in line of sight, whether they are prepared, and what other robots in view
carry, though not in what state. Walls and obstacles block sight. An object that should lie in the room and was in no
part of it is not there. In the corridors a robot sees nothing but itself. Three modes say what it looks at:

- ``watch``: only what its plan hangs on (the watch set), and objects that it has lost;
- ``sight``: everything in view;
- ``full``: everything, everywhere.

The first two come to the same beliefs, because a robot heeds no more than that of what it sees; but every fact that
is looked at counts, and takes time if looking does: a robot looks again when it is through with what it looks at.
"""

import math
from collections.abc import Mapping
from typing import Any

from clo_fleet.clo.strategies import Everything, Watch
from clo_fleet.clo.task import Fact
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world.binding import EVERYWHERE, SensorKind
from clo_fleet.world.model import ObjectId, Perception, PerceptionMode, PlaceId, Point, RobotId, RoomId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Seen", "Senses", "consequences", "heeded"]

Seen = dict[Fact, bool]


class Senses:
    """The eyes of all robots of one world. ``looked``: how many facts each has looked at so far."""

    def __init__(self, site: Site, truth: Truth, perception: Perception) -> None:
        self.looked: dict[RobotId, int] = {}
        self._site, self._truth, self._perception = site, truth, perception
        self._busy: dict[RobotId, float] = {}  # until when a robot is still looking [s]
        self._searched: dict[RobotId, tuple[RoomId, frozenset[int]]] = {}  # the spots of its room seen so far

    def sight(
        self, robot: RobotId, beliefs: frozenset[Fact], watch: Watch, time: float, *, blind: bool = False
    ) -> Seen:
        """Every fact that the robot's senses settle now, and its value; ``blind``: it knows but itself."""
        known = self._of_itself(robot, beliefs)
        if blind or self._busy.get(robot, -math.inf) > time + 1e-9:
            return known
        if self._perception.mode is PerceptionMode.FULL:
            seen = self._everywhere(robot, beliefs)
        else:
            seen = self._in_room(robot, beliefs, watch)
        looked = len(seen.keys() - known.keys())
        self.looked[robot] = self.looked.get(robot, 0) + looked
        if self._perception.look > 0.0:
            self._busy[robot] = time + looked * self._perception.look
        return known | seen

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "looked": dict(self.looked),
            "busy": dict(self._busy),
            "searched": {robot: [room, sorted(seen)] for robot, (room, seen) in self._searched.items()},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.looked, self._busy = dict(state["looked"]), dict(state["busy"])
        self._searched = {robot: (room, frozenset(seen)) for robot, (room, seen) in state["searched"].items()}

    # ---- private -------------------------------------------------------------------------------------------

    def _of_itself(self, robot: RobotId, beliefs: frozenset[Fact]) -> Seen:
        """Where the robot is, and what it has in hand."""
        site, truth = self._site, self._truth
        own = sorted(fact for fact in beliefs if robot in fact and _own(fact, robot, truth.words))
        seen = {fact: fact in truth.facts for fact in own}
        place, carried = site.place(robot), site.rooms.carried(robot)
        if site.premises.is_room(place):
            seen |= dict.fromkeys(truth.words.facts(SensorKind.PLACE, robot, str(place)), True)
        for item in carried:
            seen |= dict.fromkeys(truth.words.facts(SensorKind.HOLDING, robot, item), True)
        return seen | self._effects({EVERYWHERE, robot, *carried}, beliefs)

    def _everywhere(self, robot: RobotId, beliefs: frozenset[Fact]) -> Seen:
        """All facts of the robot's task, wherever they are."""
        known = {fact for fact in self._truth.facts if self._concerns(fact, robot)}
        gone = {fact for fact in beliefs if self._truth.words.sensed(fact) and self._concerns(fact, robot)} - known
        return dict.fromkeys(sorted(known), True) | dict.fromkeys(sorted(gone), False)

    def _in_room(self, robot: RobotId, beliefs: frozenset[Fact], watch: Watch) -> Seen:
        """What the robot sees of the room on whose floor it is."""
        site = self._site
        place = site.place(robot)
        if not site.premises.is_room(place) or site.in_corridor(robot):
            return {}
        room = RoomId(place)
        attended = self._attended(robot, beliefs, watch)
        seen = {fact: value for fact, value in self._of_room(robot, room, beliefs).items() if fact in attended}
        words = self._truth.words
        there = (fact for fact in beliefs if room in fact and words.read(fact, SensorKind.POSITION)[1:] == (room,))
        missed = {fact for fact in there if fact in attended}
        missed -= seen.keys()
        if missed and self._overlooked(robot, room):
            seen |= dict.fromkeys(sorted(missed), False)
        if not missed:
            self._searched.pop(robot, None)
        return seen

    def _of_room(self, robot: RobotId, room: RoomId, beliefs: frozenset[Fact]) -> Seen:
        """The facts about the objects and the other robots in view."""
        site, seen = self._site, Seen()
        shown = self._truth.words.shown
        lying: dict[ObjectId, Point] = {}
        for item in site.items.lying_in(room):
            if (position := site.rooms.item_position(item)) is not None:
                lying[item] = position
        others = [
            other for other in site.bodies_in(room) if other != robot and (site.rooms.carried(other) or other in shown)
        ]
        points = [*lying.values(), *(site.pose(other).point for other in others)]
        in_view = site.premises.sightlines(room).seen(site.pose(robot).point, points, self._perception.range)
        words, names = self._truth.words, {str(room)}
        for item, visible in zip(lying, in_view, strict=False):
            if visible:
                names.add(item)
                seen |= dict.fromkeys(words.facts(SensorKind.POSITION, item, str(room)), True)
        for other, visible in zip(others, in_view[len(lying) :], strict=True):
            if visible:
                names.add(other)
                for item in site.rooms.carried(other):
                    seen |= dict.fromkeys(words.facts(SensorKind.HOLDING, other, item), True)
        return seen | self._effects(names, beliefs)

    def _effects(self, names: set[str], beliefs: frozenset[Fact]) -> Seen:
        """The effects that are seen where these are, those that hold and those that are believed to."""
        words, truth = self._truth.words, self._truth.effects
        facts = {fact for name in names for fact in words.effects_on(name)}
        facts.update(fact for fact in truth if words.seen_at(fact) in names)
        facts.update(fact for fact in beliefs if fact[0] in words.effects and words.seen_at(fact) in names)
        return {fact: fact in truth for fact in sorted(facts)}

    def _attended(self, robot: RobotId, beliefs: frozenset[Fact], watch: Watch) -> Watch:
        """What the robot looks at: all, or its watch set, where those objects are, and where those are that it lost."""
        if self._perception.mode is not PerceptionMode.WATCH or isinstance(watch, Everything):
            return Everything()
        words, facts = self._truth.words, self._truth.facts
        known = {words.item(fact) for fact in beliefs if not _own(fact, robot, words) or fact in facts}
        minded = ({*self._site.items.ids} - known | {words.item(fact) for fact in watch}) - {""}
        return watch | {fact for fact in facts | beliefs if words.item(fact) in minded}

    def _overlooked(self, robot: RobotId, room: RoomId) -> bool:
        """Whether the robot has seen all of the room since it began to miss something there."""
        lines = self._site.premises.sightlines(room)
        last, before = self._searched.get(robot, (room, frozenset()))
        before = before if last == room else frozenset()
        left = [number for number in range(len(lines.spots)) if number not in before]
        eye, reach = self._site.pose(robot).point, self._perception.range
        in_view = lines.seen(eye, [lines.spots[number] for number in left], reach)
        now = before | {number for number, visible in zip(left, in_view, strict=True) if visible}
        self._searched[robot] = (room, now)
        return len(now) == len(lines.spots)

    def _concerns(self, fact: Fact, robot: RobotId) -> bool:
        """Where other robots are is not a fact of a robot's own task, and a corridor is no place to be at."""
        about = self._truth.words.read(fact, SensorKind.PLACE)
        return not about or (about[0] == robot and self._site.premises.is_room(PlaceId(about[1])))


def consequences(seen: Seen, beliefs: frozenset[Fact], words: Vocabulary) -> Seen:
    """The facts seen, and the beliefs that they rule out: an object is in one place or one hand."""
    where = {item: fact for fact, value in seen.items() if value and (item := words.item(fact))}
    if not where:
        return seen
    ruled_out = {
        fact: False
        for fact in sorted(fact for fact in beliefs if not where.keys().isdisjoint(fact))
        if (item := words.item(fact)) and where.get(item, fact) != fact
    }
    return ruled_out | seen


def heeded(told: Seen, beliefs: frozenset[Fact], watch: Watch, robot: RobotId, words: Vocabulary) -> Seen:
    """Those of the facts seen or heard that differ from what is believed and that the robot heeds, sorted.

    It heeds what it watches, itself, and where an object lies of which it does not know any more where it is.
    """
    fresh = {fact: value for fact, value in sorted(told.items()) if (fact in beliefs) is not value}
    wanted = {fact for fact in fresh if fact in watch or _own(fact, robot, words)}
    lying = {fact for fact, value in fresh.items() if value and words.read(fact, SensorKind.POSITION)} - wanted
    if lying:
        known = {words.item(fact) for fact in beliefs - wanted}
        wanted |= {fact for fact in lying if words.item(fact) not in known}
    return {fact: value for fact, value in fresh.items() if fact in wanted}


def _own(fact: Fact, robot: RobotId, words: Vocabulary) -> bool:
    return (words.read(fact, SensorKind.PLACE) or words.read(fact, SensorKind.HOLDING))[:1] == (robot,)
