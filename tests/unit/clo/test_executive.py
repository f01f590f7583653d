"""The executive, transition by transition: what it is told, and what it answers."""

import json
from collections.abc import Callable, Collection

import pytest

from clo_fleet.clo.deliberation import MOST_ATTEMPTS, MOST_RELAPSES
from clo_fleet.clo.executive import TRANSITIONS, Executive, Mode, UnexpectedEventError
from clo_fleet.clo.messages import (
    AcceptOffer,
    ActionCancelled,
    ActionFailed,
    ActionFinished,
    AskPlan,
    Begin,
    CancelAction,
    Cause,
    Command,
    Event,
    Finished,
    Flip,
    GoalsMet,
    Observed,
    Offered,
    OfferEnded,
    PlanAdopted,
    PlanArrived,
    PlanFailure,
    PlanMissing,
    Promised,
    RefuseOffer,
    RepairRefused,
    StartAction,
    StepsDropped,
    Waits,
    Wake,
)
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.state import Tally
from clo_fleet.clo.strategies import Clo, Everything, Replan, ReplanOnFailure, Strategy
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact
from clo_fleet.errors import CloFleetError


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def action(
    name: str, *, needs: Collection[str] = (), adds: Collection[str] = (), deletes: Collection[str] = ()
) -> Action:
    """The action written as ``move l1 l2``."""
    schema, *args = name.split()
    conditions = tuple(Condition(parse_fact(text)) for text in needs)
    return Action(schema=schema, args=tuple(args), needs=conditions, adds=facts(*adds), deletes=facts(*deletes))


def move(start: str, end: str) -> Action:
    """Go from room to room."""
    here, there = f"(at-robot {start})", f"(at-robot {end})"
    return action(f"move {start} {end}", needs=[here], adds=[there], deletes=[here])


def prepare(item: str, room: str) -> Action:
    """Make the object ready to be grasped."""
    needs = [f"(at-object {item} {room})", f"(at-robot {room})"]
    return action(f"prepare {item} {room}", needs=needs, adds=[f"(prepared {item})"])


def grasp(item: str, room: str) -> Action:
    """Take the prepared object."""
    lies = f"(at-object {item} {room})"
    needs = [lies, f"(at-robot {room})", f"(prepared {item})"]
    return action(f"grasp {item} {room}", needs=needs, adds=[f"(holding {item})"], deletes=[lies])


START = facts("(at-robot l3)", "(at-object o1 l1)", "(at-object o2 l2)")
GOALS = ("(holding o1)", "(holding o2)")
FETCH_1 = [move("l3", "l1"), prepare("o1", "l1"), grasp("o1", "l1")]
FETCH_2 = [move("l1", "l2"), prepare("o2", "l2"), grasp("o2", "l2")]
PLAN = [*FETCH_1, *FETCH_2]
GIVEN = (Flip(("holding", "o2"), True, Cause("r2", "give(r2, r1, o2)", 41)), Flip(("at-object", "o2", "l2"), False))
BLIND = "no plan exists as things are believed"
IN_HAND = "for what another robot has in hand"
DIED = PlanMissing(9, PlanFailure.DIED)
NO_PLAN = PlanMissing(9, PlanFailure.NO_PLAN)


class Script:
    """An executive, and short words for telling it what happens."""

    def __init__(
        self, strategy: Strategy | None = None, goals: Collection[str] = GOALS, state: frozenset[Fact] = START
    ) -> None:
        self.executive = Executive(strategy or Clo(), state, goals_of(map(parse_fact, goals)))

    def tell(self, event: Event) -> list[Command]:
        """What it answers; whatever that is, its steps stay accounted for."""
        commands = list(self.executive.handle(event))
        assert self.executive.tally.adds_up
        return commands

    def begin(self, *actions: Action) -> list[Command]:
        """Begin with a first plan."""
        self.tell(Begin(0))
        return self.plan(*actions)

    def plan(self, *actions: Action) -> list[Command]:
        """The planner found a plan."""
        return self.tell(PlanArrived(1, actions))

    def see(self, *true: str, false: Collection[str] = ()) -> list[Command]:
        """Facts turn out true, or false."""
        flips = (*(Flip(parse_fact(t), True) for t in true), *(Flip(parse_fact(t), False) for t in false))
        return self.tell(Observed(2, flips))

    def finish(self, times: int = 1) -> list[Command]:
        """The running action ends as it should, and so do the next ones."""
        for _ in range(times):
            commands = self.tell(ActionFinished(3, self.running))
        return commands

    def fail(self, *learnt: Flip) -> list[Command]:
        """The running action fails."""
        return self.tell(ActionFailed(4, self.running, "it slipped", learnt))

    def cancelled(self) -> list[Command]:
        """The running action has stopped as asked."""
        return self.tell(ActionCancelled(5, self.running))

    def promise(self, *texts: str) -> list[Command]:
        """Others announce what they have in hand."""
        return self.tell(Promised(6, facts(*texts)))

    @property
    def running(self) -> int:
        """The id of the running step."""
        assert self.executive.running is not None
        return self.executive.running.id

    @property
    def rest(self) -> list[str]:
        """The plan as one writes it, the running step first."""
        return list(map(str, self.executive.plan))

    def mode(self) -> Mode:
        """What the executive is doing."""
        return self.executive.mode


def started(commands: list[Command]) -> list[str]:
    """The steps that are to be started."""
    return [str(command.step) for command in commands if isinstance(command, StartAction)]


