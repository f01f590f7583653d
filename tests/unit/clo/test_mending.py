"""Mending: which means serves first, steps under way, and repairs with new actions."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import permutations

import pytest

from clo_fleet.clo import bridge
from clo_fleet.clo.bridge import Breach, NoBridge, Refusal, Way
from clo_fleet.clo.improvement import Focus
from clo_fleet.clo.links import causal_links
from clo_fleet.clo.mending import Means, Mended, composed, mended, shortened
from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.plan import Plan, first_fault, number
from clo_fleet.clo.repair import DropReason, Refused, Repaired, repair
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact


def facts(texts: Iterable[str]) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def goals(*texts: str) -> tuple[Condition, ...]:
    """What the texts write, to be true."""
    return tuple(Condition(parse_fact(text)) for text in texts)


def action(
    name: str, needs: Iterable[str] = (), adds: Iterable[str] = (), deletes: Iterable[str] = (), cost: int = 1
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    return Action(
        schema=schema,
        args=tuple(args),
        needs=goals(*needs),
        adds=facts(adds),
        deletes=facts(deletes),
        cost=cost,
    )


def move(start: str, end: str) -> Action:
    """From room to room, through a door that is open."""
    return action(f"move {start} {end}", [f"(at {start})", f"(open {end})"], [f"(at {end})"], [f"(at {start})"])


def unlock(room: str) -> Action:
    """Open its door from outside."""
    return action(f"unlock {room}", [], [f"(open {room})"])


def pick(ball: str, room: str, hand: str) -> Action:
    """Take the ball."""
    needs = [f"(at {room})", f"(in {ball} {room})", f"(free {hand})"]
    return action(f"pick {ball} {room} {hand}", needs, [f"(holds {hand} {ball})"], needs[1:])


def drop(ball: str, room: str, hand: str) -> Action:
    """Put the ball down."""
    holds = f"(holds {hand} {ball})"
    return action(
        f"drop {ball} {room} {hand}", [f"(at {room})", holds], [f"(in {ball} {room})", f"(free {hand})"], [holds]
    )


ROOMS, BALLS, HANDS = ("l1", "l2", "l3"), ("b1", "b2"), ("left", "right")
ALL = [move(start, end) for start, end in permutations(ROOMS, 2)] + [unlock(room) for room in ROOMS]
ALL += [do(ball, room, hand) for do in (pick, drop) for ball in BALLS for room in ROOMS for hand in HANDS]
OPEN = [f"(open {room})" for room in ROOMS]
START = facts(["(at l1)", "(in b1 l2)", "(in b2 l2)", "(free left)", "(free right)", *OPEN])
FETCH = [move("l1", "l2"), pick("b1", "l2", "left"), move("l2", "l3"), drop("b1", "l3", "left")]
FETCHED = goals("(in b1 l3)")


def breach(
    state: Iterable[Fact],
    plan: Iterable[Action],
    wanted: Iterable[Condition] = FETCHED,
    *,
    actions: Iterable[Action] = ALL,
    before: Iterable[Fact] | None = None,
) -> Breach:
    """What is to be mended."""
    operators = Operators(actions, wanted)
    return Breach(
        operators=operators,
        state=operators.state(frozenset(state)),
        plan=tuple(map(operators.operator, plan)),
        goals=operators.mask(wanted),
        before=None if before is None else operators.state(frozenset(before)),
    )


def changed(*, true: Iterable[str] = (), false: Iterable[str] = ()) -> frozenset[Fact]:
    """The start after a surprise."""
    return START - facts(false) | facts(true)


def texts(way: Way) -> list[int | str]:
    """The places of steps that stay, and the names of those that are new."""
    return [step.action.name if isinstance(step, Operator) else step for step in way]


def means(found: Mended | NoBridge) -> tuple[Means, list[int | str]]:
    """What it took, and the way on."""
    assert isinstance(found, Mended)
    return found.means, texts(found.way)


# ---- the means, in their order -----------------------------------------------------------------------------


def test_own_steps_come_first() -> None:
    """Somebody else has brought the robot and the ball further."""
    there = breach(changed(true=["(at l3)", "(holds left b1)"], false=["(at l1)", "(in b1 l2)"]), FETCH)
    assert means(mended(there, under_way=False)) == (Means.RELINKING, [3])


def test_then_another_object() -> None:
    """The left hand is taken."""
    found = mended(breach(changed(false=["(free left)"]), FETCH), under_way=False)
    assert means(found) == (Means.REBINDING, [0, "pick(b1, l2, right)", 2, "drop(b1, l3, right)"])


def test_then_a_bridge() -> None:
    """The door is locked."""
    found = mended(breach(changed(false=["(open l2)"]), FETCH), under_way=False)
    assert means(found) == (Means.BRIDGE, ["unlock(l2)", 0, 1, 2, 3])


def drive(truck: str, start: str, end: str) -> Action:
    """From place to place, if it runs."""
    here, there = f"(by {truck} {start})", f"(by {truck} {end})"
    return action(f"drive {truck} {start} {end}", [here, f"(runs {truck})"], [there], [here])


def load(truck: str, place: str) -> Action:
    """Load the parcel."""
    lies = f"(parcel {place})"
    return action(f"load {truck} {place}", [f"(by {truck} {place})", lies], [f"(parcel {truck})"], [lies])


def test_two_objects_are_exchanged_before_the_long_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """The other truck is nearer: some of the tour is done already, so that a new name alone does not serve."""
    tours = [[drive(truck, "p1", "p2"), load(truck, "p2"), drive(truck, "p2", "p3")] for truck in ("t1", "t2")]
    state = facts(["(by t1 p1)", "(by t2 p2)", "(runs t2)", "(parcel p2)"])
    case = breach(state, tours[0], goals("(by t2 p3)", "(parcel t2)"), actions=[*tours[0], *tours[1]])
    assert means(mended(case, under_way=False)) == (Means.BRIDGE, ["load(t2, p2)", "drive(t2, p2, p3)"])
    monkeypatch.setattr(bridge, "MOST_EXPANSIONS", 1)
    assert means(mended(case, under_way=False)) == (Means.REBINDING, ["load(t2, p2)", "drive(t2, p2, p3)"])


def test_at_last_a_long_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the short one looked at counts as effort, too."""
    case = breach(changed(true=["(in b1 l1)"], false=["(in b1 l2)", *OPEN]), FETCH)
    short = mended(case, under_way=False)
    monkeypatch.setattr(bridge, "MOST_EXPANSIONS", 1)
    long = mended(case, under_way=False)
    assert means(long)[0] is Means.BRIDGE
    assert isinstance(short, Mended)
    assert isinstance(long, Mended)
    monkeypatch.setattr(bridge, "MOST_EFFORT", 1)
    none = mended(case, under_way=False)
    assert isinstance(none, NoBridge)
    assert none.why is Refusal.BUDGET
    assert none.effort < long.effort


