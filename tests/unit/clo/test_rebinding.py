"""Rebinding: another hand, another truck, in the place of one that a surprise has taken."""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from clo_fleet.clo import rebinding
from clo_fleet.clo.bridge import Breach, Way
from clo_fleet.clo.operators import Operator, Operators
from clo_fleet.clo.rebinding import exchanged, rebound
from clo_fleet.clo.task import Action, Condition, parse_fact


def action(name: str, needs: Iterable[str], adds: Iterable[str], deletes: Iterable[str]) -> Action:
    """The action written as ``pick b1 left``."""
    schema, *args = name.split()
    return Action(
        schema=schema,
        args=tuple(args),
        needs=tuple(Condition(parse_fact(text)) for text in needs),
        adds=frozenset(map(parse_fact, adds)),
        deletes=frozenset(map(parse_fact, deletes)),
    )


def pick(ball: str, hand: str) -> Action:
    """Take the ball from the floor."""
    free, lies = f"(free {hand})", f"(lies {ball})"
    return action(f"pick {ball} {hand}", [free, lies], [f"(holds {hand} {ball})"], [free, lies])


def drop(ball: str, hand: str) -> Action:
    """Put the ball into the box."""
    holds = f"(holds {hand} {ball})"
    return action(f"drop {ball} {hand}", [holds], [f"(free {hand})", f"(boxed {ball})"], [holds])


HANDS, BALLS = ("left", "middle", "right"), ("b1", "b2")
GRIPPER = [do(ball, hand) for do in (pick, drop) for ball in BALLS for hand in HANDS]


def breach(
    state: Iterable[str],
    plan: Iterable[Action],
    goals: Iterable[str],
    *,
    actions: Iterable[Action] = GRIPPER,
    spared: Iterable[str] = (),
) -> Breach:
    """What is to be mended."""
    operators = Operators(actions, [Condition(parse_fact(goal)) for goal in goals])
    return Breach(
        operators=operators,
        state=operators.state(frozenset(map(parse_fact, state))),
        plan=tuple(map(operators.operator, plan)),
        goals=operators.mask(Condition(parse_fact(goal)) for goal in goals),
        spared=operators.mask(Condition(parse_fact(text)) for text in spared),
    )


def steps(way: Way | None) -> list[int | str]:
    """The places of steps that stay, and the names of those that are new."""
    assert way is not None
    return [step.action.name if isinstance(step, Operator) else step for step in way]


BOTH = [pick("b1", "left"), drop("b1", "left"), pick("b2", "left"), drop("b2", "left")]
BOXED = ["(boxed b1)", "(boxed b2)"]
ON_THE_FLOOR = ["(lies b1)", "(lies b2)"]


# ---- onwards -----------------------------------------------------------------------------------------------


def test_another_hand_takes_the_ball_and_puts_it_down() -> None:
    """The left one is taken: what it should have held, the other one drops; then it is free again for the rest."""
    state = ["(free right)", *ON_THE_FLOOR]
    assert steps(rebound(breach(state, BOTH, BOXED))) == [
        "pick(b1, right)",
        "drop(b1, right)",
        "pick(b2, right)",
        "drop(b2, right)",
    ]


def test_steps_that_handle_something_else_keep_their_hand() -> None:
    """Only the second ball needs another: the first is in the left hand, and stays there."""
    plan = [pick("b2", "right"), drop("b1", "left"), drop("b2", "right"), pick("b1", "right")]
    state = ["(holds left b1)", "(free middle)", "(lies b2)"]
    found = rebound(breach(state, plan[:3], BOXED))
    assert steps(found) == ["pick(b2, middle)", 1, "drop(b2, middle)"]


def test_what_another_step_makes_is_not_the_new_hand_s() -> None:
    """The right hand is repaired before its next use: from then on the plan keeps to it."""
    mend = action("mend right", [], ["(free right)"], [])
    plan = [pick("b1", "right"), drop("b1", "right"), mend, pick("b2", "right"), drop("b2", "right")]
    found = rebound(breach(["(free left)", *ON_THE_FLOOR], plan, BOXED, actions=[*GRIPPER, mend]))
    assert steps(found) == ["pick(b1, left)", "drop(b1, left)", 2, 3, 4]


def test_hand_that_comes_furthest_is_taken() -> None:
    """The middle one is wanted for something else in between."""
    wave = action("wave middle", ["(free middle)"], ["(waved)"], [])
    plan = [pick("b1", "left"), wave, drop("b1", "left")]
    state = ["(free middle)", "(free right)", "(lies b1)"]
    found = rebound(breach(state, plan, ["(boxed b1)", "(waved)"], actions=[*GRIPPER, wave]))
    assert steps(found) == ["pick(b1, right)", 1, "drop(b1, right)"]


def test_step_further_on_may_want_another_hand_as_well() -> None:
    """Both of the plan's hands are taken, and two others free."""
    plan = [pick("b1", "left"), pick("b2", "left2"), drop("b1", "left"), drop("b2", "left2")]
    hands = ("left", "left2", "right", "right2")
    actions = [do(ball, hand) for do in (pick, drop) for ball in BALLS for hand in hands]
    found = rebound(breach(["(free right)", "(free right2)", *ON_THE_FLOOR], plan, BOXED, actions=actions))
    assert steps(found) == ["pick(b1, right)", "pick(b2, right2)", "drop(b1, right)", "drop(b2, right2)"]


def test_nothing_is_rebound_where_nothing_fits() -> None:
    """No hand is free; or the plan goes through and misses its goal."""
    assert rebound(breach(ON_THE_FLOOR, BOTH, BOXED)) is None
    assert rebound(breach(["(free left)", *ON_THE_FLOOR], BOTH[:2], BOXED)) is None
    assert rebound(breach([], [], ["(boxed b1)"])) is None


