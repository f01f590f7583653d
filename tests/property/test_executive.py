"""Whatever happens, in any order, an executive keeps its promises: hypothesis plays the world around one robot."""

import json
from collections import Counter, deque
from functools import cache

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from clo_fleet.clo.executive import TRANSITIONS, Executive, Mode, UnexpectedEventError
from clo_fleet.clo.links import causal_links
from clo_fleet.clo.messages import (
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
    StartAction,
    StepsDropped,
    Wake,
)
from clo_fleet.clo.plan import Step
from clo_fleet.clo.state import Tally
from clo_fleet.clo.strategies import STRATEGIES, Clo, Strategy
from clo_fleet.clo.task import Action, Condition, Fact, apply, holds, unmet

ROOMS = ("hub", "store")
OBJECTS = ("o1", "o2")
SHUT = ("shut",)
MOST_EVENTS = 300  # what a robot that nobody disturbs any more may take to come to rest


def at(place: str) -> Fact:
    """The robot is there."""
    return ("at-robot", place)


def lies(item: str, place: str) -> Fact:
    """The object is there."""
    return ("at-object", item, place)


def prepared(item: str) -> Fact:
    """The object can be grasped."""
    return ("prepared", item)


def holding(item: str) -> Fact:
    """The robot has the object."""
    return ("holding", item)


def action(
    schema: str, args: tuple[str, ...], needs: list[Fact], adds: list[Fact], deletes: list[Fact], lacks: list[Fact]
) -> Action:
    """The action that needs some facts true and ``lacks`` false."""
    conditions = (*map(Condition, needs), *(Condition(fact, positive=False) for fact in lacks))
    return Action(
        schema=schema, args=args, needs=conditions, adds=frozenset(adds), deletes=frozenset(deletes), cost=len(schema)
    )


ACTIONS = (
    action("open", (), [at("hub")], [], [SHUT], []),
    *(action("move", (a, b), [at(a)], [at(b)], [at(a)], [SHUT]) for a in ROOMS for b in ROOMS if a != b),
    *(action("prepare", (o, r), [at(r), lies(o, r)], [prepared(o)], [], []) for o in OBJECTS for r in ROOMS),
    *(
        action("grasp", (o, r), [at(r), lies(o, r), prepared(o)], [holding(o)], [lies(o, r)], [])
        for o in OBJECTS
        for r in ROOMS
    ),
    *(action("place", (o, r), [at(r), holding(o)], [lies(o, r)], [holding(o)], []) for o in OBJECTS for r in ROOMS),
)
FACTS = sorted({fact for a in ACTIONS for fact in (*a.adds, *a.deletes)})
WISHES = (
    Condition(at("hub")),
    Condition(holding("o1")),
    Condition(lies("o2", "hub")),
    Condition(prepared("o2")),
    Condition(SHUT, positive=False),
    Condition(lies("o1", "store"), positive=False),
)


@cache
def shortest_plan(state: frozenset[Fact], goals: tuple[Condition, ...]) -> tuple[Action, ...] | None:
    """The planner: breadth-first search."""
    open_states: deque[tuple[frozenset[Fact], tuple[Action, ...]]] = deque([(state, ())])
    seen = {state}
    while open_states:
        now, plan = open_states.popleft()
        if all(holds(goal, now) for goal in goals):
            return plan
        for candidate in ACTIONS:
            then = apply(now, candidate)
            if then not in seen and not unmet(candidate, now):
                seen.add(then)
                open_states.append((then, (*plan, candidate)))
    return None


facts = st.sampled_from(FACTS)
states = st.frozensets(facts, max_size=5)
causes = st.none() | st.builds(Cause, robot=st.just("r2"), action=st.just("give"), event=st.integers(1, 9))
conditions = st.builds(Condition, facts, st.booleans())


