"""Invariants of the truth: the facts follow from where everybody and everything is, and the log tells every change."""

import math
from collections.abc import Sequence

import shapely

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.fleet.mission import Mission
from clo_fleet.study.event_log import Recorded
from clo_fleet.study.witness.broken import BrokenInvariantError
from clo_fleet.study.witness.space import Scene
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.events import ActionEnded, Disturbed, FactChanged
from clo_fleet.world.model import ObjectId, Point, RoomId
from clo_fleet.world.places import zones
from clo_fleet.world.vocabulary import vocabulary

__all__ = ["Facts"]

SHOVED = 0.3  # [m] an object moved by more than this has to be prepared again
SILL = 0.5  # [m] about a door between two rooms: there a robot has left one outline and is in the other room
BODILY = frozenset({SensorKind.PLACE, SensorKind.POSITION, SensorKind.HOLDING})  # facts that follow from positions
PREPARED = "prepared"


class Facts:
    """Looks at what is true."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._words = vocabulary(mission.world)
        building = mission.world.map
        self._names = [room.id for room in building.rooms]
        self._rooms = shapely.STRtree([shapely.Polygon(room.outline) for room in building.rooms])
        self._sills = {
            room: [door.position for door in building.doors if room in door.rooms and len(door.rooms) > 1]
            for room in self._names
        }
        self._zones = frozenset(map(str, zones(building)))
        self._told = set(mission.facts)
        self._lies: dict[str, str] = {spec.id: spec.room for spec in mission.world.objects}
        for fact in mission.facts:
            if lies := self._words.read(fact, SensorKind.POSITION):
                self._lies[lies[0]] = lies[1]
        # where each prepared object lay when it was prepared or put down; None: in a hand; nan: nobody saw it
        begun = mission.time > 0
        self._prepared: dict[str, Point | None] = {
            spec.id: (math.nan, math.nan) if begun else spec.position
            for spec in mission.world.objects
            if self._is_prepared(spec.id)
        }

    def look(self, scene: Scene, news: Sequence[Recorded]) -> None:
        """Check everything; ``news``: the events since the last look.

        Raises:
            BrokenInvariantError: for the first thing that is not so.
        """
        time, facts = self._mission.time, self._mission.facts
        for _, _, event in news:
            if isinstance(event, FactChanged):
                (self._told.add if event.value else self._told.discard)(event.fact)
        if self._told != facts:
            off = ", ".join(map(fact_text, sorted(self._told ^ facts)))
            raise BrokenInvariantError(f"the changes in the log do not add up to the truth: {off}", (), time)
        found = self._places(scene, time) | self._handled(news)
        known = {fact for fact in facts if self._words.kind(fact) in BODILY or self._is_followed(fact)}
        if found != known:
            missing = ", ".join(map(fact_text, sorted(found - known))) or "nothing"
            wrong = ", ".join(map(fact_text, sorted(known - found))) or "nothing"
            who = tuple(sorted({fact[1] for fact in found ^ known}))
            raise BrokenInvariantError(f"by where things are {missing} should be true, and {wrong} is", who, time)

    def _places(self, scene: Scene, time: float) -> set[Fact]:
        """Where each robot is: in the room around it, or in a zone; on the sill of an inner door in either room."""
        known: dict[str, list[str]] = {robot: [] for robot in scene.poses}
        found: set[Fact] = set()
        for fact in self._mission.facts:
            if is_at := self._words.read(fact, SensorKind.PLACE):
                found.add(fact)
                known[is_at[0]].append(is_at[1])
        around = self._around([pose.point for pose in scene.poses.values()])
        for (robot, pose), inside in zip(scene.poses.items(), around, strict=True):
            places = sorted(set(known[robot]))
            if not places and not inside and not self._says_zones(robot):
                continue
            if len(places) != 1 or not self._is_at(places[0], pose.point, inside):
                what = f"said to be in {places}, and by its position in {inside or 'no room'}"
                raise BrokenInvariantError(what, (robot,), time)
        return found

    def _says_zones(self, robot: str) -> bool:
        """Whether the world's domain can say of the robot that it is in a zone of corridors."""
        return any(self._words.facts(SensorKind.PLACE, robot, zone) for zone in self._zones)

    def _is_at(self, place: str, point: Point, inside: list[str]) -> bool:
        if inside:
            return place in inside
        return place in self._zones or any(math.dist(point, sill) < SILL for sill in self._sills.get(RoomId(place), ()))

    def _handled(self, news: Sequence[Recorded]) -> set[Fact]:
        """Where each object is and whether it is prepared."""
        site = self._mission.site
        specs = self._mission.world.objects
        positions = {spec.id: site.rooms.item_position(spec.id) for spec in specs}
        free = [spec.id for spec in specs if site.rooms.carrier(spec.id) is None and not site.rooms.gone(spec.id)]
        found: set[Fact] = set()
        around = self._around([positions[item] or (math.nan, math.nan) for item in free])
        for item, inside in zip(free, around, strict=True):
            if inside and self._lies.get(item) not in inside:
                self._lies[item] = inside[0]
            found.update(self._words.facts(SensorKind.POSITION, item, self._lies[item]))
        for spec in specs:
            if (carrier := site.rooms.carrier(spec.id)) is not None:
                found.update(self._words.facts(SensorKind.HOLDING, carrier, spec.id))
        self._follow_prepared(news, positions, frozenset(free))
        return found | {(PREPARED, item) for item in self._prepared}

    def _follow_prepared(
        self, news: Sequence[Recorded], positions: dict[ObjectId, Point | None], free: frozenset[ObjectId]
    ) -> None:
        """The objects that an action prepared, unless they were shoved since then."""
        for item, anchor in list(self._prepared.items()):
            position = positions[ObjectId(item)] if item in free else None
            if anchor is None or position is None:
                self._prepared[item] = position
            elif math.dist(anchor, position) > SHOVED or (math.isnan(anchor[0]) and not self._is_prepared(item)):
                del self._prepared[item]
        for _, _, event in news:
            if self._mission.world.domain is not None:
                return
            if isinstance(event, ActionEnded) and event.ending == "finished" and event.action.startswith("prepare("):
                item = event.action.split(", ")[1]
                self._prepared[item] = positions[ObjectId(item)] if item in free else None
            elif isinstance(event, Disturbed) and ObjectId(event.subject) in positions:
                self._disturbed(event.subject, positions[ObjectId(event.subject)])

    def _disturbed(self, item: str, position: Point | None) -> None:
        """People may prepare an object as they like, or undo that."""
        if self._is_prepared(item):
            self._prepared.setdefault(item, position)
        else:
            self._prepared.pop(item, None)

    def _is_prepared(self, item: str) -> bool:
        return (PREPARED, item) in self._mission.facts and self._is_followed((PREPARED, item))

    def _is_followed(self, fact: Fact) -> bool:
        """Whether the fact is that of the fleet's own domain, whose coming and going is known here."""
        return fact[0] == PREPARED and self._mission.world.domain is None

    def _around(self, points: list[Point]) -> list[list[str]]:
        """The rooms in whose outlines each point lies."""
        inside: list[list[str]] = [[] for _ in points]
        if points:
            for row, room in self._rooms.query(shapely.points(points), predicate="intersects").T.tolist():
                inside[row].append(self._names[room])
        return inside
