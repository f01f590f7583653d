"""What a robot sees, and which beliefs follow from it.

By sight a robot knows its own place and its own hands; in a room it sees the objects that lie there within
range, whether they are prepared, and what other robots in the room carry, though not in what state. An object that
should lie there and is not seen is not there. In the corridors it sees nothing but itself. With full perception it
knows everything.
"""

import math

from clo_fleet.clo.strategies import Watch
from clo_fleet.clo.task import Fact
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world.model import Perception, PerceptionMode, RobotId, RoomId

__all__ = ["consequences", "heeded", "sight"]

Seen = dict[Fact, bool]


def sight(site: Site, truth: Truth, robot: RobotId, perception: Perception, beliefs: frozenset[Fact]) -> Seen:
    """Every fact that the robot's senses settle now, and its value."""
    if perception.mode is PerceptionMode.FULL:
        known = {fact for fact in truth.facts if _concerns(fact, robot, site)}
        gone = {fact for fact in beliefs if fact[0] in _SENSED and _concerns(fact, robot, site)} - known
        return dict.fromkeys(sorted(known), True) | dict.fromkeys(sorted(gone), False)
    seen = _of_itself(site, truth, robot, beliefs)
    place = site.place(robot)
    if site.is_room(place) and not site.in_corridor(robot):
        seen |= _of_its_room(site, truth, robot, RoomId(place), perception.range)
        missed = {fact for fact in beliefs if fact[0] == "at-object" and fact[2] == place} - seen.keys()
        if missed and _overlooks(site, robot, perception.range):
            seen |= dict.fromkeys(sorted(missed), False)
    return seen


def _of_itself(site: Site, truth: Truth, robot: RobotId, beliefs: frozenset[Fact]) -> Seen:
    """Where the robot is, and what it has in hand."""
    own = sorted(fact for fact in beliefs if _own(fact, robot))
    seen = {fact: fact in truth.facts for fact in own}
    place = site.place(robot)
    if site.is_room(place):
        seen["at-robot", robot, str(place)] = True
    for item in site.rooms.carried(robot):
        seen["holding", robot, item] = True
        seen["prepared", item] = truth.prepared(item)
    return seen


def _of_its_room(site: Site, truth: Truth, robot: RobotId, room: RoomId, reach: float) -> Seen:
    """What lies in the room within reach of sight [m], and what other robots there have in hand."""
    seen: Seen = {}
    here = site.pose(robot).point
    for item in site.items_in(room):
        position = site.item_position(item)
        if position is not None and math.dist(here, position) <= reach:
            seen["at-object", item, str(room)] = True
            seen["prepared", item] = truth.prepared(item)
    for other in site.bodies_in(room):
        if other != robot and math.dist(here, site.pose(other).point) <= reach:
            seen |= dict.fromkeys((("holding", other, item) for item in site.rooms.carried(other)), True)
    return seen


def consequences(seen: Seen, beliefs: frozenset[Fact]) -> Seen:
    """The facts seen, and the beliefs that they rule out: an object is in one place or one hand."""
    where = {_item(fact): fact for fact, value in seen.items() if value and fact[0] in ("at-object", "holding")}
    ruled_out = {
        fact: False
        for fact in sorted(beliefs)
        if fact[0] in ("at-object", "holding") and where.get(_item(fact), fact) != fact
    }
    return ruled_out | seen


def heeded(told: Seen, beliefs: frozenset[Fact], watch: Watch, robot: RobotId) -> Seen:
    """Those of the facts seen or heard that differ from what is believed and that the robot heeds, sorted.

    It heeds what it watches, itself, and where an object lies of which it does not know any more where it is.
    """
    fresh = {fact: value for fact, value in sorted(told.items()) if (fact in beliefs) is not value}
    wanted = {fact for fact in fresh if fact in watch or _own(fact, robot)}
    if lying := {fact for fact, value in fresh.items() if value and fact[0] == "at-object"} - wanted:
        known = {_item(fact) for fact in beliefs - wanted if fact[0] in ("at-object", "holding")}
        wanted |= {fact for fact in lying if _item(fact) not in known}
    return {fact: value for fact, value in fresh.items() if fact in wanted}


_SENSED = frozenset({"at-robot", "at-object", "prepared", "holding"})


def _own(fact: Fact, robot: RobotId) -> bool:
    return fact[0] in ("at-robot", "holding") and fact[1] == robot


def _concerns(fact: Fact, robot: RobotId, site: Site) -> bool:
    """Where other robots are is not a fact of a robot's own task, and a corridor is no place to be at."""
    return fact[0] != "at-robot" or (fact[1] == robot and fact[2] in {room.id for room in site.building.rooms})


def _item(fact: Fact) -> str:
    return fact[1] if fact[0] == "at-object" else fact[2]


def _overlooks(site: Site, robot: RobotId, reach: float) -> bool:
    """Whether the robot's sight reaches all of its room."""
    here = site.pose(robot).point
    room = site.room(RoomId(site.place(robot)))
    return all(math.dist(here, corner) <= reach for corner in room.outline)
