"""Who minds what: for each subject of facts, the robots whose plans and goals hang on it.

The *subject* of a fact is the object whose place it tells; of any other fact, the fact itself. A robot minds the
subjects of what it watches and of what its plan and its goals need, all objects named there, and those that it does not
know the place of. Whoever has something to tell asks here whom it concerns, so that nobody else need be told.
"""

from collections.abc import Iterable, Mapping
from itertools import chain

from clo_fleet.clo.executive import Executive
from clo_fleet.clo.strategies import Everything
from clo_fleet.clo.task import Fact, State
from clo_fleet.robot.robot import Robot
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import RobotId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Interests"]

Subject = str | Fact


class Interests:
    """The subjects that each robot minds; what has become of them is asked for when somebody wants to know.

    Args:
        robots: all of them.
        words: which facts say what.
    """

    def __init__(self, robots: Mapping[RobotId, Robot], words: Vocabulary) -> None:
        self._robots = robots
        self._words = words
        self._objects = frozenset(words.names.objects)
        self._stale = dict.fromkeys(robots)
        self._minds: dict[RobotId, frozenset[Subject]] = {}
        self._minders: dict[Subject, set[RobotId]] = {}
        self._all: set[RobotId] = set()  # who minds everything

    def renew(self, robot: RobotId) -> None:
        """The robot's beliefs or its plan may have changed."""
        self._stale[robot] = None

    def minders(self, facts: Iterable[Fact]) -> list[RobotId]:
        """The robots that mind one of the facts, or whose hands it is about, sorted."""
        self._refresh()
        facts = tuple(facts)
        if not facts:
            return []
        found = set(self._all)
        for fact in facts:
            found |= self._minders.get(self._subject(fact), set())
            if about := self._words.read(fact, SensorKind.HOLDING):
                found.add(RobotId(about[0]))
        return sorted(found)

    def minded(self, robot: RobotId, facts: Iterable[Fact]) -> frozenset[Fact]:
        """Those of the facts that the robot minds."""
        self._refresh()
        if robot in self._all:
            return frozenset(facts)
        minds = self._minds.get(robot, frozenset())
        return frozenset(fact for fact in facts if self._subject(fact) in minds)

    def _refresh(self) -> None:
        for robot in self._stale:
            executive = self._robots[robot].executive
            watch = executive.watch
            (self._all.add if isinstance(watch, Everything) else self._all.discard)(robot)
            minds = frozenset() if isinstance(watch, Everything) else self._of(executive, watch)
            before = self._minds.get(robot, frozenset())
            for lost in before - minds:
                self._minders[lost].discard(robot)
            for new in minds - before:
                self._minders.setdefault(new, set()).add(robot)
            self._minds[robot] = minds
        self._stale.clear()

    def _of(self, executive: Executive, watch: Iterable[Fact]) -> frozenset[Subject]:
        facts = {*watch, *(goal.fact for goal in executive.goals)}
        facts |= {need.fact for step in executive.plan for need in step.action.needs}
        objects = self._objects.intersection(chain.from_iterable(facts))
        return frozenset(map(self._subject, facts)) | objects | self._lost(executive.beliefs)

    def _subject(self, fact: Fact) -> Subject:
        return self._words.item(fact) or fact

    def _lost(self, beliefs: State) -> frozenset[str]:
        """The objects of which it is not believed where they are."""
        return self._objects - set(map(self._words.item, beliefs))
