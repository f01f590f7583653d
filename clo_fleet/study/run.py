"""Running a world, from a script, a test or the command: step it, look at it, and get a typed result.

>>> from clo_fleet.study.run import Run            # doctest: +SKIP
>>> with Run(read_world("worlds/hello.yaml")) as run:     # doctest: +SKIP
...     result = run.finish()
"""

import tempfile
import time as clock
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from clo_fleet.clo.strategies import STRATEGIES, Strategy
from clo_fleet.clo.task import Fact
from clo_fleet.errors import CloFleetError
from clo_fleet.fleet.mission import TICK, Mission
from clo_fleet.fleet.robot_view import RobotView
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.checkpoints import Checkpoint, CheckpointError, Checkpoints
from clo_fleet.study.event_log import EventLog, Recorded
from clo_fleet.study.metrics import measure
from clo_fleet.study.replay.scene import write_scene
from clo_fleet.study.result import RunResult, write_result
from clo_fleet.study.run_file import RunFile, held, read_run_file
from clo_fleet.world.model import PlanningTime, World
from clo_fleet.world.pddl import fleet_domain

__all__ = ["OutputExistsError", "Run", "UnknownRobotError", "UnknownStrategyError", "planner_pool", "strategy_named"]

TINY = 1e-9  # [s]
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


