"""Grounding of lifted actions."""

from dataclasses import replace

import pytest

from clo_fleet.clo.task import Action, Condition
from clo_fleet.planning import reachability
from clo_fleet.planning.formulas import FALSE, TRUE, AllOf, AnyOf, Formula, Literal
from clo_fleet.planning.grounding import Change, GroundingError, LiftedAction, LiftedTask, grounding

PLACES = ("p1", "p2", "p3")
ROAD, HERE, THERE = Literal(("road", 0, 1)), Literal(("at", 0)), Literal(("at", 1))
MOVE = LiftedAction(
    name="move",
    parameters=(PLACES, PLACES),
    needs=AllOf((ROAD, HERE)),
    changes=(Change(("at", 1), True, TRUE), Change(("at", 0), False, TRUE)),
)
TASK = LiftedTask(
    name="town",
    predicates=frozenset({"at", "road"}),
    facts=frozenset({("at", "p1"), ("road", "p1", "p2"), ("road", "p3", "p1")}),
    goal=Literal(("at", "p2")),
    actions=(MOVE,),
)


def with_move(needs: Formula = MOVE.needs, cost: int | tuple[str | int, ...] = 1) -> LiftedTask:
    """The task with another move."""
    return replace(TASK, actions=(replace(MOVE, needs=needs, cost=cost),))


def test_only_what_can_be_reached_becomes_an_action_and_static_facts_are_left_out() -> None:
    """There is no road to p3: nothing starts there. Roads are in no state and in no condition."""
    found = grounding(TASK)
    assert found.task.state == {("at", "p1")}
    assert found.static == {("road", "p1", "p2"), ("road", "p3", "p1")}
    assert found.task.goals == (Condition(("at", "p2")),)
    assert found.task.actions == (
        Action(
            schema="move",
            args=("p1", "p2"),
            needs=(Condition(("at", "p1")),),
            adds=frozenset({("at", "p2")}),
            deletes=frozenset({("at", "p1")}),
        ),
    )
    assert found.origins == {("move", ("p1", "p2")): ("move", ("p1", "p2"))}


def test_parameters_that_no_fact_binds_take_every_object() -> None:
    """Without a road to ask for, every pair of places is a move; to stay adds what it deletes."""
    names = [action.name for action in grounding(with_move(HERE)).task.actions]
    assert names == [f"move({a}, {b})" for a in PLACES for b in PLACES]


def test_negative_conditions_do_not_keep_an_action_from_being_reached() -> None:
    """They are kept as they are, with their sign."""
    found = grounding(with_move(AllOf((ROAD, HERE, Literal(("at", 1), positive=False)))))
    assert found.task.actions[0].needs == (Condition(("at", "p1")), Condition(("at", "p2"), positive=False))


def test_an_action_with_several_cases_becomes_variants_with_names_of_their_own() -> None:
    """They lead back to the one action of the problem. A case that cannot be reached is no variant."""
    found = grounding(with_move(AllOf((ROAD, AnyOf((HERE, Literal(("at", 1), positive=False)))))))
    assert [action.name for action in found.task.actions] == ["move(p3, p1)", "move/1(p1, p2)", "move/2(p1, p2)"]
    assert found.origins["move/2", ("p1", "p2")] == ("move", ("p1", "p2"))


def test_conditional_effects_split_by_whether_they_apply() -> None:
    """One variant for each: the condition holds and the effect is there, or it does not and it is not."""
    lock = LiftedAction(
        name="lock",
        parameters=(),
        needs=TRUE,
        changes=(Change(("at", "p3"), True, Literal(("at", "p1"))), Change(("at", "p1"), False, TRUE)),
    )
    actions = grounding(replace(TASK, actions=(lock,))).task.actions
    assert {(action.needs, action.adds) for action in actions} == {
        ((Condition(("at", "p1")),), frozenset({("at", "p3")})),
        ((Condition(("at", "p1"), positive=False),), frozenset()),
    }


def test_a_goal_with_several_cases_is_noted_by_an_action() -> None:
    """The note has no original, and every action that could undo the goal takes it away."""
    found = grounding(replace(TASK, goal=AnyOf((Literal(("at", "p2")), Literal(("at", "p1"), positive=False)))))
    (goal,) = found.task.goals
    notes = [action for action in found.task.actions if goal.fact in action.adds]
    assert {action.needs for action in notes} == {
        (Condition(("at", "p2")),),
        (Condition(("at", "p1"), positive=False),),
    }
    assert all(found.origins[action.schema, action.args] is None and action.cost == 0 for action in notes)
    assert all(goal.fact in action.deletes for action in found.task.actions if action not in notes)


def test_a_goal_that_is_settled_by_static_facts() -> None:
    """A goal that always holds asks for nothing; one that never does, for what nothing adds."""
    assert grounding(replace(TASK, goal=Literal(("road", "p1", "p2")))).task.goals == ()
    never = grounding(replace(TASK, goal=FALSE)).task
    assert len(never.goals) == 1
    assert all(never.goals[0].fact not in action.adds for action in never.actions)


def test_costs_come_from_the_terms_of_the_task() -> None:
    """A cost term is looked up for the bound parameters; one without a value is named."""
    priced = replace(with_move(cost=("length", 0, 1)), costs={("length", "p1", "p2"): 7})
    assert [action.cost for action in grounding(priced).task.actions] == [7]
    with pytest.raises(GroundingError, match=r"action move: the cost \(length p1 p2\) has no value") as caught:
        grounding(with_move(cost=("length", 0, 1)))
    assert caught.value.place == "action move"


def test_a_problem_too_large_to_be_grounded_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limits are on actions found, on bindings looked at, and on the cases of one action or the goal."""
    either = tuple(AnyOf((Literal(("at", f"a{i}")), Literal(("at", f"b{i}")))) for i in range(13))
    with pytest.raises(GroundingError, match="move: its conditions have more than 4096 cases"):
        grounding(with_move(AllOf((ROAD, HERE, *either))))
    with pytest.raises(GroundingError, match="the goal: its conditions have more than"):
        grounding(replace(TASK, goal=AllOf(either)))
    switches = tuple(Change(("at", f"b{i}"), True, Literal(("at", f"a{i}"))) for i in range(13))
    with pytest.raises(GroundingError, match="move: its conditions have more than 4096 cases"):
        grounding(replace(TASK, actions=(replace(MOVE, changes=switches),)))
    monkeypatch.setattr(reachability, "MOST_BINDINGS", 8)
    with pytest.raises(GroundingError, match="more than 8 bindings"):
        grounding(with_move(HERE))