def dropped(commands: list[Command]) -> list[str]:
    """The steps that left the plan."""
    return [str(step) for command in commands if isinstance(command, StepsDropped) for step in command.steps]


# ---- from the first question to the goals ------------------------------------------------------------------


def test_run_without_surprise() -> None:
    """One question, one plan, one step after the other, and the goals are met."""
    robot = Script()
    assert robot.mode() is Mode.NEW
    assert robot.tell(Begin(0)) == [AskPlan("first plan")]
    assert robot.mode() is Mode.PLANNING
    commands = robot.plan(*PLAN)
    plan = robot.executive.plan
    assert commands == [PlanAdopted(plan, (), first=True), StartAction(plan[0])]
    assert [step.action for step in plan] == PLAN
    assert robot.mode() is Mode.ACTING
    for step in plan[1:]:
        assert robot.finish() == [StartAction(step)]
    assert robot.finish() == [GoalsMet()]
    assert robot.mode() is Mode.SATISFIED
    assert robot.executive.tally == Tally(planned=6, executed=6, plans=1, planner_calls=1)


def test_robot_whose_goals_hold_asks_for_nothing() -> None:
    """It is satisfied at once."""
    robot = Script(goals=["(at-robot l3)"])
    assert robot.tell(Begin(0)) == [GoalsMet()]
    assert robot.mode() is Mode.SATISFIED
    assert robot.tell(Wake(1)) == []


def test_it_can_be_asked_what_it_knows() -> None:
    """Its strategy, beliefs, goals, plan, links and what it attends to."""
    robot = Script()
    executive = robot.executive
    assert isinstance(executive.strategy, Clo)
    assert (executive.beliefs, executive.goals) == (START, goals_of(map(parse_fact, GOALS)))
    assert (executive.running, executive.plan, executive.links.links, executive.outcome) == (None, (), (), "")
    assert executive.watch == facts(*GOALS)
    robot.begin(*PLAN)
    assert str(executive.running) == "move(l3, l1)"
    assert executive.watch == executive.links.watched | facts(*GOALS, "(at-robot l3)", "(at-robot l1)")
    assert Script(Replan()).executive.watch == Everything()


def test_learning_before_the_beginning_is_quiet() -> None:
    """It only remembers."""
    robot = Script()
    assert robot.see("(prepared o1)") == []
    assert robot.promise("(holding o2)") == []
    assert robot.executive.promised == {("holding", "o2")}
    assert robot.executive.beliefs == START | facts("(prepared o1)")
    assert robot.executive.planning_state == START | facts("(prepared o1)", "(holding o2)")
    assert robot.mode() is Mode.NEW


# ---- surprises ---------------------------------------------------------------------------------------------


def test_example_of_the_paper() -> None:
    """In room l1 the other object is given: three steps go, and the log can say why and thanks to whom."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish()
    (decision,) = robot.tell(Observed(2, GIVEN))
    assert isinstance(decision, StepsDropped)
    assert list(map(str, decision.steps)) == ["move(l1, l2)", "prepare(o2, l2)", "grasp(o2, l2)"]
    assert (decision.fact, decision.cause) == (GIVEN[0].fact, GIVEN[0].cause)
    assert robot.rest == ["prepare(o1, l1)", "grasp(o1, l1)"]
    assert robot.finish(2) == [GoalsMet()]
    assert robot.executive.tally == Tally(planned=6, executed=3, dropped=3, plans=1, planner_calls=1)


def test_expected_effects_are_no_surprise() -> None:
    """A robot that crosses the door line is seen in the next room while it still moves."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    assert robot.see("(at-robot l1)", false=["(at-robot l3)"]) == []
    assert started(robot.finish()) == ["prepare(o1, l1)"]


def test_what_another_does_in_place_of_the_running_action_is_a_surprise() -> None:
    """Somebody prepares what the robot is preparing: it stops, and goes on with the next step."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish()
    running = robot.executive.running
    assert running is not None
    own = Flip(("prepared", "o1"), True, Cause("r1", running.action.name, 5))
    assert robot.tell(Observed(2, (own,))) == []
    robot = Script()
    robot.begin(*PLAN)
    robot.finish()
    other = Flip(("prepared", "o1"), True, Cause("r2", "prepare(r2, o1, l1)", 7))
    (stop,) = robot.tell(Observed(2, (other,)))
    assert isinstance(stop, CancelAction)
    assert (stop.fact, stop.cause) == (other.fact, other.cause)
    assert started(robot.cancelled()) == ["grasp(o1, l1)"]


def test_a_guess_leaves_a_plan_alone_that_runs_through_without_it() -> None:
    """It is believed all the same; who has no sound plan, or waits for one, heeds it as any news."""
    guess = Observed(2, (Flip(("lit", "l3"), True),), guess=True)
    robot = Script(Replan())
    robot.begin(*PLAN)
    assert robot.tell(guess) == []
    assert ("lit", "l3") in robot.executive.beliefs
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see(false=["(at-object o1 l1)"])
    assert robot.tell(guess) == []
    robot.tell(NO_PLAN)
    answer = robot.tell(Observed(3, (Flip(("lit", "l2"), True),), guess=True))
    assert any(isinstance(command, AskPlan) for command in answer)


def test_who_reached_the_goals_is_named_when_an_action_is_stopped_for_that() -> None:
    """Of several goals, the one that somebody has reached."""
    robot = Script(Replan(), goals=["(lit l3)", "(holding o2)"])
    robot.begin(*PLAN)
    given = (Flip(("lit", "l3"), True), *GIVEN)
    (stop,) = [command for command in robot.tell(Observed(2, given)) if isinstance(command, CancelAction)]
    assert (stop.why, stop.fact, stop.cause) == ("the goals hold already", ("holding", "o2"), GIVEN[0].cause)


def test_robot_that_has_left_is_still_moving() -> None:
    """Its action has ended the condition itself: that is no reason to cancel it, nor to plan without it."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    assert robot.see("(lit l3)", false=["(at-robot l3)"]) == [AskPlan("unexpected: (lit l3)")]
    assert ("at-robot", "l1") in robot.executive.planning_state


