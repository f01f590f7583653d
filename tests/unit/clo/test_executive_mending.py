"""The executive with a repertoire: mended plans, goals that change, and what is not known any more."""

from collections.abc import Collection
from dataclasses import dataclass, field

import pytest

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.messages import (
    ActionCancelled,
    ActionFinished,
    AskPlan,
    Begin,
    CancelAction,
    Cause,
    Command,
    Event,
    Flip,
    Forgotten,
    GoalsChanged,
    GoalsMet,
    Observed,
    PlanArrived,
    PlanMended,
    RepairRefused,
    StartAction,
)
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.repair import Repaired
from clo_fleet.clo.strategies import (
    Adopt,
    AsPrinted,
    Clo,
    Replan,
    ReplanOnOpportunity,
    Revision,
    Situation,
    Strategy,
)
from clo_fleet.clo.task import Action, Condition, Fact, State, parse_fact

ROOMS = ("l1", "l2", "l3")
ITEMS = ("o1", "o2")


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def action(name: str, needs: Collection[str], adds: Collection[str], deletes: Collection[str] = ()) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    conditions = tuple(Condition(parse_fact(text)) for text in needs)
    return Action(schema=schema, args=tuple(args), needs=conditions, adds=facts(*adds), deletes=facts(*deletes))


def move(start: str, end: str) -> Action:
    """Go from room to room."""
    return action(f"move {start} {end}", [f"(at {start})"], [f"(at {end})"], [f"(at {start})"])


def grasp(item: str, room: str) -> Action:
    """Take the object."""
    lies = f"(in {item} {room})"
    return action(f"grasp {item} {room}", [lies, f"(at {room})"], [f"(holding {item})"], [lies])


EVERYTHING = (
    *(move(start, end) for start in ROOMS for end in ROOMS if start != end),
    *(grasp(item, room) for item in ITEMS for room in ROOMS),
)
START = facts("(at l1)", "(in o1 l2)", "(in o2 l3)")
GOALS = ("(holding o1)",)
FETCH = [move("l1", "l2"), grasp("o1", "l2")]


@dataclass
class Known:
    """An ``ActionSource`` for one building; remembers the states that it was asked about."""

    asked: list[State] = field(default_factory=list)

    def operators(self, state: State, goals: tuple[Condition, ...]) -> Operators:
        """All actions."""
        self.asked.append(state)
        return Operators(EVERYTHING, goals)


class Script:
    """An executive that knows what its robot could do."""

    def __init__(self, *plan: Action, strategy: Strategy | None = None, goals: Collection[str] = GOALS) -> None:
        self.known = Known()
        self.executive = Executive(strategy or Clo(), START, goals_of(map(parse_fact, goals)), self.known)
        self.tell(Begin(0))
        self.first = self.tell(PlanArrived(0, plan))

    def tell(self, event: Event) -> list[Command]:
        """What it answers; its steps stay accounted for."""
        commands = list(self.executive.handle(event))
        assert self.executive.tally.adds_up
        return commands

    def see(self, *true: str, false: Collection[str] = ()) -> list[Command]:
        """Facts turn out true, or false."""
        return self.tell(
            Observed(1, (*(Flip(parse_fact(t), True) for t in true), *(Flip(parse_fact(t), False) for t in false)))
        )

    @property
    def rest(self) -> list[str]:
        """The plan as one writes it."""
        return list(map(str, self.executive.plan))


def kinds(commands: list[Command]) -> list[str]:
    """What sort of answers there are."""
    return [type(command).__name__ for command in commands]


# ---- mending -----------------------------------------------------------------------------------------------


def test_plan_is_mended_behind_the_running_action() -> None:
    """Somebody moved the object: the way on begins where the running move will end; the planner is not asked."""
    robot = Script(*FETCH)
    commands = robot.see("(in o1 l3)", false=["(in o1 l2)"])
    assert kinds(commands) == ["StepsDropped", "PlanMended"]
    assert robot.rest == ["move(l1, l2)", "move(l2, l3)", "grasp(o1, l3)"]
    assert robot.executive.tally.added == 2
    assert robot.executive.tally.planner_calls == 1


def test_mended_steps_have_ids_never_used_before() -> None:
    """A log that names a step by its id stays true."""
    robot = Script(*FETCH)
    mended = next(
        command for command in robot.see("(in o1 l3)", false=["(in o1 l2)"]) if isinstance(command, PlanMended)
    )
    assert [step.id for step in mended.added] == [3, 4]
    assert mended.means == "bridge"
    assert [step.id for step in robot.executive.plan] == [1, 3, 4]


def test_mended_plan_runs_to_the_goals() -> None:
    """Old and new steps, one after the other."""
    robot = Script(*FETCH)
    robot.see("(in o1 l3)", false=["(in o1 l2)"])
    for _ in range(3):
        assert robot.executive.running is not None
        commands = robot.tell(ActionFinished(2, robot.executive.running.id))
    assert commands == [GoalsMet()]


