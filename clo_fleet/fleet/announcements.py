"""What robots tell each other about their plans, and what follows: promises, and places to meet.

A robot announces the steps that it still means to do and what it has in hand. Who has an object in hand speaks
for it: what its plan will do with that object is a *promise* to all others. And a robot that is to hand something
to another can meet it at the places on the other's announced plan, those that the other would still come to if
the gift were already in its hands: a place that it would only visit to fetch the thing is no help. A place that the
other will have left before the giver can be there is no place to meet either.

Where messages can be lost, an announcement also says what the robot last did with each object: its *deeds*.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from clo_fleet.clo.messages import Flip
from clo_fleet.clo.plain import (
    plain_conditions,
    plain_facts,
    plain_flip,
    plain_plan,
    read_conditions,
    read_facts,
    read_flip,
    read_plan,
)
from clo_fleet.clo.plan import Plan
from clo_fleet.clo.repair import Repaired, repair
from clo_fleet.clo.task import Condition, Fact
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import ObjectId, RobotId
from clo_fleet.world.vocabulary import Vocabulary

__all__ = ["Announcement", "Deed", "Meeting", "in_hand_facts", "meeting_places", "promises"]


@dataclass(frozen=True, slots=True)
class Meeting:
    """A place where a robot can be met, and the planned cost after which it leaves it (infinite: it stays)."""

    place: str
    until: float


@dataclass(frozen=True, slots=True)
class Deed:
    """What a robot changed about one object, and when [s]."""

    time: float
    flips: tuple[Flip, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Announcement:
    """A robot's plan as it told it. Equal ones say the same to others, whatever the beliefs behind them.

    Attributes:
        robot: who.
        place: where it is, a room or a zone.
        plan: the steps left, the running one first.
        moving: whether the first step is under way and leads elsewhere.
        goals: what its plan is for.
        beliefs: what its plan starts from, if somebody is to bring it something; else nothing.
        in_hand: the objects that it carries.
        deeds: what it last did with objects; only said where messages can be lost.
    """

    robot: RobotId
    place: str
    plan: Plan
    moving: bool
    goals: tuple[Condition, ...]
    beliefs: frozenset[Fact] = field(compare=False)
    in_hand: tuple[ObjectId, ...]
    deeds: tuple[Deed, ...] = field(default=(), compare=False)

    def state(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "robot": self.robot,
            "place": self.place,
            "plan": plain_plan(self.plan),
            "moving": self.moving,
            "goals": plain_conditions(self.goals),
            "beliefs": plain_facts(self.beliefs),
            "in_hand": list(self.in_hand),
            "deeds": [[deed.time, list(map(plain_flip, deed.flips))] for deed in self.deeds],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """The announcement that ``state()`` was taken from."""
        return cls(
            robot=state["robot"],
            place=state["place"],
            plan=read_plan(state["plan"]),
            moving=state["moving"],
            goals=read_conditions(state["goals"]),
            beliefs=read_facts(state["beliefs"]),
            in_hand=tuple(state["in_hand"]),
            deeds=tuple(Deed(time, tuple(map(read_flip, flips))) for time, flips in state["deeds"]),
        )


def in_hand_facts(announcement: Announcement, words: Vocabulary) -> list[Fact]:
    """What an announcement says about the hands of its robot."""
    items, robot = announcement.in_hand, announcement.robot
    return [fact for item in items for fact in words.facts(SensorKind.HOLDING, robot, item)]


def promises(announcements: Iterable[Announcement]) -> frozenset[Fact]:
    """What the announced plans will have done, in the end, with the objects in their robots' hands."""
    promised: set[Fact] = set()
    for announcement in announcements:
        for item in announcement.in_hand:
            final: set[Fact] = set()
            for step in announcement.plan:
                final -= step.action.deletes
                final |= {fact for fact in step.action.adds if item in fact}
            promised |= final
    return frozenset(promised)


def meeting_places(other: Announcement, gifts: Iterable[ObjectId], words: Vocabulary) -> tuple[Meeting, ...]:
    """Where ``other`` can be met to be given ``gifts``, in the order of its plan."""
    given = frozenset(gifts)
    in_hand = {fact for item in given for fact in words.facts(SensorKind.HOLDING, other.robot, item)}
    lies = {fact for fact in other.beliefs if given.issuperset(words.read(fact, SensorKind.POSITION)[:1] or ("",))}
    state = other.beliefs - lies | in_hand
    found = repair(state, other.plan, other.goals)
    plan = found.plan if isinstance(found, Repaired) else other.plan
    return _meetings(other, plan, words) or _meetings(other, other.plan, words)


def _meetings(other: Announcement, plan: Plan, words: Vocabulary) -> tuple[Meeting, ...]:
    """Where the plan takes the robot; where it is now counts only if it has something left to do there."""
    leaves: dict[str, float] = {}
    place, present, busy, spent = other.place, not other.moving, False, 0
    for step in plan:
        ends = (words.read(fact, SensorKind.PLACE) for fact in sorted(step.action.adds))
        towards = next((end[1] for end in ends if end[:1] == (other.robot,)), None)
        if towards is None:
            busy = True
        else:
            if present and busy:
                leaves[place] = spent
            place, present, busy = towards, True, True
        spent += step.action.cost
    if present:
        leaves[place] = math.inf
    return tuple(Meeting(place, until) for place, until in leaves.items())
