"""Deletion: needless steps, loops and impossible steps, near what changed and everywhere, with their reasons."""

import sys
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import pytest

from clo_fleet.clo.deletion import Deleted, DropReason, delete
from clo_fleet.clo.links import End, Unsupported
from clo_fleet.clo.plan import Plan, first_fault, goals_of, number
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Action, Condition, Fact

HUB = ("at-robot", "hub")


def act(name: str, *, needs: str = "", lacks: str = "", adds: str = "", deletes: str = "") -> Action:
    """The action ``name``; each effect and condition is one fact without objects, split by blanks."""
    return Action(
        schema=name,
        args=(),
        needs=(
            *(Condition((fact,)) for fact in needs.split()),
            *(Condition((fact,), positive=False) for fact in lacks.split()),
        ),
        adds=frozenset((fact,) for fact in adds.split()),
        deletes=frozenset((fact,) for fact in deletes.split()),
    )


def move(start: str, end: str) -> Action:
    """Go from room to room, if the other is not shut."""
    here, there = ("at-robot", start), ("at-robot", end)
    return Action(
        schema="move",
        args=(start, end),
        needs=(Condition(here), Condition(("shut", end), positive=False)),
        adds=frozenset({there}),
        deletes=frozenset({here}),
    )


def prepare(item: str, room: str) -> Action:
    """Make the object ready to be grasped."""
    needs = goals_of([("at-object", item, room), ("at-robot", room)])
    return Action(
        schema="prepare", args=(item, room), needs=needs, adds=frozenset({("prepared", item)}), deletes=frozenset()
    )


def grasp(item: str, room: str) -> Action:
    """Take the prepared object."""
    lies = ("at-object", item, room)
    needs = goals_of([lies, ("at-robot", room), ("prepared", item)])
    return Action(
        schema="grasp",
        args=(item, room),
        needs=needs,
        adds=frozenset({("holding", item)}),
        deletes=frozenset({lies}),
    )


def star(rooms: int) -> Supports:
    """One object in each room round a hub, all to be fetched."""
    actions: list[Action] = []
    for i in range(rooms):
        room, item = f"l{i}", f"o{i}"
        actions += [move("hub", room), prepare(item, room), grasp(item, room), move(room, "hub")]
    state = {HUB, *(("at-object", f"o{i}", f"l{i}") for i in range(rooms))}
    return Supports(state, number(actions[:-1]), goals_of(("holding", f"o{i}") for i in range(rooms)))


def given(*items: int) -> dict[Fact, bool | None]:
    """Objects of the star that another robot handed over."""
    changed: dict[Fact, bool | None] = {("holding", f"o{i}"): True for i in items}
    return changed | {("at-object", f"o{i}", f"l{i}"): False for i in items}


def names(plan: Plan) -> list[str]:
    """The plan as one writes it."""
    return list(map(str, plan))


def reasons(found: Deleted) -> list[tuple[str, DropReason, tuple[Fact, ...]]]:
    """The dropped steps as one writes them, with why and because of what."""
    return [(str(drop.step), drop.reason, drop.because) for drop in found.drops]


# ---- needless steps ----------------------------------------------------------------------------------------


def test_steps_that_served_what_came_true_name_it() -> None:
    """The paper's example: the object is handed over, and the way to it is not needed."""
    plan = number([move("hub", "l1"), prepare("o", "l1"), grasp("o", "l1")])
    supports = Supports({HUB, ("at-object", "o", "l1")}, plan, goals_of([("holding", "o")]))
    news = ("holding", "o")
    assert reasons(delete(supports, {news: True})) == [
        ("move(hub, l1)", DropReason.NEEDLESS, (news,)),
        ("prepare(o, l1)", DropReason.NEEDLESS, (news,)),
        ("grasp(o, l1)", DropReason.NEEDLESS, (news,)),
    ]
    assert supports.plan == ()


def test_each_dropped_step_names_the_news_nearest_to_the_goal() -> None:
    """Two gifts at once are told apart; a step that served both names both."""
    plan = number([move("hub", "l1"), prepare("o1", "l1"), grasp("o1", "l1"), prepare("o2", "l1"), grasp("o2", "l1")])
    state = {HUB, ("at-object", "o1", "l1"), ("at-object", "o2", "l1")}
    supports = Supports(state, plan, goals_of([("holding", "o1"), ("holding", "o2")]))
    one, two = ("holding", "o1"), ("holding", "o2")
    changed: dict[Fact, bool | None] = dict.fromkeys([("prepared", "o1"), one, ("prepared", "o2"), two], True)
    assert [drop.because for drop in delete(supports, changed).drops] == [(one, two), (one,), (one,), (two,), (two,)]


