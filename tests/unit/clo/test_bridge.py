"""Detours by the plan's own steps, and bridges by new ones."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import permutations

import pytest

from clo_fleet.clo import bridge as bridges
from clo_fleet.clo.bridge import Breach, Bridge, NoBridge, Refusal, bridge, detour, long_bridge, short_bridge
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.task import Action, Condition, Fact

Search = Callable[[Breach], Bridge | NoBridge]
searches = pytest.mark.parametrize("search", [bridge, short_bridge, long_bridge])


def action(
    name: str, needs: Iterable[Fact] = (), adds: Iterable[Fact] = (), deletes: Iterable[Fact] = (), cost: int = 1
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    conditions = tuple(map(Condition, needs))
    adds, deletes = frozenset(adds), frozenset(deletes)
    return Action(schema=schema, args=tuple(args), needs=conditions, adds=adds, deletes=deletes, cost=cost)


def at(room: str) -> Fact:
    """The robot is in the room."""
    return ("at", room)


def move(start: str, end: str, cost: int = 1) -> Action:
    """From room to room."""
    return action(f"move {start} {end}", [at(start)], [at(end)], [at(start)], cost)


def take(item: str, room: str) -> Action:
    """Pick the thing up."""
    return action(f"take {item} {room}", [at(room), ("in", item, room)], [("has", item)], [("in", item, room)])


def put(item: str, room: str) -> Action:
    """Lay it down."""
    return action(f"put {item} {room}", [at(room), ("has", item)], [("in", item, room)], [("has", item)])


ROOMS = ("l1", "l2", "l3", "l4")
EVERYTHING = [
    *(move(start, end) for start, end in permutations(ROOMS, 2) if abs(int(start[1]) - int(end[1])) == 1),
    *(do(item, room) for item in ("cup", "pen") for room in ROOMS for do in (take, put)),
]


def breach(
    state: Iterable[Fact],
    plan: Iterable[Action],
    goals: Iterable[Fact],
    *,
    actions: Iterable[Action] = EVERYTHING,
    before: Iterable[Fact] | None = None,
    spared: Iterable[Condition] = (),
) -> Breach:
    """What is to be mended."""
    wanted = tuple(map(Condition, goals))
    operators = Operators(actions).covering((*wanted, *spared))
    return Breach(
        operators=operators,
        state=operators.state(frozenset(state)),
        plan=tuple(map(operators.operator, plan)),
        goals=operators.mask(wanted),
        before=None if before is None else operators.state(frozenset(before)),
        spared=operators.mask(spared),
    )


def names(found: Bridge | NoBridge) -> list[str]:
    """The actions of the bridge, which has to be one."""
    assert isinstance(found, Bridge)
    return [operator.action.name for operator in found.actions]


def why(found: Bridge | NoBridge) -> Refusal:
    """Why there is no bridge."""
    assert isinstance(found, NoBridge)
    return found.why


FETCH = [move("l1", "l2"), take("cup", "l2"), move("l2", "l3"), put("cup", "l3")]
LAID: list[Fact] = [("in", "cup", "l3")]
CUP: Fact = ("in", "cup", "l2")


# ---- detours -----------------------------------------------------------------------------------------------


def test_steps_that_a_surprise_has_done_are_skipped() -> None:
    """Somebody has carried the robot on; the last place that can be entered counts."""
    assert detour(breach([at("l2"), CUP], FETCH, LAID)) == (1, 2, 3)
    assert detour(breach([at("l3"), ("has", "cup")], FETCH, LAID)) == (3,)
    assert detour(breach([("in", "cup", "l3")], FETCH, LAID)) == ()


def test_detour_goes_along_the_plan_to_where_it_may_jump() -> None:
    """The cup cannot be taken in l2, and is not needed any more once the robot has come to l3."""
    plan = [move("l1", "l2"), take("cup", "l2"), move("l2", "l3"), take("pen", "l3")]
    state = [at("l1"), ("in", "pen", "l3")]
    assert detour(breach(state, plan, [("has", "pen")])) == (0, 2, 3)


def test_detour_does_not_do_a_step_twice() -> None:
    """What has been done once cannot be entered again, however well that would fit."""
    blink = action("blink", [("on",)], [("off",)], [("on",)])
    back = action("back", [("off",)], [("on",)], [("off",)])
    plan = [blink, back, action("shine", [("on",), ("power",)], [("seen",)])]
    assert detour(breach([("on",)], plan, [("seen",)], actions=plan)) is None


def test_steps_are_done_in_another_order_if_that_serves() -> None:
    """The pen is where the robot is, the cup is still to come."""
    plan = [take("cup", "l2"), move("l1", "l2"), take("pen", "l1")]
    state = [at("l1"), CUP, ("in", "pen", "l1")]
    mark = action("mark", [("has", "pen")], [("marked",)])
    assert detour(breach(state, plan, [("has", "cup")])) == (1, 0)
    both = [take("cup", "l2"), mark, take("pen", "l1"), move("l1", "l2")]
    assert detour(breach(state, both, [("has", "cup"), ("marked",)], actions=[*EVERYTHING, mark])) == (2, 3, 0, 1)


def test_no_detour_where_something_new_has_to_be_done() -> None:
    """The cup stands elsewhere."""
    assert detour(breach([at("l1"), ("in", "cup", "l4")], FETCH, LAID)) is None


def test_bringing_steps_into_order_has_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan written backwards takes a pass for each step."""
    count = 30
    chain = [action(f"do{i}", [(f"f{i}",)], [(f"f{i + 1}",)]) for i in range(count)]
    case = breach([("f0",)], reversed(chain), [(f"f{count}",)], actions=chain)
    assert detour(case) == tuple(range(count - 1, -1, -1))
    monkeypatch.setattr(bridges, "MOST_TRIES", count)
    assert detour(case) is None