def test_running_action_that_cannot_end_well_is_stopped_and_the_plan_goes_on_without_it() -> None:
    """The robot finds itself in another room while it grasps: it stops, goes back and grasps again."""
    robot = Script(*FETCH)
    robot.tell(ActionFinished(1, 1))
    grasping = robot.executive.running
    assert grasping is not None
    commands = robot.see("(at l3)", "(in o2 l1)", false=["(at l2)", "(in o2 l3)"])
    assert commands[0] == CancelAction(grasping, "another way takes its place")
    assert robot.rest == ["grasp(o1, l2)", "move(l3, l2)", "grasp(o1, l2)"]
    assert kinds(robot.tell(ActionCancelled(2, grasping.id))) == ["StartAction"]
    assert robot.rest == ["move(l3, l2)", "grasp(o1, l2)"]


def test_what_was_left_out_for_an_action_that_is_stopped_after_all_is_made_good() -> None:
    """Before it has stopped all is well again, so nothing needs a second grasp; but then the first one does not end."""
    robot = Script(*FETCH, move("l2", "l1"), goals=("(holding o1)", "(at l1)"))
    robot.tell(ActionFinished(1, 1))
    assert isinstance(robot.see("(at l3)", "(in o2 l1)", false=["(at l2)", "(in o2 l3)"])[0], CancelAction)
    robot.see("(at l2)", "(in o2 l3)", false=["(at l3)", "(in o2 l1)"])
    assert robot.rest == ["grasp(o1, l2)", "move(l2, l1)"]
    assert kinds(robot.tell(ActionCancelled(2, 2))) == ["PlanMended", "StartAction"]
    assert robot.rest == ["grasp(o1, l2)", "move(l2, l1)"]


@pytest.mark.parametrize(("cause", "again"), [(None, True), (Cause("r2", "take", 7), False)])
def test_what_slipped_from_the_hand_is_taken_up_again(cause: Cause | None, again: bool) -> None:
    """Going back is right where nobody is to blame; what another robot has taken is not simply taken back."""
    robot = Script(*FETCH, move("l2", "l1"), goals=("(holding o1)", "(at l1)"))
    for step in (1, 2):
        robot.tell(ActionFinished(step, step))
    lost = (Flip(parse_fact("(holding o1)"), False, cause), Flip(parse_fact("(in o1 l2)"), True, cause))
    robot.tell(Observed(3, lost))
    assert (robot.rest == ["move(l2, l1)", "move(l1, l2)", "grasp(o1, l2)", "move(l2, l1)"]) is again


def test_what_cannot_be_mended_is_refused_with_the_reason_of_the_search() -> None:
    """The object is gone from the building."""
    robot = Script(*FETCH)
    commands = robot.see(false=["(in o1 l2)"])
    refused = next(command for command in commands if isinstance(command, RepairRefused))
    assert refused.why.startswith("nothing brings about (in o1 l2) for grasp(o1, l2): no plan exists")
    assert any(isinstance(command, AskPlan) for command in commands)


def test_repertoire_is_asked_only_if_the_plan_cannot_save_itself() -> None:
    """Deletion needs no other actions."""
    robot = Script(*FETCH)
    robot.see("(holding o1)", false=["(in o1 l2)"])
    assert robot.known.asked == []
    assert robot.rest == ["move(l1, l2)"]


def test_improvement_takes_the_direct_way() -> None:
    """A way through a room where nothing is left to do is replaced, and the log says so."""
    plan = [move("l1", "l2"), grasp("o1", "l2"), move("l2", "l1"), move("l1", "l3"), grasp("o2", "l3")]
    robot = Script(*plan, strategy=Clo("clo-improve", improve=True), goals=("(holding o1)", "(holding o2)"))
    assert robot.rest == ["move(l1, l2)", "grasp(o1, l2)", "move(l2, l3)", "grasp(o2, l3)"]
    mended = next(command for command in robot.first if isinstance(command, PlanMended))
    assert mended.means == "a shorter way"


def test_blocked_plan_is_mended_when_its_turn_comes() -> None:
    """A plan that arrived broken is mended before its first step starts."""
    robot = Script(grasp("o1", "l2"))
    assert robot.rest == ["move(l1, l2)", "grasp(o1, l2)"]
    assert [str(command.step) for command in robot.first if isinstance(command, StartAction)] == ["move(l1, l2)"]


class Stubborn(Clo):
    """Finds every plan good as it is."""

    def revise(self, situation: Situation) -> Revision:
        """The plan."""
        return Adopt(Repaired(situation.plan, ()))


def test_strategy_that_brings_back_the_blocked_step_does_not_go_round_for_ever() -> None:
    """The planner is asked then."""
    robot = Script(grasp("o1", "l2"), strategy=Stubborn())
    assert robot.first[-1] == AskPlan("grasp(o1, l2) cannot start: it lacks (at l2)")


# ---- goals that change -------------------------------------------------------------------------------------


def test_steps_for_a_goal_that_is_no_longer_wanted_are_dropped() -> None:
    """Without asking the planner; the running action stops, since nothing needs it."""
    robot = Script(*FETCH)
    commands = robot.tell(GoalsChanged(1, goals_of(facts("(at l1)"))))
    assert isinstance(commands[0], CancelAction)


