"""DIALOG: people in an open space, each in a place of their own, who are to be asked five questions each, in order."""

from dataclasses import dataclass
from itertools import pairwise

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import Fact, State
from clo_fleet.paper import opportunities
from clo_fleet.paper.settings import Draw, Newcomer, packaged_domain, problem_name
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import Domain

__all__ = ["QUESTIONS", "Dialog"]

QUESTIONS = tuple(f"q{i}" for i in range(6))  # the first counts as asked; the other five are to be asked


@dataclass(frozen=True, slots=True)
class Dialog:
    """The setting. Plans have 6n steps: a ``move`` to each person, and five times ``ask``."""

    name: str = "dialog"

    def domain(self) -> Domain:
        """The domain of ``dialog.pddl``."""
        return packaged_domain(self.name)

    def task(self, size: int) -> PlanningTask:
        """The problem with ``size`` people; the robot starts in a place where nobody is."""
        people = tuple(f"h{i}" for i in range(1, size + 1))
        places = tuple(f"l{i}" for i in range(1, size + 1))
        facts: set[Fact] = {("at-robot", "l0")}
        facts |= {("depends", after, before) for before, after in pairwise(QUESTIONS)}
        for person, place in zip(people, places, strict=True):
            facts |= {("at-human", person, place), ("asked", person, QUESTIONS[0])}
        return PlanningTask(
            robot=problem_name(size),
            objects=(("place", ("l0", *places)), ("human", people), ("question", QUESTIONS)),
            facts=frozenset(facts),
            goals=tuple(("asked", person, question) for person in people for question in QUESTIONS[1:]),
        )

    def newcomer(self, truth: State, number: int) -> Newcomer:
        """A person farther off, in a place of their own, whom nobody wants to be asked."""
        person, place = f"x{number}", f"y{number}"
        return Newcomer(
            objects=((person, "human"), (place, "place")),
            facts=(("at-human", person, place), ("asked", person, QUESTIONS[0])),
        )

    def opportunity(self, task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
        """Somebody answers questions that the robot has not asked yet."""
        return opportunities.in_dialog(task, truth, draw)
