"""What is written as plain data reads back as it was."""

import json

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.plain import (
    plain_cause,
    plain_conditions,
    plain_facts,
    plain_flip,
    plain_plan,
    read_cause,
    read_conditions,
    read_facts,
    read_flip,
    read_plan,
)
from clo_fleet.clo.plan import number
from clo_fleet.clo.task import Action, Condition

HERE, THERE = ("at-robot", "l1"), ("at-robot", "l2")
MOVE = Action(
    schema="move",
    args=("l1", "l2"),
    needs=(Condition(HERE), Condition(("shut", "l2"), positive=False)),
    adds=frozenset({THERE}),
    deletes=frozenset({HERE}),
    cost=35,
)
CAUSE = Cause("r2", "close(l2)", 41)


def test_each_kind_of_value_survives_json() -> None:
    """Facts, conditions, causes, flips and plans are the same after a round trip."""
    facts, conditions, plan = frozenset({HERE, THERE}), MOVE.needs, number([MOVE, MOVE], first=7)
    assert read_facts(json.loads(json.dumps(plain_facts(facts)))) == facts
    assert read_conditions(json.loads(json.dumps(plain_conditions(conditions)))) == conditions
    assert read_plan(json.loads(json.dumps(plain_plan(plan)))) == plan
    for cause in (CAUSE, None):
        assert read_cause(json.loads(json.dumps(plain_cause(cause)))) == cause
        flip = Flip(HERE, False, cause)
        assert read_flip(json.loads(json.dumps(plain_flip(flip)))) == flip


def test_equal_sets_are_written_alike() -> None:
    """Whatever the order in which their facts came."""
    assert plain_facts([HERE, THERE]) == plain_facts([THERE, HERE])