def test_what_is_known_already_is_no_surprise() -> None:
    """Not even for a strategy that plans again at any difference."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    assert robot.see("(at-object o1 l1)", false=["(prepared o1)"]) == []


def test_needless_running_action_is_cancelled_once() -> None:
    """When it has stopped, the next step starts."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish()
    running = robot.executive.running
    assert running is not None
    commands = robot.see("(holding o1)", false=["(at-object o1 l1)"])
    assert [command for command in commands if isinstance(command, CancelAction)] == [
        CancelAction(running, "nothing that is left needs it", ("holding", "o1"))
    ]
    assert dropped(commands) == ["grasp(o1, l1)"]
    assert robot.see("(lit l1)") == []
    assert started(robot.cancelled()) == ["move(l1, l2)"]
    assert robot.executive.tally.cancelled == 1


def test_cancelled_action_may_end_all_the_same() -> None:
    """It came too late; its effects are taken into account."""
    robot = Script(goals=["(holding o1)"])
    robot.begin(*FETCH_1)
    robot.see("(at-robot l1)", "(prepared o1)", "(lit l3)", false=["(at-robot l3)"])
    assert started(robot.finish()) == ["grasp(o1, l1)"]
    assert robot.executive.tally.executed == 1


def test_action_that_could_not_be_stopped_may_break_the_goals() -> None:
    """All that it did is unexpected then."""
    robot = Script(Replan(), goals=["(at-robot l3)", "(lit l1)"])
    robot.begin(move("l3", "l1"), action("light l1", adds=["(lit l1)"]), move("l1", "l3"))
    assert isinstance(robot.see("(lit l1)")[0], CancelAction)
    assert robot.finish() == [AskPlan("unexpected: (at-robot l1), (at-robot l3)")]


def test_effects_of_an_action_that_was_to_stop_can_be_a_surprise() -> None:
    """It has left the room where the rest of the plan was to be done."""
    robot = Script()
    robot.begin(move("l3", "l1"), *FETCH_1[1:], *FETCH_2)
    commands = robot.see("(at-object o1 l3)", "(holding o1)", "(at-object o2 l3)", false=["(at-object o2 l2)"])
    assert commands[-1] == AskPlan("the repair was refused")
    commands = robot.plan(prepare("o2", "l3"), grasp("o2", "l3"))
    assert isinstance(commands[-1], CancelAction)
    assert robot.finish()[-1] == AskPlan("the repair was refused")


def test_replan_asks_at_any_difference() -> None:
    """The running action goes on meanwhile; the rest of the old plan is superseded by the new one."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    old = robot.executive.plan
    assert robot.see("(lit l3)") == [AskPlan("unexpected: (lit l3)")]
    assert robot.mode() is Mode.ACTING_AND_PLANNING
    (adopted,) = robot.plan(*PLAN[1:])
    assert isinstance(adopted, PlanAdopted)
    assert (adopted.superseded, adopted.first) == (old[1:], False)
    assert robot.rest == [action.name for action in PLAN]
    assert robot.executive.tally == Tally(planned=6, planned_again=5, superseded=5, pending=6, plans=2, planner_calls=2)


def test_replan_on_failure_finds_out_when_a_step_cannot_start() -> None:
    """It says what the step lacks."""
    robot = Script(ReplanOnFailure())
    robot.begin(*PLAN)
    assert robot.see(false=["(at-object o1 l1)"]) == []
    assert robot.finish() == [AskPlan("prepare(o1, l1) cannot start: it lacks (at-object o1 l1)")]


def test_refused_repair_is_told_with_its_reason() -> None:
    """Then the planner is asked."""
    robot = Script()
    robot.begin(*PLAN)
    lacks = "nothing brings about (at-object o1 l1) for"
    assert robot.see(false=["(at-object o1 l1)"]) == [
        RepairRefused(f"{lacks} prepare(o1, l1); {lacks} grasp(o1, l1)"),
        AskPlan("the repair was refused"),
    ]


def test_plan_that_ends_without_its_goals_is_followed_by_another() -> None:
    """The planner's, or one that a replanning strategy has kept too long."""
    robot = Script(ReplanOnFailure(), goals=["(at-robot l1)", "(lit l3)"])
    robot.begin(move("l3", "l1"))
    assert robot.finish() == [AskPlan("the plan ended without its goals")]


def test_next_step_that_became_impossible_and_needless_is_skipped() -> None:
    """Found out when the planner, asked before that was known, has no plan."""
    robot = Script(goals=["(packed o1)"], state=facts("(at-robot l1)", "(at-object o1 l1)"))
    robot.begin(*FETCH_1[1:], action("pack", needs=["(holding o1)"], adds=["(packed o1)"]))
    robot.see(false=["(at-object o1 l1)"])
    robot.fail()
    robot.see("(holding o1)")
    commands = robot.tell(NO_PLAN)
    assert dropped(commands) == ["prepare(o1, l1)", "grasp(o1, l1)"]
    assert started(commands) == ["pack()"]


