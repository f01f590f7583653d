"""What is read of a problem of unified-planning."""

from fractions import Fraction

import pytest
from unified_planning.environment import Environment
from unified_planning.model import Fluent, InstantaneousAction, Object, Problem, Variable
from unified_planning.model.metrics import MinimizeActionCosts
from unified_planning.model.multi_agent import MultiAgentProblem

from clo_fleet.clo.task import Condition
from clo_fleet.planning import lifting
from clo_fleet.planning.grounding import grounding
from clo_fleet.planning.lifting import UnsupportedProblemError, lifted


class World:
    """A problem with two lamps, ``on`` and ``off`` as facts of each, and a switch for both."""

    def __init__(self) -> None:
        self.environment = Environment()
        self.environment.error_used_name = False
        self.manager = self.environment.expression_manager
        types = self.environment.type_manager
        self.lamp = types.UserType("lamp")
        self.on = Fluent("on", types.BoolType(), environment=self.environment, x=self.lamp)
        self.ready = Fluent("ready", types.BoolType(), environment=self.environment)
        self.problem = Problem("lamps", self.environment)
        self.problem.add_fluent(self.on, default_initial_value=True)
        self.problem.add_fluent(self.ready, default_initial_value=False)
        self.lamps = [Object(name, self.lamp, self.environment) for name in ("a", "b")]
        self.problem.add_objects(self.lamps)

    def action(self, name: str) -> InstantaneousAction:
        """A new action without parameters."""
        action = InstantaneousAction(name, None, self.environment)
        self.problem.add_action(action)
        return action


def test_what_is_true_by_default_is_true_unless_said_otherwise() -> None:
    """Closed worlds have defaults that are false; others are spelt out."""
    world = World()
    world.problem.set_initial_value(world.on(world.lamps[1]), False)
    assert lifted(world.problem).facts == {("on", "a")}


def test_a_value_that_depends_on_the_state_becomes_two_conditional_effects() -> None:
    """``ready := on(a) iff on(b)`` is set where that holds, and unset where it does not."""
    world = World()
    a, b = (world.on(lamp) for lamp in world.lamps)
    world.action("compare").add_effect(world.ready, world.manager.Iff(a, b))
    world.action("break").add_effect(a, False)
    for action in grounding(lifted(world.problem)).task.actions:
        if action.schema.startswith("compare"):
            signs = {need.positive for need in action.needs}
            assert (action.adds == {("ready",)}) is (len(signs) == 1)
            assert (action.deletes == {("ready",)}) is (len(signs) == 2)


def test_implications_and_quantifiers_are_spelt_out() -> None:
    """``forall x: ready implies on(x)`` holds without ``ready``, or with both lamps on."""
    world = World()
    x = Variable("x", world.lamp, world.environment)
    manager = world.manager
    world.problem.add_goal(manager.Forall(manager.Implies(world.ready, world.on(x)), x))
    world.action("go").add_effect(world.ready, True)
    world.action("break").add_effect(world.on(world.lamps[0]), False)
    world.action("crash").add_effect(world.on(world.lamps[1]), False)
    task = grounding(lifted(world.problem)).task
    notes = [set(action.needs) for action in task.actions if ("goal-reached",) in action.adds]
    assert {Condition(("ready",), positive=False)} in notes
    assert {Condition(("on", "a")), Condition(("on", "b"))} in notes


def test_costs_are_multiplied_to_whole_numbers() -> None:
    """A half and a third become three and two; an action without a cost costs nothing."""
    world = World()
    costs = {world.action("half"): Fraction(1, 2), world.action("third"): Fraction(1, 3)}
    world.action("free")
    numbers = {action: world.manager.Real(cost) for action, cost in costs.items()}
    world.problem.add_quality_metric(MinimizeActionCosts(numbers, environment=world.environment))
    assert {action.name: action.cost for action in lifted(world.problem).actions} == {"half": 3, "third": 2, "free": 0}


def test_what_has_no_ground_form_is_named_with_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Object fluents, other kinds of problems, and formulas that are too large or too deep."""
    world = World()
    best = Fluent("best", world.lamp, environment=world.environment)
    world.problem.add_fluent(best, default_initial_value=world.lamps[0])
    with pytest.raises(UnsupportedProblemError, match="the problem: not supported: object fluents") as caught:
        lifted(world.problem)
    assert (caught.value.place, caught.value.what) == ("the problem", "object fluents")
    with pytest.raises(UnsupportedProblemError, match="not supported: a MultiAgentProblem"):
        lifted(MultiAgentProblem("many"))
    world = World()
    x, y = (Variable(name, world.lamp, world.environment) for name in "xy")
    action = world.action("check")
    action.add_effect(world.ready, True)
    action.add_precondition(world.manager.Exists(world.manager.And(world.on(x), world.on(y)), x, y))
    monkeypatch.setattr(lifting, "MOST_PARTS", 3)
    with pytest.raises(UnsupportedProblemError, match="action check: not supported: more than 3 objects"):
        lifted(world.problem)
    deep = world.ready()
    for _ in range(2000):
        deep = world.manager.Or(world.manager.And(deep, world.on(world.lamps[0])), world.on(world.lamps[1]))
    action.clear_preconditions()
    action.add_precondition(deep)
    with pytest.raises(UnsupportedProblemError, match="conditions that nest so deeply"):
        lifted(world.problem)