class RobotAmongOthers(RuleBasedStateMachine):
    """One executive in a symbolic world where others act, and do not always tell."""

    strategy: Strategy = Clo()

    def __init__(self) -> None:
        super().__init__()
        self.time = 0.0
        self.truth: set[Fact] = set()
        self.question: frozenset[Fact] | None = None
        self.unsolvable: frozenset[Fact] | None = None
        self.offers: dict[int, tuple[Flip, ...]] = {}
        self.needs: dict[int, tuple[Condition, ...]] = {}
        self.cancelling = False
        self.counts: Counter[str] = Counter()
        self.offered = 0

    @initialize(state=st.permutations(FACTS).map(lambda all_of_them: frozenset(all_of_them[:4])), wishes=st.data())
    def wake_up(self, state: frozenset[Fact], wishes: st.DataObject) -> None:
        """A robot somewhere in a random world, with a few goals."""
        goals = tuple(wishes.draw(st.lists(st.sampled_from(WISHES), min_size=1, max_size=4, unique=True)))
        self.truth = {at("hub"), lies("o1", "store"), lies("o2", "store"), SHUT} ^ state
        self.executive = Executive(self.strategy, self.truth, goals)
        self.tell(Begin(0.0))

    # ---- what happens --------------------------------------------------------------------------------------

    @precondition(lambda self: self.question is not None)
    @rule()
    def planner_answers(self) -> None:
        """The planner finds the shortest plan from the state it was asked about, or proves that there is none."""
        assert self.question is not None
        plan = shortest_plan(self.question, self.executive.goals)
        self.unsolvable = self.question if plan is None else None
        self.question = None
        self.tell(PlanMissing(self.time, PlanFailure.NO_PLAN) if plan is None else PlanArrived(self.time, plan))

    @precondition(lambda self: self.question is not None)
    @rule(failure=st.sampled_from([*[PlanFailure.DIED] * 4, PlanFailure.OUT_OF_TIME]))
    def planner_fails(self, failure: PlanFailure) -> None:
        """The planner brings nothing, whether there is a plan or not."""
        self.question = None
        self.tell(PlanMissing(self.time, failure))

    @precondition(lambda self: self.executive.running is not None)
    @rule()
    def action_ends(self) -> None:
        """The running action has its effects, unless something that it needs is not so."""
        step = self.running()
        ended = step.action.adds | step.action.deletes
        missing = [need for need in unmet(step.action, self.truth) if need.fact not in ended]
        self.cancelling = False
        if missing:
            learnt = tuple(Flip(need.fact, not need.positive) for need in missing)
            self.tell(ActionFailed(self.time, step.id, "not as expected", learnt))
        else:
            self.truth = set(apply(self.truth, step.action))
            self.tell(ActionFinished(self.time, step.id))

    @precondition(lambda self: self.executive.running is not None)
    @rule()
    def action_fails(self) -> None:
        """The running action fails, and nothing is learnt by it."""
        self.cancelling = False
        self.tell(ActionFailed(self.time, self.running().id, "slipped"))

    @precondition(lambda self: self.executive.running is not None and self.cancelling)
    @rule()
    def action_is_cancelled(self) -> None:
        """The action stops as it was asked to."""
        self.cancelling = False
        self.tell(ActionCancelled(self.time, self.running().id))

    @precondition(lambda self: self.executive.running is not None)
    @rule()
    def effects_show_early(self) -> None:
        """The effects of the running action are seen before it ends: a robot has crossed the door line."""
        action = self.running().action
        self.truth = set(apply(self.truth, action))
        self.observe(*sorted(action.adds | action.deletes))

    @rule(changes=st.lists(facts, min_size=1, max_size=3, unique=True), cause=causes, promised=st.none() | states)
    def others_act(self, changes: list[Fact], cause: Cause | None, promised: frozenset[Fact] | None) -> None:
        """Others change the world, and it is seen at once; they may promise or take back something by it."""
        self.truth ^= set(changes)
        self.observe(*changes, cause=cause, promised=promised)

    @rule(fact=facts)
    def others_act_unseen(self, fact: Fact) -> None:
        """Others change the world behind the robot's back."""
        self.truth ^= {fact}

    @rule()
    def looks_round(self) -> None:
        """The robot sees all that is."""
        self.observe(*FACTS)

    @rule(promised=states)
    def others_promise(self, promised: frozenset[Fact]) -> None:
        """Others announce what they have in hand; they may take it back."""
        self.tell(Promised(self.time, promised))

    @precondition(lambda self: self.executive.mode is not Mode.GAVE_UP)
    @rule(changes=st.lists(facts, min_size=1, max_size=2, unique=True), needs=st.lists(conditions, max_size=2))
    def other_offers(self, changes: list[Fact], needs: list[Condition]) -> None:
        """Another robot offers to change something."""
        flips = tuple(Flip(fact, fact not in self.executive.beliefs) for fact in changes)
        self.offered += 1
        self.offers[self.offered], self.needs[self.offered] = flips, tuple(needs)
        self.tell(Offered(self.time, self.offered, "r2", flips, tuple(needs)))

    @precondition(lambda self: self.offers)
    @rule(kept=st.booleans())
    def offer_ends(self, kept: bool) -> None:
        """An accepted offer is kept, or comes to nothing."""
        offer = min(self.offers)
        flips = self.offers.pop(offer)
        del self.needs[offer]
        if kept:
            self.truth -= {flip.fact for flip in flips}
            self.truth |= {flip.fact for flip in flips if flip.value}
            self.observe(*(flip.fact for flip in flips))
        self.tell(OfferEnded(self.time, offer))

    @rule()
    def time_passes(self) -> None:
        """Nothing happens for a while, and nothing comes of it."""
        assert self.tell(Wake(self.time)) == ()

    @rule(which=st.integers(0, 99))
    def something_odd_happens(self, which: int) -> None:
        """An event that the mode does not know, or about another step, is refused and changes nothing."""
        nowhere = -1
        odd: list[Event] = [
            event
            for event in (
                Begin(self.time),
                PlanArrived(self.time, ()),
                PlanMissing(self.time, PlanFailure.NO_PLAN),
                Offered(self.time, 0, "r2", ()),
            )
            if self.executive.mode not in TRANSITIONS[type(event)][0]
        ]
        odd += [
            ActionFinished(self.time, nowhere),
            ActionFailed(self.time, nowhere, "?"),
            ActionCancelled(self.time, nowhere),
        ]
        event = odd[which % len(odd)]
        before, mode = self.executive.state(), self.executive.mode
        with pytest.raises(UnexpectedEventError) as raised:
            self.executive.handle(event)
        assert (raised.value.mode, raised.value.event) == (mode, event)
        assert self.executive.state() == before

    # ---- what always holds ---------------------------------------------------------------------------------

    @invariant()
    def steps_are_accounted_for(self) -> None:
        """The tally adds up, and agrees with what was told and answered."""
        assert self.executive.tally.adds_up
        assert self.executive.tally == Tally(**self.counts, pending=len(self.executive.plan))

    @invariant()
    def suspended_steps_are_still_to_be_done(self) -> None:
        """They stand in the plan, and none of them runs."""
        executive = self.executive
        assert executive.suspended <= {step.id for step in executive.plan}
        assert executive.running is None or executive.running.id not in executive.suspended

    @invariant()
    def success_is_believed(self) -> None:
        """A robot that is satisfied believes all its goals; one that gave up says why."""
        believed = all(holds(goal, self.executive.beliefs) for goal in self.executive.goals)
        assert believed or self.executive.mode is not Mode.SATISFIED
        assert bool(self.executive.outcome) is (self.executive.mode is Mode.GAVE_UP)

    @invariant()
    def links_are_those_of_the_plan(self) -> None:
        """The opportunities that it watches for are those of the plan that it has now."""
        if self.executive.running is None:
            assert self.executive.links == causal_links(
                self.executive.beliefs, self.executive.plan, self.executive.goals
            )

    def teardown(self) -> None:
        """Left alone, with all promises and offers over, the robot comes to rest, and not without need."""
        if not hasattr(self, "executive"):
            return
        self.tell(Promised(self.time, frozenset()))
        while self.offers:
            self.offer_ends(kept=False)
        for _ in range(MOST_EVENTS):
            if self.question is not None:
                self.planner_answers()
            elif self.executive.running is not None:
                self.action_ends()
            else:
                break
        else:
            pytest.fail("it never comes to rest")
        assert self.executive.mode in {Mode.SATISFIED, Mode.WAITING, Mode.GAVE_UP}
        if self.executive.mode is Mode.WAITING:
            assert shortest_plan(self.executive.beliefs, self.executive.goals) is None

    # ---- telling it ----------------------------------------------------------------------------------------

    def running(self) -> Step:
        """The step under way."""
        assert self.executive.running is not None
        return self.executive.running

    def observe(self, *seen: Fact, cause: Cause | None = None, promised: frozenset[Fact] | None = None) -> None:
        """Tell what differs from the robot's beliefs."""
        flips = tuple(
            Flip(fact, fact in self.truth, cause)
            for fact in seen
            if (fact in self.truth) is not (fact in self.executive.beliefs)
        )
        if flips:
            self.tell(Observed(self.time, flips, promised))

    def tell(self, event: Event) -> tuple[Command, ...]:
        """Tell the executive, and one restored from its saved state, and check what they answer."""
        saved = json.loads(json.dumps(self.executive.state()))
        restored = Executive.from_state(self.strategy, saved)
        assert json.loads(json.dumps(restored.state())) == saved
        had_given_up = self.executive.mode is Mode.GAVE_UP
        match event:
            case ActionFinished():
                self.counts["executed"] += 1
            case ActionFailed():
                self.counts.update(failed=1, added=1)
            case ActionCancelled():
                self.counts["cancelled"] += 1
        self.time += 1.0
        commands = self.executive.handle(event)
        assert restored.handle(event) == commands
        assert restored.state() == self.executive.state()
        assert (restored.links, restored.watch) == (self.executive.links, self.executive.watch)
        assert not (had_given_up and commands)
        for command in commands:
            self.take(command)
        assert sum(isinstance(command, StartAction | AskPlan) for command in commands) <= 1
        if self.executive.mode is Mode.GAVE_UP:
            self.question = None
        assert (self.question is None) is (self.executive.mode not in {Mode.PLANNING, Mode.ACTING_AND_PLANNING})
        return commands

    def take(self, command: Command) -> None:
        """Do what the executive says; refuse what it must never say."""
        beliefs = self.executive.beliefs
        match command:
            case AskPlan():
                assert self.question is None
                self.question = self.executive.planning_state
                assert self.question != self.unsolvable
                self.unsolvable = None
                self.counts["planner_calls"] += 1
            case StartAction(step):
                assert not unmet(step.action, beliefs)
                assert self.executive.running == step
                after = apply(beliefs, step.action)
                accepted = [need for needs in self.needs.values() for need in needs if holds(need, beliefs)]
                assert all(holds(need, after) for need in accepted)
            case CancelAction(step):
                assert self.executive.running == step
                assert not self.cancelling
                self.cancelling = True
            case RefuseOffer(offer):
                del self.offers[offer], self.needs[offer]
            case GoalsMet():
                assert all(holds(goal, beliefs) for goal in self.executive.goals)
            case Finished(outcome):
                assert outcome == self.executive.outcome
            case StepsDropped(steps):
                assert not set(steps) & set(self.executive.plan)
                self.counts["dropped"] += len(steps)
            case PlanAdopted(plan, superseded, first):
                self.counts["planned" if first else "planned_again"] += len(plan)
                self.counts.update(plans=1, superseded=len(superseded))


@pytest.mark.parametrize("name", sorted(STRATEGIES))
def test_executive_keeps_its_promises(name: str) -> None:
    """Any order of events is answered soundly or refused unchanged, is restorable, and leads to rest."""
    run_state_machine_as_test(
        type(name, (RobotAmongOthers,), {"strategy": STRATEGIES[name]}),
        settings=settings(
            max_examples=100,
            stateful_step_count=30,
            deadline=None,
            derandomize=True,
            suppress_health_check=list(HealthCheck),
        ),
    )