# ---- the goals, reached by others and lost again -----------------------------------------------------------


@pytest.mark.parametrize("strategy", [Clo(), Replan(), ReplanOnFailure()])
def test_goals_reached_by_others_stop_the_robot(strategy: Strategy) -> None:
    """What it does is cancelled, and what is left of its plan is dropped, whatever its strategy."""
    robot = Script(strategy)
    robot.begin(*PLAN)
    commands = robot.see(*GOALS)
    assert [str(command.step) for command in commands if isinstance(command, CancelAction)] == ["move(l3, l1)"]
    commands += robot.cancelled()
    assert commands[-1] == GoalsMet()
    assert sorted(dropped(commands)) == sorted(action.name for action in PLAN[1:])
    assert robot.executive.tally == Tally(planned=6, dropped=5, cancelled=1, plans=1, planner_calls=1)


def test_action_that_has_had_its_effects_may_end() -> None:
    """It is not cancelled for reaching the goals itself."""
    robot = Script(Replan(), goals=["(at-robot l1)"])
    robot.begin(move("l3", "l1"))
    assert robot.see("(at-robot l1)", "(lit l1)", false=["(at-robot l3)"]) == []
    assert robot.finish() == [GoalsMet()]


def test_goal_that_is_lost_again_is_planned_for_again() -> None:
    """Success is no end."""
    robot = Script(goals=["(lit l3)"], state=START | facts("(lit l3)"))
    robot.tell(Begin(0))
    assert robot.see(false=["(lit l3)"])[-1] == AskPlan("the repair was refused")
    assert robot.mode() is Mode.PLANNING


@pytest.mark.parametrize("strategy", [Clo(), Replan(), ReplanOnFailure()])
def test_goals_lost_again_and_again_are_a_conflict(strategy: Strategy) -> None:
    """Others undo them for ever: it gives up, with that outcome. What happens by accident does not count."""
    robot = Script(strategy, goals=["(lit l3)"], state=START | facts("(lit l3)"))
    robot.tell(Begin(0))
    light = action("light l3", adds=["(lit l3)"])
    doused = Observed(2, (Flip(parse_fact("(lit l3)"), False, Cause("r2", "douse(l3)", 7)),))
    for _ in range(MOST_RELAPSES):
        assert isinstance(robot.see(false=["(lit l3)"])[-1], AskPlan)
        robot.plan(light)
        assert robot.finish() == [GoalsMet()]
    for _ in range(MOST_RELAPSES - 1):
        assert isinstance(robot.tell(doused)[-1], AskPlan)
        robot.plan(light)
        assert robot.finish() == [GoalsMet()]
    why = f"its goals were met and lost again {MOST_RELAPSES} times"
    assert robot.tell(doused) == [Finished("conflict", why)]
    assert (robot.mode(), robot.executive.outcome) == (Mode.GAVE_UP, "conflict")


def test_robot_that_lost_its_goals_is_not_satisfied_while_it_waits() -> None:
    """Though another has promised to bring them about again."""
    robot = Script(goals=["(lit l3)"], state=START | facts("(lit l3)"))
    robot.tell(Begin(0))
    robot.promise("(lit l3)")
    assert robot.see(false=["(lit l3)"]) == [Waits(IN_HAND)]
    assert robot.mode() is Mode.WAITING
    assert robot.see("(lit l3)") == [GoalsMet()]


# ---- promises ----------------------------------------------------------------------------------------------


def promised_the_second_object() -> Script:
    """A robot on its way to o1, whose o2 has been taken by another that will give it."""
    robot = Script()
    robot.begin(*PLAN)
    robot.promise("(holding o2)")
    assert robot.see(false=["(at-object o2 l2)"]) == []
    return robot


def test_promise_suspends_the_steps_that_it_spares() -> None:
    """They stay in the plan and are not started; nobody plans again."""
    robot = promised_the_second_object()
    suspended = [str(step) for step in robot.executive.plan if step.id in robot.executive.suspended]
    assert suspended == [action.name for action in FETCH_2]
    assert robot.finish(3) == [Waits(IN_HAND)]
    assert robot.mode() is Mode.WAITING
    assert robot.tell(Wake(9)) == []


def test_later_steps_go_on_while_earlier_ones_are_suspended() -> None:
    """The other was faster: this robot turns to the next object."""
    robot = Script(state=facts("(at-robot l1)", "(at-object o1 l1)", "(at-object o2 l1)"))
    robot.begin(prepare("o2", "l1"), grasp("o2", "l1"), prepare("o1", "l1"), grasp("o1", "l1"))
    robot.promise("(holding o2)")
    assert started(robot.fail(Flip(("at-object", "o2", "l1"), False))) == ["prepare(o1, l1)"]
    assert str(robot.executive.running) == "prepare(o1, l1)"
    assert started(robot.finish()) == ["grasp(o1, l1)"]
    assert robot.rest == ["prepare(o2, l1)", "grasp(o2, l1)", "grasp(o1, l1)"]