# ---- bridges -----------------------------------------------------------------------------------------------


@searches
def test_bridge_leads_back_into_the_plan(search: Search) -> None:
    """The robot has been put into another room: it goes back, and then on as planned."""
    found = search(breach([at("l4"), CUP], FETCH, LAID))
    assert names(found) == ["move(l4, l3)", "move(l3, l2)"]
    assert isinstance(found, Bridge)
    assert (found.entry, found.way(4)) == (1, (*found.actions, 1, 2, 3))
    assert found.effort > 0


@searches
def test_bridge_may_go_to_the_end(search: Search) -> None:
    """Where nothing of the plan is of use."""
    found = search(breach([at("l4"), ("in", "cup", "l4")], [move("l1", "l2")], [("has", "cup")]))
    assert names(found) == ["take(cup, l4)"]
    assert isinstance(found, Bridge)
    assert found.entry == 1


@searches
def test_plan_that_can_be_entered_needs_no_actions(search: Search) -> None:
    """Even where nothing can be done at all: that is not unsolvable."""
    assert search(breach([at("l2"), CUP], FETCH, LAID, actions=FETCH)) == Bridge((), 1, 0)
    assert search(breach([("done",)], [], [("done",)], actions=[])) == Bridge((), 0, 0)


def test_of_the_shortest_bridges_the_one_with_the_cheapest_rest_is_taken() -> None:
    """With what is left of the plan behind it."""
    plan = [action("rise", [("up",)], [("high",)], cost=5), action("sing", [("high",)], [("sung",)])]
    for cost, cheaper in ((5, "fly()"), (7, "climb()")):
        ways = [action("climb", [], [("up",)]), action("fly", [], [("high",)], cost=cost)]
        assert names(short_bridge(breach([], plan, [("sung",)], actions=[*ways, *plan]))) == [cheaper]


@searches
def test_bridge_does_not_undo_what_others_have_done(search: Search) -> None:
    """Somebody has shut the door: the robot goes round, though to open it again would be shorter."""
    door: Fact = ("open", "door")
    through = action("through", [at("l1"), door], [at("l3")], [at("l1")])
    actions = [action("open", [], [door]), through, *EVERYTHING]
    case = breach([at("l1")], [through], [at("l3")], actions=actions, before=[at("l1"), door])
    assert names(search(case)) == ["move(l1, l2)", "move(l2, l3)"]
    assert names(search(replace(case, before=None))) == ["open()"]


@searches
def test_if_the_only_way_leads_back_that_is_said(search: Search) -> None:
    """The lamp was put out: it could be lit again, and nothing else."""
    light, read = action("light", [], [("lit",)]), action("read", [("lit",)], [("known",)])
    case = breach([], [read], [("known",)], actions=[light, read], before=[("lit",)])
    assert why(search(case)) is Refusal.ONLY_BACK
    assert names(search(replace(case, before=None))) == ["light()"]
    assert names(search(replace(case, before=case.state))) == ["light()"]


@searches
def test_what_others_need_is_left_alone(search: Search) -> None:
    """The way through l2 would end the guard that stands there; without it there is another."""
    guard, past = ("guarded",), move("l1", "l2")
    rush = action("rush", [at("l1")], [at("l2")], [at("l1"), guard])
    enter = [take("cup", "l2")]
    state = [at("l1"), CUP, guard]
    kept = breach(state, enter, [("has", "cup")], actions=[rush, past, *enter], spared=[Condition(guard)])
    assert names(search(kept)) == ["move(l1, l2)"]
    lost = breach(state, enter, [("has", "cup")], actions=[rush, *enter], spared=[Condition(guard)])
    assert why(search(lost)) is Refusal.SPARED
    assert names(search(replace(lost, spared=0))) == ["rush()"]


@searches
def test_negation_that_others_need_is_left_alone_too(search: Search) -> None:
    """Nothing may be spilt, though no action of the robot needs it dry."""
    dry = Condition(("wet",), positive=False)
    splash, reach = action("splash", [], [("near",), ("wet",)]), action("reach", [("near",)], [("done",)])
    case = breach([], [reach], [("done",)], actions=[splash, reach], spared=[dry])
    assert why(search(case)) is Refusal.SPARED