def test_superfluous_step_names_no_news() -> None:
    """It goes at the same time, but was not needed before."""
    plan = number([act("wave", adds="waved"), act("make", adds="f")])
    supports = Supports(frozenset(), plan, goals_of([("f",)]))
    assert [drop.because for drop in delete(supports, {("f",): True}).drops] == [(), (("f",),)]
    assert not supports.plan


def test_news_that_replaced_nothing_is_not_named() -> None:
    """Only what a link was on, or what made its consumer needless."""
    plan = number([act("make", adds="f"), act("use", needs="f", adds="g")])
    supports = Supports(frozenset(), plan, goals_of([("g",)]))
    found = delete(supports, {("g",): True, ("lit",): True, ("f",): True})
    assert [drop.because for drop in found.drops] == [(("g",),), (("g",),)]


def test_step_whose_work_another_does_again_names_all_news() -> None:
    """The one who undid it is gone, so that what was there before is enough; no link says so."""
    plan = number(
        [
            act("make", adds="f"),
            act("check", needs="f", adds="checked"),
            act("undo", adds="x", deletes="f"),
            act("make-again", adds="f"),
            act("use", needs="f", adds="g"),
        ]
    )
    supports = Supports(frozenset(), plan, goals_of([("g",), ("x",), ("checked",)]))
    assert {str(drop.step): drop.because for drop in delete(supports, {("x",): True, ("y",): True}).drops} == {
        "undo()": (("x",),),
        "make-again()": (("x",),),
    }


def test_maker_after_a_threat_names_its_fact_as_well() -> None:
    """It holds by itself, once the threat goes too."""
    plan = number(
        [
            act("paint", adds="painted", deletes="clean"),
            act("wash", adds="clean"),
            act("show", needs="clean painted", adds="shown"),
        ]
    )
    supports = Supports(frozenset(), plan, goals_of([("shown",)]))
    news: dict[Fact, bool | None] = {("painted",): True, ("clean",): True}
    assert {str(drop.step): drop.because for drop in delete(supports, news).drops} == {
        "paint()": (("painted",),),
        "wash()": (("clean",),),
    }


def test_nothing_goes_when_nothing_replaces_it() -> None:
    """News that the plan makes anew, or does not need."""
    supports = star(3)
    plan = supports.plan
    assert delete(supports, {("lit",): True, HUB: True, ("warm",): None}) == Deleted((), ())
    assert supports.plan == plan


# ---- loops -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("items", [range(5), range(5, 10), range(0, 10, 2), range(1, 10, 2)])
def test_star_of_ten_rooms_comes_to_nineteen_steps(items: range) -> None:
    """From 39, with half of the objects handed over, at once or one after the other."""
    at_once, one_by_one = star(10), star(10)
    delete(at_once, given(*items))
    for i in items:
        delete(one_by_one, given(i))
    assert len(at_once.plan) == 19
    assert at_once.plan == one_by_one.plan
    assert first_fault(at_once.state, at_once.plan, at_once.goals) is None


def test_round_trip_goes_with_what_it_was_for() -> None:
    """Its moves support each other; they are a loop, for the same news."""
    supports = star(2)
    news = (("holding", "o0"),)
    assert reasons(delete(supports, given(0))) == [
        ("move(hub, l0)", DropReason.LOOP, news),
        ("prepare(o0, l0)", DropReason.NEEDLESS, news),
        ("grasp(o0, l0)", DropReason.NEEDLESS, news),
        ("move(l0, hub)", DropReason.LOOP, news),
    ]


def test_round_trip_through_other_rooms_goes_whole() -> None:
    """It begins before the room that has lost its use."""
    plan = number(
        [move("hub", "a"), move("a", "b"), grasp("o", "b"), move("b", "c"), move("c", "hub"), move("hub", "d")]
    )
    state = {HUB, ("at-object", "o", "b"), ("prepared", "o")}
    supports = Supports(state, plan, goals_of([("holding", "o"), ("at-robot", "d")]))
    delete(supports, {("holding", "o"): True})
    assert names(supports.plan) == ["move(hub, d)"]


def test_way_into_a_dead_end_goes_both_ways() -> None:
    """Room by room."""
    plan = number(
        [move("hub", "a"), move("a", "b"), grasp("o", "b"), move("b", "a"), move("a", "hub"), move("hub", "d")]
    )
    state = {HUB, ("at-object", "o", "b"), ("prepared", "o")}
    supports = Supports(state, plan, goals_of([("holding", "o"), ("at-robot", "d")]))
    delete(supports, {("holding", "o"): True})
    assert names(supports.plan) == ["move(hub, d)"]