class CheckpointEveryError(CloFleetError):
    """A run can be saved between two ticks only.

    Attributes:
        seconds: how often it was to be saved [s].
    """

    def __init__(self, seconds: float) -> None:
        super().__init__(f"a checkpoint every {seconds:g} s: expected a multiple of the tick, {TICK:g} s")
        self.seconds = seconds


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
        checkpoint_every: save the run so often [s], a multiple of the tick, for ``Run.resumed``. It is another run
            then: engines forget something when they are restarted from what was saved.
        source: the world's file, for who goes on with the run.
        planners: from ``planner_pool()``; who makes many runs in one process spares each the second that planners take
            to start. They are left running; those that the run would start itself are ended with it.

    Raises:
        UnknownStrategyError: if no strategy has that name.
        OutputExistsError: if ``out`` holds a run, and not ``force``.
        CheckpointEveryError: if ``checkpoint_every`` is no multiple of the tick.
    """

    def __init__(
        self,
        world: World,
        strategy: Strategy | str = "clo",
        *,
        out: Path | None = None,
        force: bool = False,
        planners: PlannerPool | None = None,
        checkpoint_every: float | None = None,
        source: Path | None = None,
        start: Checkpoint | None = None,
    ) -> None:
        self._checkpoint_every = checkpoint_every
        self._every = _ticks(checkpoint_every)
        self._source = source
        self._start = start
        self._begun = False  # whether it goes on with a run that somebody has begun
        self._strategy = strategy_named(strategy) if isinstance(strategy, str) else strategy
        self._out = out
        self._begin = clock.perf_counter()
        if out is not None and not force and any((out / name).exists() for name in ("events.jsonl", "result.json")):
            raise OutputExistsError(out)
        self._open_things = ExitStack()
        self._log = EventLog()
        self._entered = False
        self.mission = Mission(
            world,
            self._strategy,
            self._log,
            planners,
            checkpoint_every=checkpoint_every,
            saved=start.saved if start else None,
        )

    @classmethod
    def resumed(
        cls,
        folder: Path,
        world: World | Path | None = None,
        strategy: Strategy | None = None,
        *,
        planners: PlannerPool | None = None,
    ) -> Self:
        """The run in ``folder``, begun with ``checkpoint_every``: from its last checkpoint on, or from its beginning.

        What it writes is what it would have written if it had never been stopped.

        Args:
            folder: where it writes to.
            world: the world if it was made in code, or its file if that is elsewhere now.
            strategy: the strategy if it is none of our own.
            planners: as for any run.

        Raises:
            ResumeError: if there is no such run, it has ended, or what it was begun with has changed since.
            CheckpointError: if all its checkpoints are damaged.
        """
        begun = read_run_file(folder)
        known = begun.world(folder, world)
        start = Checkpoints(folder / "checkpoints").last(folder / "events.jsonl")
        try:
            run = cls(
                known,
                strategy or begun.strategy,
                out=folder,
                force=True,
                planners=planners,
                checkpoint_every=begun.checkpoint_every,
                source=world if isinstance(world, Path) else Path(begun.source) if begun.source else None,
                start=start,
            )
            run._begun = True
            return run
        except (LookupError, TypeError, ValueError, AttributeError) as error:
            if start is None:
                raise
            raise CheckpointError(start.path, f"is no state of this world ({error!r})") from error

    def __enter__(self) -> Self:
        if self._entered:
            return self
        with ExitStack() as stack:
            stack.enter_context(self.mission)
            stack.callback(self._log.close)
            if self._out is not None:  # only now: an engine that refuses to start leaves an earlier run as it is
                self._open(self._out, stack)
            elif self._every:
                scratch = stack.enter_context(tempfile.TemporaryDirectory(prefix="clo-fleet-run-"))
                self._checkpoints = Checkpoints(Path(scratch))
            self._open_things = stack.pop_all()
        self._entered = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open_things.close()

    @property
    def resumed_at(self) -> float | None:
        """From when on it goes on with a run that was stopped [s]; ``None``: it began at the beginning."""
        return self._start.time if self._start else None

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
        """The events from the one of that number on; another thread may ask too."""
        return tuple(self._log.events[number:])

    def step(self, ticks: int = 1) -> None:
        """Go on for some ticks; nothing happens once the run has ended."""
        for _ in range(ticks):
            self._tick()

    def finish(self, until: float | None = None, progress: Callable[[Mission], None] | None = None) -> RunResult:
        """Go on until the run ends, at the latest at ``until`` [s]; returns and writes the result.

        Args:
            until: the longest that the run may last; the world's own limit if not given.
            progress: called after each simulated second.
        """
        ticks = 0
        while not self.done:
            self._tick(until)
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
        return measure(self.mission, self._log.events, self._wall())

    # ---- private -------------------------------------------------------------------------------------------

    def _open(self, out: Path, stack: ExitStack) -> None:
        """Make the run's files, or go on with them."""
        out.mkdir(parents=True, exist_ok=True)
        self._checkpoints = Checkpoints(out / "checkpoints")
        stack.enter_context(held(out))
        if self._start is not None:
            self._log.go_on(out / "events.jsonl", self._start.log)
            return
        if not self._begun:
            (out / "run.json").unlink(missing_ok=True)  # first, so that nobody goes on with half an old run
        (out / "result.json").unlink(missing_ok=True)
        self._checkpoints.clear()
        write_scene(self.mission.world, out / "scene.json")
        self._log.write_to(out / "events.jsonl")
        if self._checkpoint_every is not None and not self._begun:
            RunFile.of(self.mission.world, self._source, self._strategy.name, self._checkpoint_every).write(out)
            stack.enter_context(held(out))

    def _tick(self, until: float | None = None) -> None:
        """One tick, and a checkpoint if it is time for one."""
        self.mission.step(until)
        if self._every and not self.done and round(self.time / TICK) % self._every == 0:
            self.mission.rebuild(self._checkpoints.keep(self.mission, self._log.mark(), self._wall()))

    def _wall(self) -> float:
        """The real time that the run has taken [s]."""
        return (self._start.wall_run if self._start else 0.0) + clock.perf_counter() - self._begin


def _ticks(seconds: float | None) -> int:
    """So many ticks, 0 for ``None``."""
    ticks = round((seconds or 0.0) / TICK)
    if seconds is not None and (ticks < 1 or abs(ticks * TICK - seconds) > TINY):
        raise CheckpointEveryError(seconds)
    return ticks
