"""ROOMS: as many rooms as objects, one object in each; the robot starts in the first room and is to hold them all."""

from dataclasses import dataclass

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.task import State
from clo_fleet.paper import opportunities
from clo_fleet.paper.settings import Draw, Newcomer, packaged_domain, problem_name
from clo_fleet.planning.problem import PlanningTask
from clo_fleet.world.schemas import Domain

__all__ = ["Rooms"]


@dataclass(frozen=True, slots=True)
class Rooms:
    """The setting. Plans have 3n - 1 steps: a ``prepare``, a ``grasp`` for each object, a ``move`` between two."""

    name: str = "rooms"

    def domain(self) -> Domain:
        """The domain of ``rooms.pddl``."""
        return packaged_domain(self.name)

    def task(self, size: int) -> PlanningTask:
        """The problem with ``size`` objects."""
        items = tuple(f"o{i}" for i in range(1, size + 1))
        rooms = tuple(f"l{i}" for i in range(1, size + 1))
        return PlanningTask(
            robot=problem_name(size),
            objects=(("room", rooms), ("item", items)),
            facts=frozenset({("at-robot", "l1"), *(("at-object", *pair) for pair in zip(items, rooms, strict=True))}),
            goals=tuple(("holding", item) for item in items),
        )

    def newcomer(self, truth: State, number: int) -> Newcomer:
        """An object in the robot's room that nobody asked for."""
        room = next(fact[1] for fact in truth if fact[0] == "at-robot")
        name = f"x{number}"
        return Newcomer(objects=((name, "item"),), facts=(("at-object", name, room),))

    def opportunity(self, task: PlanningTask, truth: State, draw: Draw) -> tuple[Flip, ...]:
        """Another agent prepares an object, or hands it over."""
        return opportunities.in_rooms(task, truth, draw)
