"""COOKING: ingredients to be cut into given numbers of units, a unit with each cut."""

from dataclasses import dataclass
from itertools import pairwise

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import State
from clo_fleet.paper import opportunities
from clo_fleet.paper.settings import Draw, Newcomer, packaged_domain, problem_name
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import Domain

__all__ = ["Cooking", "units"]

LEAST, MOST = 3, 9


def units(number: int) -> int:
    """How many units of the ``number``-th ingredient are wanted: 4, 5, 6, 7, 8, 9, 9, ...

    The paper does not give the amounts. These are the ones that give its four plan lengths, 10n - 15.

    >>> [sum(1 + units(i) for i in range(1, n + 1)) for n in (5, 10, 20, 40)]
    [35, 85, 185, 385]
    """
    return min(LEAST + number, MOST)


@dataclass(frozen=True, slots=True)
class Cooking:
    """The setting. Plans have a ``get`` for each ingredient and a ``cut`` for each unit."""

    name: str = "cooking"

    def domain(self) -> Domain:
        """The domain of ``cooking.pddl``."""
        return packaged_domain(self.name)

    def task(self, size: int) -> PlanningTask:
        """The problem with ``size`` ingredients."""
        ingredients = tuple(f"i{i}" for i in range(1, size + 1))
        amounts = tuple(f"n{i}" for i in range(MOST + 1))
        facts = {("next", *pair) for pair in pairwise(amounts)}
        facts |= {("has-cut", ingredient, amounts[0]) for ingredient in ingredients}
        return PlanningTask(
            robot=problem_name(size),
            objects=(("ingredient", ingredients), ("amount", amounts)),
            facts=frozenset(facts),
            goals=tuple(
                ("has-cut", ingredient, amounts[units(i)]) for i, ingredient in enumerate(ingredients, start=1)
            ),
        )

    def newcomer(self, truth: State, number: int) -> Newcomer:
        """An ingredient that the recipe does not want."""
        name = f"x{number}"
        return Newcomer(objects=((name, "ingredient"),), facts=(("has-cut", name, "n0"),))

    def opportunity(self, task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
        """More units of an ingredient are cut than the robot has cut itself."""
        return opportunities.in_cooking(task, truth, draw)
