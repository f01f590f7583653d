"""Repairs: the paper's example, what its rule breaks, and loops, gaps and refusals."""

from collections.abc import Collection

import pytest

from clo_fleet.clo.links import End, Unsupported
from clo_fleet.clo.plan import Plan, first_fault, goals_of, number
from clo_fleet.clo.repair import DropReason, Refused, Repaired, repair
from clo_fleet.clo.task import Action, Condition, Fact, apply, parse_fact


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def action(
    name: str, *, needs: Collection[str] = (), lacks: Collection[str] = (), adds: Collection[str] = (),
    deletes: Collection[str] = (),
) -> Action:  # fmt: skip
    """The action written as ``move l1 l2``; what it lacks must be false."""
    schema, *args = name.split()
    return Action(
        schema=schema,
        args=tuple(args),
        needs=(
            *map(Condition, map(parse_fact, needs)),
            *(Condition(parse_fact(text), positive=False) for text in lacks),
        ),
        adds=facts(*adds),
        deletes=facts(*deletes),
    )


def move(start: str, end: str) -> Action:
    """Go from room to room, if the door of the other is not shut."""
    here, there = f"(at-robot {start})", f"(at-robot {end})"
    return action(f"move {start} {end}", needs=[here], lacks=[f"(shut {end})"], adds=[there], deletes=[here])


def prepare(item: str, room: str) -> Action:
    """Make the object ready to be grasped."""
    needs = [f"(at-object {item} {room})", f"(at-robot {room})"]
    return action(f"prepare {item} {room}", needs=needs, adds=[f"(prepared {item})"])


def grasp(item: str, room: str) -> Action:
    """Take the prepared object."""
    lies = f"(at-object {item} {room})"
    needs = [lies, f"(at-robot {room})", f"(prepared {item})"]
    return action(f"grasp {item} {room}", needs=needs, adds=[f"(holding {item})"], deletes=[lies])


START = facts("(at-robot l3)", "(at-object o1 l1)", "(at-object o2 l2)")
GOALS = goals_of(facts("(holding o1)", "(holding o2)"))
PLAN = number(
    [
        move("l3", "l1"),
        prepare("o1", "l1"),
        grasp("o1", "l1"),
        move("l1", "l2"),
        prepare("o2", "l2"),
        grasp("o2", "l2"),
    ],
    first=1,
)


def repaired(found: Repaired | Refused) -> Repaired:
    """The repair, which must not have been refused."""
    assert isinstance(found, Repaired)
    return found


def names(plan: Plan) -> list[str]:
    """The plan as one writes it."""
    return list(map(str, plan))


def star(rooms: int) -> tuple[frozenset[Fact], Plan, tuple[Condition, ...]]:
    """One object in each room round a hub, all to be fetched: the state, the plan and the goals."""
    actions: list[Action] = []
    for i in range(rooms):
        room, item = f"l{i}", f"o{i}"
        actions += [move("hub", room), prepare(item, room), grasp(item, room), move(room, "hub")]
    state = facts("(at-robot hub)", *(f"(at-object o{i} l{i})" for i in range(rooms)))
    return state, number(actions[:-1]), goals_of(("holding", f"o{i}") for i in range(rooms))


def given(state: frozenset[Fact], *items: int) -> frozenset[Fact]:
    """The state after another robot has handed these objects over."""
    return (state - facts(*(f"(at-object o{i} l{i})" for i in items))) | facts(*(f"(holding o{i})" for i in items))


# ---- the paper's example -----------------------------------------------------------------------------------


def test_example_of_the_paper_comes_out_as_printed() -> None:
    """When ``holding(o2)`` turns true in room l1, what is left is to take o1."""
    state = apply(START, PLAN[0].action) | facts("(holding o2)")
    found = repaired(repair(state, PLAN[1:], GOALS, changed=facts("(holding o2)")))
    assert names(found.plan) == ["prepare(o1, l1)", "grasp(o1, l1)"]
    assert [(link.producer, str(link.condition), link.consumer) for link in found.links.links] == [
        (2, "(prepared o1)", 3),
        (3, "(holding o1)", End.GOAL),
    ]


def test_dropped_steps_of_the_example_name_what_replaced_them() -> None:
    """The move, which only served the other two, as well: all for ``(holding o2)``."""
    state = given(apply(START, PLAN[0].action), 2) - facts("(at-object o2 l2)")
    changed = facts("(holding o2)", "(at-object o2 l2)")
    found = repaired(repair(state, PLAN[1:], GOALS, changed=changed))
    assert [(str(drop.step), drop.reason, drop.because) for drop in found.dropped] == [
        ("move(l1, l2)", DropReason.NEEDLESS, (("holding", "o2"),)),
        ("prepare(o2, l2)", DropReason.NEEDLESS, (("holding", "o2"),)),
        ("grasp(o2, l2)", DropReason.NEEDLESS, (("holding", "o2"),)),
    ]


