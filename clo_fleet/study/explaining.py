"""Puts together what is to be said of a plan, from its links, the worth of its opportunities, and its repair."""

from collections.abc import Collection, Iterable, Sequence
from functools import reduce

from clo_fleet.clo.links import Consumer, End, Guard, Link, Links, causal_links
from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import Plan, cost, number
from clo_fleet.clo.repair import Refused, Repaired, repair
from clo_fleet.clo.task import Action, Condition, Fact, State, apply, fact_text, holds
from clo_fleet.clo.worth import Window, worths
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.study.explanation import (
    EXPLANATION_FORMAT,
    GOAL,
    ChangeRow,
    Explanation,
    FateRow,
    GuardRow,
    LinkRow,
    OpportunityRow,
    Place,
    RepairRow,
    StepRow,
    WindowRow,
)
from clo_fleet.study.surprise import Surprise, facts_of

__all__ = ["TooFewStepsError", "explain"]


class TooFewStepsError(CloFleetError):
    """More steps are said to have been done than the plan has.

    Attributes:
        executed: how many were said to have been done.
        steps: how many the plan has.
    """

    def __init__(self, executed: int, steps: int) -> None:
        super().__init__(f"--after {executed}: the plan has {steps} steps, expected a number from 0 to {steps}")
        self.executed = executed
        self.steps = steps


def explain(task: GroundTask, actions: Sequence[Action], source: str, executed: int, surprise: Surprise) -> Explanation:
    """What is to be said of a plan that reaches the goals of ``task``.

    Args:
        task: what the plan is for.
        actions: the plan.
        source: where it comes from, in words.
        executed: how many of its steps have been done, just as modelled.
        surprise: what changed by itself at that moment, perhaps nothing.

    Raises:
        TooFewStepsError: if the plan has fewer steps than are said to have been done.
    """
    if executed > len(actions):
        raise TooFewStepsError(executed, len(actions))
    plan = number(actions, first=1)
    rest = plan[executed:]
    state = reduce(apply, actions[:executed], task.state)
    links = causal_links(state, rest, task.goals)
    supports = _by_producer(links.links)
    return Explanation(
        format=EXPLANATION_FORMAT,
        task=task.name,
        source=source,
        cost=cost(plan),
        executed=executed,
        steps=tuple(
            StepRow(
                step=step.id,
                action=str(step),
                cost=step.action.cost,
                done=step.id <= executed,
                supports=supports.get(step.id, ()),
            )
            for step in plan
        ),
        links=_link_rows(links.links),
        opportunities=_opportunities(state, rest, task.goals),
        guards=_guard_rows(links.guards),
        repair=_repair_row(task, state, plan, executed, surprise, links) if surprise.conditions else None,
    )


def _repair_row(
    task: GroundTask, state: State, plan: Plan, executed: int, surprise: Surprise, before: Links
) -> RepairRow:
    rest = plan[executed:]
    known = facts_of(task)
    after = (frozenset(state) | surprise.true) - surprise.false
    changes = tuple(
        ChangeRow(
            fact=fact_text(condition.fact),
            value=condition.positive,
            news=not holds(condition, state),
            meaning=_meaning(condition, before, known),
        )
        for condition in surprise.conditions
    )
    found = repair(
        after,
        rest,
        task.goals,
        changed=after ^ state,
        operators=Operators(task.actions, task.goals),
        next_id=len(plan) + 1,
    )
    repaired = found if isinstance(found, Repaired) else None
    links = repaired.links if repaired else Links()
    missing = found.missing if isinstance(found, Refused) else ()
    return RepairRow(
        changes=changes,
        refused=found.why.value if isinstance(found, Refused) else "",
        means=repaired.means.value if repaired else "",
        steps=_fates(rest, repaired, links) if repaired else (),
        cost_before=cost(rest),
        cost_after=cost(repaired.plan) if repaired else None,
        links=_link_rows(links.links),
        guards=_guard_rows(links.guards),
        missing=_guard_rows(Guard(gap.condition, gap.consumer) for gap in missing),
    )