def test_kept_promise_drops_the_suspended_steps() -> None:
    """The fact is seen like any other, and named as the reason."""
    robot = promised_the_second_object()
    robot.finish(3)
    decision, met = robot.tell(Observed(2, GIVEN[:1]))
    assert isinstance(decision, StepsDropped)
    assert (decision.fact, decision.cause) == (GIVEN[0].fact, GIVEN[0].cause)
    assert met == GoalsMet()
    assert robot.executive.tally == Tally(planned=6, executed=3, dropped=3, plans=1, planner_calls=1)


def test_withdrawn_promise_is_a_reason_to_plan() -> None:
    """The same promise told again is not."""
    robot = promised_the_second_object()
    assert robot.promise("(holding o2)") == []
    assert robot.promise()[-1] == AskPlan("the repair was refused")
    assert robot.executive.suspended == frozenset()


def test_promise_kept_and_taken_back_at_once_is_kept() -> None:
    """Seen together, they are no reason to plan."""
    robot = promised_the_second_object()
    commands = robot.tell(Observed(2, GIVEN[:1], promised=frozenset()))
    assert dropped(commands) == [action.name for action in FETCH_2]
    assert len(commands) == 1


def test_loss_and_promise_at_once_are_no_loss() -> None:
    """The other has taken the object, and will give it."""
    robot = Script()
    robot.begin(*PLAN)
    assert robot.tell(Observed(2, GIVEN[1:], promised=facts("(holding o2)"))) == []
    assert len(robot.executive.suspended) == 3


@pytest.mark.parametrize(("promised", "asks"), [(frozenset(), True), (facts("(holding o2)"), False), (None, False)])
def test_promise_can_be_withdrawn_with_an_observation(promised: frozenset[Fact] | None, asks: bool) -> None:
    """Without a word about promises, they stand."""
    robot = promised_the_second_object()
    commands = robot.tell(Observed(2, (), promised=promised))
    assert any(isinstance(command, AskPlan) for command in commands) is asks


def test_promise_mends_a_plan_that_waits() -> None:
    """It was broken, and no other was found."""
    robot = Script()
    robot.begin(*PLAN)
    robot.see(false=["(at-object o2 l2)"])
    robot.tell(NO_PLAN)
    assert robot.promise("(holding o2)") == []
    assert len(robot.executive.suspended) == 3


def test_step_waits_for_what_is_promised() -> None:
    """It is not started before its conditions are believed true."""
    robot = Script(goals=["(prepared o1)"], state=facts("(at-robot l1)"))
    robot.promise("(at-object o1 l1)")
    commands = robot.begin(prepare("o1", "l1"))
    assert commands[1:] == [Waits(IN_HAND)]
    assert robot.executive.suspended == frozenset()
    assert started(robot.see("(at-object o1 l1)")) == ["prepare(o1, l1)"]


def test_promise_that_does_not_matter_changes_nothing() -> None:
    """The plan stands without it."""
    robot = Script()
    robot.begin(*PLAN)
    assert robot.promise("(lit l3)") == []
    assert robot.executive.suspended == frozenset()


# ---- the planner -------------------------------------------------------------------------------------------


def test_question_without_an_answer_is_not_asked_twice() -> None:
    """Until a belief changes."""
    robot = Script(Replan())
    robot.tell(Begin(0))
    assert robot.tell(NO_PLAN) == [Waits(BLIND)]
    assert robot.mode() is Mode.WAITING
    assert robot.tell(Wake(9)) == []
    assert robot.see("(at-object o3 l1)") == [AskPlan("first plan")]


def test_vain_question_is_remembered_while_the_goals_hold() -> None:
    """Lost again in the same state, they are not asked for again."""
    robot = Script(goals=["(lit l3)"])
    robot.tell(Begin(0))
    robot.see("(lit l3)")
    assert robot.tell(NO_PLAN) == [GoalsMet()]
    assert robot.see(false=["(lit l3)"])[-1] == Waits(BLIND)
    assert robot.mode() is Mode.WAITING


def test_no_plan_for_a_state_that_was_left_is_no_answer_for_the_present() -> None:
    """What was asked was whether a plan exists after the running action; it failed."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see(false=["(at-object o2 l2)"])
    robot.fail()
    robot.tell(NO_PLAN)
    assert robot.rest[0] == "move(l3, l1)"
    robot.see(false=["(at-object o1 l1)"])
    robot.tell(NO_PLAN)
    assert robot.see("(at-object o1 l1)")[-1] == AskPlan("unexpected: (at-object o1 l1)")


def test_planner_that_died_is_asked_once_more() -> None:
    """The second time, the robot gives up."""
    robot = Script()
    robot.tell(Begin(0))
    assert robot.tell(DIED) == [AskPlan("the planner died: once more")]
    assert robot.tell(DIED) == [Finished("planner failed: the planner died", "the planner died")]
    assert robot.mode() is Mode.GAVE_UP


def test_planner_that_has_answered_since_it_died_is_asked_once_more_again() -> None:
    """Only deaths in a row count, and that no plan exists is an answer as well."""
    robot = Script()
    robot.tell(Begin(0))
    robot.tell(DIED)
    robot.tell(NO_PLAN)
    robot.see(false=["(at-object o1 l1)"])
    assert robot.tell(DIED) == [AskPlan("the planner died: once more")]


@pytest.mark.parametrize("failure", [PlanFailure.OUT_OF_TIME, PlanFailure.OUT_OF_MEMORY])
def test_planner_that_reaches_its_limits_is_not_asked_again(failure: PlanFailure) -> None:
    """It would reach them again."""
    robot = Script()
    robot.tell(Begin(0))
    assert robot.tell(PlanMissing(1, failure)) == [Finished(f"planner failed: {failure.value}", failure.value)]


@pytest.mark.parametrize("failure", PlanFailure)
def test_robot_goes_on_without_the_planner_if_its_plan_stands(failure: PlanFailure) -> None:
    """It was only asked for something better."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see("(lit l3)")
    assert robot.tell(PlanMissing(1, failure)) == []
    assert started(robot.finish()) == ["prepare(o1, l1)"]


