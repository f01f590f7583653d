"""The symbolic world: what an action does, whom the robot meets, and that chance is the same for every strategy."""

import pytest

from clo_fleet.clo.task import Action
from clo_fleet.paper.catalogue import SETTINGS
from clo_fleet.paper.symbolic import NEWCOMERS, SymbolicWorld


def rooms(probability: float = 0.0, seed: int = 0) -> SymbolicWorld:
    """ROOMS with five objects."""
    setting = SETTINGS["rooms"]
    return SymbolicWorld(setting=setting, task=setting.task(5), probability=probability, seed=seed)


def act(schema: str, *args: str) -> Action:
    """An action of ROOMS."""
    return SETTINGS["rooms"].domain().ground(schema, args, {})


def test_an_action_that_can_be_done_changes_the_truth() -> None:
    """Its effects come true, and with it the robot perceives five new objects, in its room."""
    world = rooms()
    happened = world.execute(act("move", "l1", "l2"))
    assert happened.missing == ()
    assert ("at-robot", "l2") in world.facts
    assert ("at-robot", "l1") not in world.facts
    assert [flip.fact for flip in happened.flips] == [("at-object", f"x{i}", "l2") for i in range(1, NEWCOMERS + 1)]


def test_an_action_that_cannot_be_done_changes_nothing_but_takes_its_time() -> None:
    """What it lacked is told; others may act meanwhile."""
    world = rooms()
    happened = world.execute(act("grasp", "o1", "l1"))
    assert [str(need) for need in happened.missing] == ["(prepared o1)"]
    assert ("holding", "o1") not in world.facts
    assert world.tried == 1


@pytest.mark.parametrize(("probability", "helped"), [(0.0, 0), (1.0, 3)])
def test_probability_is_that_of_an_opportunity_after_each_action(probability: float, helped: int) -> None:
    """None at 0, one after each action at 1."""
    world = rooms(probability)
    for goal in ("l2", "l3", "l4"):
        here = next(fact[1] for fact in world.facts if fact[0] == "at-robot")
        world.execute(act("move", here, goal))
    assert world.helped == helped


def test_the_same_seed_gives_the_same_help_after_the_same_number_of_actions() -> None:
    """It does not matter which actions they were."""
    ways = [(3, ("l2", "l3", "l4")), (3, ("l5", "l1", "l5")), (4, ("l2", "l3", "l4"))]
    found = []
    for seed, rooms_ in ways:
        world, here, helped = rooms(1.0, seed), "l1", []
        for room in rooms_:
            flips = world.execute(act("move", here, room)).flips
            helped.append([flip for flip in flips if not flip.fact[1].startswith("x")])
            here = room
        found.append(helped)
    assert found[0] == found[1] != found[2]


def test_a_greater_probability_adds_opportunities_and_moves_none() -> None:
    """Where one appears at 0.1, one appears at 0.5."""
    times: dict[float, set[int]] = {}
    for probability in (0.1, 0.5):
        times[probability] = set()
        for seed in range(60):
            world = rooms(probability, seed)
            world.execute(act("move", "l1", "l2"))
            if world.helped:
                times[probability].add(seed)
    assert set() < times[0.1] < times[0.5]


def test_newcomers_enter_the_problem_of_those_who_have_seen_them() -> None:
    """A robot that believes nothing about them plans without them."""
    world = rooms()
    world.execute(act("move", "l1", "l2"))
    known = frozenset({("at-robot", "l2"), ("at-object", "x1", "l2"), ("at-object", "x3", "l2")})
    items = dict(world.question(known).objects)["item"]
    assert items == ("o1", "o2", "o3", "o4", "o5", "x1", "x3")
    assert dict(world.question(world.task.facts).objects)["item"] == items[:5]
