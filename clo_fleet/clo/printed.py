"""Algorithms 1, 3 and 4 of Borrajo and Veloso 2024 as they are printed: a baseline with its faults.

Three corrections, without which they do not run (DECISIONS 12): steps are counted forward, from 1; the links of steps
that have been done are popped with the plan; a step enters the removal set once (printed, Algorithm 4 adds the step
that it is about to remove again and again). Nothing else is mended: all links on a fact are taken away, also those
whose producer makes it anew after it was undone, and no threat is looked for.

The worked example, after the first move, when ``holding(O2)`` turns true:

>>> from clo_fleet.clo.task import Action
>>> def act(schema, *args, needs, adds, deletes=()):
...     conditions = tuple(Condition(tuple(fact.split())) for fact in needs)
...     return Action(schema=schema, args=args, needs=conditions,
...                   adds=frozenset(tuple(fact.split()) for fact in adds),
...                   deletes=frozenset(tuple(fact.split()) for fact in deletes))
>>> def move(a, b):
...     here, there = f"at-robot {a}", f"at-robot {b}"
...     return act("move", a, b, needs=[here], adds=[there], deletes=[here])
>>> def prepare(o, l):
...     return act("prepare", o, l, needs=[f"at-object {o} {l}", f"at-robot {l}"], adds=[f"prepared {o}"])
>>> def grasp(o, l):
...     return act("grasp", o, l, needs=[f"at-object {o} {l}", f"at-robot {l}", f"prepared {o}"],
...                adds=[f"holding {o}"], deletes=[f"at-object {o} {l}"])
>>> plan = (move("L3", "L1"), prepare("O1", "L1"), grasp("O1", "L1"),
...         move("L1", "L2"), prepare("O2", "L2"), grasp("O2", "L2"))
>>> goals = (Condition(("holding", "O1")), Condition(("holding", "O2")))
>>> links = printed_links(plan, goals)
>>> print(table(plan, links))
1  move(L3, L1)     at-robot L1  prepare(O1, L1)
   move(L3, L1)     at-robot L1  grasp(O1, L1)
   move(L3, L1)     at-robot L1  move(L1, L2)
2  prepare(O1, L1)  prepared O1  grasp(O1, L1)
3  grasp(O1, L1)    holding O1   goal
4  move(L1, L2)     at-robot L2  prepare(O2, L2)
   move(L1, L2)     at-robot L2  grasp(O2, L2)
5  prepare(O2, L2)  prepared O2  grasp(O2, L2)
6  grasp(O2, L2)    holding O2   goal
>>> print(*sorted(" ".join(fact) for fact in opportunities(links)), sep=", ")
at-robot L1, at-robot L2, holding O1, holding O2, prepared O1, prepared O2

When the first step has been done its links are popped; then the fact turns true. Algorithm 4 first walks back from
step 6, then from the steps that became empty on the way:

>>> rest = (None, *plan[1:])
>>> stages, left = printed_repair(("holding", "O2"), rest, ((), *links[1:]))
>>> print(table(plan, stages[0]))
2  prepare(O1, L1)  prepared O1  grasp(O1, L1)
3  grasp(O1, L1)    holding O1   goal
4  move(L1, L2)     at-robot L2  prepare(O2, L2)
>>> shorter = tuple(plan[i] for i in left)
>>> print(table(shorter, tuple(tuple(PrintedLink(left.index(link.producer), link.fact, link.consumer
...     if link.consumer is None else left.index(link.consumer)) for link in stages[-1][i]) for i in left)))
1  prepare(O1, L1)  prepared O1  grasp(O1, L1)
2  grasp(O1, L1)    holding O1   goal
>>> print(*(action.name for action in shorter), sep=", ")
prepare(O1, L1), grasp(O1, L1)
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from clo_fleet.clo.task import Action, Condition, Fact

__all__ = ["PrintedLink", "opportunities", "printed_links", "printed_repair", "table"]


@dataclass(frozen=True, slots=True)
class PrintedLink:
    """A causal link between places of a plan, counted from 0; the consumer ``None`` is the goal."""

    producer: int
    fact: Fact
    consumer: int | None


LinkVector = tuple[tuple[PrintedLink, ...], ...]


def printed_links(plan: Sequence[Action], goals: Iterable[Condition]) -> LinkVector:
    """Algorithm 1: from the end of the plan, each pending condition goes to the last step that adds it."""
    pending: list[tuple[Fact, int | None]] = [(goal.fact, None) for goal in goals if goal.positive]
    vector: list[tuple[PrintedLink, ...]] = []
    for i in range(len(plan) - 1, -1, -1):
        met = [pair for pair in pending if pair[0] in plan[i].adds]
        order = sorted(met, key=lambda pair: len(plan) if pair[1] is None else pair[1])
        vector.append(tuple(PrintedLink(i, fact, consumer) for fact, consumer in order))
        pending = [pair for pair in pending if pair not in met]
        pending += [(need.fact, i) for need in plan[i].needs if need.positive]
    return tuple(reversed(vector))


def opportunities(links: LinkVector) -> frozenset[Fact]:
    """The facts of all links."""
    return frozenset(link.fact for at_step in links for link in at_step)


def printed_repair(
    fact: Fact, plan: Sequence[Action | None], links: LinkVector
) -> tuple[tuple[LinkVector, ...], tuple[int, ...]]:
    """Algorithm 3: take away all links on ``fact``, then all steps that have none left.

    Args:
        fact: the opportunity.
        plan: the steps; ``None`` where one has been done.
        links: their links, empty where a step has been done.

    Returns:
        The links after each walk of Algorithm 4, the last ones at the end; the places of the steps that are left.
    """
    left = {i for i, action in enumerate(plan) if action is not None}
    vector = [list(at_step) for at_step in links]
    stages: list[LinkVector] = []
    changed = True
    while changed:
        changed = False
        for i in sorted(left):
            kept = [link for link in vector[i] if link.fact != fact]
            changed = len(kept) < len(vector[i])
            vector[i] = kept
            if not kept:
                _remove_actions(i, left, vector, stages)
            if changed:
                break
    stages.append(tuple(map(tuple, vector)))
    return tuple(stages), tuple(sorted(left))


def _remove_actions(first: int, left: set[int], vector: list[list[PrintedLink]], stages: list[LinkVector]) -> None:
    """Algorithm 4: drop a step, take away the links that served it, and drop the steps that served nothing else."""
    removal = [first]
    left.discard(first)
    while removal:
        i = removal.pop(0)
        for k in range(i, -1, -1):
            if k not in left:
                continue
            vector[k] = [link for link in vector[k] if link.consumer != i]
            if not vector[k]:
                removal.append(k)
                left.discard(k)
        stages.append(tuple(map(tuple, vector)))


def table(plan: Sequence[Action], links: LinkVector) -> str:
    """The links as the paper prints them: step, producer, proposition, consumer."""
    rows = [
        (
            str(i + 1) if number == 0 else "",
            plan[link.producer].name,
            " ".join(link.fact),
            "goal" if link.consumer is None else plan[link.consumer].name,
        )
        for i, at_step in enumerate(links)
        for number, link in enumerate(at_step)
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    return "\n".join("  ".join((*map(str.ljust, row[:3], widths), row[3])) for row in rows)