def test_what_a_bridge_makes_needless_goes() -> None:
    """The ball comes along by itself when it is fetched with the cart: nobody has to pick it up first."""
    cart = action("cart", ["(at l1)"], ["(at l3)", "(in b1 l3)"], ["(at l1)", "(in b1 l2)"])
    plan = [action("call", [], ["(called)"]), *FETCH]
    case = breach(changed(false=["(free left)", "(free right)"]), plan, actions=[cart, *FETCH, plan[0]])
    assert means(mended(case, under_way=False)) == (Means.BRIDGE, ["cart()"])


def test_why_there_is_no_way_is_said() -> None:
    """The ball is gone."""
    found = mended(breach(changed(false=["(in b1 l2)"]), FETCH), under_way=False)
    assert isinstance(found, NoBridge)
    assert found.why is Refusal.UNSOLVABLE


# ---- a step under way --------------------------------------------------------------------------------------


def test_new_steps_come_behind_the_one_under_way() -> None:
    """The ball was moved while the robot is on its way: it arrives first."""
    state = changed(true=["(in b1 l3)"], false=["(in b1 l2)", "(in b2 l2)"])
    wanted = goals("(holds left b1)")
    case = breach(state, FETCH[:2], wanted)
    assert texts_of(mended(case, under_way=True)) == [0, "move(l2, l3)", "pick(b1, l3, left)"]
    assert texts_of(mended(case, under_way=False)) == ["move(l1, l3)", "pick(b1, l3, left)"]


def texts_of(found: Mended | NoBridge) -> list[int | str]:
    """The way on."""
    return means(found)[1]


