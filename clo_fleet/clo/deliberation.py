"""Deliberation: what an executive makes of its memory. Decides; the executive only says when.

Every method reads and changes the memory, and returns the commands and decisions that follow from that.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from clo_fleet.clo.links import causal_links
from clo_fleet.clo.messages import (
    AskPlan,
    CancelAction,
    Cause,
    Command,
    Finished,
    Flip,
    GoalsMet,
    PlanMended,
    RepairRefused,
    StartAction,
    StepsDropped,
    Waits,
)
from clo_fleet.clo.operators import bits
from clo_fleet.clo.plan import Plan, Step, number
from clo_fleet.clo.relaxation import INFINITE, Relaxation
from clo_fleet.clo.repair import Drop, Means, Repaired
from clo_fleet.clo.state import ExecutiveState
from clo_fleet.clo.strategies import ActionSource, Adopt, Keep, PlanAgain, Revision, Situation, Strategy
from clo_fleet.clo.task import Action, Condition, Fact, apply, holds

__all__ = ["MOST_ATTEMPTS", "MOST_RELAPSES", "Deliberation", "under_way"]

MOST_ATTEMPTS = 3  # the same action failing this often, nothing achieved or learnt by it meanwhile: stuck
MOST_RELAPSES = 5  # goals met and lost again this often, by others' doing: conflict
_NO_PLAN = "no plan exists as things are believed"


@dataclass(frozen=True, slots=True)
class Deliberation:
    """A strategy at work on one executive's memory. ``partly``: whether a part of the goals is better than nothing."""

    strategy: Strategy
    data: ExecutiveState
    actions: ActionSource | None = None
    partly: bool = False

    @property
    def running(self) -> Step | None:
        """The step under way."""
        return self.step(self.data.running) if self.data.running is not None else None

    @property
    def planning_state(self) -> frozenset[Fact]:
        """The state a new plan should start from: what is believed and promised, the running action done."""
        data = self.data
        state = frozenset(data.beliefs) | data.promised
        running = self.running
        if running is None or data.cancelling or self.lacks(under_way(running).action):
            return state
        return apply(state, running.action)

    def rely_on(self, promised: frozenset[Fact]) -> bool:
        """Note what is promised; whether the plan has to be looked at for it."""
        data = self.data
        changed, data.promised = promised != data.promised, promised
        return changed and bool(data.suspended or not self.sound())

    def revise(self, news: Mapping[Fact, Cause | None]) -> list[Command]:
        """Ask the strategy what becomes of the plan; while a new one is awaited, only note the news."""
        data = self.data
        if data.outcome:
            return []
        data.news |= news
        if data.question is not None:
            return []
        if self.reached():
            revision = self.strategy.revise(self.situation(frozenset(news))) if data.plan else Keep()
            if isinstance(revision, Adopt):
                return self.follow(revision)
            running = self.running
            over = running is None or apply(data.beliefs, running.action) == data.beliefs
            goal = next((goal.fact for goal in data.goals if data.news.get(goal.fact) is not None), None)
            return [] if over else self.stop("the goals hold already", goal)
        if data.satisfied:
            data.satisfied = False
            data.relapses += any(news.get(goal.fact) for goal in data.goals)  # accidents are no conflict
            if data.relapses >= MOST_RELAPSES:
                return self.give_up("conflict", f"its goals were met and lost again {MOST_RELAPSES} times")
        elif not data.plan:
            return []
        return self.follow(self.strategy.revise(self.situation(frozenset(news))))

    def follow(self, revision: Revision) -> list[Command]:
        """Do what the strategy said."""
        data = self.data
        if isinstance(revision, Keep):
            data.news = {}
            return []
        if isinstance(revision, PlanAgain):
            asked = self.ask(revision.why)
            return [RepairRefused(revision.refused), *asked] if asked and revision.refused else asked
        drops = revision.repaired.dropped
        if not revision.on_promise:
            data.suspended = set()
            commands = self._drop(drops) + self._mend(revision.repaired)
            data.news = {}
            return commands
        # what is needless for what is true already goes; what is needless if a promise is kept is put off
        gone = tuple(drop for drop in drops if data.beliefs.issuperset(drop.because))
        data.suspended = {drop.step.id for drop in drops if drop not in gone and drop.step.id != data.running}
        return self._drop(gone)

    def _drop(self, drops: tuple[Drop, ...]) -> list[Command]:
        """Take the dropped steps out of the plan; one decision for each fact that made steps needless."""
        data = self.data
        commands: list[Command] = []
        groups: dict[tuple[Fact | None, str], list[Step]] = {}
        for drop in drops:
            if drop.step.id == data.running:
                commands += self.stop(drop.reason.value, drop.because[0] if drop.because else None)
                continue
            groups.setdefault((drop.because[0] if drop.because else None, drop.reason.value), []).append(drop.step)
        gone = {step.id for steps in groups.values() for step in steps}
        data.plan = [step for step in data.plan if step.id not in gone]
        data.tally = data.tally.plus(dropped=len(gone))
        for (fact, reason), steps in groups.items():
            cause = data.news.get(fact) if fact is not None else None
            commands.append(StepsDropped(tuple(steps), reason, fact, cause))
        return commands

    def _mend(self, repaired: Repaired) -> list[Command]:
        """Bring new steps into the plan, and all steps into the repaired plan's order."""
        data = self.data
        steps = {step.id: step for step in data.plan}
        plan = [steps.get(step.id, step) for step in repaired.plan]
        if data.running is not None and all(step.id != data.running for step in plan):
            plan.insert(0, steps[data.running])  # it is being stopped
        if plan == data.plan:
            return []
        data.plan = plan
        data.next_step = max(data.next_step, *(step.id + 1 for step in plan))
        data.tally = data.tally.plus(added=len(repaired.added))
        means = [repaired.means.value] if repaired.means is not Means.DELETION else []
        means += ["a shorter way"] if repaired.shortened else []
        return [PlanMended(repaired.added, tuple(plan), ", ".join(means))]

    def stop(self, why: str, fact: Fact | None = None) -> list[Command]:
        """Have the running step cancelled, unless that is asked already. ``fact``: what made it needless."""
        if self.data.cancelling:
            return []
        self.data.cancelling = True
        cause = self.data.news.get(fact) if fact is not None else None
        return [CancelAction(self.step(self.data.running), why, fact, cause)]

    def advance(self) -> list[Command]:
        """Start the next step, or say why not."""
        data = self.data
        if data.running is not None or data.question is not None or not data.begun or data.outcome:
            return []
        if self.reached():
            return self._settle()
        step = next((step for step in data.plan if step.id not in data.suspended), None)
        if step is None:
            if all(map(self.hoped, data.goals)):
                return self._wait("for what another robot has in hand")
            return self.ask("the plan ended without its goals" if data.tally.plans else "first plan")
        missing = self.lacks(step.action)
        if missing:
            return self._blocked(step, missing)
        if step.id not in data.meanwhile and data.unsolvable == self.planning_state and not self.sound(data.promised):
            return self._wait(_NO_PLAN)
        threatened = {need for needs in data.offers.values() for need in needs}
        after = apply(data.beliefs, step.action)
        if any(not holds(need, after) for need in threatened if holds(need, data.beliefs)):
            return self._wait("for a handover to end")
        data.running, data.waiting = step.id, ""
        return [StartAction(step)]

    def _blocked(self, step: Step, missing: tuple[Condition, ...]) -> list[Command]:
        """The next step cannot start: wait if the rest is promised, else have the plan made good."""
        if all(map(self.hoped, missing)):
            return self._wait("for what another robot has in hand")
        revision = self.strategy.revise(self.situation(frozenset()))
        if isinstance(revision, Adopt) and step.id not in {kept.id for kept in revision.repaired.plan[:1]}:
            return self.follow(revision) + self.advance()
        lacks = ", ".join(str(condition) for condition in missing)
        why = PlanAgain(f"{step} cannot start: it lacks {lacks}")
        return self.follow(revision if isinstance(revision, PlanAgain) else why)

    def _settle(self) -> list[Command]:
        """The goals hold: whatever is left of the plan is not needed."""
        data = self.data
        commands: list[Command] = []
        if data.plan:
            commands.append(StepsDropped(tuple(data.plan), "the goals hold already"))
            data.tally = data.tally.plus(dropped=len(data.plan))
            data.plan, data.suspended = [], set()
        if not data.satisfied:
            data.satisfied, data.waiting = True, ""
            commands.append(GoalsMet())
        return commands

    def ask(self, why: str) -> list[Command]:
        """Ask for a plan, unless the same question had no answer; stop an action that cannot end well."""
        data = self.data
        data.suspended = set()
        if data.unsolvable == self.planning_state:
            return self._wait(_NO_PLAN)
        running = self.running
        lacks = self.lacks(under_way(running).action) if running is not None else ()
        stop = self.stop(f"it lacks {', '.join(map(str, lacks))}") if lacks else []
        data.question, data.unsolvable, data.waiting = self.planning_state, None, ""
        data.asked = data.goals
        data.tally = data.tally.plus(planner_calls=1)
        return [*stop, AskPlan(why)]

    def ask_for_part(self) -> list[Command]:
        """As there is no plan to all goals, ask for one to those within reach, unless they hold already."""
        data, state = self.data, self.planning_state
        part = self._within_reach(state) if self.partly else ()
        if all(holds(goal, state) for goal in part) or part == data.goals:
            return []
        data.part, data.question = part, state
        data.tally = data.tally.plus(planner_calls=1)
        return [AskPlan("there is none to all goals: for those within reach", part)]

    def _within_reach(self, state: frozenset[Fact]) -> tuple[Condition, ...]:
        """The goals that could be brought about one by one, were nothing ever undone."""
        if self.actions is None:
            return ()
        operators = self.actions.operators(state, self.data.goals)
        far = Relaxation.of(operators, operators.state(state, self.data.unknown - state)).distance
        return tuple(
            goal for goal in self.data.goals if all(far[bit] < INFINITE for bit in bits(operators.mask((goal,))))
        )

    def _wait(self, why: str) -> list[Command]:
        if self.data.waiting == why:
            return []
        self.data.waiting = why
        return [Waits(why)]

    def give_up(self, outcome: str, why: str) -> list[Command]:
        """Stop for good."""
        if self.data.outcome:
            return []
        self.data.outcome, self.data.question = outcome, None
        return [Finished(outcome, why)]

    # ---- small questions -----------------------------------------------------------------------------------

    def learn(self, flips: Iterable[Flip]) -> dict[Fact, Cause | None]:
        """Believe the flips; returns those that were not expected, with their causes."""
        data = self.data
        running = self.running
        news: dict[Fact, Cause | None] = {}
        for flip in flips:
            if flip.fact not in data.unknown and (flip.fact in data.beliefs) is flip.value:
                continue
            data.unknown.discard(flip.fact)
            (data.beliefs.add if flip.value else data.beliefs.discard)(flip.fact)
            if running is None or not _brought_about(running.action, flip):
                news[flip.fact] = flip.cause
        return news

    def reached(self) -> bool:
        """Whether all goals are believed true."""
        return all(map(self.believed, self.data.goals))

    def believed(self, condition: Condition) -> bool:
        """Whether the condition is known to hold."""
        return condition.fact not in self.data.unknown and holds(condition, self.data.beliefs)

    def hoped(self, condition: Condition) -> bool:
        """Whether the condition is known to hold, or will when others have done what they promised."""
        return condition.positive if condition.fact in self.data.promised else self.believed(condition)

    def lacks(self, action: Action) -> tuple[Condition, ...]:
        """The preconditions of the action that are not known to hold."""
        return tuple(need for need in action.needs if not self.believed(need))

    def sound(self, promised: frozenset[Fact] = frozenset()) -> bool:
        """Whether the plan, as things are believed and perhaps promised, runs through to its goals."""
        data = self.data
        return not causal_links(data.beliefs | promised, self.rest(), data.goals, data.unknown - promised).unsupported

    def step(self, step_id: int | None) -> Step:
        """The step of that id."""
        return next(step for step in self.data.plan if step.id == step_id)

    def numbered(self, actions: Iterable[Action]) -> Plan:
        """The actions as new steps, with ids never used before."""
        steps = number(actions, self.data.next_step)
        self.data.next_step += len(steps)
        return steps

    def rest(self) -> Plan:
        """The plan; of the running step only the conditions that it does not itself end."""
        return tuple(under_way(step) if step.id == self.data.running else step for step in self.data.plan)

    def situation(self, changed: frozenset[Fact]) -> Situation:
        """What the strategy is to decide on."""
        data = self.data
        plan = self.rest()
        return Situation(
            state=frozenset(data.beliefs),
            plan=plan,
            goals=data.goals,
            changed=changed,
            since=frozenset(data.news),
            past=frozenset(data.beliefs ^ data.news.keys()),
            promised=data.promised,
            accidental=bool(data.news) and not any(data.news.values()),
            running=data.running is not None,
            unknown=frozenset(data.unknown),
            new_goals=data.new_goals,
            actions=self.actions,
            next_id=data.next_step,
        )


def _brought_about(action: Action, flip: Flip) -> bool:
    """Whether this is the running action's doing, or may be: what another's action has made true is not."""
    if not flip.value:
        return flip.fact in action.deletes
    return flip.fact in action.adds and (flip.cause is None or flip.cause.action == action.name)


def under_way(step: Step) -> Step:
    """A running step: it needs no longer what it ends itself (a robot that has left is still moving)."""
    ended = step.action.adds | step.action.deletes
    needs = tuple(need for need in step.action.needs if need.fact not in ended)
    return Step(step.id, replace(step.action, needs=needs))