def test_each_dropped_step_names_the_news_nearest_to_the_goal() -> None:
    """Two gifts at once are told apart; a step that served both names both; who holds a thing needs no preparing."""
    plan = number([move("hub", "l1"), prepare("o1", "l1"), grasp("o1", "l1"), prepare("o2", "l1"), grasp("o2", "l1")])
    state = facts("(at-robot hub)", "(at-object o1 l1)", "(at-object o2 l1)")
    news = facts("(prepared o1)", "(holding o1)", "(prepared o2)", "(holding o2)")
    found = repaired(repair(state | news, plan, GOALS, changed=news))
    assert found.plan == ()
    assert [drop.because for drop in found.dropped] == [
        (("holding", "o1"), ("holding", "o2")),
        (("holding", "o1"),),
        (("holding", "o1"),),
        (("holding", "o2"),),
        (("holding", "o2"),),
    ]


def test_step_that_no_news_replaces_names_none() -> None:
    """A superfluous step is dropped at the same time, but not because of what is new."""
    plan = (*number([action("wave", adds=["(waved)"])], first=9), *PLAN)
    state = given(START, 2) - facts("(at-object o2 l2)")
    news = facts("(holding o2)", "(at-object o2 l2)")
    found = repaired(repair(state, plan, GOALS, changed=news))
    assert {str(drop.step): drop.because for drop in found.dropped} == {
        "wave()": (),
        "move(l1, l2)": (("holding", "o2"),),
        "prepare(o2, l2)": (("holding", "o2"),),
        "grasp(o2, l2)": (("holding", "o2"),),
    }


def test_loop_names_the_news_that_replaced_other_steps() -> None:
    """Other news has nothing to do with it."""
    state, plan, goals = star(2)
    news = facts("(holding o0)", "(lit l0)")
    found = repaired(repair(given(state, 0) | news, plan, goals, changed=news))
    assert [drop.because for drop in found.dropped if drop.reason is DropReason.LOOP] == 2 * [(("holding", "o0"),)]


# ---- where the paper's rule breaks -------------------------------------------------------------------------


def test_plan_without_surprise_stays_as_it_is() -> None:
    """Also one that comes through a room again: the paper's loop takes that for an opportunity."""
    plan = number(
        [move("l1", "l2"), prepare("o2", "l2"), move("l2", "l1"), prepare("o1", "l1"), move("l1", "l2")],
    )
    state = facts("(at-robot l1)", "(at-object o1 l1)", "(at-object o2 l2)")
    goals = goals_of(facts("(prepared o2)", "(prepared o1)", "(at-robot l2)"))
    assert repaired(repair(START, PLAN, iter(GOALS))).plan == PLAN
    for done in range(2):
        state = apply(state, plan[done].action)
        assert repaired(repair(state, plan[done + 1 :], goals)).plan == plan[done + 1 :]


def test_fact_that_is_undone_before_it_is_needed_is_made_again() -> None:
    """A threat: it is true now, but a step that is needed for something else deletes it."""
    plan = number(
        [
            action("paint", adds=["(painted)"], deletes=["(clean)"]),
            action("wash", adds=["(clean)"]),
            action("show", needs=["(clean)", "(painted)"], adds=["(shown)"]),
        ]
    )
    found = repaired(repair(facts("(clean)"), plan, goals_of(facts("(shown)")), changed=facts("(clean)")))
    assert found.plan == plan


def test_negative_condition_that_came_true_by_itself_spares_its_step() -> None:
    """Somebody else opened the door."""
    plan = number([action("open l2", deletes=["(shut l2)"]), move("l1", "l2")])
    goals = goals_of(facts("(at-robot l2)"))
    assert repaired(repair(facts("(at-robot l1)", "(shut l2)"), plan, goals)).plan == plan
    assert names(repaired(repair(facts("(at-robot l1)"), plan, goals)).plan) == ["move(l1, l2)"]


# ---- loops -------------------------------------------------------------------------------------------------


def test_round_trip_for_an_object_that_was_given_goes_whole() -> None:
    """The two moves support each other, and go together."""
    state, plan, goals = star(2)
    news = facts("(holding o0)", "(at-object o0 l0)")
    found = repaired(repair(given(state, 0), plan, goals, changed=news))
    assert names(found.plan) == ["move(hub, l1)", "prepare(o1, l1)", "grasp(o1, l1)"]
    assert [(str(drop.step), drop.reason) for drop in found.dropped] == [
        ("move(hub, l0)", DropReason.LOOP),
        ("prepare(o0, l0)", DropReason.NEEDLESS),
        ("grasp(o0, l0)", DropReason.NEEDLESS),
        ("move(l0, hub)", DropReason.LOOP),
    ]
    assert {drop.because for drop in found.dropped} == {(("holding", "o0"),)}