def test_new_goal_is_reached_by_a_bridge() -> None:
    """What the plan does for the old one is kept."""
    robot = Script(*FETCH)
    robot.tell(GoalsChanged(1, goals_of([("holding", "o1"), ("holding", "o2")])))
    assert robot.rest == ["move(l1, l2)", "grasp(o1, l2)", "move(l2, l3)", "grasp(o2, l3)"]
    assert robot.executive.goals == goals_of([("holding", "o1"), ("holding", "o2")])


def test_same_goals_again_change_nothing() -> None:
    """Nothing is decided."""
    robot = Script(*FETCH)
    before = robot.executive.state()
    assert robot.tell(GoalsChanged(1, goals_of(facts(*GOALS)))) == []
    assert robot.executive.state() == before


def test_goals_may_change_before_the_beginning() -> None:
    """The first plan is then for the new ones."""
    executive = Executive(Clo(), START, goals_of(facts(*GOALS)))
    assert executive.handle(GoalsChanged(0, goals_of(facts("(at l1)")))) == ()
    assert executive.mode is Mode.NEW
    assert executive.handle(Begin(0)) == (GoalsMet(),)


@pytest.mark.parametrize("strategy", [Replan(), ReplanOnOpportunity()])
def test_replanning_strategies_plan_for_the_new_goals(strategy: Strategy) -> None:
    """At once, and again if the answer was still for the old ones."""
    robot = Script(*FETCH, strategy=strategy)
    assert robot.tell(GoalsChanged(1, goals_of(facts("(holding o2)")))) == [AskPlan("the goals have changed")]
    robot.tell(GoalsChanged(2, goals_of(facts("(at l3)"))))
    assert AskPlan("the goals have changed") in robot.tell(PlanArrived(3, (grasp("o2", "l3"),)))


def test_met_goals_that_change_are_worked_for_again() -> None:
    """This is no relapse."""
    executive = Executive(Clo(), START, goals_of(facts("(at l1)")))
    assert executive.handle(Begin(0)) == (GoalsMet(),)
    assert kinds(list(executive.handle(GoalsChanged(1, goals_of(facts("(at l2)")))))) == ["AskPlan"]


# ---- what is not known -------------------------------------------------------------------------------------


def test_no_step_starts_on_a_fact_that_is_not_known() -> None:
    """Neither as true nor as false: the plan is broken, and says by what."""
    robot = Script(*FETCH)
    commands = robot.tell(Forgotten(1, facts("(in o1 l2)")))
    assert "RepairRefused" in kinds(commands)
    assert ("in", "o1", "l2") not in robot.executive.beliefs


def test_plan_stands_again_when_the_fact_is_seen() -> None:
    """What was not known is known."""
    robot = Script(*FETCH)
    robot.tell(Forgotten(1, facts("(in o1 l2)")))
    robot.see("(in o1 l2)")
    assert ("in", "o1", "l2") in robot.executive.beliefs
    assert robot.executive.links.unsupported == ()


def test_what_the_running_action_brings_about_is_not_forgotten() -> None:
    """It will be known when it ends."""
    robot = Script(*FETCH)
    assert robot.tell(Forgotten(1, facts("(at l1)", "(at l2)"))) == []
    assert robot.executive.beliefs == START


def test_facts_become_known_by_the_robots_own_actions() -> None:
    """And are forgotten only once."""
    robot = Script(*FETCH, strategy=AsPrinted())
    assert robot.tell(Forgotten(1, facts("(holding o1)"))) == []
    assert robot.tell(Forgotten(1, facts("(holding o1)"))) == []
    robot.tell(ActionFinished(2, 1))
    assert robot.tell(ActionFinished(3, 2))[-1] == GoalsMet()


def test_unknown_goal_is_not_reached() -> None:
    """It has to be made sure of."""
    executive = Executive(Clo(), START, goals_of(facts("(at l1)")))
    executive.handle(Forgotten(0, facts("(at l1)")))
    assert executive.handle(Begin(0)) == (AskPlan("first plan"),)


# ---- planning again at opportunities -----------------------------------------------------------------------


def test_opportunity_makes_it_plan_again() -> None:
    """A step's work was done by somebody."""
    plan = [*FETCH, move("l2", "l3"), grasp("o2", "l3")]
    robot = Script(*plan, strategy=ReplanOnOpportunity(), goals=("(holding o1)", "(holding o2)"))
    assert robot.see("(holding o1)") == [AskPlan("unexpected: (holding o1)")]


def test_broken_plan_makes_it_plan_again() -> None:
    """It says what is missing."""
    robot = Script(*FETCH, strategy=ReplanOnOpportunity())
    assert robot.see(false=["(in o1 l2)"])[0] == AskPlan("nothing brings about (in o1 l2) for grasp(o1, l2)")


def test_news_of_no_use_leave_the_plan_alone() -> None:
    """It watches what its plan depends on, and goes on."""
    robot = Script(*FETCH, strategy=ReplanOnOpportunity())
    assert robot.see("(lit)") == []
    watch = robot.executive.watch
    assert ("in", "o1", "l2") in watch
    assert ("lit",) not in watch