@searches
def test_goal_that_is_out_of_reach_has_no_plan(search: Search) -> None:
    """Whatever is done: nobody has a key."""
    unlock = action("unlock", [("key",)], [("open",)])
    enter = action("enter", [("open",)], [("inside",)])
    assert why(search(breach([], [enter], [("inside",)], actions=[unlock, enter]))) is Refusal.UNSOLVABLE
    assert why(search(breach([], [enter], [("inside",)], actions=[unlock, enter], before=[("open",)]))) is (
        Refusal.UNSOLVABLE
    )


def lamps(count: int) -> list[Action]:
    """Lamps that can be switched on and off, and a match that is used up by the first fire."""
    on = [action(f"on{i}", [], [(f"lamp{i}",)]) for i in range(count)]
    off = [action(f"off{i}", [(f"lamp{i}",)], [], [(f"lamp{i}",)]) for i in range(count)]
    fires = [action(f"fire{name}", [("match",)], [(name,)], [("match",)]) for name in ("here", "there")]
    return [*on, *off, *fires]


@searches
def test_goals_that_exclude_each_other_have_no_plan(search: Search) -> None:
    """If nothing were ever undone, one match would do for both fires: all states have to be looked at."""
    case = breach([("match",)], [], [("here",), ("there",)], actions=lamps(3))
    assert why(search(case)) is Refusal.UNSOLVABLE


def test_searches_have_budgets(monkeypatch: pytest.MonkeyPatch) -> None:
    """With many lamps there are too many states: that is no proof."""
    case = breach([("match",)], [], [("here",), ("there",)], actions=lamps(12))
    found = short_bridge(case)
    assert why(found) is Refusal.BUDGET
    monkeypatch.setattr(bridges, "MOST_STATES", 30)
    less = short_bridge(case)
    assert (why(less), less.effort < 60 < found.effort) == (Refusal.BUDGET, True)
    monkeypatch.setattr(bridges, "MOST_EFFORT", 3000)
    assert why(long_bridge(case)) is Refusal.BUDGET
    assert why(bridge(case)) is Refusal.BUDGET


def test_way_back_is_no_reason_where_the_search_was_not_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is one, of one action; whether there is another nobody knows."""
    fires: list[Fact] = [("here",), ("there",)]
    again = action("again", [], fires)
    case = breach([("match",)], [], fires, actions=[*lamps(12), again], before=[("match",), *fires])
    assert names(long_bridge(replace(case, before=None))) == ["again()"]
    monkeypatch.setattr(bridges, "MOST_EFFORT", 0)
    assert why(long_bridge(case)) is Refusal.BUDGET


def test_bridge_found_in_the_last_expansions_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though its layer could not be finished."""
    monkeypatch.setattr(bridges, "MOST_EXPANSIONS", 2)
    steps = [action("a", [], [("a",)]), action("b", [], [("b",)]), action("win", [("a",)], [("won",)])]
    assert names(short_bridge(breach([], [], [("won",)], actions=steps))) == ["a()", "win()"]


def test_long_bridge_goes_where_breadth_first_search_does_not_come() -> None:
    """Five things are to be brought into another room."""
    items = [f"o{i}" for i in range(5)]
    actions = [move("l1", "l2"), move("l2", "l1")]
    actions += [do(item, room) for item in items for room in ("l1", "l2") for do in (take, put)]
    state = [at("l1"), *(("in", item, "l1") for item in items)]
    case = breach(state, [], [("in", item, "l2") for item in items], actions=actions)
    assert why(short_bridge(case)) is Refusal.BUDGET
    carried = names(bridge(case))
    assert [carried.count(f"put({item}, l2)") for item in items] == [1] * len(items)


def test_long_bridge_passes_over_states_from_which_there_is_no_way() -> None:
    """One of two matches is wet: who strikes it first is lost."""
    strike = action("strike", [("match",)], [("burnt",)], [("match",)])
    dry, light = action("dry", [], [("dry",)]), action("light", [("match",), ("dry",)], [("fire",)], [("match",)])
    found = long_bridge(breach([("match",)], [], [("fire",)], actions=[strike, dry, light]))
    assert names(found) == ["dry()", "light()"]


def test_search_aims_where_bridge_and_rest_are_cheapest() -> None:
    """Not at the end, which is further than what the plan would do."""
    far = [move(f"l{i}", f"l{i + 1}") for i in range(5, 9)]
    plan = [move("l4", "l5"), *far]
    found = long_bridge(breach([at("l2")], plan, [at("l9")], actions=[*EVERYTHING, *plan]))
    assert names(found) == ["move(l2, l3)", "move(l3, l4)"]


def test_search_does_not_aim_before_a_step_that_spoils_the_goal() -> None:
    """However little would be left to be done there: the plan can be entered only behind it."""
    spoil, mix, bake = (
        action("spoil", [], [], [("cake",)]),
        action("mix", [], [("dough",)]),
        action("bake", [("dough",)], [("cake",)]),
    )
    assert names(long_bridge(breach([], [spoil], [("cake",)], actions=[spoil, mix, bake]))) == ["mix()", "bake()"]