def test_step_that_cannot_end_well_is_replaced() -> None:
    """The door was shut in front of the robot."""
    state = changed(false=["(open l2)"])
    assert texts_of(mended(breach(state, FETCH), under_way=True)) == [
        "unlock(l2)",
        "move(l1, l2)",
        1,
        2,
        3,
    ]


def test_nothing_is_under_way_in_an_empty_plan() -> None:
    """There is no first step."""
    state = changed(true=["(in b1 l1)"], false=["(in b1 l2)"])
    found = mended(breach(state, [], goals("(holds left b1)")), under_way=True)
    assert texts_of(found) == ["pick(b1, l1, left)"]


def test_bridge_behind_a_step_under_way_does_not_lead_back() -> None:
    """To where that step would have led without the surprise: somebody has taken the ball into l1."""
    state = changed(true=["(in b1 l1)"], false=["(in b1 l2)"])
    swap = [
        action(f"throw {start} {end}", [f"(in b1 {start})"], [f"(in b1 {end})"], [f"(in b1 {start})"])
        for start, end in permutations(ROOMS, 2)
    ]
    case = breach(state, FETCH[:2], goals("(holds left b1)"), actions=[*ALL, *swap])
    assert texts_of(mended(case, under_way=True)) == [0, "throw(l1, l2)", 1]
    case = replace(case, before=case.operators.state(START))
    assert texts_of(mended(case, under_way=True)) != [0, "throw(l1, l2)", 1]


def test_shorter_ways_begin_behind_the_step_under_way() -> None:
    """It cannot be taken back, whatever would have been shorter."""
    case = breach(START, [move("l1", "l2"), move("l2", "l1"), move("l1", "l3")], goals("(at l3)"))
    assert texts(shortened(case, (0, 1, 2), under_way=False)) == [2]
    assert texts(shortened(case, (0, 1, 2), under_way=True)) == [0, "move(l2, l3)"]
    assert texts(shortened(case, (2,), under_way=True)) == [2]
    assert texts(shortened(case, (0, 1, 2), Focus(frozenset({1}), 0), under_way=True)) == [0, "move(l2, l3)"]
    assert texts(shortened(case, (0, 1, 2), Focus(frozenset(), 0), under_way=True)) == [0, 1, 2]


def test_new_steps_may_be_shortened_again() -> None:
    """Those behind the one under way as well."""
    case = breach(START, [move("l1", "l2")], goals("(at l3)"))
    back, on = (case.operators.operator(move(*rooms)) for rooms in (("l2", "l1"), ("l1", "l3")))
    assert texts(shortened(case, (0, back, on), under_way=True)) == [0, "move(l2, l3)"]


def test_ways_are_composed() -> None:
    """New actions pass through."""
    back = Operators(ALL).all[0]
    assert composed((3, back, 5), (1, 0, back)) == (back, 3, back)


# ---- repairs -----------------------------------------------------------------------------------------------


PLAN = number(FETCH, first=3)


def mend(
    state: frozenset[Fact],
    plan: Plan = PLAN,
    wanted: tuple[Condition, ...] = FETCHED,
    *,
    actions: Iterable[Action] = ALL,
    spared: Iterable[Condition] = (),
    unknown: Iterable[str] = (),
    improve: bool = False,
    under_way: bool = False,
    undo: bool = False,
    next_id: int | None = None,
) -> Repaired | Refused:
    """The repair after what has changed since the start."""
    return repair(
        state,
        plan,
        wanted,
        changed=state ^ START,
        unknown=facts(unknown),
        operators=Operators(actions, wanted),
        spared=tuple(spared),
        improve=improve,
        under_way=under_way,
        undo=undo,
        next_id=next_id,
    )


def repaired(found: Repaired | Refused) -> Repaired:
    """The repair, which must not have been refused."""
    assert isinstance(found, Repaired)
    return found


def why(found: Repaired | Refused) -> Refusal:
    """Why it was refused."""
    assert isinstance(found, Refused)
    return found.why


def names(plan: Plan) -> list[str]:
    """The plan as one writes it."""
    return list(map(str, plan))


LOCKED = changed(false=["(open l2)"])