@pytest.mark.parametrize("failure", PlanFailure)
def test_robot_needs_no_planner_if_its_goals_hold(failure: PlanFailure) -> None:
    """Others reached them while it was waiting for the answer."""
    robot = Script()
    robot.tell(Begin(0))
    robot.see(*GOALS)
    assert robot.tell(PlanMissing(1, failure)) == [GoalsMet()]


def test_robot_whose_broken_plan_is_not_needed_any_more_needs_no_planner() -> None:
    """It drops what is left of it."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.finish()
    robot.see(false=["(at-object o1 l1)"])
    robot.fail()
    robot.see(*GOALS)
    assert robot.tell(PlanMissing(1, PlanFailure.OUT_OF_TIME))[-1] == GoalsMet()


def test_late_plan_is_repaired_for_what_was_learnt_meanwhile() -> None:
    """The news keeps its cause."""
    robot = Script()
    robot.tell(Begin(0))
    assert robot.tell(Observed(1, GIVEN)) == []
    commands = robot.plan(*PLAN)
    decision = commands[1]
    assert isinstance(decision, StepsDropped)
    assert list(map(str, decision.steps)) == [action.name for action in FETCH_2]
    assert (decision.fact, decision.cause) == (GIVEN[0].fact, GIVEN[0].cause)
    assert started(commands) == ["move(l3, l1)"]


def test_news_that_was_undone_meanwhile_is_no_news() -> None:
    """It replaced nothing, though a step is dropped from the late plan."""
    robot = Script(state=START | facts("(lit l3)"))
    robot.tell(Begin(0))
    robot.see(false=["(lit l3)"])
    robot.see("(lit l3)")
    decision = robot.plan(move("l3", "l2"), move("l2", "l3"), *PLAN)[1]
    assert isinstance(decision, StepsDropped)
    assert (list(map(str, decision.steps)), decision.fact) == (["move(l3, l2)", "move(l2, l3)"], None)


def test_superfluous_steps_of_a_fresh_plan_are_dropped() -> None:
    """They replace nothing, so no fact is named."""
    robot = Script()
    _, decision, _ = robot.begin(action("wave"), *PLAN)
    assert isinstance(decision, StepsDropped)
    assert (list(map(str, decision.steps)), decision.fact, decision.cause) == (["wave()"], None, None)


def test_replan_keeps_a_late_plan_that_still_stands() -> None:
    """Else it would ask for ever in a lively world."""
    robot = Script(Replan())
    robot.tell(Begin(0))
    robot.see("(lit l3)")
    assert started(robot.plan(*PLAN)) == ["move(l3, l1)"]


@pytest.mark.parametrize("strategy", [Clo(), Replan()])
def test_late_plan_that_does_not_stand_is_asked_for_again(strategy: Strategy) -> None:
    """From what is believed now."""
    robot = Script(strategy)
    robot.tell(Begin(0))
    robot.see("(at-object o2 l3)", false=["(at-object o2 l2)"])
    assert isinstance(robot.plan(*PLAN)[-1], AskPlan)
    assert started(robot.plan(prepare("o2", "l3"), grasp("o2", "l3"), *FETCH_1)) == ["prepare(o2, l3)"]


def test_planner_whose_plan_is_no_good_is_not_asked_the_same_again() -> None:
    """It would say the same again."""
    robot = Script()
    robot.tell(Begin(0))
    commands = robot.plan(*FETCH_2)
    assert isinstance(commands[1], RepairRefused)
    assert commands[2:] == [Waits(BLIND)]
    assert robot.mode() is Mode.WAITING


def test_new_plan_starts_where_the_running_action_ends() -> None:
    """So that it can go on."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see("(lit l3)")
    moved = (START | facts("(lit l3)", "(at-robot l1)")) - facts("(at-robot l3)")
    assert robot.executive.planning_state == moved


def test_new_plan_does_not_count_on_an_action_that_will_not_end_well() -> None:
    """What it still needs is gone, or it is being cancelled."""
    doomed = Script()
    doomed.begin(*PLAN)
    doomed.finish()
    doomed.see(false=["(at-object o1 l1)"])
    assert doomed.mode() is Mode.ACTING_AND_PLANNING
    assert doomed.executive.planning_state == doomed.executive.beliefs
    stopping = Script(goals=["(holding o1)"])
    stopping.begin(*FETCH_1)
    stopping.see("(holding o1)")
    assert stopping.executive.planning_state == stopping.executive.beliefs


def test_doomed_action_is_cancelled_as_soon_as_a_new_plan_is_asked_for() -> None:
    """The object is in another room now, and has to be prepared there."""
    robot = Script(goals=["(holding o1)"])
    robot.begin(*FETCH_1)
    robot.finish()
    commands = robot.see("(at-object o1 l2)", false=["(at-object o1 l1)"])
    assert [command.why for command in commands if isinstance(command, CancelAction)] == ["it lacks (at-object o1 l1)"]
    robot.plan(move("l1", "l2"), prepare("o1", "l2"), grasp("o1", "l2"))
    assert started(robot.cancelled()) == ["move(l1, l2)"]


