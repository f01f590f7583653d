"""What robots believe of closed doors and corridors, and which rooms they therefore cannot go between.

Theory of operation. A robot sees whether the doors of its room are closed, and what is near by in the corridors. Who is
refused the way is told why. What a robot has found out it tells by radio. From what it believes closed follows between
which rooms no way is left: for its executive these are facts ``(blocked a b)``, and every drive of its plan needs that
its own is false. So a closed door breaks a causal link, and the plan is repaired round it, or waits.

What a robot does not see it does not believe closed for ever: after a while it takes it for open again, and tries if it
has no other plan. Each time in vain it waits twice as long. A run in which nothing is ever closed has no such object,
and no such conditions.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from clo_fleet.clo.messages import Flip, Observed
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.conversation import Conversation
from clo_fleet.fleet.radio import RadioChannel
from clo_fleet.planning.problem import BLOCKED
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.wait import Wait, WaitCause
from clo_fleet.sim.site import Site
from clo_fleet.world.events import Recorder, Sensed
from clo_fleet.world.model import BuildingMap, PerceptionMode, Point, RobotId, RoomId, World
from clo_fleet.world.places import connected_rooms

__all__ = ["CLOSED", "Closures"]

CLOSED = "closed"  # (closed d): what robots see of doors and corridors, and tell one another
NEAR = 5.0  # [m] so far a robot in the corridors sees whether a door or a corridor is closed
TRY_AGAIN = 20.0  # [s] after which a robot first tries what it believes closed and does not see
AT_MOST = 320.0  # [s] between two such attempts


@dataclass(slots=True)
class _Belief:
    """That something is closed: since when that is known [s], and for how long it is believed unseen [s]."""

    known: float
    lasts: float = TRY_AGAIN


class Closures:
    """Who believes what to be closed."""

    def __init__(self, world: World, site: Site, robots: Mapping[RobotId, Robot], conversation: Conversation) -> None:
        self._world, self._site, self._robots, self._conversation = world, site, robots, conversation
        self._believed: dict[RobotId, dict[str, _Belief]] = {robot: {} for robot in robots}
        self._tried: dict[RobotId, dict[str, float]] = {robot: {} for robot in robots}  # how long it waits next [s]
        self._radio = RadioChannel(world.radio, robots, seed=world.seed)
        self._doors = {str(door.id): door for door in world.map.doors}
        self._ends = {str(corridor.id): (corridor.shape[0], corridor.shape[-1]) for corridor in world.map.corridors}
        self._all = frozenset(connected_rooms(world.map))
        self._pairs: dict[frozenset[str], frozenset[Fact]] = {frozenset(): frozenset()}

    @property
    def settled(self) -> bool:
        """Whether everybody who believes something closed is right."""
        shut = set(self._site.traffic.closed())
        return all(shut.issuperset(believed) for believed in self._believed.values())

    def step(self, time: float, waits: Mapping[RobotId, Wait], recorder: Recorder) -> None:
        """Let every robot look, hear, and try again what it has not seen for long. ``waits``: why robots stand."""
        if not (self._site.traffic.closed() or any(self._believed.values())):
            return
        self._radio.lost = self._conversation.radio.lost
        shut = frozenset(self._site.traffic.closed())
        for robot in self._robots.values():
            seen = self._sight(robot, shut)
            if (wait := waits.get(robot.id)) is not None and wait.cause is WaitCause.CLOSED:
                seen |= dict.fromkeys(shut, True)
            fresh = self._learn(robot, seen, time)
            self._write_down(robot, fresh, time, "sight", recorder)
            self._radio.tell(time, robot.id, fresh, lambda of: self._site.pose(of).point)
        for message in self._radio.due(time):
            if isinstance(message.news, Flip):
                for robot in self._robots.values():
                    if self._radio.reaches(message, robot.id):
                        fresh = self._learn(robot, {message.news.fact[1]: message.news.value}, time)
                        self._write_down(robot, fresh, time, "radio", recorder)
        for robot in self._robots.values():
            self._try_again(robot, time)
            self._tell(robot, time)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "believed": {
                robot: {name: [belief.known, belief.lasts] for name, belief in sorted(believed.items())}
                for robot, believed in self._believed.items()
            },
            "tried": {robot: dict(sorted(tried.items())) for robot, tried in self._tried.items()},
            "radio": self._radio.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._believed = {
            robot: {name: _Belief(*belief) for name, belief in believed.items()}
            for robot, believed in state["believed"].items()
        }
        self._tried = {robot: dict(tried) for robot, tried in state["tried"].items()}
        self._radio.restore(state["radio"])

    # ---- private -------------------------------------------------------------------------------------------

    def _sight(self, robot: Robot, shut: frozenset[str]) -> dict[str, bool]:
        """What of that which is closed, or believed so, the robot sees, and whether it is."""
        names = shut.union(self._believed[robot.id])
        if robot.blind or not names:
            return {}
        if self._world.perception.mode is PerceptionMode.FULL:
            return {name: name in shut for name in sorted(names)}
        here, floor = self._site.pose(robot.id).point, self._site.floor(robot.id)
        return {name: name in shut for name in sorted(names) if self._in_view(name, here, floor)}

    def _in_view(self, name: str, here: Point, floor: RoomId | None) -> bool:
        reach = self._world.perception.range
        if (door := self._doors.get(name)) is not None:
            return math.dist(here, door.position) <= (reach if floor in door.rooms else min(reach, NEAR))
        return min(math.dist(here, end) for end in self._ends[name]) <= min(reach, NEAR)

    def _write_down(self, robot: Robot, fresh: Iterable[Flip], time: float, source: str, recorder: Recorder) -> None:
        for flip in fresh:
            recorder.record(time, Sensed(robot.id, flip.fact, flip.value, source, False, None, None))

    def _learn(self, robot: Robot, news: Mapping[str, bool], time: float) -> tuple[Flip, ...]:
        """Believe it; returns what is new to the robot."""
        believed, tried = self._believed[robot.id], self._tried[robot.id]
        fresh = []
        for name, value in sorted(news.items()):
            if (name in believed) is not value:
                fresh.append(Flip((CLOSED, name), value))
            if value:
                believed[name] = _Belief(time, tried.get(name, TRY_AGAIN))
            else:
                believed.pop(name, None)
                tried.pop(name, None)
        return tuple(fresh)

    def _try_again(self, robot: Robot, time: float) -> None:
        """Take for open what was closed when the robot last knew, if that is long ago."""
        believed = self._believed[robot.id]
        for name in [name for name, belief in believed.items() if time - belief.known >= belief.lasts - 1e-9]:
            self._tried[robot.id][name] = min(AT_MOST, 2.0 * believed.pop(name).lasts)

    def _tell(self, robot: Robot, time: float) -> None:
        """Tell the executive between which rooms there is no way; on its way through corridors it goes on."""
        blocked = self._blocked(self._believed[robot.id])
        believed = {fact for fact in robot.executive.beliefs if fact[0] == BLOCKED}
        changes = blocked ^ believed
        if not changes or self._site.in_corridor(robot.id):
            return
        guessed = self._blocked({*self._believed[robot.id], *self._tried[robot.id]}) - blocked
        for facts, guess in ((changes - guessed, False), (changes & guessed, True)):
            if facts:
                flips = tuple(Flip(fact, fact in blocked) for fact in sorted(facts))
                self._conversation.put(robot.id, Observed(time, flips, guess=guess))

    def _blocked(self, names: Iterable[str]) -> frozenset[Fact]:
        """The facts that follow if these are closed."""
        shut = frozenset(names)
        if shut not in self._pairs:
            left = frozenset(connected_rooms(without(self._world.map, shut)))
            self._pairs[shut] = frozenset((BLOCKED, *pair) for pair in self._all - left)
        return self._pairs[shut]


def without(building: BuildingMap, shut: frozenset[str]) -> BuildingMap:
    """The building without these doors and corridors, nor any corridor that ends at such a door."""
    return replace(
        building,
        doors=tuple(door for door in building.doors if door.id not in shut),
        corridors=tuple(
            corridor for corridor in building.corridors if shut.isdisjoint((corridor.id, corridor.start, corridor.end))
        ),
    )