def test_old_steps_keep_their_ids_and_new_ones_get_new_ones() -> None:
    """One more than the highest, or from the id that was asked for."""
    found = repaired(mend(changed(false=["(free left)"])))
    assert [(step.id, str(step)) for step in found.plan] == [
        (3, "move(l1, l2)"),
        (7, "pick(b1, l2, right)"),
        (5, "move(l2, l3)"),
        (8, "drop(b1, l3, right)"),
    ]
    assert [step.id for step in found.added] == [7, 8]
    assert [(drop.step.id, drop.reason) for drop in found.dropped] == [
        (4, DropReason.REPLACED),
        (6, DropReason.REPLACED),
    ]
    assert [step.id for step in repaired(mend(changed(false=["(free left)"]), next_id=20)).added] == [20, 21]
    assert [step.id for step in repaired(mend(changed(false=["(free left)"]), next_id=2)).added] == [7, 8]


def test_repair_says_what_it_took() -> None:
    """And how much was looked at."""
    found = repaired(mend(LOCKED))
    assert (found.means, found.effort > 0, found.shortened) == (Means.BRIDGE, True, False)
    assert "unlock(l2)" in names(found.added)
    assert not found.links.unsupported
    easy = repaired(mend(changed(true=["(in b1 l3)"], false=["(in b1 l2)"])))
    assert (easy.plan, easy.means, easy.effort, easy.added) == ((), Means.DELETION, 0, ())


def test_certificate_names_the_supports_that_are_new() -> None:
    """The ball is held already: the rest of the plan hangs together as before, only its hold is taken from now."""
    state = changed(true=["(holds left b1)"], false=["(in b1 l2)", "(free left)"])
    found = repaired(mend(state))
    news = found.certificate(causal_links(START, PLAN, FETCHED))
    assert [(str(support.condition), support.consumer) for support in news] == [("(holds left b1)", 6)]
    assert found.certificate(found.links) == ()


def test_without_operators_the_plan_is_mended_by_its_own_steps_only() -> None:
    """Nobody knows what else could be done."""
    assert why(repair(LOCKED, PLAN, FETCHED, improve=True)) is Refusal.NO_ACTIONS


def test_refusal_says_why_and_what_is_missing() -> None:
    """The ball is gone; or others need what would have to be ended; or the only way is back."""
    gone = mend(changed(false=["(in b1 l2)"]))
    assert why(gone) is Refusal.UNSOLVABLE
    assert isinstance(gone, Refused)
    assert [str(gap.condition) for gap in gone.missing] == ["(in b1 l2)"]
    shut = Condition(parse_fact("(open l2)"), positive=False)
    assert why(mend(LOCKED, spared=[shut])) is Refusal.SPARED
    assert why(mend(LOCKED, actions=[unlock("l2"), *FETCH])) is Refusal.ONLY_BACK


def test_what_others_need_stays_though_no_action_asks_for_it() -> None:
    """The robot's actions tell only whether something is wet, not whether it is dry."""
    dry = Condition(parse_fact("(wet l2)"), positive=False)
    wade = action("wade", ["(at l1)"], ["(at l2)", "(wet l2)"], ["(at l1)"])
    assert why(mend(LOCKED, actions=[wade, *FETCH], spared=[dry])) is Refusal.SPARED
    assert "wade()" in names(repaired(mend(LOCKED, actions=[wade, *FETCH])).plan)


def test_another_object_is_not_taken_from_others() -> None:
    """They have asked for the right hand; nothing else would do."""
    hand = Condition(parse_fact("(free right)"))
    no_left = changed(false=["(free left)"])
    actions = [*FETCH, pick("b1", "l2", "right"), drop("b1", "l3", "right")]
    assert "pick(b1, l2, right)" in names(repaired(mend(no_left, actions=actions)).plan)
    assert why(mend(no_left, actions=actions, spared=[hand])) is Refusal.SPARED


def test_plan_may_need_what_no_action_speaks_of() -> None:
    """A meeting was called off, and with it an action that the plan still has: the ball is fetched instead."""
    receive = action("receive b1", ["(meets anna l3)", "(at l3)"], ["(in b1 l3)"])
    plan = number([move("l1", "l3"), receive])
    found = repaired(
        repair(START, plan, FETCHED, changed=facts(["(meets anna l3)"]), operators=Operators(ALL, FETCHED))
    )
    assert first_fault(START, found.plan, FETCHED) is None
    assert found.means is Means.BRIDGE
    there = START | facts(["(meets anna l3)"])
    assert names(repaired(repair(there, plan, FETCHED, operators=Operators(ALL, FETCHED), improve=True)).plan) == [
        "move(l1, l3)",
        "receive(b1)",
    ]


