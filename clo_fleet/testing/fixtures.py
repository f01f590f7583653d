"""What the pytest fixtures hand out: makers of worlds, and of runs that are closed when the test is over."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

from clo_fleet.clo.strategies import Strategy
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.run import Run
from clo_fleet.testing.buildings import rooms_in_a_row, rooms_on_a_corridor, shipped_map
from clo_fleet.testing.worlds import WorldBuilder
from clo_fleet.world.map_file import read_map
from clo_fleet.world.model import BuildingMap, World
from clo_fleet.world.world_file import read_world

__all__ = ["FleetWorld", "RunFleet"]


class FleetWorld:
    """Makes empty worlds. ``folder``: where networks are built, for rooms on a corridor of their own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __call__(
        self, *rooms: str, on_map: str | Path | BuildingMap | None = None, corridor: bool = False
    ) -> WorldBuilder:
        """An empty world: the rooms in a row with doors between them, or a building that there is.

        Args:
            rooms: names of rooms.
            on_map: a building, a map file, or the name of a shipped map such as ``hello``, in place of rooms.
            corridor: let the rooms lie on both sides of a corridor; needs the extra ``maps``.
        """
        if isinstance(on_map, BuildingMap):
            return WorldBuilder(on_map)
        if isinstance(on_map, Path):
            return WorldBuilder(read_map(on_map))
        if on_map is not None:
            return WorldBuilder(shipped_map(on_map))
        return WorldBuilder(rooms_on_a_corridor(rooms, self._folder) if corridor else rooms_in_a_row(*rooms))


class RunFleet:
    """Starts runs and closes them all in the end, whatever has become of them. A context manager.

    ``planners``: for all of them, from ``planner_pool()``; otherwise each run has its own.
    """

    def __init__(self, planners: PlannerPool | None = None) -> None:
        self._planners = planners
        self._open: list[Run] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __call__(
        self, world: World | WorldBuilder | str | Path, strategy: Strategy | str = "clo", *, seed: int | None = None
    ) -> Run:
        """A run that has begun; step it or let it finish. Runs that have ended are closed before the next begins.

        Args:
            world: a world, one that is being put together, or a world file.
            strategy: a strategy, or its name.
            seed: in place of the world's.

        Raises:
            CorridorsOpenError: if the building has corridors and another run with corridors has not ended yet: SUMO
                simulates one network at a time.
        """
        if isinstance(world, str | Path):
            world = read_world(Path(world))
        elif isinstance(world, WorldBuilder):
            world = world.build()
        if seed is not None:
            world = replace(world, seed=seed)
        self.close(ended_only=True)
        run = Run(world, strategy, planners=self._planners)
        run.__enter__()
        self._open.append(run)
        return run

    def close(self, *, ended_only: bool = False) -> None:
        """Close SUMO, and end the planners, of all runs, or of those that have ended."""
        with ExitStack() as closing:  # closes the others as well if one cannot be closed
            for run in [run for run in self._open if run.done or not ended_only]:
                self._open.remove(run)
                closing.push(run.__exit__)
