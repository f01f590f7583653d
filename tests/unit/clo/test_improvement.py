"""Improvement: plans made shorter and cheaper by leaving steps out and by windows."""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from clo_fleet.clo.bridge import Breach, Way
from clo_fleet.clo.improvement import Focus, eliminated, improved
from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact


def action(
    name: str, needs: Iterable[str] = (), adds: Iterable[str] = (), deletes: Iterable[str] = (), cost: int = 1
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    return Action(
        schema=schema,
        args=tuple(args),
        needs=tuple(Condition(parse_fact(text)) for text in needs),
        adds=frozenset(map(parse_fact, adds)),
        deletes=frozenset(map(parse_fact, deletes)),
        cost=cost,
    )


def move(start: str, end: str, cost: int = 1) -> Action:
    """From room to room."""
    return action(f"move {start} {end}", [f"(at {start})"], [f"(at {end})"], [f"(at {start})"], cost)


def grasp(item: str, room: str) -> Action:
    """Take the thing."""
    return action(f"grasp {item} {room}", [f"(at {room})", f"(lies {item} {room})"], [f"(has {item})"])


ROOMS = ("l1", "l2", "l3", "l4", "l5")
HUB = [move(start, end) for start in ROOMS for end in ROOMS if start != end]
HUB += [grasp(item, room) for item in ("cup", "pen") for room in ROOMS]


def breach(
    state: Iterable[str],
    plan: Iterable[Action],
    goals: Iterable[str],
    *,
    actions: Iterable[Action] = HUB,
    before: Iterable[str] | None = None,
    spared: Iterable[str] = (),
) -> Breach:
    """A plan that goes through."""
    wanted, others = ([Condition(parse_fact(text)) for text in texts] for texts in (goals, spared))
    operators = Operators(actions, wanted).covering(others)
    return Breach(
        operators=operators,
        state=operators.state(facts(state)),
        plan=tuple(map(operators.operator, plan)),
        goals=operators.mask(wanted),
        before=None if before is None else operators.state(facts(before)),
        spared=operators.mask(others),
    )


def facts(texts: Iterable[str]) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def whole(case: Breach) -> Way:
    """The plan as it is."""
    return tuple(range(len(case.plan)))


def better(case: Breach, focus: Focus | None = None) -> list[int | str]:
    """The improved plan: the places of steps that stay, and the names of those that are new."""
    return texts(improved(case, whole(case), focus=focus))


def texts(way: Way) -> list[int | str]:
    """The places of steps that stay, and the names of those that are new."""
    return [step.action.name if isinstance(step, Operator) else step for step in way]


# ---- elimination -------------------------------------------------------------------------------------------


def test_step_goes_with_all_that_cannot_be_done_without_it() -> None:
    """Nobody asks for the cup: neither for the way to it, and back."""
    plan = [move("l1", "l2"), grasp("cup", "l2"), move("l2", "l1"), grasp("pen", "l1")]
    case = breach(["(at l1)", "(lies cup l2)", "(lies pen l1)"], plan, ["(has pen)"])
    assert eliminated(case, whole(case)) == (3,)


def test_step_that_is_needed_stays() -> None:
    """Each of them."""
    case = breach(["(at l1)", "(lies cup l2)"], [move("l1", "l2"), grasp("cup", "l2")], ["(has cup)"])
    assert eliminated(case, whole(case)) == (0, 1)


def test_new_steps_are_eliminated_like_old_ones() -> None:
    """A way may begin with a bridge that turns out too long."""
    case = breach(["(at l1)", "(lies cup l1)"], [grasp("cup", "l1")], ["(has cup)"])
    there, back = (case.operators.operator(act) for act in (move("l1", "l2"), move("l2", "l1")))
    assert eliminated(case, (there, back, 0)) == (0,)


def test_elimination_keeps_a_bridge_from_leading_back() -> None:
    """Without the first step the second would do again what the surprise undid."""
    shut, push = action("shut", [], ["(shut)"]), action("push", [], ["(open)"])
    through = action("through", ["(open)"], ["(in)"])
    case = breach([], [through], ["(in)"], actions=[shut, push, through], before=["(open)"])
    way = case.operators.operator(shut), case.operators.operator(push), 0
    assert texts(eliminated(case, way)) == ["shut()", "push()", 0]
    assert texts(eliminated(replace(case, before=None), way)) == ["push()", 0]


# ---- windows -----------------------------------------------------------------------------------------------


def test_way_through_a_room_where_nothing_is_to_be_done_becomes_a_direct_one() -> None:
    """Two moves by one; what follows stays."""
    plan = [move("l1", "l2"), move("l2", "l3"), grasp("cup", "l3")]
    case = breach(["(at l1)", "(lies cup l3)"], plan, ["(has cup)"])
    assert better(case) == ["move(l1, l3)", 2]


def test_round_trip_needs_nothing_in_its_place() -> None:
    """Though each of its steps is needed by the next, and something is done on the way that need not be done there."""
    plan = [move("l1", "l2"), move("l2", "l3"), move("l3", "l1"), grasp("cup", "l1")]
    assert better(breach(["(at l1)", "(lies cup l1)"], plan, ["(has cup)"])) == [3]


def test_steps_that_do_harm_only_by_themselves_go_together() -> None:
    """Each repairs what the one before has broken: elimination, which begins with one of them, is of no use."""
    unplug = action("unplug", [], ["(cable)"], ["(power)"])
    rewire = action("rewire", [], ["(power)"], ["(tidy)"])
    clear = action("clear", ["(cable)"], ["(tidy)"])
    plan = [unplug, rewire, clear, grasp("cup", "l1")]
    state = ["(at l1)", "(lies cup l1)", "(power)", "(tidy)"]
    case = breach(state, plan, ["(power)", "(tidy)", "(has cup)"], actions=plan)
    assert eliminated(case, whole(case)) == (0, 1, 2, 3)
    assert better(case) == [3]


def test_cheaper_action_takes_the_place_of_a_dear_one() -> None:
    """Though there are no fewer steps; what costs more is not looked at."""
    dear, cheap, gold = (
        action(name, [], ["(there)"], cost=cost) for name, cost in (("cab", 9), ("bus", 2), ("jet", 99))
    )
    case = breach([], [dear], ["(there)"], actions=[dear, gold, cheap])
    assert better(case) == ["bus()"]


def test_two_cheap_actions_take_the_place_of_dear_ones() -> None:
    """Never more steps than there were."""
    slow = [action("climb", [], ["(half)"], cost=5), action("climb on", ["(half)"], ["(top)"], cost=5)]
    fast = [action("call", [], ["(lift)"]), action("ride", ["(lift)"], ["(top)"])]
    assert better(breach([], slow, ["(top)"], actions=[*slow, *fast])) == ["call()", "ride()"]
    assert better(breach([], [replace(slow[1], needs=())], ["(top)"], actions=fast)) == [0]


def test_fewer_steps_count_where_nothing_costs() -> None:
    """Of equal sums the shorter plan is the better one; an equal one is left as it is."""
    stairs = [action("up", [], ["(half)"], cost=0), action("up on", ["(half)"], ["(top)"], cost=0)]
    leap, hop = action("leap", [], ["(top)"], cost=0), action("hop", [], ["(top)"], cost=0)
    assert better(breach([], stairs, ["(top)"], actions=[*stairs, leap])) == ["leap()"]
    assert better(breach([], [leap], ["(top)"], actions=[hop, leap])) == [0]


def test_longer_windows_come_when_short_ways_are_exhausted() -> None:
    """Three actions instead of four; after each success the shortest ways are looked for again."""
    old = [action(f"old{i}", [f"(old {i})"] if i else [], [f"(old {i + 1})"], [f"(old {i})"]) for i in range(4)]
    new = [action(f"new{i}", [f"(new {i})"] if i else [], [f"(new {i + 1})"]) for i in range(2)]
    last = [action("oldlast", ["(old 4)"], ["(won)"]), action("newlast", ["(new 2)"], ["(won)"])]
    plan = [*old, last[0], move("l1", "l2"), move("l2", "l3")]
    case = breach(["(at l1)"], plan, ["(won)", "(at l3)"], actions=[*old, *new, *last, *HUB])
    assert better(case) == ["new0()", "new1()", "newlast()", "move(l1, l3)"]


def test_window_leaves_alone_what_others_need() -> None:
    """The short way would push the cart away that somebody asked for."""
    push = action("push l1 l3", ["(at l1)"], ["(at l3)"], ["(at l1)", "(cart l1)"])
    plan = [move("l1", "l2"), move("l2", "l3")]
    case = breach(["(at l1)", "(cart l1)"], plan, ["(at l3)"], actions=[push, *plan])
    assert better(case) == ["push(l1, l3)"]
    assert better(breach(["(at l1)", "(cart l1)"], plan, ["(at l3)"], actions=[push, *plan], spared=["(cart l1)"])) == [
        0,
        1,
    ]


def test_window_does_not_undo_what_others_have_done() -> None:
    """Somebody shut the door: the way round stays, though to open it again would be cheaper; over it one may go."""
    opened, through = action("open", [], ["(open)"]), action("through", ["(open)", "(at l1)"], ["(at l3)"], ["(at l1)"])
    plan = [move("l1", "l2", cost=9), move("l2", "l3", cost=9)]
    actions = [*plan, opened, through]
    case = breach(["(at l1)"], plan, ["(at l3)"], actions=actions, before=["(at l1)", "(open)"])
    assert better(case) == [0, 1]
    assert better(replace(case, before=None)) == ["open()", "through()"]
    ladder = [
        action("place", ["(at l1)"], ["(ladder)"]),
        action("over", ["(ladder)"], ["(at l3)"], ["(at l1)"], cost=2),
    ]
    case = breach(["(at l1)"], plan, ["(at l3)"], actions=[*actions, *ladder], before=["(at l1)", "(open)"])
    assert better(case) == ["place()", "over()"]


def test_new_action_further_on_is_kept_from_leading_back() -> None:
    """The step before it could be had for less, but then the bridge behind it would make all as it was."""
    dear, cheap = action("dear", [], ["(on)", "(noise)"], cost=9), action("cheap", [], ["(on)"])
    mend, use = action("mend", ["(on)"], ["(whole)"]), action("use", ["(whole)"], ["(used)"])
    case = breach([], [dear, use], ["(used)"], actions=[dear, cheap, mend, use], before=["(on)", "(whole)"])
    way = 0, case.operators.operator(mend), 1
    assert texts(improved(case, way)) == [0, "mend()", 1]
    assert texts(improved(replace(case, before=None), way)) == ["cheap()", "mend()", 1]


def test_budget_ends_the_search() -> None:
    """What has been found by then is kept."""
    paint = action("paint l3", needs=["(at l3)"], adds=["(painted)"])
    plan = [move("l1", "l2"), move("l2", "l3"), paint, move("l3", "l4"), move("l4", "l5")]
    case = breach(["(at l1)"], plan, ["(painted)", "(at l5)"])
    assert better(case) == ["move(l1, l3)", 2, "move(l3, l5)"]
    assert texts(improved(case, whole(case), budget=1)) == [0, 1, 2, 3, 4]
    assert texts(improved(case, whole(case), budget=12)) == ["move(l1, l3)", 2, 3, 4]


@pytest.mark.parametrize("steps", [0, 300])
def test_long_plans_get_windows_too(steps: int) -> None:
    """Elimination does not use up the whole budget: it alone would need the square of the plan's length."""
    chain = [action(f"do{i}", [f"(f {i})"], [f"(f {i + 1})"]) for i in range(steps)]
    plan = [move("l1", "l2"), move("l2", "l3"), *chain]
    case = breach(["(at l1)", "(f 0)"], plan, ["(at l3)", f"(f {steps})"], actions=[*HUB, *chain])
    assert better(case) == ["move(l1, l3)", *range(2, steps + 2)]


# ---- focus -------------------------------------------------------------------------------------------------


TOUR = [
    move("l1", "l2"),
    move("l2", "l3"),
    *(grasp("cup", "l3") for _ in range(12)),
    move("l3", "l4"),
    move("l4", "l5"),
]


def tour(*more: Action, state: Iterable[str] = ()) -> Breach:
    """A way through two rooms where nothing is done, a long stay, and another such way."""
    marks = [action(f"mark{i}", [f"(mark {i})"] if i else [], [f"(mark {i + 1})"]) for i in range(12)]
    plan = [move("l1", "l2"), move("l2", "l3"), *marks, move("l3", "l4"), move("l4", "l5")]
    return breach(["(at l1)", *state], plan, ["(at l5)", "(mark 12)"], actions=[*HUB, *marks, *more])


def test_only_what_is_near_the_gaps_is_looked_at() -> None:
    """Elsewhere nothing has changed since the plan was improved; the two ways are twelve steps apart."""
    assert better(tour()) == ["move(l1, l3)", *range(2, 14), "move(l3, l5)"]
    assert better(tour(), Focus(frozenset({1}), 0)) == ["move(l1, l3)", *range(2, 16)]
    assert better(tour(), Focus(frozenset({15}), 0)) == [*range(14), "move(l3, l5)"]
    assert better(tour(), Focus(frozenset(), 0)) == list(range(16))


def test_places_in_focus_move_with_the_plan() -> None:
    """When the first way has become shorter, the second one begins earlier."""
    assert better(tour(), Focus(frozenset({0, 15}), 0)) == ["move(l1, l3)", *range(2, 14), "move(l3, l5)"]


def test_action_that_has_become_possible_is_tried_everywhere() -> None:
    """The lift runs now; it goes on as far as it serves."""
    lift = action("lift", ["(power)", "(at l3)"], ["(at l5)"], ["(at l3)"])
    case = tour(lift, state=["(power)"])
    focus = Focus(frozenset(), case.operators.mask([Condition(parse_fact("(power)"))]))
    assert better(case, focus) == [*range(14), "lift()"]
    spared = case.operators.mask([Condition(parse_fact("(at l3)"))])
    assert better(replace(case, spared=spared), focus) == list(range(16))


def test_action_that_has_become_possible_must_be_better() -> None:
    """Neither a dearer one nor one that leads elsewhere takes a place."""
    slow = action("slow", ["(power)", "(at l3)"], ["(at l5)"], ["(at l3)"], cost=3)
    away = action("away", ["(power)", "(at l3)"], ["(at l1)"], ["(at l3)"])
    case = tour(slow, away, state=["(power)"])
    power = case.operators.mask([Condition(parse_fact("(power)"))])
    assert better(case, Focus(frozenset(), power)) == list(range(16))


def test_focus_without_the_first_step() -> None:
    """Every place comes one nearer."""
    assert Focus(frozenset({0, 1, 5}), 3).behind_first() == Focus(frozenset({0, 4}), 3)
