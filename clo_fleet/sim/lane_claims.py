"""Claims on lanes: each single-lane chain in one direction at a time, and no circle of lanes that could all be full.

A lane can be full only if as many robots claim it as it holds: it *can fill up*. Robots in corridors stand still for
good only in a circle of full lanes in which the foremost robot of each wants to go on to the next. So no claim is
taken by which lanes that can fill up would form a circle, each followed by those that robots claim right after it.
Claims only become fewer as robots leave lanes behind, so what held when a claim was taken goes on to hold.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from clo_fleet.sim.lanes import ChainWay, Ground
from clo_fleet.world.model import RobotId

__all__ = ["LaneClaims"]


class LaneClaims:
    """Who claims which lanes, in the order in which it will drive over them."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        self._lanes: dict[RobotId, tuple[str, ...]] = {}
        self._on_lane: Counter[str] = Counter()
        self._onward: dict[str, Counter[str]] = {}
        self._chains: dict[str, dict[RobotId, bool]] = {}

    def lanes(self, robot: RobotId) -> tuple[str, ...]:
        """What the robot claims."""
        return self._lanes.get(robot, ())

    def set(self, robot: RobotId, lanes: Sequence[str]) -> None:
        """Let the robot claim these lanes and no others, whether they fit or not."""
        old = self._lanes.pop(robot, ())
        for lane in old:
            self._on_lane[lane] -= 1
        for lane, after in pairwise(old):
            self._onward[lane][after] -= 1
            if not self._onward[lane][after]:
                del self._onward[lane][after]
        for way in self.ways(old):
            self._chains[way.chain].pop(robot, None)
        if not lanes:
            return
        self._lanes[robot] = tuple(lanes)
        for lane in lanes:
            self._on_lane[lane] += 1
        for lane, after in pairwise(lanes):
            self._onward.setdefault(lane, Counter())[after] += 1
        for way in self.ways(lanes):
            self._chains.setdefault(way.chain, {})[robot] = way.forwards

    def ways(self, lanes: Iterable[str]) -> list[ChainWay]:
        """The ways through chains that the lanes are part of."""
        return [self._ground.ways[lane] for lane in lanes if lane in self._ground.ways]

    def fit(self, lanes: Sequence[str]) -> bool:
        """Whether one more robot can claim the lanes."""
        directions: dict[str, bool] = {}
        for way in self.ways(lanes):
            if directions.setdefault(way.chain, way.forwards) != way.forwards:
                return False  # it would meet itself
        for chain, forwards in directions.items():
            if self._chains.get(chain) and next(iter(self._chains[chain].values())) != forwards:
                return False  # all who claim a chain do so in the same direction
        return self.circle(lanes) is None

    def against(self, lane: str) -> tuple[RobotId, ...]:
        """Those who claim the lane's chain in the other direction, sorted; nobody if it is no single lane."""
        way = self._ground.ways.get(lane)
        if way is None:
            return ()
        return tuple(sorted(r for r, forwards in self._chains.get(way.chain, {}).items() if forwards != way.forwards))

    def claimants(self, lane: str) -> tuple[RobotId, ...]:
        """Those who claim the lane, sorted."""
        return tuple(sorted(robot for robot, lanes in self._lanes.items() if lane in lanes))

    def load(self, lane: str) -> float:
        """How many claim the lane, as a share of those that it holds."""
        return self._on_lane[lane] / self._ground.capacity[lane]

    def circle(self, lanes: Sequence[str]) -> str | None:
        """A lane in a circle of lanes that could all be full if one more robot claimed these; ``None``: no circle."""
        mine = Counter(lanes)
        done: set[str] = set()
        for first in lanes:
            if first in done or not self._fills(first, mine):
                continue
            path: dict[str, Iterator[str]] = {first: self._after(first, lanes)}  # from the first to where the search is
            while path:
                lane = next(reversed(path))
                after = next(path[lane], None)
                if after is None:
                    done.add(lane)
                    del path[lane]
                elif after in path:
                    return after
                elif after not in done and self._fills(after, mine):
                    path[after] = self._after(after, lanes)
        return None

    def _fills(self, lane: str, mine: Counter[str]) -> bool:
        return self._on_lane[lane] + mine[lane] >= self._ground.capacity[lane]

    def _after(self, lane: str, lanes: Sequence[str]) -> Iterator[str]:
        """The lanes to which claims, or ``lanes``, lead from a lane."""
        mine = {b for a, b in pairwise(lanes) if a == lane} if lane in lanes else set[str]()
        after = mine.union(self._onward.get(lane, ()))
        return iter(sorted(after) if len(after) > 1 else after)
