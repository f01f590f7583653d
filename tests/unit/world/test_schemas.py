"""Schemas and their ground actions."""

import pytest

from clo_fleet.clo.task import Action, Condition
from clo_fleet.world.pddl import fleet_domain, read_domain
from clo_fleet.world.schemas import GroundingError

COSTS = {("travel-time", "l3", "l1"): 70, ("give-time",): 20}


def test_a_ground_action_has_changing_preconditions_only() -> None:
    """`self`, `room` and `connected` decide which actions exist; they are not needed by the ground action."""
    assert fleet_domain().ground("move", ("r1", "l3", "l1"), COSTS) == Action(
        schema="move",
        args=("r1", "l3", "l1"),
        needs=(Condition(("at-robot", "r1", "l3")),),
        adds=frozenset({("at-robot", "r1", "l1")}),
        deletes=frozenset({("at-robot", "r1", "l3")}),
        cost=70,
    )


def test_what_others_announce_is_needed_although_no_action_changes_it() -> None:
    """`meets` may change while the plan runs, so `give` watches it."""
    action = fleet_domain().ground("give", ("r1", "r2", "o1", "l1"), COSTS)
    assert Condition(("meets", "r2", "l1")) in action.needs
    assert action.cost == 20


def test_negative_preconditions_and_equality_of_any_domain() -> None:
    """A negative precondition stays one, equality is static, an action without a cost costs 1."""
    domain = read_domain("""(define (domain d) (:predicates (on ?a) (broken ?a)) (:action light :parameters (?a ?b)
        :precondition (and (on ?a) (not (broken ?b)) (not (= ?a ?b))) :effect (and (on ?b) (broken ?a))))""")
    action = domain.ground("light", ("x", "y"), {})
    assert action.needs == (Condition(("on", "x")), Condition(("broken", "y"), positive=False))
    assert action.cost == 1


@pytest.mark.parametrize(
    ("name", "args", "fault"),
    [
        ("fly", ("r1",), "has no such action"),
        ("move", ("r1", "l3"), "expected 3 arguments, got 2"),
        ("move", ("r1", "l1", "l2"), r"no value for \(travel-time l1 l2\)"),
    ],
)
def test_what_cannot_be_grounded_is_refused(name: str, args: tuple[str, ...], fault: str) -> None:
    """The error names the step and the reason."""
    with pytest.raises(GroundingError, match=fault) as caught:
        fleet_domain().ground(name, args, COSTS)
    assert caught.value.step == (name, *args)
