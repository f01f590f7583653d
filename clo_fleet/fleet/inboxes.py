"""The robots' inboxes: what each executive has still to be told, and whose turn it is.

Nobody is asked whether it has news: who gets some is *stirred* and has its turn. In a round those come first whose
action has ended, then the others, each in the order of ids. Who is stirred while the round goes on has its turn in it
if that is still to come, or else in the next.
"""

import heapq
from collections.abc import Iterable, Iterator

from clo_fleet.clo.messages import ActionCancelled, ActionFailed, ActionFinished, Event, Observed, Promised
from clo_fleet.world.model import RobotId

__all__ = ["Inboxes", "in_order"]


class Inboxes:
    """Events on their way to executives. Empty between ticks.

    Args:
        robots: all of them, in the order of their turns.
    """

    def __init__(self, robots: Iterable[RobotId]) -> None:
        self._robots = tuple(robots)
        self._rank = {robot: rank for rank, robot in enumerate(self._robots)}
        self._events: dict[RobotId, list[Event]] = {robot: [] for robot in self._robots}
        self._stirred: set[RobotId] = set()
        self._ended: set[RobotId] = set()
        self._later: list[int] = []  # a heap: the ranks of those whose turn in this round is still to come
        self._now = -1  # the rank of the one whose turn it is, among those that come last

    def __bool__(self) -> bool:
        """Whether anybody is to have a turn."""
        return bool(self._stirred)

    def __getitem__(self, robot: RobotId) -> tuple[Event, ...]:
        """What the robot is still to be told."""
        return tuple(self._events[robot])

    def put(self, robot: RobotId, *events: Event) -> None:
        """Something to be told to a robot."""
        if events:
            self._events[robot] += events
            self.stir(robot)

    def stir(self, robot: RobotId) -> None:
        """Give the robot a turn, with or without news."""
        if robot not in self._stirred:
            self._stirred.add(robot)
            rank = self._rank[robot]
            if rank > self._now and robot not in self._ended:
                heapq.heappush(self._later, rank)

    def round(self) -> Iterator[tuple[RobotId, list[Event]]]:
        """The turns of one round: each robot with its events, which are taken out."""
        ended = [robot for robot in self._stirred if any(map(_is_ending, self._events[robot]))]
        self._ended = set(ended)
        self._now = -1
        self._later = [self._rank[robot] for robot in self._stirred if robot not in self._ended]
        heapq.heapify(self._later)
        for robot in sorted(ended, key=self._rank.__getitem__):
            yield robot, self._take(robot)
        while self._later:
            self._now = heapq.heappop(self._later)
            robot = self._robots[self._now]
            yield robot, self._take(robot)
        self._now, self._ended = -1, set()

    def _take(self, robot: RobotId) -> list[Event]:
        self._stirred.discard(robot)
        events, self._events[robot] = self._events[robot], []
        return events


def in_order(time: float, inbox: list[Event]) -> list[Event]:
    """What was seen, heard and promised as one event, and before the rest: nobody acts on what it knows better."""
    guesses = [event for event in inbox if isinstance(event, Observed) and event.guess]
    flips = tuple(flip for event in inbox if isinstance(event, Observed) and not event.guess for flip in event.flips)
    promised = [event.facts for event in inbox if isinstance(event, Promised)]
    rest = [event for event in inbox if not isinstance(event, Observed | Promised)]
    news = [Observed(time, flips, promised[-1] if promised else None)] if flips or promised else []
    return [*news, *guesses, *rest]


def _is_ending(event: Event) -> bool:
    return isinstance(event, ActionFinished | ActionFailed | ActionCancelled)
