"""A plan is run forward, step by step, to tell whether and where it breaks."""

import pytest

from clo_fleet.clo.plan import Fault, Step, cost, first_fault, goals_of, number
from clo_fleet.clo.task import Action, Condition, Fact

AT = {place: ("at-robot", place) for place in ("l1", "l2", "l3")}


def move(start: str, end: str, price: int = 1) -> Action:
    """Go from room to room."""
    return Action(
        schema="move",
        args=(start, end),
        needs=(Condition(AT[start]),),
        adds=frozenset({AT[end]}),
        deletes=frozenset({AT[start]}),
        cost=price,
    )


THERE_AND_BACK = number([move("l1", "l2", 30), move("l2", "l1", 40)], first=7)


def test_steps_are_numbered_from_the_first() -> None:
    """The same action twice makes two steps."""
    plan = number([move("l1", "l2"), move("l2", "l1"), move("l1", "l2")], first=5)
    assert [step.id for step in plan] == [5, 6, 7]
    assert plan[0] != plan[2]
    assert plan[0].action == plan[2].action


def test_step_is_written_as_its_action() -> None:
    """Its number is of no interest to people."""
    assert str(Step(7, move("l1", "l2"))) == "move(l1, l2)"


def test_cost_of_a_plan_is_that_of_its_actions() -> None:
    """Nothing costs nothing."""
    assert (cost(()), cost(THERE_AND_BACK)) == (0, 70)


def test_facts_become_goals_to_be_true() -> None:
    """In the order given."""
    assert goals_of([AT["l2"], AT["l1"]]) == (Condition(AT["l2"]), Condition(AT["l1"]))


@pytest.mark.parametrize(
    ("state", "goals", "fault"),
    [
        ({AT["l1"]}, [Condition(AT["l1"]), Condition(AT["l2"], positive=False)], None),
        ({AT["l3"]}, [Condition(AT["l3"])], Fault(THERE_AND_BACK[0], (Condition(AT["l1"]),))),
        ({AT["l1"]}, [Condition(AT["l1"]), Condition(AT["l3"])], Fault(None, (Condition(AT["l3"]),))),
        ({AT["l1"], AT["l3"]}, [Condition(AT["l3"], positive=False)], Fault(None, (Condition(AT["l3"], False),))),
    ],
)
def test_first_fault_says_where_a_plan_breaks(state: set[Fact], goals: list[Condition], fault: Fault | None) -> None:
    """At the step that cannot be done, or at the end for goals that are not reached."""
    assert first_fault(state, THERE_AND_BACK, goals) == fault


def test_later_steps_see_the_effects_of_earlier_ones() -> None:
    """The second step breaks if the first is left out."""
    assert first_fault({AT["l1"]}, THERE_AND_BACK[1:], ()) == Fault(THERE_AND_BACK[1], (Condition(AT["l2"]),))