@pytest.mark.parametrize("items", [range(5), range(5, 10), range(0, 10, 2), range(1, 10, 2)])
def test_star_of_ten_rooms_comes_to_nineteen_steps(items: range) -> None:
    """From 39, with half of the objects handed over, whichever half it is."""
    state, plan, goals = star(10)
    found = repaired(repair(given(state, *items), plan, goals))
    assert (len(plan), len(found.plan)) == (39, 19)
    assert first_fault(given(state, *items), found.plan, goals) is None


def test_loop_in_a_negative_condition_goes_too() -> None:
    """Close the door, paint it, open it again: painted by somebody else, it may stay open."""
    plan = number(
        [
            action("close l2", adds=["(shut l2)"]),
            action("paint l2", needs=["(shut l2)"], adds=["(painted l2)"]),
            action("open l2", needs=["(shut l2)"], deletes=["(shut l2)"]),
            move("l1", "l2"),
        ]
    )
    goals = goals_of(facts("(at-robot l2)", "(painted l2)"))
    found = repaired(repair(facts("(at-robot l1)", "(painted l2)"), plan, goals))
    assert names(found.plan) == ["move(l1, l2)"]
    assert [drop.reason for drop in found.dropped] == [DropReason.LOOP, DropReason.NEEDLESS, DropReason.LOOP]


def test_detour_over_several_rooms_goes_whole() -> None:
    """However long it is, it only left and came back."""
    plan = number([move("hub", "l1"), move("l1", "l2"), move("l2", "hub"), move("hub", "l3")])
    found = repaired(repair(facts("(at-robot hub)"), plan, goals_of(facts("(at-robot l3)"))))
    assert names(found.plan) == ["move(hub, l3)"]


# ---- steps that cannot be done any more --------------------------------------------------------------------


def test_impossible_round_trip_that_is_not_needed_is_skipped() -> None:
    """The door is shut, but what lay behind it is here."""
    plan = number(
        [
            move("hub", "l1"),
            grasp("o1", "l1"),
            move("l1", "hub"),
            action("pack", needs=["(holding o1)", "(at-robot hub)"], adds=["(packed o1)"]),
        ]
    )
    state = facts("(at-robot hub)", "(holding o1)", "(shut l1)")
    found = repaired(repair(state, plan, goals_of(facts("(packed o1)"))))
    assert names(found.plan) == ["pack()"]
    assert [drop.reason for drop in found.dropped] == [
        DropReason.IMPOSSIBLE,
        DropReason.NEEDLESS,
        DropReason.IMPOSSIBLE,
    ]


def test_impossible_step_does_not_make_a_possible_one_look_needless() -> None:
    """The object was moved to where the robot would have prepared it a second time."""
    plan = number([prepare("o1", "l1"), move("l1", "l2"), prepare("o1", "l2"), grasp("o1", "l2")])
    found = repaired(repair(facts("(at-robot l1)", "(at-object o1 l2)"), plan, goals_of(facts("(holding o1)"))))
    assert names(found.plan) == ["move(l1, l2)", "prepare(o1, l2)", "grasp(o1, l2)"]
    assert [(str(drop.step), drop.reason) for drop in found.dropped] == [("prepare(o1, l1)", DropReason.IMPOSSIBLE)]


def test_state_and_plan_are_left_as_they_were() -> None:
    """Also a state that could be changed."""
    state, plan, goals = star(2)
    now = set(given(state, 0))
    repair(now, plan, goals)
    assert now == given(state, 0)


def test_needed_step_that_cannot_be_done_refuses_the_repair() -> None:
    """What it lacks is named; the object to be taken is gone."""
    state = START - facts("(at-object o2 l2)")
    lies = Condition(parse_fact("(at-object o2 l2)"))
    assert repair(state, PLAN, GOALS) == Refused((Unsupported(lies, 5), Unsupported(lies, 6)))


def test_goal_that_no_step_brings_about_refuses_the_repair() -> None:
    """The plan as such could go on."""
    lost = Condition(parse_fact("(holding o3)"))
    assert repair(START, PLAN, (*GOALS, lost)) == Refused((Unsupported(lost, End.GOAL),))


def test_empty_plan_is_repaired_if_the_goals_hold() -> None:
    """And refused if they do not."""
    assert repaired(repair(facts("(holding o1)"), (), goals_of(facts("(holding o1)")))).plan == ()
    assert isinstance(repair(frozenset(), (), goals_of(facts("(holding o1)"))), Refused)
