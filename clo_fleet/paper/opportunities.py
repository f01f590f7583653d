"""What others do for the robot, and how it is drawn. The paper leaves it open; this file is all that we have chosen.

After each action that the robot has carried out an opportunity appears with the run's probability. Which one is drawn
below from what is still to be done, each candidate with a number of its own: the same seed offers the same help after
the same number of actions to every strategy, as far as their robots have left it to be done.

Kinds are the paper's. Amounts are chosen so that CLO executes about as many actions as in its Table V: there an
opportunity saves about one action in ROOMS and two in DIALOG, and in COOKING from one at p-05 to ten at p-40.
"""

from collections.abc import Iterable, Mapping

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Fact, State
from clo_fleet.paper.settings import Draw
from clo_fleet.planning.problem import PlanningTask

__all__ = ["in_cooking", "in_dialog", "in_rooms"]

HELD = 0.5  # ROOMS: how many opportunities are objects handed over; the others are objects prepared
ANSWERS = 2  # DIALOG: questions answered at once
LARGEST = 0.75  # COOKING: units that one opportunity brings at most, as a share of the number of ingredients


def in_rooms(task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
    """An object that the robot does not hold yet is handed to it, or prepared: half and half."""
    lies: Mapping[str, Fact] = {fact[1]: fact for fact in sorted(truth) if fact[0] == "at-object"}
    wanted = [goal[1] for goal in task.goals if goal not in truth]
    if draw("kind") < HELD:
        item = _picked(wanted, draw)
        return tuple(Flip(*flip) for item in item for flip in ((("holding", item), True), (lies[item], False)))
    item = _picked((item for item in wanted if ("prepared", item) not in truth), draw)
    return tuple(Flip(("prepared", item), True) for item in item)


def in_dialog(task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
    """Somebody who has not answered everything yet answers the next two questions."""
    open_: dict[str, list[Fact]] = {}
    for goal in task.goals:
        if goal not in truth:
            open_.setdefault(goal[1], []).append(goal)
    return tuple(Flip(goal, True) for person in _picked(open_, draw) for goal in open_[person][:ANSWERS])


def in_cooking(task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
    """There is more of an ingredient, cut, than the robot has cut: up to three quarters of the problem's size more."""
    wanted = {goal[1]: goal for goal in task.goals if goal not in truth}
    flips: list[Flip] = []
    for ingredient in _picked(wanted, draw):
        there = max(_amount(fact) for fact in truth if fact[:2] == ("has-cut", ingredient))
        more = 1 + int(draw("units") * int(LARGEST * len(task.goals)))
        after = min(there + more, _amount(wanted[ingredient]))
        flips += [Flip(("has-cut", ingredient, f"n{amount}"), True) for amount in range(there + 1, after + 1)]
    return tuple(flips)


def _picked(candidates: Iterable[str], draw: Draw) -> tuple[str, ...]:
    """The candidate whose number is the smallest; none if there are none."""
    return tuple(sorted(candidates, key=lambda name: (draw(name), name))[:1])


def _amount(fact: Fact) -> int:
    return int(fact[2].removeprefix("n"))
