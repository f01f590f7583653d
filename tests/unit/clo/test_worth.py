"""What an opportunity saves and until when: visits, second makers, loops, prohibitions, and what only harms."""

from collections.abc import Collection, Sequence

import pytest

from clo_fleet.clo.plan import Plan, goals_of, number
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact
from clo_fleet.clo.worth import Window, Worth, worths


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def literal(text: str) -> Condition:
    """The condition written as ``(shut l1)`` or ``not (shut l1)``."""
    return Condition(parse_fact(text.removeprefix("not ")), positive=not text.startswith("not "))


def action(
    name: str,
    *,
    needs: Collection[str] = (),
    adds: Collection[str] = (),
    deletes: Collection[str] = (),
    cost: int = 1,
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    needed = tuple(map(literal, needs))
    return Action(schema=schema, args=tuple(args), needs=needed, adds=facts(*adds), deletes=facts(*deletes), cost=cost)


def move(start: str, end: str, cost: int = 1) -> Action:
    """Go from room to room."""
    here, there = f"(at-robot {start})", f"(at-robot {end})"
    return action(f"move {start} {end}", needs=[here], adds=[there], deletes=[here], cost=cost)


def light(room: str) -> Action:
    """Switch the light of the room on."""
    return action(f"light {room}", needs=[f"(at-robot {room})"], adds=[f"(lit {room})"])


def worth(text: str, state: Collection[str], plan: Plan, goals: Sequence[str]) -> Worth:
    """The worth of the one opportunity that the text writes."""
    found = worths(facts(*state), plan, tuple(map(literal, goals)))
    (only,) = (worth for worth in found if worth.condition == literal(text))
    return only


def spans(*spans: tuple[int, int]) -> tuple[Window, ...]:
    """Windows with these first and last places."""
    return tuple(Window(first, last) for first, last in spans)


# ---- windows -----------------------------------------------------------------------------------------------


def test_help_must_come_before_the_step_that_it_replaces() -> None:
    """A light is of use until the robot switches it on itself, and so is being brought there."""
    plan = number([move("hub", "l1"), light("l1")])
    assert worth("(lit l1)", ["(at-robot hub)"], plan, ["(lit l1)"]) == Worth(
        literal("(lit l1)"), value=2, steps=2, windows=spans((0, 1))
    )
    assert worth("(at-robot l1)", ["(at-robot hub)"], plan, ["(lit l1)"]).windows == spans((0, 0))


def test_room_entered_twice_has_two_windows() -> None:
    """To be there helps before the first way in, and after the way out until the second way in; not within."""
    plan = number([move("hub", "l1"), light("l1"), move("l1", "hub"), light("hub"), move("hub", "l1")])
    goals = ["(lit l1)", "(lit hub)", "(at-robot l1)"]
    assert worth("(at-robot l1)", ["(at-robot hub)"], plan, goals).windows == spans((0, 0), (3, 4))


def test_last_step_that_undoes_it_opens_the_window() -> None:
    """Also one that undoes it in vain as planned: before it, help would be lost again."""
    reset = action("reset", adds=["(clean)"], deletes=["(lit l1)"])
    plan = number([reset, light("l1")])
    found = worth("(lit l1)", ["(at-robot l1)"], plan, ["(lit l1)", "(clean)"])
    assert found == Worth(literal("(lit l1)"), value=0, steps=0, windows=spans((1, 1)))


def test_step_kept_by_another_use_is_not_replaced() -> None:
    """The condition is an opportunity all the same, without a window."""
    both = action("switch", adds=["(lit l1)", "(lit l2)"])
    found = worths(set(), number([both]), goals_of(facts("(lit l1)", "(lit l2)")))
    assert found == (Worth(literal("(lit l1)"), 0, 0, ()), Worth(literal("(lit l2)"), 0, 0, ()))


def test_step_that_makes_anew_what_holds_is_no_use() -> None:
    """Only the first maker is replaced; the second is kept by what else it makes."""
    also = action("switch", adds=["(lit l1)", "(lit l2)"])
    plan = number([light("l1"), action("read", needs=["(lit l1)"], adds=["(read)"]), also])
    goals = ["(lit l1)", "(read)", "(lit l2)"]
    assert worth("(lit l1)", ["(at-robot l1)"], plan, goals).windows == spans((0, 0))
    assert worth("(lit l2)", ["(at-robot l1)"], plan, goals).windows == spans((0, 2))


def test_prohibitions_are_opportunities_too() -> None:
    """Mirrored: that a door comes open by itself helps from the last step that shuts it to the one that opens it."""
    shut = action("shut", adds=["(shut)", "(quiet)"])
    unlock = action("open", deletes=["(shut)"])
    leave = action("leave", needs=["not (shut)"], adds=["(out)"])
    plan = number([shut, action("sleep", needs=["(quiet)"], adds=["(rested)"]), unlock, leave])
    found = worth("not (shut)", [], plan, ["(rested)", "(out)"])
    assert found == Worth(literal("not (shut)"), value=0, steps=0, windows=spans((1, 2)))


def test_same_action_at_two_places_is_two_steps() -> None:
    """Each has its own window."""
    spend = action("pour", needs=["(water)"], adds=["(wet)"], deletes=["(water)"])
    again = action("drink", needs=["(water)"], adds=["(fresh)"], deletes=["(water)"])
    fetch = action("fetch", adds=["(water)"])
    plan = number([fetch, spend, fetch, again])
    found = worth("(water)", [], plan, ["(wet)", "(fresh)"])
    assert (found.value, found.windows) == (1, spans((0, 0), (2, 2)))


# ---- values ------------------------------------------------------------------------------------------------


def test_value_counts_costs_and_the_way_there() -> None:
    """All that only served it goes with it, there and back: loops are counted."""
    plan = number([move("hub", "l1", cost=7), light("l1"), move("l1", "hub", cost=8)])
    goals = ["(lit l1)", "(at-robot hub)"]
    found = worth("(lit l1)", ["(at-robot hub)"], plan, goals)
    assert (found.value, found.steps, found.windows) == (16, 3, spans((0, 1)))


def test_value_of_a_prohibition_is_what_it_spares() -> None:
    """A door that comes open by itself."""
    plan = number([action("open", deletes=["(shut)"], cost=4), action("leave", needs=["not (shut)"], adds=["(out)"])])
    found = worth("not (shut)", ["(shut)"], plan, ["(out)"])
    assert found == Worth(literal("not (shut)"), value=4, steps=1, windows=spans((0, 0)))


def test_what_is_not_known_may_still_come_true() -> None:
    """To see that the light is on already is worth as much as that somebody switches it on."""
    plan = number([light("l1")])
    found = worths(facts("(at-robot l1)"), plan, goals_of(facts("(lit l1)")), unknown=facts("(lit l1)"))
    assert found == (Worth(literal("(lit l1)"), value=1, steps=1, windows=spans((0, 0))),)


def test_most_valuable_comes_first_and_equals_in_order() -> None:
    """Whatever order the plan has them in."""
    plan = number([light("l9"), light("l1"), action("paint", needs=["(lit l9)"], adds=["(red)"], cost=4)])
    found = worths(facts("(at-robot l1)", "(at-robot l9)"), plan, tuple(map(literal, ["(red)", "(lit l1)"])))
    assert [(str(worth.condition), worth.value) for worth in found] == [
        ("(red)", 5),
        ("(lit l1)", 1),
        ("(lit l9)", 1),
    ]


def test_what_would_break_the_plan_has_no_value() -> None:
    """Windows still say where steps would become needless by it."""
    unlock = action("open", deletes=["(shut)"])
    plan = number([action("look", needs=["(shut)"], adds=["(seen)"]), unlock])
    found = worth("not (shut)", ["(shut)"], plan, ["(seen)", "not (shut)"])
    assert found == Worth(literal("not (shut)"), value=0, steps=0, windows=spans((0, 1)))


def test_what_holds_now_saves_nothing_before_it_is_undone() -> None:
    """It cannot come true now."""
    plan = number([move("hub", "l1"), light("l1"), move("l1", "hub")])
    found = worth("(at-robot hub)", ["(at-robot hub)"], plan, ["(lit l1)", "(at-robot hub)"])
    assert found == Worth(literal("(at-robot hub)"), value=0, steps=0, windows=spans((1, 2)))


@pytest.mark.parametrize("goals", [(), goals_of(facts("(lit l1)"))])
def test_plan_without_links_has_no_opportunities(goals: tuple[Condition, ...]) -> None:
    """Nothing is to be done, or nothing can be."""
    assert worths(set(), (), goals) == ()


def test_window_holds_its_ends() -> None:
    """First and last place are both in it."""
    assert [place for place in range(6) if place in Window(2, 4)] == [2, 3, 4]
