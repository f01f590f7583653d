"""What robots do about closed corridors and doors, and when they are called back on their way."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace

import pytest

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Action
from clo_fleet.fleet.offers import Offers
from clo_fleet.robot.drive import Drive, Phase
from clo_fleet.robot.skill import Body, Cancelled, Done, Failed, Progress, Under
from clo_fleet.sim.network import build_network
from clo_fleet.sim.site import Site
from clo_fleet.sim.traffic import Course, Traffic, UnknownCorridorError
from clo_fleet.sim.truth import Truth
from clo_fleet.study.event_log import EventLog
from clo_fleet.world.buildings import Measures, ring
from clo_fleet.world.model import (
    BuildingMap,
    CorridorId,
    DoorId,
    PlaceId,
    RobotId,
    RobotSpec,
    RoomId,
    SkillSettings,
    World,
)
from clo_fleet.world.vocabulary import vocabulary

MOVE = Action(schema="move", args=(), needs=(), adds=frozenset(), deletes=frozenset())
R1 = RobotId("r1")
HOME, FIRST, SECOND = RoomId("room-0"), RoomId("room-1"), RoomId("room-2")
SHORT, AHEAD, ROUND = CorridorId("node-0--node-1"), CorridorId("node-1--node-2"), CorridorId("node-3--node-0")


@dataclass(slots=True)
class Trip:
    """One robot on its way round a ring of four rooms."""

    site: Site
    spec: RobotSpec
    drive: Drive
    time: float = 0.0
    progress: Progress | None = None

    def step(self) -> Progress:
        """One tick."""
        self.time = round(self.time + 0.2, 3)
        world = World(name="", map=self.site.building, robots=(self.spec,), objects=())
        body = Body(
            spec=self.spec,
            site=self.site,
            truth=Truth(self.site, vocabulary(world)),
            exchange=Offers(EventLog()),
            settings=SkillSettings(),
            time=self.time,
            action=MOVE,
            cause=Cause(R1, "move", 0),
        )
        progress = self.drive.step(body)
        if isinstance(progress, Under) and not self.site.in_corridor(R1):
            self.site.rooms.drive(R1, progress.velocity)
        self.site.step()
        return progress

    def until(self, *phases: Phase) -> None:
        """Go on until the drive has come so far."""
        while self.drive.phase not in phases:
            assert isinstance(self.step(), Under)
            assert self.time < 60.0

    def end(self) -> Progress:
        """Go on until the drive has ended."""
        while isinstance(progress := self.step(), Under):
            assert self.time < 300.0, progress
        return progress

    def edges(self) -> tuple[str, ...]:
        """The lanes that the robot may use."""
        return self.site.traffic.right_of_way.claim(R1)


@pytest.fixture(scope="module")
def building(tmp_path_factory: pytest.TempPathFactory) -> BuildingMap:
    """Four rooms at the corners of a square, two lanes."""
    plain = ring(4, Measures(two_lane=True))
    build_network(plain, path := tmp_path_factory.mktemp("ring") / "ring.net.xml.gz")
    return replace(plain, network=path)


def trip(building: BuildingMap, goal: RoomId) -> Iterator[Trip]:
    """A robot that sets out from the first room."""
    spawn = next(spawn for spawn in building.spawn_points if spawn.room == HOME)
    spec = RobotSpec(id=R1, room=HOME, pose=spawn.pose, goals=())
    with Site(building, (spec,), (), seed=1, tick=0.2) as site:
        yield Trip(site, spec, Drive(HOME, goal))


def test_a_closed_corridor_is_on_nobodys_way(building: BuildingMap) -> None:
    """The robot takes the other way round."""
    for it in trip(building, FIRST):
        it.site.traffic.close_corridor(SHORT)
        assert it.site.traffic.closed() == (SHORT,)
        it.until(Phase.TRAVEL)
        assert SHORT not in it.edges()
        assert f"-{ROUND}" in it.edges()
        assert isinstance(it.end(), Done)


def test_who_finds_a_corridor_closed_ahead_goes_another_way(building: BuildingMap) -> None:
    """While it can still turn off for it."""
    for it in trip(building, SECOND):
        it.until(Phase.TRAVEL)
        second = it.edges()[2].removeprefix("-")
        it.site.traffic.close_corridor(CorridorId(second))
        while second in [edge.removeprefix("-") for edge in it.edges()]:
            it.step()
            assert it.time < 10.0
        assert isinstance(it.end(), Done)


def test_who_is_past_the_last_turn_waits_before_what_is_closed(building: BuildingMap) -> None:
    """And goes on when it is open again."""
    for it in trip(building, SECOND):
        it.until(Phase.TRAVEL)
        while len(it.edges()) > 3:
            it.step()
        second = it.edges()[1].removeprefix("-")
        it.site.traffic.close_corridor(CorridorId(second))
        for _ in range(150):
            it.step()
        assert it.drive.phase is Phase.TRAVEL
        assert it.site.speed(R1) == 0.0
        it.site.traffic.open_corridor(CorridorId(second))
        assert isinstance(it.end(), Done)


def test_who_sets_out_the_long_way_takes_the_short_one_once_it_is_open_again(building: BuildingMap) -> None:
    """Be it that it waits at the door by then or is on its way: it turns off as soon as it can, and says why, once."""
    for phase in (Phase.QUEUE, Phase.TRAVEL):
        for it in trip(building, FIRST):
            it.site.traffic.close_corridor(SHORT)
            it.step()
            it.until(phase)
            it.site.traffic.open_corridor(SHORT)
            told = []
            while isinstance(progress := it.step(), Under):
                told += [progress.rerouted] if progress.rerouted else []
            assert told == [f"open again: {SHORT}"]
            assert isinstance(progress, Done)
            assert it.drive.way.course is not None
            assert SHORT in it.drive.way.course.lanes
            assert it.time < 30.0, "round the ring it takes a minute"


def test_who_is_past_the_last_turn_goes_on_the_long_way(building: BuildingMap) -> None:
    """It does not come back for the short one, and arrives; nor does it turn off for what is no quicker."""
    for it in trip(building, FIRST):
        it.site.traffic.close_corridor(SHORT)
        it.until(Phase.TRAVEL)
        while it.edges()[0].removeprefix("-") != ROUND:
            it.step()
        it.site.traffic.open_corridor(SHORT)
        assert isinstance(it.end(), Done)
        assert it.drive.way.course is not None
        assert SHORT not in it.drive.way.course.lanes
    for it in trip(building, FIRST):
        it.site.traffic.close_corridor(ROUND)
        it.until(Phase.TRAVEL)
        assert it.drive.way.avoided == (ROUND,)
        assert Drive.from_state(json.loads(json.dumps(it.drive.state()))) == it.drive
        it.site.traffic.open_corridor(ROUND)
        while isinstance(progress := it.step(), Under):
            assert not progress.rerouted


def test_without_any_way_a_robot_waits_for_a_while_and_fails_with_a_reason(building: BuildingMap) -> None:
    """It names what is closed; opened in time, the way is taken."""
    for it in trip(building, FIRST):
        it.site.traffic.close_door(DoorId("room-1-door"))
        waits = it.step()
        assert isinstance(waits, Under)
        assert waits.standing_for == "room-1-door, which is closed"
        assert it.end() == Failed("closed: room-1-door")
        assert it.time > 60.0
    for it in trip(building, FIRST):
        it.site.traffic.close_door(DoorId("room-1-door"))
        it.step()
        it.site.traffic.open_door(DoorId("room-1-door"))
        assert isinstance(it.end(), Done)


def test_who_comes_to_a_closed_door_holds_before_it(building: BuildingMap) -> None:
    """Until it is open again."""
    for it in trip(building, FIRST):
        it.until(Phase.TRAVEL)
        it.site.traffic.close_door(DoorId("room-1-door"))
        it.until(Phase.WAIT_TO_ENTER)
        for _ in range(20):
            waits = it.step()
            assert isinstance(waits, Under)
            assert waits.standing_for == "door room-1-door, which is closed"
        it.site.traffic.open_door(DoorId("room-1-door"))
        assert isinstance(it.end(), Done)


def test_who_is_called_back_on_its_way_comes_back_where_a_loop_leads_back(building: BuildingMap) -> None:
    """Round the ring, into the room from which it came; its claim goes with it."""
    for it in trip(building, SECOND):
        it.until(Phase.TRAVEL)
        it.drive.cancel()
        assert isinstance(it.end(), Cancelled)
        assert it.site.place(R1) == PlaceId(HOME)
        assert it.edges() == ()


def test_what_is_closed_is_in_the_state(building: BuildingMap) -> None:
    """Through JSON; courses too."""
    for it in trip(building, SECOND):
        it.until(Phase.TRAVEL)
        it.site.traffic.close_door(DoorId("room-3-door"))
        it.site.traffic.close_corridor(SHORT)
        state = json.loads(json.dumps(it.site.traffic.state()))
        again = Traffic.from_state(building, it.site.corridors, (it.spec,), state)
        assert again.closed() == (SHORT, "room-3-door")
        assert again.state() == it.site.traffic.state()
        course = it.drive.way.course
        assert course is not None
        assert Course.from_state(json.loads(json.dumps(course.state()))) == course
        with pytest.raises(UnknownCorridorError, match="nowhere"):
            it.site.traffic.close_corridor(CorridorId("nowhere"))
        with pytest.raises(UnknownCorridorError):
            it.site.traffic.open_door(DoorId("nowhere"))
        with pytest.raises(UnknownCorridorError):
            it.site.traffic.close_door(DoorId("nowhere"))