def test_hand_that_cannot_do_all_that_follows_is_not_taken() -> None:
    """The right one can pick, and not drop."""
    actions = [step for step in GRIPPER if step.name != "drop(b1, right)"]
    state = ["(free right)", "(lies b1)"]
    assert rebound(breach(state, BOTH[:2], BOXED[:1], actions=actions)) is None


def test_what_others_need_is_not_taken() -> None:
    """They have asked for the right hand; there is still the middle one."""
    state = ["(free middle)", "(free right)", "(lies b1)"]
    case = breach(state, BOTH[:2], BOXED[:1], spared=["(free right)"])
    assert steps(rebound(case)) == ["pick(b1, middle)", "drop(b1, middle)"]
    assert rebound(breach(["(free right)", "(lies b1)"], BOTH[:2], BOXED[:1], spared=["(free right)"])) is None


def test_trials_have_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each costs the steps that it runs through."""
    plan = [pick("b1", "left"), pick("b2", "left2"), drop("b1", "left"), drop("b2", "left2")]
    hands = ("left", "left2", "right", "right2")
    actions = [do(ball, hand) for do in (pick, drop) for ball in BALLS for hand in hands]
    case = breach(["(free right)", "(free right2)", *ON_THE_FLOOR], plan, BOXED, actions=actions)
    monkeypatch.setattr(rebinding, "MOST_ONWARDS", 3)
    assert rebound(case) is None
    monkeypatch.setattr(rebinding, "MOST_ONWARDS", 8)
    assert rebound(case) is not None


# ---- exchanged ---------------------------------------------------------------------------------------------


def drive(truck: str, start: str, end: str) -> Action:
    """From place to place."""
    here, there = f"(at {truck} {start})", f"(at {truck} {end})"
    return action(f"drive {truck} {start} {end}", [here, f"(runs {truck})"], [there], [here])


def load(truck: str, place: str) -> Action:
    """Load the parcel."""
    at, lies = f"(at {truck} {place})", f"(parcel {place})"
    return action(f"load {truck} {place}", [at, lies], [f"(parcel {truck})"], [lies])


PLACES, TRUCKS = ("p1", "p2", "p3"), ("t1", "t2")
TRANSPORT = [drive(truck, start, end) for truck in TRUCKS for start in PLACES for end in PLACES if start != end]
TRANSPORT += [load(truck, place) for truck in TRUCKS for place in PLACES]
DELIVERY = [drive("t1", "p1", "p2"), load("t1", "p2"), drive("t1", "p2", "p3")]


def test_other_truck_takes_the_place_of_one_that_broke_down() -> None:
    """It is nearer: its way to the parcel is left out."""
    state = ["(at t1 p1)", "(at t2 p2)", "(runs t2)", "(parcel p2)"]
    case = breach(state, DELIVERY, ["(at t2 p3)", "(parcel t2)"], actions=TRANSPORT)
    assert steps(exchanged(case)) == ["load(t2, p2)", "drive(t2, p2, p3)"]
    assert rebound(case) is None


def test_two_trucks_exchange_their_tours() -> None:
    """Each does what the other should have done; a step of neither stays as it is."""
    ring = action("ring", [], ["(rung)"], [])
    plan = [drive("t1", "p1", "p2"), ring, drive("t2", "p3", "p2")]
    state = ["(at t1 p3)", "(at t2 p1)", "(runs t1)", "(runs t2)"]
    case = breach(state, plan, ["(at t1 p2)", "(at t2 p2)", "(rung)"], actions=[*TRANSPORT, ring])
    assert steps(exchanged(case)) == ["drive(t2, p1, p2)", 1, "drive(t1, p3, p2)"]


def test_plan_that_is_not_broken_has_nothing_to_exchange() -> None:
    """Its goals are lost for another reason."""
    case = breach(["(at t1 p1)", "(runs t1)"], DELIVERY[:1], ["(parcel t1)"], actions=TRANSPORT)
    assert exchanged(case) is None


def test_exchange_needs_an_action_for_each_step() -> None:
    """The other truck cannot load."""
    state = ["(at t1 p1)", "(at t2 p1)", "(runs t2)", "(parcel p2)"]
    actions = [act for act in TRANSPORT if act.name != "load(t2, p2)"]
    assert exchanged(breach(state, DELIVERY, ["(at t2 p3)"], actions=actions)) is None
    assert exchanged(breach(state, DELIVERY, ["(at t2 p3)"], actions=TRANSPORT)) is not None


def test_exchange_does_not_end_what_others_need() -> None:
    """They have asked the other truck to stay."""
    state = ["(at t1 p1)", "(at t2 p2)", "(runs t2)", "(parcel p2)"]
    case = breach(state, DELIVERY, ["(parcel t2)", "(at t2 p3)"], actions=TRANSPORT, spared=["(at t2 p2)"])
    assert exchanged(case) is None
    assert exchanged(replace(case, spared=0)) is not None


def test_exchanges_have_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """With many trucks only the first are tried."""
    trucks = [f"t{i}" for i in range(1, 8)]
    actions = [do for truck in trucks for do in (drive(truck, "p1", "p2"), drive(truck, "p2", "p3"), load(truck, "p2"))]
    case = breach(["(at t7 p1)", "(runs t7)", "(parcel p2)"], DELIVERY, ["(parcel t7)"], actions=actions)
    assert exchanged(case) is not None
    monkeypatch.setattr(rebinding, "MOST_EXCHANGED", 10)
    assert exchanged(case) is None
