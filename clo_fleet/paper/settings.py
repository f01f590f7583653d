"""What each of the paper's domains has to tell the study: its PDDL, its problems, its newcomers, its opportunities.

| paper                                  | here                                 |
|----------------------------------------|--------------------------------------|
| problem p-05, p-10, ...                | the task of `size` 5, 10, ...        |
| appearance of an opportunity           | `Setting.opportunity`: facts flip    |
| five new objects perceived each action | `Setting.newcomer`, five times       |
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.resources import files
from typing import Protocol

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Fact, State, fact_text
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.pddl import read_domain
from clo_fleet.world.schemas import Domain

__all__ = ["Draw", "Newcomer", "Setting", "packaged_domain", "problem_name", "problem_text"]

Draw = Callable[[str], float]
"""A number in [0, 1) for a purpose, the same whenever it is asked for again at the same moment of the same run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Newcomer:
    """An object that the robot comes to see on its way. It has nothing to do with the goals.

    Attributes:
        objects: the names that come with it, with their types.
        facts: what is true of it.
    """

    objects: tuple[tuple[str, str], ...]
    facts: tuple[Fact, ...]


class Setting(Protocol):
    """One of the paper's domains with its problems and its surprises."""

    @property
    def name(self) -> str:
        """The domain's name, lower-case."""

    def domain(self) -> Domain:
        """The domain, read from the PDDL beside the module."""

    def task(self, size: int) -> PlanningTask:
        """The problem with ``size`` objects to deal with."""

    def newcomer(self, truth: State, number: int) -> Newcomer:
        """The ``number``-th object that the robot comes to see, where it is now."""

    def opportunity(self, task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
        """What somebody else does for the robot now; empty if there is nothing left to do for it."""


def packaged_domain(name: str) -> Domain:
    """The domain in ``<name>.pddl`` beside this module."""
    return read_domain((files("clo_fleet.paper") / f"{name}.pddl").read_text(encoding="utf-8"))


def problem_name(size: int) -> str:
    """The paper's name of a problem.

    >>> problem_name(5)
    'p-05'
    """
    return f"p-{size:02}"


def problem_text(task: PlanningTask, domain: str) -> str:
    """The task as a PDDL problem; equal tasks give equal texts."""
    objects = (f"{' '.join(names)} - {type_}" for type_, names in task.objects if names)
    return (
        f"(define (problem {task.robot})\n"
        f"  (:domain {domain})\n"
        f"  (:objects\n    {_lines(objects)})\n"
        f"  (:init\n    {_lines(map(fact_text, sorted(task.facts)))})\n"
        f"  (:goal (and\n    {_lines(map(fact_text, task.goals))})))\n"
    )


def _lines(items: Iterable[str]) -> str:
    return "\n    ".join(items)
