"""Who has to look: nobody to whom all looks the same as when it last looked.

In the corridors a robot sees nothing but itself. In a *plain* room, which hides nothing and is within sight from wall
to wall, what a robot sees changes with what is true there, not with where it stands. So whoever has looked there
*rests* until its own beliefs or its plan change, or something comes, goes or changes in its room. In any other room, or
where looking takes time, or where messages can be lost and robots have to remember when they saw what, they look in
every tick. If it is forgotten who rests, that costs one look more.
"""

from collections.abc import Iterable, Mapping

from clo_fleet.clo.task import Fact
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.senses import Senses
from clo_fleet.sim.site import Site
from clo_fleet.world.binding import DOER, SensorKind
from clo_fleet.world.model import ObjectId, PerceptionMode, PlaceId, RobotId, RoomId, World
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Attention"]


class Attention:
    """Which robots rest from looking."""

    def __init__(
        self, world: World, site: Site, words: Vocabulary, robots: Mapping[RobotId, Robot], senses: Senses
    ) -> None:
        self._site = site
        self._words = words
        self._robots = robots
        self._senses = senses
        self._range = world.perception.range
        sees = world.perception
        self._ever = sees.mode is not PerceptionMode.FULL and sees.look == 0.0 and world.radio.perfect
        self._resting: dict[RobotId, int] = {}  # and how many facts it would look at in each tick

    def looking(self) -> list[Robot]:
        """Those that have to look in this tick, in the order of ids; what the others would look at is counted."""
        for room in self._site.stirred:
            self._wake(self._site.bodies_in(room))
        for robot, count in self._resting.items():
            if count and not self._robots[robot].blind:
                self._senses.looked[robot] += count
        return [robot for robot in self._robots.values() if robot.id not in self._resting]

    def rest(self, robot: Robot, looked: int) -> None:
        """The robot has looked, at so many facts; let it rest if nothing can look different in the next tick."""
        if self._ever and not robot.blind and (self._site.in_corridor(robot.id) or self._at_a_glance(robot.id)):
            self._resting[robot.id] = looked

    def wake(self, robot: RobotId) -> None:
        """The robot's beliefs or its plan have changed, or its action has ended: it looks again."""
        self._resting.pop(robot, None)

    def note(self, facts: Iterable[Fact]) -> None:
        """These facts have turned true or false: whoever is near enough to see that looks again."""
        for fact in facts if self._resting else ():
            self._wake(self._witnesses(fact))

    def _wake(self, robots: Iterable[RobotId]) -> None:
        for robot in robots:
            self._resting.pop(robot, None)

    def _witnesses(self, fact: Fact) -> Iterable[RobotId]:
        """Who may see the fact, or have it in hand."""
        words, site = self._words, self._site
        if about := words.read(fact, SensorKind.POSITION):
            return site.bodies_in(RoomId(about[1]))
        if about := words.read(fact, SensorKind.HOLDING):
            return self._around(RobotId(about[0]))
        if about := words.read(fact, SensorKind.PLACE):
            robot = RobotId(about[0])
            return self._around(robot) if site.rooms.carried(robot) or robot in words.shown else (robot,)
        shown = words.seen_at(fact)
        if shown in self._robots:
            return self._around(RobotId(shown))
        if shown in words.names.objects:
            item = ObjectId(shown)
            carrier, room = site.rooms.carrier(item), site.items.place(item)
            return self._around(carrier) if carrier is not None else site.bodies_in(RoomId(room)) if room else ()
        return site.bodies_in(RoomId(shown)) if shown in words.names.rooms else (() if shown == DOER else self._robots)

    def _around(self, robot: RobotId) -> tuple[RobotId, ...]:
        """The robot and those on the same floor."""
        floor = self._site.floor(robot)
        return (robot, *(self._site.bodies_in(floor) if floor is not None else ()))

    def _at_a_glance(self, robot: RobotId) -> bool:
        """Whether the robot sees all that there is in its room, wherever it and the others go in there."""
        site = self._site
        room = site.floor(robot)
        if room is None or site.place(robot) != PlaceId(room):
            return False
        sightlines = site.premises.sightlines(room)
        if not sightlines.plain_within(self._range):
            return False
        lying = (site.rooms.item_position(item) for item in site.items.lying_in(room))
        loaded = (other for other in site.bodies_in(room) if site.rooms.carried(other) or other in self._words.shown)
        return all(at is not None and sightlines.inside(at) for at in lying) and all(
            site.place(other) == PlaceId(room) for other in loaded
        )