# ---- failures ----------------------------------------------------------------------------------------------


def test_failed_step_is_tried_again_and_thrice_is_stuck() -> None:
    """A step that is tried again is a new step; the last reason is told."""
    robot = Script()
    robot.begin(*PLAN)
    first = robot.running
    for _ in range(MOST_ATTEMPTS - 1):
        assert started(robot.fail()) == ["move(l3, l1)"]
    assert robot.running != first
    assert robot.fail() == [Finished("stuck", "move(l3, l1) failed 3 times, the last time: it slipped")]
    assert robot.executive.tally == Tally(planned=6, added=3, failed=3, pending=6, plans=1, planner_calls=1)


def test_failure_that_teaches_something_starts_the_count_again() -> None:
    """The next attempt is made with other beliefs."""
    robot = Script()
    robot.begin(*PLAN)
    robot.fail()
    robot.fail()
    assert started(robot.fail(Flip(("lit", "l3"), True))) == ["move(l3, l1)"]
    assert started(robot.fail()) == ["move(l3, l1)"]


def test_success_starts_the_count_again() -> None:
    """The same action may come again later in the plan."""
    robot = Script(goals=["(holding o1)", "(at-robot l3)"])
    robot.begin(*FETCH_1, move("l1", "l3"))
    robot.fail()
    robot.fail()
    robot.finish()
    assert robot.executive.state()["attempts"] == {}


def test_failure_that_breaks_the_plan_is_a_reason_to_plan() -> None:
    """The object is not there."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish()
    commands = robot.fail(Flip(("at-object", "o1", "l1"), False))
    assert isinstance(commands[0], RepairRefused)
    assert commands[1:] == [AskPlan("the repair was refused")]


def test_failure_can_bring_an_opportunity() -> None:
    """It failed because another was faster, and has given the object: who it was is told."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish(4)
    decision, *_ = robot.fail(*GIVEN)
    assert isinstance(decision, StepsDropped)
    assert list(map(str, decision.steps)) == ["prepare(o2, l2)", "grasp(o2, l2)"]
    assert (decision.fact, decision.cause) == (GIVEN[0].fact, GIVEN[0].cause)
    assert robot.mode() is Mode.SATISFIED


# ---- offers ------------------------------------------------------------------------------------------------


def offer(*flips: Flip, needs: Collection[str] = ()) -> Offered:
    """Another robot offers to change these facts."""
    return Offered(7, 1, "r2", flips, goals_of(map(parse_fact, needs)))


def test_offer_that_shortens_the_plan_is_accepted() -> None:
    """Nothing changes before the facts are seen."""
    robot = Script()
    robot.begin(*PLAN)
    assert robot.tell(offer(*GIVEN)) == [AcceptOffer(1)]
    assert len(robot.rest) == 6


def test_offer_of_what_is_no_goal_may_help_too() -> None:
    """It is enough that the plan stands with it."""
    robot = Script()
    robot.begin(*PLAN)
    assert robot.tell(offer(Flip(("prepared", "o2"), True))) == [AcceptOffer(1)]


def test_offer_that_would_break_the_plan_is_refused() -> None:
    """To take the object away, say."""
    robot = Script()
    robot.begin(*PLAN)
    taken = Flip(("at-object", "o1", "l1"), False)
    assert robot.tell(offer(taken)) == [RefuseOffer(1, "the plan would not stand any more")]
    assert robot.finish() != []


def test_offer_of_a_goal_is_accepted_even_if_the_plan_is_broken() -> None:
    """The planner will see to the rest."""
    robot = Script()
    robot.tell(Begin(0))
    robot.tell(NO_PLAN)
    assert robot.tell(offer(*GIVEN)) == [AcceptOffer(1)]
    assert robot.tell(offer(Flip(("lit", "l3"), True))) == [RefuseOffer(1, "the plan would not stand any more")]