def test_step_that_ends_what_turned_true_goes_with_what_restores_it() -> None:
    """Nothing lost a use: the fact was false, was ended once more, and made later."""
    plan = number(
        [
            act("end", adds="x", deletes="f"),
            act("make", needs="x", adds="f", deletes="x"),
            act("use", needs="f", adds="g"),
        ]
    )
    supports = Supports(frozenset(), plan, goals_of([("g",)]))
    found = delete(supports, {("f",): True})
    assert names(supports.plan) == ["use()"]
    assert [drop.reason for drop in found.drops] == [DropReason.LOOP, DropReason.LOOP]


def test_loop_in_a_negative_condition_goes_too() -> None:
    """Shut the door, paint it, open it again: painted by somebody else, it may stay open."""
    plan = number(
        [
            act("close", adds="shut"),
            act("paint", needs="shut", adds="painted"),
            act("open", needs="shut", deletes="shut"),
            act("pass", lacks="shut", adds="through"),
        ]
    )
    supports = Supports(frozenset(), plan, goals_of([("through",), ("painted",)]))
    found = delete(supports, {("painted",): True})
    assert names(supports.plan) == ["pass()"]
    assert [drop.reason for drop in found.drops] == [DropReason.LOOP, DropReason.NEEDLESS, DropReason.LOOP]


def test_loop_in_a_fact_that_was_unknown_is_kept() -> None:
    """Without the step that makes it known, its reader would have nothing."""
    plan = number([act("make", adds="f x"), act("use", needs="f", adds="g"), act("other", needs="x", adds="h")])
    supports = Supports(frozenset(), plan, goals_of([("g",), ("h",)]), unknown=frozenset({("f",)}))
    assert delete(supports, {("h",): True}).gaps == ()
    assert names(supports.plan) == ["make()", "use()"]


def test_detour_of_a_new_plan_is_found_by_looking_everywhere() -> None:
    """Nothing has changed that would lead to it."""
    plan = number([move("hub", "a"), move("a", "b"), move("b", "hub"), move("hub", "d")])
    near, everywhere = (Supports({HUB}, plan, goals_of([("at-robot", "d")])) for _ in range(2))
    assert delete(near, {}).drops == ()
    found = delete(everywhere, {}, everywhere=True)
    assert names(everywhere.plan) == ["move(hub, d)"]
    assert {(drop.reason, drop.because) for drop in found.drops} == {(DropReason.LOOP, ())}


def test_everywhere_is_searched_again_after_something_went() -> None:
    """One loop may hide another, and a suspect that stays hides none."""
    plan = number(
        [
            act("close", needs="a", deletes="a b"),
            act("open", needs="d", adds="a e", deletes="b c"),
            act("look", lacks="c", adds="e", deletes="d"),
        ]
    )
    goals = (Condition(("a",)), Condition(("b",), positive=False))
    supports = Supports({("a",), ("b",), ("c",), ("d",)}, plan, goals)
    delete(supports, {}, everywhere=True)
    assert names(supports.plan) == ["open()"]


def test_trial_that_takes_too_long_is_given_up() -> None:
    """The loop stays, and the plan is valid with it."""
    rooms = [f"r{i}" for i in range(20)]
    way = [move(start, end) for start, end in zip(["hub", *rooms], [*rooms, "hub"], strict=True)]
    for operations, left in ((20, 22), (21, 1)):
        supports = Supports({HUB}, number([*way, move("hub", "d")]), goals_of([("at-robot", "d")]))
        delete(supports, {}, everywhere=True, operations=operations)
        assert len(supports.plan) == left


# ---- steps that cannot be done any more --------------------------------------------------------------------


def test_impossible_round_trip_that_is_not_needed_is_skipped() -> None:
    """The door is shut, but what lay behind it is here."""
    plan = number([move("hub", "l1"), grasp("o1", "l1"), move("l1", "hub"), act("pack", needs="here", adds="packed")])
    state = {HUB, ("at-object", "o1", "l1"), ("prepared", "o1"), ("here",)}
    goals = goals_of([("packed",), ("holding", "o1")])
    supports = Supports(state, plan, goals)
    found = delete(supports, {("holding", "o1"): True, ("shut", "l1"): True})
    assert names(supports.plan) == ["pack()"]
    assert found.gaps == ()
    assert {drop.reason for drop in found.drops} == {DropReason.NEEDLESS}


