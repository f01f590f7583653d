"""What is left out of a question cannot matter: the answer exists just as well, at no greater cost."""

from itertools import pairwise

import pytest

from clo_fleet.clo.task import Fact
from clo_fleet.planning.problem import PlanningTask, Scene
from clo_fleet.planning.relevance import Travels, narrow_task
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import SkillSettings
from clo_fleet.world.vocabulary import Names, Vocabulary

ROOMS = ("a", "b", "c", "d", "e")
LINE = dict.fromkeys([*pairwise(ROOMS), *pairwise(ROOMS[::-1])], 10)
WORDS = Vocabulary(
    fleet_binding(), Names(robots=("r1", "r2", "r3"), objects=("cup", "pot"), rooms=ROOMS, zones=("zone-1",))
)
SCENE = Scene(words=WORDS, travel=LINE | {("zone-1", "d"): 5}, skills=SkillSettings())
BELIEFS = frozenset(
    {
        ("at-robot", "r1", "b"),
        ("at-robot", "r2", "a"),
        ("at-object", "cup", "d"),
        ("at-object", "pot", "a"),
        ("prepared", "pot"),
        ("meets", "r2", "e"),
    }
)


def narrow(*goals: Fact, beliefs: frozenset[Fact] = BELIEFS) -> PlanningTask:
    """The question of r1."""
    return narrow_task("r1", SCENE, Travels(SCENE.travel), beliefs, goals)


def names(task: PlanningTask) -> dict[str, tuple[str, ...]]:
    """What there is, by type."""
    return dict(task.objects)


def test_only_what_the_goal_hangs_on_stays() -> None:
    """The object, where it lies, where the robot is, and the rooms on the way."""
    task = narrow(("prepared", "cup"))
    assert names(task) == {"robot": ("r1",), "item": ("cup",), "place": ("b", "c", "d")}
    assert ("connected", "b", "c") in task.facts
    assert ("at-object", "cup", "d") in task.facts
    assert all({"pot", "r2", "a", "e"}.isdisjoint(fact) for fact in task.facts)
    assert {term[1:] for term, _ in task.costs if term[0] == "travel-time"} == {
        ("b", "c"), ("c", "b"), ("c", "d"), ("d", "c"),
    }  # fmt: skip


def test_a_gift_lets_its_taker_in_and_where_it_can_be_met() -> None:
    """Nobody else."""
    task = narrow(("holding", "r2", "pot"))
    assert names(task) == {"robot": ("r1", "r2"), "item": ("pot",), "place": ROOMS}
    assert ("meets", "r2", "e") in task.facts


def test_a_zone_stays_only_as_the_place_to_start_from() -> None:
    """With the rooms behind it that lie on the way."""
    inside = BELIEFS - {("at-robot", "r1", "b")} | {("at-robot", "r1", "zone-1")}
    assert names(narrow(("at-robot", "r1", "e"), beliefs=inside))["place"] == ("d", "e", "zone-1")
    assert names(narrow(("at-robot", "r1", "c")))["place"] == ("b", "c")


def test_what_somebody_else_holds_is_known_to_be_out_of_reach() -> None:
    """The question says of the object no more than that it lies nowhere."""
    held = BELIEFS - {("at-object", "cup", "d")} | {("holding", "r3", "cup")}
    task = narrow(("holding", "r1", "cup"), beliefs=held)
    assert names(task)["item"] == ("cup",)
    assert not any("cup" in fact for fact in task.facts)


@pytest.mark.parametrize(("start", "end", "way", "cost"), [("a", "d", ("a", "b", "c", "d"), 30), ("c", "c", ("c",), 0)])
def test_ways_are_shortest(start: str, end: str, way: tuple[str, ...], cost: float) -> None:
    """Over as many rooms as it takes."""
    travels = Travels(LINE)
    assert travels.way(start, end) == way
    assert travels.cost(start, end) == cost


def test_there_may_be_no_way() -> None:
    """Not into a zone, and not to where nobody has been."""
    travels = Travels(SCENE.travel)
    assert travels.way("a", "zone-1") == ()
    assert travels.cost("a", "nowhere") == float("inf")


def test_a_direct_way_is_preferred_to_an_equally_short_one() -> None:
    """So that rooms in between need not be let in."""
    assert Travels({("a", "b"): 1, ("b", "c"): 1, ("a", "c"): 2}).way("a", "c") == ("a", "c")