def test_handover_holds_back_what_would_break_it() -> None:
    """The robot stays in the room until it is over."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish(2)
    robot.tell(offer(*GIVEN, needs=["(at-robot l1)"]))
    assert robot.finish() == [Waits("for a handover to end")]
    assert robot.mode() is Mode.WAITING
    assert started(robot.tell(OfferEnded(8, 1))) == ["move(l1, l2)"]


@pytest.mark.parametrize("place", ["(at-robot l1)", "(at-robot l2)"])
def test_handover_holds_back_nothing_else(place: str) -> None:
    """Steps that do not touch what it needs go on, and so do those before it comes about."""
    robot = Script()
    robot.begin(*PLAN)
    robot.tell(offer(*GIVEN, needs=[place]))
    assert started(robot.finish()) == ["prepare(o1, l1)"]
    assert started(robot.finish()) == ["grasp(o1, l1)"]


def test_kept_offer_spares_the_way() -> None:
    """The object is seen in the hand before the robot may leave."""
    robot = Script()
    robot.begin(*PLAN)
    robot.finish(2)
    robot.tell(offer(*GIVEN, needs=["(at-robot l1)"]))
    robot.finish()
    commands = robot.tell(Observed(8, GIVEN))
    assert dropped(commands) == [action.name for action in FETCH_2]
    assert commands[-1] == GoalsMet()
    assert robot.tell(OfferEnded(8, 1)) == []


# ---- giving up, refusing and remembering -------------------------------------------------------------------


@pytest.mark.parametrize("strategy", [Clo(), Replan(), ReplanOnFailure()])
def test_robot_that_gave_up_only_listens(strategy: Strategy) -> None:
    """Whatever it learns, it asks for nothing, starts nothing and finishes only once."""
    robot = Script(strategy)
    robot.begin(*PLAN)
    robot.see(false=["(at-object o1 l1)"])
    if robot.mode() is not Mode.ACTING_AND_PLANNING:
        robot.finish()
    robot.tell(PlanMissing(1, PlanFailure.OUT_OF_TIME))
    assert robot.mode() is Mode.GAVE_UP
    assert robot.see("(at-object o1 l3)", false=["(at-robot l3)"]) == []
    assert robot.promise("(holding o1)") == []
    assert robot.tell(OfferEnded(9, 1)) == []
    assert robot.tell(Wake(9)) == []
    if robot.executive.running:
        assert robot.fail() == []
    assert robot.executive.outcome == "planner failed: the planner ran out of time"


def test_action_of_a_robot_that_gave_up_may_fail_for_the_third_time() -> None:
    """The outcome stays what it was."""
    robot = Script()
    robot.begin(*PLAN)
    robot.fail()
    robot.fail()
    robot.see(false=["(at-object o1 l1)"])
    robot.tell(PlanMissing(1, PlanFailure.OUT_OF_MEMORY))
    assert robot.fail() == []
    assert robot.executive.outcome == "planner failed: the planner ran out of memory"


@pytest.mark.parametrize("finished", [True, False])
def test_action_of_a_robot_that_gave_up_may_end(finished: bool) -> None:
    """What it did is believed and counted; nothing follows."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see(false=["(at-object o1 l1)"])
    robot.tell(PlanMissing(1, PlanFailure.OUT_OF_TIME))
    assert (robot.finish() if finished else robot.cancelled()) == []
    assert (("at-robot", "l1") in robot.executive.beliefs) is finished
    assert robot.mode() is Mode.GAVE_UP


def in_each_mode() -> dict[Mode, Script]:
    """An executive in each mode."""
    scripts = {mode: Script(Replan()) for mode in Mode}
    for mode, script in scripts.items():
        if mode is not Mode.NEW:
            script.tell(Begin(0))
    scripts[Mode.ACTING].plan(*PLAN)
    scripts[Mode.ACTING_AND_PLANNING].plan(*PLAN)
    scripts[Mode.ACTING_AND_PLANNING].see("(lit l3)")
    scripts[Mode.WAITING].tell(NO_PLAN)
    scripts[Mode.SATISFIED].see(*GOALS)
    scripts[Mode.SATISFIED].tell(NO_PLAN)
    scripts[Mode.GAVE_UP].tell(PlanMissing(1, PlanFailure.OUT_OF_TIME))
    return scripts


@pytest.mark.parametrize(
    "event",
    [
        Begin(9),
        PlanArrived(9, ()),
        NO_PLAN,
        ActionFinished(9, 1),
        ActionFailed(9, 1, "why"),
        ActionCancelled(9, 1),
        Observed(9, ()),
        Promised(9, frozenset()),
        Offered(9, 1, "r2", ()),
        OfferEnded(9, 1),
        Wake(9),
    ],
)
@pytest.mark.parametrize("mode", Mode)
def test_table_tells_which_events_a_mode_knows(mode: Mode, event: Event) -> None:
    """Those are answered; any other is refused by name, and changes nothing."""
    executive = in_each_mode()[mode].executive
    assert executive.mode is mode
    about_running = isinstance(event, ActionFinished | ActionFailed | ActionCancelled)
    if mode in TRANSITIONS[type(event)][0] and not (about_running and executive.running is None):
        executive.handle(event)
        return
    before = executive.state()
    with pytest.raises(
        UnexpectedEventError, match=f"that is {mode.value} cannot take {type(event).__name__}"
    ) as raised:
        executive.handle(event)
    assert (raised.value.mode, raised.value.event) == (mode, event)
    assert isinstance(raised.value, CloFleetError)
    assert executive.state() == before


@pytest.mark.parametrize("word", [ActionFinished, ActionCancelled, lambda time, step: ActionFailed(time, step, "why")])
def test_step_that_does_not_run_cannot_end(word: Callable[[float, int], Event]) -> None:
    """The error names the one that runs."""
    robot = Script()
    robot.begin(*PLAN)
    before = robot.executive.state()
    with pytest.raises(UnexpectedEventError, match=rf"\(running step: {robot.running}\)"):
        robot.tell(word(9, robot.running + 1))
    assert robot.executive.state() == before


def test_restored_executive_goes_on_where_it_was() -> None:
    """Saved as JSON while it acts and waits for the planner, with news that it has not used yet."""
    robot = Script(Replan())
    robot.begin(*PLAN)
    robot.see("(lit l3)")
    robot.tell(Observed(2, GIVEN))
    saved = json.loads(json.dumps(robot.executive.state()))
    restored = Executive.from_state(Replan(), saved)
    assert restored.links == robot.executive.links
    assert (restored.mode, restored.plan) == (Mode.ACTING_AND_PLANNING, robot.executive.plan)
    for event in (PlanArrived(3, tuple(PLAN[1:])), ActionFinished(4, 1)):
        assert restored.handle(event) == robot.executive.handle(event)
    assert restored.state() == robot.executive.state()
