"""What befalls the fleet: each disturbance of the schedule is handed to the chapter that knows how to apply it.

Doors, corridors and objects are the simulation's, sensors and hands the robots', the radio the fleet's, planners the
planning's. What cannot happen at its moment, such as moving an object that a robot carries, is put down in the log as
having no effect, with the reason.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from clo_fleet.fleet.closures import Closures
from clo_fleet.fleet.conversation import Conversation
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.wait import Wait
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world import disturbances as world
from clo_fleet.world.disturbances import Disturbance, described, kind_of, subject_of
from clo_fleet.world.events import Disturbed, Recorder
from clo_fleet.world.model import ObjectId, Point, RobotId, World
from clo_fleet.world.random_faults import schedule
from clo_fleet.world.vocabulary import PREPARED

__all__ = ["Disturbances"]

# kinds that never help anybody: nobody needs to wait for them with the end of a run
HARMFUL = (
    world.CorridorClosed
    | world.DoorClosed
    | world.ObjectTaken
    | world.RobotSlowed
    | world.RobotBroken
    | world.SkillFails
    | world.SensorBlinded
    | world.RadioLost
    | world.PlannerKilled
    | world.PlannerSlowed
)


@dataclass(frozen=True, slots=True)
class _NoEffect:
    """It cannot happen now, for this reason."""

    reason: str


class Disturbances:
    """The schedule of one run, and what it takes to carry it out."""

    def __init__(
        self, setting: World, site: Site, truth: Truth, robots: Mapping[RobotId, Robot], conversation: Conversation
    ) -> None:
        self._schedule = schedule(setting)
        self._done = 0
        self._site = site
        self._truth = truth
        self._robots = robots
        self._conversation = conversation
        self._normal = {robot: site.max_speed(robot) for robot in robots}  # [m/s]
        self._slowed: dict[RobotId, float] = {}
        closable = conversation.questions.scene.closable
        self._closures = Closures(setting, site, robots, conversation) if closable else None

    @property
    def help_may_come(self) -> bool:
        """Whether something is still to happen, or to be found out, that may let a robot go on that cannot."""
        mistaken = self._closures is not None and not self._closures.settled
        return mistaken or any(not isinstance(disturbance, HARMFUL) for disturbance in self._schedule[self._done :])

    def notice(self, time: float, waits: Mapping[RobotId, Wait], recorder: Recorder) -> None:
        """Let the robots notice what is closed and what is open again. ``waits``: why robots stand."""
        if self._closures is not None:
            self._closures.step(time, waits, recorder)

    def step(self, time: float, recorder: Recorder) -> None:
        """Apply what is due by ``time`` [s]."""
        while self._done < len(self._schedule) and self._schedule[self._done].time <= time + 1e-9:
            disturbance = self._schedule[self._done]
            self._done += 1
            detail = self._apply(disturbance, time)
            effect = not isinstance(detail, _NoEffect)
            text = f"no effect: {detail.reason}" if isinstance(detail, _NoEffect) else detail
            recorder.record(time, Disturbed(kind_of(disturbance), subject_of(disturbance), text, effect))

    def state(self) -> dict[str, Any]:
        """What has been done of the schedule, and what lasts, as plain data."""
        return {
            "done": self._done,
            "closures": None if self._closures is None else self._closures.state(),
            "slowed": dict(sorted(self._slowed.items())),
            "normal": dict(sorted(self._normal.items())),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._done = state["done"]
        if self._closures is not None:
            self._closures.restore(state["closures"])
        self._slowed, self._normal = dict(state["slowed"]), dict(state["normal"])

    # ---- applying ------------------------------------------------------------------------------------------

    def _apply(self, disturbance: Disturbance, time: float) -> str | _NoEffect:
        """Let it happen; returns what exactly has happened, or why it cannot happen now."""
        match disturbance:
            case world.CorridorClosed() | world.CorridorOpened() | world.DoorClosed() | world.DoorOpened():
                return self._close_or_open(disturbance)
            case world.FactTurned(_, fact, value):
                if (fact in self._truth.effects) is value:
                    return _NoEffect("it is so already")
                self._truth.come_about({fact: value}, None)
                return described(disturbance)
            case world.SkillFails():
                self._conversation.mishaps.add(disturbance)
                return described(disturbance)
            case (
                world.ObjectMoved()
                | world.ObjectTaken()
                | world.ObjectPrepared()
                | world.ObjectReturned()
                | world.ObjectDropped()
            ):
                return self._befall_object(disturbance, disturbance.object)
            case _:
                return self._befall_robot(disturbance, self._robots[disturbance.robot], time)

    def _close_or_open(self, disturbance: Disturbance) -> str | _NoEffect:
        traffic, closed = self._site.traffic, subject_of(disturbance) in self._site.traffic.closed()
        match disturbance:
            case world.DoorClosed(_, door) if not closed:
                traffic.close_door(door)
            case world.DoorOpened(_, door) if closed:
                traffic.open_door(door)
            case world.CorridorClosed(_, corridor) if not closed:
                traffic.close_corridor(corridor)
            case world.CorridorOpened(_, corridor) if closed:
                traffic.open_corridor(corridor)
            case _:
                return _NoEffect("it is so already")
        return ""

    def _befall_object(self, disturbance: Disturbance, item: ObjectId) -> str | _NoEffect:
        rooms = self._site.rooms
        match disturbance:
            case world.ObjectReturned(_, _, position):
                return self._bring_back(item, position) if rooms.gone(item) else _NoEffect("it is not gone")
            case _ if rooms.gone(item):
                return _NoEffect("it is gone")
            case world.ObjectDropped():
                return self._drop(item)
            case _ if (carrier := rooms.carrier(item)) is not None:
                return _NoEffect(f"carried by {carrier}")
            case world.ObjectMoved(_, _, position):
                rooms.move_item(item, position)
            case world.ObjectTaken():
                self._site.items.take_away(item)
            case _:
                return self._prepare(item)
        return described(disturbance)

    def _befall_robot(self, disturbance: Disturbance, robot: Robot, time: float) -> str | _NoEffect:
        lost, slower = self._conversation.radio.lost, self._conversation.questions.faults.slower
        match disturbance:
            case world.RobotSlowed(_, _, speed):
                self._slowed[robot.id] = speed
            case world.RobotRecovered() if robot.id in self._slowed:
                del self._slowed[robot.id]
            case world.RobotBroken() if not robot.broken:
                robot.broken = True
            case world.RobotRepaired() if robot.broken:
                robot.broken = False
            case world.SensorBlinded() if not robot.blind:
                robot.blind = True
            case world.SensorRestored() if robot.blind:
                robot.blind = False
            case world.RadioLost() if robot.id not in lost:
                lost.add(robot.id)
            case world.RadioRestored() if robot.id in lost:
                lost.remove(robot.id)
                self._conversation.reconnect(robot.id)
            case world.PlannerKilled():
                return "" if self._conversation.questions.kill(robot.id, time) else "over its next question"
            case world.PlannerSlowed(_, _, seconds):
                slower[robot.id] = seconds
            case world.PlannerRecovered() if robot.id in slower:
                del slower[robot.id]
            case _:
                return _NoEffect("it is so already")
        self._site.slow(robot.id, 0.0 if robot.broken else self._slowed.get(robot.id, self._normal[robot.id]))
        return described(disturbance)

    def _prepare(self, item: ObjectId) -> str | _NoEffect:
        fact = (PREPARED, item)
        if not self._truth.words.is_effect(fact):
            return _NoEffect(f"nothing is {PREPARED} in this domain")
        if fact in self._truth.effects:
            return _NoEffect("prepared already")
        self._truth.come_about({fact: True}, None)
        return ""

    def _bring_back(self, item: ObjectId, position: Point | None) -> str:
        x, y = self._site.items.bring_back(item, position)
        return f"to {x:.3g} {y:.3g}"

    def _drop(self, item: ObjectId) -> str | _NoEffect:
        carrier = self._site.rooms.carrier(item)
        if carrier is None:
            return _NoEffect("nobody carries it")
        floor = self._site.floor(carrier)
        spot = self._site.items.drop(item, carrier, floor) if floor is not None else None
        if spot is None:
            return _NoEffect(f"no floor for it beside {carrier}")
        self._truth.handle(item, None)
        return f"by {carrier} at {spot[0]:.3g} {spot[1]:.3g}"
