"""Right of way: who may set out for another room, so that nobody meets head-on and nothing ever freezes.

Theory of operation
-------------------
A robot sets out only when it can have, all at once, a claim on its whole way: a place in the room at its end, the
direction of every single-lane chain, and room on its lanes (``lane_claims``). It gives back each lane when its tail
has left it. Until it may set out it waits in its room. In the corridors robots therefore wait only for what moves on by
itself: nobody comes towards them, queues that spill back close no circle, and behind the last door there is a place.

Who waits is served in turn. Others may overtake it as far as they do not need what it needs, and `OVERTAKINGS` times
if they do: then they wait until it has gone. Places are booked before lanes are claimed, strictly in turn for each
room, and who has a place will get its lanes. So nobody starves, but for a room that nobody leaves.

Rooms that are full of robots which want into one another's rooms exchange them in a circle: the places are booked for
all of the circle at once. Each of these rooms then holds one more than its places until its own robot has left.

Nothing here knows SUMO, poses or time.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.lane_claims import LaneClaims
from clo_fleet.sim.lanes import Ground
from clo_fleet.world.model import RobotId, RoomId

__all__ = ["OVERTAKINGS", "Claim", "Hindrance", "NoClaimError", "Obstacle", "RightOfWay", "Standing"]

OVERTAKINGS = 8  # robots in a row through a chain before those who wait at its other end

Standing = Mapping[RoomId, Sequence[RobotId]]  # who is on the floor of each room


class NoClaimError(CloFleetError):
    """A robot without a claim was to give back some of it, or to change it.

    Attributes:
        robot: who.
    """

    def __init__(self, robot: RobotId) -> None:
        super().__init__(f"robot {robot!r} has no claim on the corridors")
        self.robot = robot


@dataclass(frozen=True, slots=True)
class Claim:
    """What a robot wants: out of a room, along lanes (edges, in order; none through a door), and into a room."""

    start: RoomId
    goal: RoomId
    lanes: tuple[str, ...] = ()

    def state(self) -> list[Any]:
        """Plain data."""
        return [self.start, self.goal, list(self.lanes)]

    @classmethod
    def from_state(cls, state: Sequence[Any]) -> Self:
        """The claim that ``state()`` was taken from."""
        return cls(state[0], state[1], tuple(state[2]))


class Obstacle(Enum):
    """Why a robot may not set out."""

    CLOSED = "closed corridor"
    ROOM = "place in room"
    SINGLE_LANE = "single lane"
    FULL_LANES = "full lanes"
    TURN = "turn"


@dataclass(frozen=True, slots=True)
class Hindrance:
    """What keeps a robot from setting out: what, where (a room or a corridor), and whose doing that is."""

    obstacle: Obstacle
    where: str
    by: tuple[RobotId, ...] = ()


@dataclass(slots=True)
class _Wish:
    """One who waits. ``booked``: it has its place; ``overtaken``: by how many that need what it needs."""

    claim: Claim
    booked: bool = False
    overtaken: int = 0


class RightOfWay:
    """The claims on all ways in a building, and who waits for one."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        self._lanes = LaneClaims(ground)
        self._waiting: dict[RobotId, _Wish] = {}  # in turn
        self._held: dict[RobotId, Claim] = {}  # as granted; which of its lanes are left, ``_lanes`` knows
        self._exchanges: list[list[RobotId]] = []  # robots that change rooms in a circle
        self._closed: set[str] = set()
        self._standing: Standing = {}
        self._stale = True
        self._fresh: set[RobotId] = set()  # who has asked since the last decision
        self._explained: dict[RobotId, Hindrance] = {}  # since the last decision
        self._needed: dict[tuple[str, ...], frozenset[str]] = {}  # by those who take these lanes
        self._used: Counter[RoomId] = Counter()  # places taken or booked; only newcomers' bookings change it in between

    # ---- asking --------------------------------------------------------------------------------------------

    def ask(self, robot: RobotId, claim: Claim) -> bool:
        """Wait for a claim, or for another one in the same turn; whether one is granted already."""
        if robot in self._held:
            return True
        wish = self._waiting.get(robot)
        if wish is not None and wish.claim == claim:
            return False
        if wish is None:
            self._waiting[robot] = _Wish(claim)
            self._fresh.add(robot)
        else:
            wish.claim, wish.booked = claim, wish.booked and wish.claim.goal == claim.goal
            self._stale = True
        return False

    def decide(self, standing: Standing) -> tuple[RobotId, ...]:
        """Grant what can be granted; those who may set out now. ``standing``: who is on the floor of each room."""
        everybody = self._stale or (standing is not self._standing and standing != self._standing)
        if not everybody and not self._fresh:
            return ()
        considered = {*(self._waiting if everybody else self._fresh)}  # the others lack what nobody has given back
        self._standing, self._stale, self._fresh = standing, False, set()
        self._explained.clear()
        if everybody:
            self._used = self._count()
        considered.update(self._book())
        granted: list[RobotId] = []
        before: list[tuple[_Wish, frozenset[str]]] = []  # those who go on waiting, with what they need
        impatient: set[str] = set()  # what those of them need whom nobody may overtake any more
        for robot, wish in list(self._waiting.items()):
            if not wish.booked or self._shut(wish.claim):
                continue
            needs = self._needs(wish.claim)
            if robot in considered and needs.isdisjoint(impatient) and self._lanes.fit(wish.claim.lanes):
                for other, theirs in before:
                    if not needs.isdisjoint(theirs):
                        other.overtaken += 1
                        if other.overtaken == OVERTAKINGS:
                            impatient |= theirs
                self._held[robot] = self._waiting[robot].claim
                self._lanes.set(robot, wish.claim.lanes)
                granted.append(robot)
                continue
            before.append((wish, needs))
            if wish.overtaken >= OVERTAKINGS:
                impatient |= needs
        for robot in granted:
            del self._waiting[robot]
        return tuple(granted)

    def granted(self, robot: RobotId) -> bool:
        """Whether the robot has a claim."""
        return robot in self._held

    def claim(self, robot: RobotId) -> tuple[str, ...]:
        """The lanes that the robot may use, less those that it gave back."""
        return self._lanes.lanes(robot)

    def exchange(self, robot: RobotId, claim: Claim) -> bool:
        """Take another claim in place of the robot's own, if that can be at once; whether it could.

        Raises:
            NoClaimError: if it has none.
        """
        if robot not in self._held:
            raise NoClaimError(robot)
        old, lanes = self._held[robot], self._lanes.lanes(robot)
        self._lanes.set(robot, ())
        place = claim.goal == old.goal or self._count()[claim.goal] < self._ground.places[claim.goal]
        fits = place and not self._shut(claim) and self._lanes.fit(claim.lanes)
        self._lanes.set(robot, claim.lanes if fits else lanes)
        if fits:
            self._held[robot] = claim
        self._stale = True
        return fits

    def left(self, robot: RobotId, lanes: Sequence[str]) -> None:
        """Give back all lanes but these last ones of the claim.

        Raises:
            NoClaimError: if it has none.
        """
        if robot not in self._held:
            raise NoClaimError(robot)
        if len(lanes) < len(self._lanes.lanes(robot)):
            self._lanes.set(robot, lanes)
            self._stale = True

    def withdraw(self, robot: RobotId) -> None:
        """Give everything back, or wait no longer; also if there is nothing."""
        if self._waiting.pop(robot, None) is None and self._held.pop(robot, None) is None:
            return
        self._fresh.discard(robot)
        self._lanes.set(robot, ())
        left = ([other for other in circle if other != robot] for circle in self._exchanges)
        self._exchanges = [circle for circle in left if circle]
        self._stale = True

    def close(self, lane: str) -> None:
        """Grant no claim on that lane any more."""
        self._closed.add(lane)
        self._stale = True

    def open(self, lane: str) -> None:
        """Grant claims on that lane again."""
        self._closed.discard(lane)
        self._stale = True

    # ---- looking on ----------------------------------------------------------------------------------------

    def hindrance(self, robot: RobotId) -> Hindrance | None:
        """Why the robot waits; ``None`` if it does not wait."""
        if robot not in self._waiting:
            return None
        if robot not in self._explained:
            self._explained[robot] = self._explain(robot)
        return self._explained[robot]

    def load(self, lane: str) -> float:
        """How many claim a lane, as a share of those that it holds."""
        return self._lanes.load(lane)

    def against(self, lane: str) -> int:
        """How many claim the chain of a single lane in the other direction."""
        return len(self._lanes.against(lane))

    @property
    def shut(self) -> bool:
        """Whether any lane is closed."""
        return bool(self._closed)

    def closed(self, lane: str) -> bool:
        """Whether the lane is closed."""
        return lane in self._closed

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "waiting": [[robot, w.claim.state(), w.booked, w.overtaken] for robot, w in self._waiting.items()],
            "held": [[robot, claim.state(), list(self._lanes.lanes(robot))] for robot, claim in self._held.items()],
            "exchanges": [list(circle) for circle in self._exchanges],
            "closed": sorted(self._closed),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._waiting = {robot: _Wish(Claim.from_state(c), booked, n) for robot, c, booked, n in state["waiting"]}
        self._lanes, self._held = LaneClaims(self._ground), {}
        for robot, claim, lanes in state["held"]:
            self._held[robot] = Claim.from_state(claim)
            self._lanes.set(robot, lanes)
        self._exchanges = [list(circle) for circle in state["exchanges"]]
        self._closed = set(state["closed"])
        self._standing, self._stale, self._fresh = {}, True, set()

    # ---- places --------------------------------------------------------------------------------------------

    def _book(self) -> list[RobotId]:
        """Give places to those who wait, in turn; then let full rooms exchange robots. Who has got a place now."""
        used, places = self._used, self._ground.places
        booked = []
        for robot, wish in self._waiting.items():
            goal = wish.claim.goal
            if not wish.booked and used[goal] < places[goal]:
                used[goal] += 1
                booked.append(robot)
                wish.booked = True
        while (circle := self._wished_circle()) is not None:
            for robot in circle:
                self._waiting[robot].booked = True
            self._exchanges.append(circle)  # each of its rooms gets one and loses one
            booked += circle
        return booked

    def _count(self) -> Counter[RoomId]:
        """The places of each room that are taken or booked; who is to leave it in an exchange counts as gone."""
        where = {robot: room for room, robots in self._standing.items() for robot in robots}
        used = Counter(where.values())
        going = [(robot, wish.claim) for robot, wish in self._waiting.items() if wish.booked]
        going += self._held.items()
        used.update(claim.goal for robot, claim in going if where.get(robot) != claim.goal)
        exchanged = {robot for circle in self._exchanges for robot in circle}
        used.subtract(claim.start for robot, claim in going if robot in exchanged and where.get(robot) == claim.start)
        return used

    def _wished_circle(self) -> list[RobotId] | None:
        """The first of those without a place who want into one another's rooms, in a circle; each room in one only."""
        busy = {self._of(robot).start for circle in self._exchanges for robot in circle}
        wishes: dict[RoomId, list[RobotId]] = {}
        for robot, wish in self._waiting.items():
            start = wish.claim.start
            if not wish.booked and start not in busy and robot in self._standing.get(start, ()):
                wishes.setdefault(start, []).append(robot)
        for first in wishes:
            tried: set[RoomId] = set()
            path, chosen = [iter(wishes[first])], list[RobotId]()
            while path:
                for robot in path[-1]:
                    goal = self._waiting[robot].claim.goal
                    if goal == first:
                        return [*chosen, robot]
                    if goal in wishes and goal not in tried:
                        tried.add(goal)
                        path.append(iter(wishes[goal]))
                        chosen.append(robot)
                        break
                else:
                    path.pop()
                    chosen = chosen[:-1]
        return None

    # ---- small things --------------------------------------------------------------------------------------

    def _explain(self, robot: RobotId) -> Hindrance:
        claim = self._waiting[robot].claim
        if shut := self._shut(claim):
            return Hindrance(Obstacle.CLOSED, shut.removeprefix("-"))
        if not self._waiting[robot].booked:
            return Hindrance(Obstacle.ROOM, claim.goal, tuple(self._standing.get(claim.goal, ())))
        for lane in claim.lanes:
            if against := self._lanes.against(lane):
                return Hindrance(Obstacle.SINGLE_LANE, lane.removeprefix("-"), against)
        if lane_in_circle := self._lanes.circle(claim.lanes):
            claimants = self._lanes.claimants(lane_in_circle)
            return Hindrance(Obstacle.FULL_LANES, lane_in_circle.removeprefix("-"), claimants)
        needs = self._needs(claim)
        first = next(
            (o for o in self._before(robot) if not needs.isdisjoint(self._needs(self._waiting[o].claim))), None
        )
        return Hindrance(Obstacle.TURN, claim.goal, () if first is None else (first,))

    def _shut(self, claim: Claim) -> str | None:
        """The first lane of the claim that is closed."""
        return next((lane for lane in claim.lanes if lane in self._closed), None)

    def _needs(self, claim: Claim) -> frozenset[str]:
        """What others must not take before one who is out of patience."""
        if claim.lanes not in self._needed:
            chains = (f"chain {way.chain}" for way in self._lanes.ways(claim.lanes))
            self._needed[claim.lanes] = frozenset((*claim.lanes, *chains))
        return self._needed[claim.lanes]

    def _before(self, robot: RobotId) -> Iterator[RobotId]:
        """Those who wait, have their places, and are before the robot."""
        for other, wish in self._waiting.items():
            if other == robot:
                return
            if wish.booked:
                yield other

    def _of(self, robot: RobotId) -> Claim:
        return self._held[robot] if robot in self._held else self._waiting[robot].claim