def _fates(rest: Plan, repaired: Repaired, links: Links) -> tuple[FateRow, ...]:
    """The repaired plan in its order, with each dropped step after the step that it used to follow."""
    drops = {drop.step.id: drop for drop in repaired.dropped}
    order = [*repaired.plan]
    for place, step in enumerate(rest):
        if step.id in drops:
            before = [other.id for other in order].index(rest[place - 1].id) + 1 if place else 0
            order.insert(before, step)
    gives: dict[int, list[Link]] = {}
    for link in links.links:
        gives.setdefault(link.producer, []).append(link)
    rows = []
    for step in order:
        drop, fate, reason = drops.get(step.id), "kept", ""
        if drop is not None:
            fate, reason = "dropped", drop.reason.value
        elif step in repaired.added:
            fate, reason = "added", _purpose(gives.get(step.id, ()))
        because = tuple(map(fact_text, drop.because)) if drop else ()
        rows.append(
            FateRow(step=step.id, action=str(step), cost=step.action.cost, fate=fate, reason=reason, because=because)
        )
    return tuple(rows)


def _purpose(links: Iterable[Link]) -> str:
    """Why a step is in the plan."""
    takers: dict[str, list[str]] = {}
    for link in links:
        takers.setdefault(str(link.condition), []).append(str(_place(link.consumer)))
    return "gives " + "; ".join(f"{fact} to {', '.join(places)}" for fact, places in takers.items())


def _meaning(condition: Condition, links: Links, known: Collection[Fact]) -> str:
    opposite = Condition(condition.fact, not condition.positive)
    if condition in links.opportunities:
        return "an opportunity"
    if any(guard.condition == opposite for guard in links.guards):
        return "a guard broken"
    if condition.fact not in known:
        return "no action that could be done before has to do with it"
    return "nothing that the plan relies on"


def _opportunities(state: State, rest: Plan, goals: Sequence[Condition]) -> tuple[OpportunityRow, ...]:
    """Their worth for what a repair leaves of the plan: what is needless anyway is no credit to any fact."""
    lean = repair(state, rest, goals)
    plan = lean.plan if isinstance(lean, Repaired) else rest
    rows = []
    for worth in worths(state, plan, goals):
        windows = list(worth.windows)
        if worth.value and not any(0 in window for window in windows):
            windows.insert(0, Window(0, 0))  # past what the windows promise, a repair finds loops
        rows.append(
            OpportunityRow(
                fact=str(worth.condition),
                saves=worth.value,
                saves_steps=worth.steps,
                windows=tuple(WindowRow(first=plan[window.first].id, last=plan[window.last].id) for window in windows),
            )
        )
    return tuple(rows)


def _place(consumer: Consumer) -> Place:
    return GOAL if isinstance(consumer, End) else consumer


def _in_order(place: Place) -> tuple[bool, Place]:
    """Sorts steps by number, the goal last."""
    return isinstance(place, str), place


def _by_producer(links: Iterable[Link]) -> dict[int, tuple[Place, ...]]:
    consumers: dict[int, set[Place]] = {}
    for link in links:
        consumers.setdefault(link.producer, set()).add(_place(link.consumer))
    return {producer: tuple(sorted(places, key=_in_order)) for producer, places in consumers.items()}


def _link_rows(links: Iterable[Link]) -> tuple[LinkRow, ...]:
    """The links by producer, fact and consumer, as the paper's table lists them."""
    rows = (LinkRow(producer=link.producer, fact=str(link.condition), consumer=_place(link.consumer)) for link in links)
    return tuple(sorted(rows, key=lambda row: (row.producer, row.fact, _in_order(row.consumer))))


def _guard_rows(guards: Iterable[Guard]) -> tuple[GuardRow, ...]:
    needed: dict[str, set[Place]] = {}
    for guard in guards:
        needed.setdefault(str(guard.condition), set()).add(_place(guard.consumer))
    return tuple(
        GuardRow(fact=fact, needed_by=tuple(sorted(places, key=_in_order))) for fact, places in sorted(needed.items())
    )
