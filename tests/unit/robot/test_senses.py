"""What a robot looks at, what it sees, and what that makes it believe."""

import json
from collections.abc import Mapping

import pytest

from clo_fleet.clo.strategies import Everything, Watch
from clo_fleet.clo.task import Fact
from clo_fleet.robot.senses import Senses, consequences, heeded
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world.model import (
    BuildingMap,
    ObjectId,
    ObjectSpec,
    Perception,
    PerceptionMode,
    Point,
    Pose,
    RobotId,
    RobotSpec,
    Room,
    RoomId,
    World,
)
from clo_fleet.world.vocabulary import vocabulary

HALL, STORE = RoomId("hall"), RoomId("store")
PILLAR = ((4.0, 1.0), (5.0, 1.0), (5.0, 5.0), (4.0, 5.0))
BUILDING = BuildingMap(
    name="two rooms",
    rooms=(
        Room(HALL, ((0, 0), (10, 0), (10, 6), (0, 6)), (PILLAR,)),
        Room(STORE, ((20, 0), (30, 0), (30, 6), (20, 6))),
    ),
    doors=(),
)
R1, R2 = RobotId("r1"), RobotId("r2")
FULL, SIGHT, WATCH = PerceptionMode.FULL, PerceptionMode.SIGHT, PerceptionMode.WATCH
CUP_HERE, CUP_THERE = ("at-object", "cup", "hall"), ("at-object", "cup", "store")


class Scene:
    """Robot r1 at a point of the hall, perhaps r2 with objects in hand, and things that lie about."""

    def __init__(
        self, at: Point, perception: Perception, *, things: Mapping[str, Point], r2: Point | None = None, held: str = ""
    ) -> None:
        self.specs = [RobotSpec(id=R1, room=HALL, pose=Pose(*at), goals=())]
        self.specs += [RobotSpec(id=R2, room=HALL, pose=Pose(*r2), goals=())] if r2 else []
        rooms = {name: HALL if x < 15 else STORE for name, (x, _) in things.items()}
        self.things = [ObjectSpec(id=ObjectId(n), room=rooms[n], position=p) for n, p in things.items()]
        world = World(name="hall", map=BUILDING, robots=tuple(self.specs), objects=tuple(self.things))
        words = vocabulary(world)
        self.site = Site(BUILDING, self.specs, self.things, seed=0, tick=0.2)
        if held:
            self.site.rooms.grasp(R2, ObjectId(held))
        self.truth = Truth(self.site, words)
        self.senses = Senses(self.site, self.truth, perception)

    def see(self, beliefs: frozenset[Fact] = frozenset(), watch: Watch | None = None, time: float = 0.0) -> set[Fact]:
        """The facts that r1 sees to be true."""
        seen = self.senses.sight(R1, beliefs, Everything() if watch is None else watch, time)
        return {fact for fact, value in seen.items() if value}

    def move(self, to: Point) -> None:
        """Put r1 somewhere else."""
        self.site.rooms.remove_robot(R1)
        self.site.rooms.add_robot(R1, Pose(*to))


def test_an_obstacle_hides_what_lies_behind_it() -> None:
    """The cup behind the pillar is not seen, the one before it is; another robot hides nothing."""
    scene = Scene((1, 3), Perception(), things={"cup": (8, 3), "mug": (3, 3)}, r2=(2, 3))
    assert ("at-object", "mug", "hall") in scene.see()
    assert CUP_HERE not in scene.see()


def test_what_another_robot_carries_is_seen_where_the_robot_is() -> None:
    """In view its load is known; behind the pillar, or out of range, it is not."""
    for at, reach, visible in (((3, 5.5), 20.0, True), ((8, 3), 20.0, False), ((3, 5.5), 2.0, False)):
        scene = Scene((1, 3), Perception(range=reach), things={"cup": (8, 5)}, r2=at, held="cup")
        assert (("holding", "r2", "cup") in scene.see()) is visible


def test_another_room_is_out_of_sight_unless_perception_is_full() -> None:
    """With full perception the robot knows what lies anywhere, and what is gone."""
    for mode, visible in ((SIGHT, False), (FULL, True)):
        scene = Scene((1, 3), Perception(mode), things={"cup": (25, 3)})
        assert (CUP_THERE in scene.see()) is visible
        gone = scene.senses.sight(R1, frozenset({CUP_HERE}), Everything(), 1.0)
        assert gone.get(CUP_HERE) is (False if mode is FULL else None)


