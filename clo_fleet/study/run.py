"""Running a world, from a script, a test or the command: step it, look at it, and get a typed result.

>>> from clo_fleet.study.run import Run            # doctest: +SKIP
>>> with Run(read_world("worlds/hello.yaml")) as run:     # doctest: +SKIP
...     result = run.finish()
"""

import time as clock
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from clo_fleet.clo.strategies import STRATEGIES, Strategy
from clo_fleet.clo.task import Fact
from clo_fleet.errors import CloFleetError
from clo_fleet.fleet.mission import Mission, RobotView
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.event_log import EventLog, Recorded
from clo_fleet.study.metrics import measure
from clo_fleet.study.replay.scene import write_scene
from clo_fleet.study.result import RunResult, write_result
from clo_fleet.world.model import PlanningTime, World
from clo_fleet.world.pddl import fleet_domain

__all__ = ["OutputExistsError", "Run", "UnknownRobotError", "UnknownStrategyError", "planner_pool", "strategy_named"]

FLUSH_EVERY = 100  # ticks between two times that the log is brought to the disk


class UnknownStrategyError(CloFleetError):
    """There is no strategy of that name.

    Attributes:
        name: the name as given.
    """

    def __init__(self, name: str) -> None:
        super().__init__(f"unknown strategy {name!r}; expected one of {', '.join(STRATEGIES)}")
        self.name = name


class UnknownRobotError(CloFleetError):
    """The world has no robot of that name.

    Attributes:
        name: the name as given.
        robots: the robots there are.
    """

    def __init__(self, name: str, robots: tuple[str, ...]) -> None:
        super().__init__(f"there is no robot {name!r}; expected one of {', '.join(robots)}")
        self.name = name
        self.robots = robots


class OutputExistsError(CloFleetError):
    """A run would overwrite another run's files.

    Attributes:
        folder: the folder that holds them.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder} holds a run already; choose another folder, or overwrite it with --force")
        self.folder = folder


def planner_pool() -> PlannerPool:
    """Planners for runs of worlds with the usual limits of planning, one run after another. A context manager."""
    usual = PlanningTime()
    return PlannerPool(fleet_domain(), wall_limit=usual.wall_limit, memory_limit=usual.memory_limit)


def strategy_named(name: str) -> Strategy:
    """The strategy of that name.

    Raises:
        UnknownStrategyError: if there is none.
    """
    if name not in STRATEGIES:
        raise UnknownStrategyError(name)
    return STRATEGIES[name]


class Run:
    """One run of a world. A context manager: on leaving it, SUMO and the planners are ended.

    To enter a run that has been entered changes nothing.

    Args:
        world: the world, from ``read_world`` or made in code.
        strategy: a strategy, or its name.
        out: folder for ``events.jsonl``, ``result.json`` and ``scene.json``; nothing is written without one.
        force: overwrite what an earlier run left in ``out``.
        planners: from ``planner_pool()``; who makes many runs in one process spares each the 2 s that planners take to
            start. They are left running; those that the run would start itself are ended with it.

    Raises:
        UnknownStrategyError: if no strategy has that name.
        OutputExistsError: if ``out`` holds a run, and not ``force``.
    """

    def __init__(
        self,
        world: World,
        strategy: Strategy | str = "clo",
        *,
        out: Path | None = None,
        force: bool = False,
        planners: PlannerPool | None = None,
    ) -> None:
        self._strategy = strategy_named(strategy) if isinstance(strategy, str) else strategy
        self._out = out
        self._begin = clock.perf_counter()
        if out is not None and not force and any((out / name).exists() for name in ("events.jsonl", "result.json")):
            raise OutputExistsError(out)
        self._log = EventLog()
        self._entered = False
        self.mission = Mission(world, self._strategy, self._log, planners)

    def __enter__(self) -> Self:
        if self._entered:
            return self
        self.mission.__enter__()
        if self._out is not None:  # only now: an engine that refuses to start leaves an earlier run as it is
            try:
                self._out.mkdir(parents=True, exist_ok=True)
                (self._out / "result.json").unlink(missing_ok=True)
                write_scene(self.mission.world, self._out / "scene.json")
                self._log.write_to(self._out / "events.jsonl")
            except OSError:
                self.mission.__exit__(None, None, None)
                raise
        self._entered = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.mission.__exit__(kind, error, trace)
        self._log.close()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.mission.time

    @property
    def done(self) -> bool:
        """Whether the run has ended."""
        return self.mission.outcome is not None

    @property
    def facts(self) -> frozenset[Fact]:
        """The facts that truly hold."""
        return self.mission.facts

    def robot(self, robot: str) -> RobotView:
        """One robot as it is now: pose, place, plan, links, beliefs.

        Raises:
            UnknownRobotError: if the world has no such robot.
        """
        known = tuple(spec.id for spec in self.mission.world.robots)
        if robot not in known:
            raise UnknownRobotError(robot, known)
        return self.mission.view(robot)

    @property
    def log(self) -> tuple[Recorded, ...]:
        """The events so far, as (id, time [s], event)."""
        return tuple(self._log.events)

    def log_since(self, number: int) -> tuple[Recorded, ...]:
        """The events from the one of that number on."""
        return tuple(self._log.events[number:])

    def step(self, ticks: int = 1) -> None:
        """Go on for some ticks; nothing happens once the run has ended."""
        for _ in range(ticks):
            self.mission.step()

    def finish(self, until: float | None = None, progress: Callable[[Mission], None] | None = None) -> RunResult:
        """Go on until the run ends, at the latest at ``until`` [s]; returns and writes the result.

        Args:
            until: the longest that the run may last; the world's own limit if not given.
            progress: called after each simulated second.
        """
        ticks = 0
        while not self.done:
            self.mission.step(until)
            ticks += 1
            if ticks % FLUSH_EVERY == 0:
                self._log.flush()
            if progress is not None and ticks % 5 == 0:
                progress(self.mission)
        result = self.result()
        if self._out is not None:
            self._log.close()
            write_result(result, self._out / "result.json")
        return result

    def result(self) -> RunResult:
        """The result as things stand; its outcome is ``running`` while the run goes on."""
        return measure(self.mission, self._log.events, clock.perf_counter() - self._begin)
