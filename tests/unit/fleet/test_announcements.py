"""What follows from announced plans: promises, and places to meet."""

import math

from clo_fleet.clo.plan import goals_of, number
from clo_fleet.clo.task import Action, Condition, Fact
from clo_fleet.fleet.announcements import Announcement, Meeting, meeting_places, promises
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import ObjectId, RobotId
from clo_fleet.world.vocabulary import Names, Vocabulary

WORDS = Vocabulary(fleet_binding(), Names(robots=("r1",), objects=("o1", "o2", "o9"), rooms=("l1", "l2", "l3")))


def action(schema: str, *args: str, needs: list[Fact], adds: list[Fact], deletes: list[Fact], cost: int = 10) -> Action:
    """An action of r1."""
    conditions = tuple(map(Condition, needs))
    return Action(
        schema=schema, args=args, needs=conditions, adds=frozenset(adds), deletes=frozenset(deletes), cost=cost
    )


def at(place: str) -> Fact:
    """Where r1 is."""
    return ("at-robot", "r1", place)


def move(start: str, goal: str) -> Action:
    """r1 goes."""
    return action("move", "r1", start, goal, needs=[at(start)], adds=[at(goal)], deletes=[at(start)])


def grasp(item: str, place: str) -> Action:
    """r1 takes a thing."""
    lies, held = ("at-object", item, place), ("holding", "r1", item)
    return action("grasp", "r1", item, place, needs=[lies, at(place)], adds=[held], deletes=[lies])


def place_down(item: str, place: str) -> Action:
    """r1 puts a thing down."""
    lies, held = ("at-object", item, place), ("holding", "r1", item)
    return action("place", "r1", item, place, needs=[held, at(place)], adds=[lies], deletes=[held])


def announced(*plan: Action, moving: bool = False, in_hand: tuple[str, ...] = ()) -> Announcement:
    """r1 in l3, wanting both things, with this plan."""
    return Announcement(
        robot=RobotId("r1"),
        place="l3",
        plan=number(plan),
        moving=moving,
        goals=goals_of([("holding", "r1", "o1"), ("holding", "r1", "o2")]),
        beliefs=frozenset({at("l3"), ("at-object", "o1", "l1"), ("at-object", "o2", "l2")}),
        in_hand=tuple(map(ObjectId, in_hand)),
    )


FETCH = (move("l3", "l1"), grasp("o1", "l1"), move("l1", "l2"), grasp("o2", "l2"))


def test_only_what_is_in_hand_is_promised() -> None:
    """A plan to take and bring promises nothing before the thing is taken."""
    plan = (move("l3", "l1"), place_down("o9", "l1"))
    assert promises([announced(*plan, in_hand=("o9",))]) == {("at-object", "o9", "l1")}
    assert promises([announced(*plan)]) == set()


def test_robot_is_not_met_where_it_would_only_fetch_the_gift() -> None:
    """Given o2, r1 goes to l1 and stays; l3, which it is about to leave, is no place to meet."""
    assert meeting_places(announced(*FETCH), [ObjectId("o2")], WORDS) == (Meeting("l1", math.inf),)


def test_places_on_the_way_are_left_when_the_work_there_is_done() -> None:
    """Without use for the gift, every place of the plan counts, each until the robot leaves it."""
    assert meeting_places(announced(*FETCH), [ObjectId("o9")], WORDS) == (Meeting("l1", 20), Meeting("l2", math.inf))


def test_robot_with_work_where_it_is_can_be_met_there() -> None:
    """An idle robot stays where it is; a moving one has left."""
    assert meeting_places(announced(), [], WORDS) == (Meeting("l3", math.inf),)
    assert meeting_places(announced(moving=True), [], WORDS) == ()