def test_an_object_is_not_there_once_all_of_the_room_has_been_seen() -> None:
    """From one side of the pillar alone its absence is not known; after a look from the other side it is."""
    scene = Scene((1, 3), Perception(), things={"cup": (25, 3)})
    believed = frozenset({CUP_HERE})
    everything = Everything()
    assert CUP_HERE not in scene.senses.sight(R1, believed, everything, 0.0)
    scene.move((9, 3))
    assert scene.senses.sight(R1, believed, everything, 0.2)[CUP_HERE] is False


def test_a_search_is_remembered_over_a_save() -> None:
    """Senses restored from plain data know what has been searched and counted, and until when they look."""
    scene = Scene((1, 3), Perception(look=0.1), things={"cup": (25, 3), "mug": (2, 2)})
    believed = frozenset({CUP_HERE})
    scene.senses.sight(R1, believed, Everything(), 0.0)
    other = Senses(scene.site, scene.truth, Perception(look=0.1))
    other.restore(json.loads(json.dumps(scene.senses.state())))
    scene.move((9, 3))
    for time in (0.1, 0.2, 0.4, 0.6):
        seen = scene.senses.sight(R1, believed, Everything(), time)
        assert other.sight(R1, believed, Everything(), time) == seen
        assert (seen.get(CUP_HERE) is False) is (time >= 0.2)
    assert other.state() == scene.senses.state()


def test_with_its_watch_set_only_a_robot_looks_at_little() -> None:
    """It looks at what it watches, and for what it lost, and each fact counts."""
    things = {"cup": (2, 2), "mug": (2, 4), "book": (3, 5), "pen": (1, 5)}
    beliefs = frozenset(("at-object", name, "hall") for name in things if name != "pen")
    watch = frozenset({CUP_HERE, ("prepared", "mug")})
    scene = Scene((1, 3), Perception(WATCH), things=things)
    assert scene.see(beliefs, watch) == {("at-robot", "r1", "hall"), CUP_HERE, ("at-object", "pen", "hall")}
    assert scene.senses.looked == {"r1": 3}
    scene = Scene((1, 3), Perception(SIGHT), things=things)
    assert {("at-object", name, "hall") for name in things} < scene.see(beliefs, watch)
    assert scene.senses.looked == {"r1": 8}


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("watched", [CUP_HERE, CUP_THERE, ("prepared", "cup"), ("holding", "r2", "cup")])
@pytest.mark.parametrize("held", ["", "cup"])
def test_looking_at_less_does_not_mean_knowing_less(watched: Fact, held: str, lost: bool) -> None:
    """Whatever is watched, believed and true: both modes end in the same beliefs."""
    beliefs = frozenset({("at-object", "mug", "store")} | (set() if lost else {CUP_THERE, ("holding", "r1", "mug")}))
    watch = frozenset({watched})
    learnt = []
    for mode in (SIGHT, WATCH):
        scene = Scene((1, 3), Perception(mode), things={"cup": (2, 2), "mug": (2, 4)}, r2=(3, 3), held=held)
        words = scene.truth.words
        seen = scene.senses.sight(R1, beliefs, watch, 0.0)
        learnt.append(heeded(consequences(seen, beliefs, words), beliefs, watch, R1, words))
    assert learnt[0] == learnt[1]


def test_looking_takes_time_where_the_world_says_so() -> None:
    """Who looks at three objects looks again after six facts' time; its own hands it knows meanwhile."""
    scene = Scene((1, 3), Perception(look=0.5), things={"cup": (2, 2), "mug": (2, 4), "pen": (3, 3)})
    assert len(scene.see(time=0.0)) == 4
    scene.site.rooms.move_item(ObjectId("cup"), (8, 3))
    for time in (0.2, 2.8):
        assert scene.see(time=time) == {("at-robot", "r1", "hall")}
    assert CUP_HERE not in scene.see(time=3.0)
    assert scene.senses.looked == {"r1": 10}
