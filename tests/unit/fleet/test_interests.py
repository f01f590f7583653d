"""Who minds what: what plans and goals hang on, what is lost, and for who replans everything."""

from clo_fleet.clo.executive import Executive
from clo_fleet.clo.messages import Flip, Observed
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.interests import Interests
from clo_fleet.robot.robot import Robot
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import Pose, RobotId, RobotSpec, RoomId
from clo_fleet.world.vocabulary import Names, Vocabulary

A, B = RobotId("a"), RobotId("b")
WORDS = Vocabulary(fleet_binding(), Names(robots=(A, B), objects=("cup", "pot"), rooms=("east", "west")))
LIES = (("at-object", "cup", "west"), ("at-object", "pot", "west"))


def robot(name: RobotId, goal: Fact, strategy: str = "clo") -> Robot:
    """A robot that wants one thing and knows where two objects lie."""
    spec = RobotSpec(id=name, room=RoomId("west"), pose=Pose(0.0, 0.0), goals=(goal,))
    return Robot(spec, Executive(STRATEGIES[strategy], LIES, goals_of([goal])), seed=0)


def test_a_robot_minds_what_its_goals_are_about() -> None:
    """And nothing else; a fact about somebody's hands concerns that one too."""
    robots = {A: robot(A, ("prepared", "cup")), B: robot(B, ("prepared", "pot"))}
    interests = Interests(robots, WORDS)
    assert interests.minders([("at-object", "cup", "east")]) == [A]
    assert interests.minders([("holding", "b", "cup")]) == [A, B]
    assert interests.minders([]) == []
    assert interests.minded(B, [("prepared", "cup"), ("prepared", "pot")]) == {("prepared", "pot")}


def test_who_replans_minds_everything() -> None:
    """Its watch set leaves nothing out."""
    robots = {A: robot(A, ("prepared", "cup"), "replan"), B: robot(B, ("prepared", "pot"))}
    interests = Interests(robots, WORDS)
    assert interests.minders([("at-object", "pot", "east")]) == [A, B]
    assert interests.minded(A, LIES) == set(LIES)


def test_what_is_lost_is_minded_until_it_is_found() -> None:
    """A robot that does not know where an object is wants to hear of it."""
    robots = {A: robot(A, ("prepared", "cup")), B: robot(B, ("prepared", "pot"))}
    interests = Interests(robots, WORDS)
    assert interests.minders([LIES[0]]) == [A]
    for known, minders in ((False, [A, B]), (True, [A])):
        robots[B].executive.handle(Observed(1.0, (Flip(LIES[0], known),)))
        interests.renew(B)
        assert interests.minders([LIES[0]]) == minders