def test_what_is_not_known_is_not_relied_on() -> None:
    """Perhaps the door is open: to unlock it does no harm."""
    found = repaired(mend(START, unknown=["(open l2)"]))
    assert names(found.plan)[:2] == ["unlock(l2)", "move(l1, l2)"]


def test_step_under_way_is_mended_behind() -> None:
    """Its id stays; the door behind it does not matter."""
    found = repaired(
        mend(changed(true=["(in b1 l3)"], false=["(in b1 l2)"]), PLAN[:2], goals("(holds left b1)"), under_way=True)
    )
    assert found.plan[0] == PLAN[0]
    assert names(found.added) == ["move(l2, l3)", "pick(b1, l3, left)"]


# ---- improvement -------------------------------------------------------------------------------------------


def test_shorter_way_is_taken_if_asked_for() -> None:
    """The move through a room where nothing is to be done any more becomes a direct one."""
    state = changed(true=["(holds left b1)"], false=["(in b1 l2)", "(free left)"])
    plain, better = (repaired(mend(state, improve=improve)) for improve in (False, True))
    assert (names(plain.plan), plain.shortened) == (["move(l1, l2)", "move(l2, l3)", "drop(b1, l3, left)"], False)
    assert (names(better.plan), better.shortened) == (["move(l1, l3)", "drop(b1, l3, left)"], True)
    assert {drop.step.id: drop.reason for drop in better.dropped} == {
        3: DropReason.REPLACED,
        4: DropReason.NEEDLESS,
        5: DropReason.REPLACED,
    }
    assert better.means is Means.DELETION


def test_plan_that_cannot_be_bettered_stays_as_it_is() -> None:
    """With all that was found out about it."""
    found = repaired(mend(START, improve=True))
    assert (found.plan, found.shortened, found.added) == (PLAN, False, ())


def test_shorter_way_does_not_undo_what_others_have_done() -> None:
    """The bridge goes round by l3; to unlock the door again would be shorter, and lead back."""
    wanted = goals("(at l2)")
    plan = number([move("l1", "l2")])
    round_ = [
        action("out l3", ["(at l1)"], ["(at l3)"], ["(at l1)"]),
        action("in l2", ["(at l3)"], ["(at l2)"], ["(at l3)"]),
    ]
    actions = [unlock("l2"), *FETCH[:1], *(replace(act, cost=5) for act in round_)]
    found = repaired(mend(LOCKED, plan, wanted, actions=actions, improve=True))
    assert names(found.plan) == ["out(l3)", "in(l2)"]
    assert found.means is Means.BRIDGE


@pytest.mark.parametrize("improve", [False, True])
def test_bridge_is_not_shortened_to_one_that_leads_back(improve: bool) -> None:
    """Somebody has pushed the robot out of where it should be."""
    found = repaired(mend(changed(true=["(at l2)"], false=["(at l1)"]), (), goals("(at l1)"), improve=improve))
    assert first_fault(changed(true=["(at l2)"], false=["(at l1)"]), found.plan, goals("(at l1)")) is None
    assert names(found.plan) != ["move(l2, l1)"]


def test_new_plan_is_looked_through_as_a_whole() -> None:
    """After a small change only what is near it, unless it is said that the plan is new."""
    marks = [action(f"mark{i}", [f"(mark {i})"], [f"(mark {i + 1})"]) for i in range(12)]
    wave = action("wave", [], ["(waved)"])
    wanted = goals("(at l3)", "(mark 12)", "(waved)")
    plan = number([move("l1", "l2"), move("l2", "l3"), *marks, wave])
    state, news = START | facts(["(mark 0)", "(waved)"]), facts(["(waved)"])
    operators = Operators([*ALL, *marks, wave], wanted)
    near, whole = (
        repaired(repair(state, plan, wanted, changed=news, operators=operators, improve=True, everywhere=everywhere))
        for everywhere in (False, True)
    )
    assert near.plan == plan[:-1]
    assert names(whole.plan) == ["move(l1, l3)", *map(str, plan[2:-1])]


def test_what_nobody_meant_may_be_undone() -> None:
    """Where going back is no offence, the door that fell shut is simply opened again."""
    found = repaired(mend(LOCKED, actions=[unlock("l2"), *FETCH], undo=True))
    assert [step.action for step in found.added] == [unlock("l2")]
    assert found.plan[1:] == PLAN
