"""The truth: the facts that hold, derived from poses and from the state of the objects, and whose doing they are.

No skill asserts a fact. A robot is at the place where its centre is; an object is at the place where its body
lies, or in the hand that its joint is tied to. An object is prepared from the moment a robot has prepared it
until it is shoved from where it was prepared: what has slid across the floor has to be prepared again.

A change is attributed to the action that handled the object in that tick, or to the action of the robot that
pushed it; what nobody did has no cause.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from clo_fleet.clo.messages import Cause, Flip
from clo_fleet.clo.plain import plain_cause, read_cause
from clo_fleet.clo.task import Fact
from clo_fleet.sim.site import Site
from clo_fleet.world.model import ObjectId, ObjectSpec, Point, RobotId, RobotSpec

__all__ = ["SHOVED", "Truth"]

SHOVED = 0.3  # [m] a prepared object that lies further from where it was prepared is not prepared any more


class Truth:
    """All facts of one site, renewed every tick."""

    def __init__(self, site: Site, robots: Sequence[RobotSpec], objects: Sequence[ObjectSpec]) -> None:
        self._site = site
        self._robots = tuple(sorted(spec.id for spec in robots))
        self._objects = tuple(sorted(spec.id for spec in objects))
        # where each prepared object lay when it was prepared or last put down; None while it is carried
        self._prepared: dict[ObjectId, Point | None] = {spec.id: spec.position for spec in objects if spec.prepared}
        self._handled: dict[ObjectId, Cause] = {}
        self._causes: dict[Fact, Cause | None] = {}
        self._facts = self._derive()

    @property
    def facts(self) -> frozenset[Fact]:
        """The facts that hold."""
        return self._facts

    def cause(self, fact: Fact) -> Cause | None:
        """The action that last changed the fact, if one did."""
        return self._causes.get(fact)

    def look(self, fact: Fact) -> Flip:
        """Whether a fact about an object holds at this moment, and whose doing that is.

        ``facts`` is as of the end of the last tick; since then other robots may have acted.
        """
        holds = fact in self._facts_of(ObjectId(fact[1] if fact[0] != "holding" else fact[2]))
        return Flip(fact, holds, self._causes.get(fact) if holds is (fact in self._facts) else self._cause_of(fact, {}))

    def prepared(self, item: ObjectId) -> bool:
        """Whether the object is prepared."""
        return item in self._prepared

    def prepare(self, item: ObjectId, cause: Cause) -> None:
        """The object has been prepared where it is."""
        self._prepared[item] = self._site.item_position(item)
        self._handled[item] = cause

    def handle(self, item: ObjectId, cause: Cause) -> None:
        """The object is being taken, put down or passed on in this tick by that action."""
        self._handled[item] = cause

    def step(self, running: Mapping[RobotId, Cause]) -> tuple[Flip, ...]:
        """Derive the facts anew; the changes, sorted. ``running``: the action of each robot that has one."""
        for item in list(self._prepared):
            self._follow(item)
        before, self._facts = self._facts, self._derive()
        flips = []
        for fact in sorted(before ^ self._facts):
            cause = self._cause_of(fact, running)
            self._causes[fact] = cause
            flips.append(Flip(fact, fact in self._facts, cause))
        self._handled.clear()
        return tuple(flips)

    def state(self) -> dict[str, Any]:
        """What is not derived, as plain data."""
        return {
            "prepared": {item: list(point) if point else None for item, point in sorted(self._prepared.items())},
            "causes": [[list(fact), plain_cause(cause)] for fact, cause in sorted(self._causes.items())],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self._prepared = {item: (point[0], point[1]) if point else None for item, point in state["prepared"].items()}
        self._causes = {tuple(fact): read_cause(cause) for fact, cause in state["causes"]}
        self._facts = self._derive()

    def _derive(self) -> frozenset[Fact]:
        facts: set[Fact] = {("at-robot", robot, self._site.place(robot)) for robot in self._robots}
        for item in self._objects:
            facts |= self._facts_of(item)
        return frozenset(facts)

    def _facts_of(self, item: ObjectId) -> set[Fact]:
        """All facts about one object that hold at this moment."""
        carrier = self._site.rooms.carrier(item)
        facts: set[Fact] = {("prepared", item)} if item in self._prepared else set()
        facts.add(
            ("at-object", item, str(self._site.item_place(item))) if carrier is None else ("holding", carrier, item)
        )
        return facts

    def _follow(self, item: ObjectId) -> None:
        """Forget that an object was prepared if it was shoved away; keep it while it is carried."""
        if self._site.rooms.carrier(item) is not None:
            self._prepared[item] = None
            return
        position = self._site.item_position(item)
        anchor = self._prepared[item]
        if anchor is None:
            self._prepared[item] = position
        elif position is not None and math.dist(anchor, position) > SHOVED:
            del self._prepared[item]

    def _cause_of(self, fact: Fact, running: Mapping[RobotId, Cause]) -> Cause | None:
        if fact[0] == "at-robot":
            return running.get(RobotId(fact[1]))
        item = ObjectId(fact[1] if fact[0] != "holding" else fact[2])
        if item in self._handled:
            return self._handled[item]
        pusher = self._site.rooms.pusher(item)
        return running.get(pusher) if pusher is not None else None