def test_impossible_step_takes_with_it_what_it_was_to_make_possible() -> None:
    """If no goal is lost by that."""
    plan = number(
        [act("charge", needs="socket", adds="full"), act("shine", needs="full", adds="light"), act("go", adds="g")]
    )
    supports = Supports({("socket",)}, plan, (*goals_of([("g",)]), Condition(("light",), positive=True)))
    found = delete(supports, {("socket",): False, ("light",): True, ("full",): False})
    assert names(supports.plan) == ["go()"]
    assert found.gaps == ()


def test_impossible_loop_is_skipped() -> None:
    """There and back through a door that was shut: who stays loses nothing."""
    plan = number([move("hub", "l1"), move("l1", "hub"), move("hub", "d")])
    supports = Supports({HUB}, plan, goals_of([("at-robot", "d")]))
    found = delete(supports, {("shut", "l1"): True})
    assert names(supports.plan) == ["move(hub, d)"]
    assert reasons(found) == [
        ("move(hub, l1)", DropReason.IMPOSSIBLE, (("shut", "l1"),)),
        ("move(l1, hub)", DropReason.IMPOSSIBLE, (("shut", "l1"),)),
    ]


def test_impossible_step_does_not_make_a_possible_one_look_needless() -> None:
    """The object was moved to where the robot would have prepared it a second time."""
    plan = number([prepare("o1", "l1"), move("l1", "l2"), prepare("o1", "l2"), grasp("o1", "l2")])
    supports = Supports({("at-robot", "l1"), ("at-object", "o1", "l1")}, plan, goals_of([("holding", "o1")]))
    found = delete(supports, {("at-object", "o1", "l1"): False, ("at-object", "o1", "l2"): True})
    assert names(supports.plan) == ["move(l1, l2)", "prepare(o1, l2)", "grasp(o1, l2)"]
    assert [(str(drop.step), drop.reason) for drop in found.drops] == [("prepare(o1, l1)", DropReason.IMPOSSIBLE)]


def test_step_that_is_possible_without_an_impossible_one_stays() -> None:
    """What cannot be done cannot do harm either."""
    plan = number(
        [act("spoil", needs="x", adds="y", deletes="f"), act("use", needs="f", adds="g"), act("late", needs="y")]
    )
    supports = Supports({("f",)}, plan, goals_of([("g",)]))
    assert supports.lacking() == [0, 1]
    found = delete(supports, {})
    assert names(supports.plan) == ["use()"]
    assert found.gaps == ()


def test_what_a_needed_step_lacks_is_named() -> None:
    """Also what a goal lacks; what can go goes nevertheless."""
    plan = number([act("wave", adds="waved"), act("take", needs="there", adds="taken")])
    supports = Supports({("there",)}, plan, goals_of([("taken",), ("sun",)]))
    found = delete(supports, {("there",): False})
    assert found.gaps == (Unsupported(Condition(("there",)), 1), Unsupported(Condition(("sun",)), End.GOAL))
    assert names(supports.plan) == ["take()"]


def test_goal_that_only_an_impossible_step_keeps_from_holding_comes_true_without_it() -> None:
    """It was going to be ended, and now is not."""
    plan = number([act("end", needs="x", deletes="f"), act("make", adds="g")])
    supports = Supports({("f",)}, plan, goals_of([("f",), ("g",)]))
    assert delete(supports, {}).gaps == ()
    assert names(supports.plan) == ["make()"]


# ---- cost --------------------------------------------------------------------------------------------------


def calls(function: Callable[[], object]) -> int:
    """How many functions of ours, and of Python's, are called."""
    count = 0

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        function()
    finally:
        sys.setprofile(before)
    return count


def test_cost_of_a_repair_does_not_grow_with_the_plan() -> None:
    """It does the same in a plan a hundred times as long."""
    short, long = star(8), star(800)
    assert calls(lambda: delete(short, given(4))) == calls(lambda: delete(long, given(4)))


def test_suspect_on_a_long_way_costs_no_more_than_its_operations() -> None:
    """All steps behind it fail without it, and all steps before it, which serve it alone, could be tried in turn."""
    costs = []
    for half in (500, 2_000):
        rooms = ["hub", *(f"r{i}" for i in range(2 * half))]
        way = [move(start, end) for start, end in pairwise(rooms)]
        look = Action(
            schema="look", args=(), needs=(Condition(("at-robot", rooms[half])),), adds=frozenset({("seen",)}),
            deletes=frozenset(),
        )  # fmt: skip
        plan = number([*way[:half], look, *way[half:]])
        supports = Supports({HUB}, plan, goals_of([("seen",), ("at-robot", rooms[-1])]))
        costs.append(calls(partial(delete, supports, {("seen",): True})))
        assert len(supports.plan) == 2 * half
    assert costs[0] == costs[1]
