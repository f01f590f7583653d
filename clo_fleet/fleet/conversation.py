"""The conversation: what robots learn, hear and announce, and what their executives answer.

Theory of operation
-------------------
Every robot has an inbox of events for its executive, filled in the course of a tick: how its action ended, what it
sees, what it hears, what is offered to it. ``serve`` empties the inboxes and carries out what the executives answer,
goes round as long as somebody has something new to say, and lets the planner answer in between. What an executive
means to do it announces at once, so that those who are told of its deeds know its intentions as well.
"""

import time as clock
from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

from clo_fleet.clo.executive import Mode
from clo_fleet.clo.messages import (
    AcceptOffer,
    ActionFinished,
    AskPlan,
    Begin,
    CancelAction,
    Command,
    Event,
    Flip,
    Observed,
    Offered,
    OfferEnded,
    PlanArrived,
    PlanMissing,
    Promised,
    RefuseOffer,
    StartAction,
)
from clo_fleet.clo.task import Condition, Fact
from clo_fleet.fleet.announcements import Announcement, meeting_places, promises
from clo_fleet.fleet.decisions import changes_plan, decision_told, plan_linked
from clo_fleet.fleet.inboxes import Inboxes
from clo_fleet.fleet.interests import Interests
from clo_fleet.fleet.offers import Offers
from clo_fleet.fleet.questions import Questions, Reply
from clo_fleet.fleet.radio import RadioChannel
from clo_fleet.robot.mishaps import Mishaps
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.senses import Senses, consequences, heeded
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world import events
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.events import Recorder, credit
from clo_fleet.world.model import ObjectId, PerceptionMode, PlaceId, Point, RobotId, World

__all__ = ["Conversation"]


class Conversation:
    """Between the robots of one world, their executives, their planner and one another."""

    def __init__(
        self,
        world: World,
        site: Site,
        truth: Truth,
        robots: dict[RobotId, Robot],
        recorder: Recorder,
        questions: Questions,
    ) -> None:
        self.offers = Offers(recorder)
        self.questions = questions
        self.senses = Senses(site, truth, world.perception)
        self.wall_deciding: dict[RobotId, float] = dict.fromkeys(robots, 0.0)
        self._world = world
        self._site = site
        self._truth = truth
        self._words = truth.words
        self._robots = robots
        self._recorder = recorder
        self.radio = RadioChannel(world.radio, robots, seed=world.seed)
        self.mishaps = Mishaps(world.seed)
        self._announced: dict[RobotId, Announcement] = {}
        self._promises: dict[RobotId, frozenset[Fact]] = {}  # what each robot that has something in hand has promised
        self._inboxes = Inboxes(robots)
        self._interests = Interests(robots, truth.words)
        self._givers = tuple(robot for robot in robots.values() if self._gifts(robot))
        self._takers = {taker for robot in self._givers for taker in self._gifts(robot)}
        self._dull: set[RobotId] = set()  # vehicles of which nothing has changed since they last looked

    def begin(self) -> None:
        """The first plans: first of robots that work for themselves, then of those that are to meet others.

        A robot that is to hand something to another has to know where the other will come by.
        """
        givers = {robot.id for robot in self._givers}
        for wave in ([robot for robot in self._robots.values() if robot.id not in givers], self._givers):
            for robot in wave:
                self._tell(robot, Begin(self.time))
            self.serve()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.offers.time

    @time.setter
    def time(self, time: float) -> None:
        self.offers.time = time

    def put(self, robot: RobotId, event: Event) -> None:
        """Something for the robot's executive, to be told when the tick is over."""
        self._dull.discard(robot)
        self._inboxes.put(robot, event)

    def note(self, facts: Iterable[Fact]) -> None:
        """These facts have turned true or false: the robots that they are about look again, and may tell others."""
        words = self._words
        for fact in facts:
            if own := words.read(fact, SensorKind.PLACE) or words.read(fact, SensorKind.HOLDING):
                self._dull.discard(RobotId(own[0]))
                self._inboxes.stir(RobotId(own[0]))
            else:
                self._dull.clear()  # it may be in sight of any of them: of a load, or of the whole building

    def perceive(self) -> None:
        """Every robot looks at the same snapshot; what is new to it, it also tells."""
        for robot in self._robots.values():
            if robot.id in self._dull:
                continue
            beliefs = robot.executive.beliefs
            watch = robot.executive.watch
            seen = self.senses.sight(robot.id, beliefs, watch, self.time, blind=robot.blind)
            fresh = heeded(consequences(seen, beliefs, self._words), beliefs, watch, robot.id, self._words)
            flips = tuple(Flip(fact, value, self._truth.cause(fact)) for fact, value in fresh.items())
            self._learn(robot, flips, "sight")
            self.radio.tell(self.time, robot.id, (*flips, *self._effects(robot)), self._point)
            if self._site.in_corridor(robot.id) and self._world.perception.mode is not PerceptionMode.FULL:
                self._dull.add(robot.id)  # until something changes about it, it sees nothing new in there
        self._listen()

    def pass_offers_on(self) -> None:
        """Ask the executives about new offers, and tell them which have ended."""
        words = self._words
        for robot in self.offers.takers():
            self._inboxes.put(robot, *(OfferEnded(self.time, offer) for offer in self.offers.ended(robot)))
            for offer in self.offers.untold(robot, self.radio.lost):
                there = words.facts(SensorKind.PLACE, robot, str(offer.place))
                gift = (
                    *(Flip(fact, True) for fact in words.facts(SensorKind.HOLDING, robot, offer.item)),
                    *(Flip(fact, False) for fact in words.facts(SensorKind.HOLDING, offer.giver, offer.item)),
                )
                self._inboxes.put(robot, Offered(self.time, offer.id, offer.giver, gift, tuple(map(Condition, there))))

    def reconnect(self, robot: RobotId) -> None:
        """The robot's radio works again: it hears what the others mean to do now."""
        others = [said for said in self._announced.values() if said.robot != robot]
        in_hand = [(said.robot, item) for said in others for item in said.in_hand]
        known = [fact for pair in in_hand for fact in self._words.facts(SensorKind.HOLDING, *pair)]
        self._take_note(self._robots[robot], known)

    def serve(self) -> None:
        """Tell the executives what happened, and let the planner answer, until nobody has a question left.

        Robots whose action has ended come first: what they then announce is known to those who are told of its
        effects, so that nobody takes an object in good hands for one that is gone.
        """
        while True:
            for robot_id, inbox in self._inboxes.round():
                robot = self._robots[robot_id]
                for event in _in_order(self.time, inbox):
                    self._tell(robot, event)
                self._announce(robot)
                self._remind(robot)
            replies = self.questions.due(self.time)
            for reply in replies:
                self._deliver(reply)
            if not replies and not self._inboxes:
                return

    def state(self) -> dict[str, Any]:
        """Plain data; between ticks all inboxes are empty."""
        return {
            "offers": self.offers.state(),
            "radio": self.radio.state(),
            "announced": [announcement.state() for announcement in self._announced.values()],
            "questions": self.questions.state(),
            "senses": self.senses.state(),
            "mishaps": self.mishaps.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.offers.restore(state["offers"])
        self.radio.restore(state["radio"])
        announced = map(Announcement.from_state, state["announced"])
        self._announced = {announcement.robot: announcement for announcement in announced}
        promised = {robot: promises([announcement]) for robot, announcement in self._announced.items()}
        self._promises = {robot: facts for robot, facts in promised.items() if facts}
        self.questions.restore(state["questions"])
        self.senses.restore(state["senses"])
        self.mishaps.restore(state["mishaps"])

    # ---- learning ------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        """Bring what was told to those whom it concerns; in the order in which anything reached them."""
        messages = self.radio.due(self.time)
        heard: dict[RobotId, list[Flip]] = {}
        for message in messages:
            for robot in self._interests.minders([message.flip.fact]):
                if self.radio.reaches(message, robot):
                    heard.setdefault(robot, []).append(message.flip)

        def first(robot: RobotId) -> tuple[int, RobotId]:
            return next(n for n, message in enumerate(messages) if self.radio.reaches(message, robot)), robot

        for robot in sorted(heard, key=first):
            self._hear(self._robots[robot], heard[robot])

    def _hear(self, robot: Robot, flips: list[Flip]) -> None:
        """Believe what was heard of things that the robot watches and does not see for itself."""
        beliefs = robot.executive.beliefs
        told = consequences({flip.fact: flip.value for flip in flips}, beliefs, self._words)
        causes = {flip.fact: flip.cause for flip in flips}
        fresh = heeded(told, beliefs, robot.executive.watch, robot.id, self._words)
        flips = [
            Flip(fact, value, causes.get(fact) or self._truth.cause(fact))
            for fact, value in fresh.items()
            if not self._words.read(fact, SensorKind.PLACE)
        ]
        self._learn(robot, tuple(flips), "radio")

    def _learn(self, robot: Robot, flips: tuple[Flip, ...], source: str) -> None:
        waiting = {
            flip.fact for event in self._inboxes[robot.id] if isinstance(event, Observed) for flip in event.flips
        }
        flips = tuple(flip for flip in flips if flip.fact not in waiting)
        if not flips:
            return
        opportunities = robot.executive.links.opportunities
        for flip in flips:
            by, cause = credit(flip.cause)
            helpful = Condition(flip.fact, flip.value) in opportunities and by != robot.id
            self._record(events.Sensed(robot.id, flip.fact, flip.value, source, helpful, by, cause))
        self._inboxes.put(robot.id, Observed(self.time, flips))

    def _effects(self, robot: Robot) -> tuple[Flip, ...]:
        """What the robot's action that ended in this tick has truly changed, to be told to others."""
        finished = [event for event in self._inboxes[robot.id] if isinstance(event, ActionFinished)]
        if not finished or robot.cause is None:
            return ()
        step = robot.executive.running
        assert step is not None
        facts = dict.fromkeys(step.action.adds, True) | dict.fromkeys(step.action.deletes, False)
        return tuple(
            Flip(fact, value, robot.cause)
            for fact, value in sorted(facts.items())
            if self._words.told(fact) and (fact in self._truth.facts) is value
        )

    # ---- announcing ----------------------------------------------------------------------------------------

    def _announce(self, robot: Robot) -> None:
        """Tell the others what the robot means to do, if that has changed, and what follows for them."""
        executive, running = robot.executive, robot.executive.running
        if robot.id in self.radio.lost:
            return
        if executive.mode in (Mode.NEW, Mode.PLANNING) and robot.id not in self._announced:
            return
        announcement = Announcement(
            robot=robot.id,
            place=self._site.place(robot.id),
            plan=tuple(step for step in executive.plan if step.id not in executive.suspended),
            moving=running is not None and self._words.is_drive(running.action.schema),
            goals=executive.goals,
            beliefs=executive.beliefs if robot.id in self._takers else frozenset(),
            in_hand=self._site.rooms.carried(robot.id),
        )
        before = self._announced.get(robot.id)
        if before == announcement:
            return
        self._announced[robot.id] = announcement
        if before is None or before.plan != announcement.plan:
            self._record(events.PlanAnnounced(robot.id, tuple(step.action.name for step in announcement.plan)))
        promised, before_promised = promises([announcement]), self._promises.pop(robot.id, frozenset())
        if promised:
            self._promises[robot.id] = promised
        items, words = announcement.in_hand, self._words
        in_hand = [fact for item in items for fact in words.facts(SensorKind.HOLDING, robot.id, item)]
        concerned = {*self._interests.minders([*in_hand, *(promised ^ before_promised)])}
        for other in sorted(concerned.union(giver.id for giver in self._givers) - {robot.id}):
            if self._robots[other].executive.mode is not Mode.NEW and other not in self.radio.lost:
                self._take_note(self._robots[other], in_hand)

    def _take_note(self, robot: Robot, in_hand: Iterable[Fact]) -> None:
        """What an announcement of another robot, with these facts in hand, means to this one."""
        self._inboxes.put(robot.id, Promised(self.time, self._promised_to(robot.id)))
        self._hear(robot, [Flip(fact, True) for fact in in_hand if fact not in robot.executive.beliefs])
        needed = {need.fact for step in robot.executive.plan for need in step.action.needs}
        self._learn(robot, tuple(flip for flip in self._meets(robot) if flip.fact in needed), "radio")

    def _remind(self, robot: Robot) -> None:
        """Tell a robot what others have promised about things that it has not minded before."""
        if robot.id in self.radio.lost:
            return
        if self._promises and (promised := self._promised_to(robot.id)) != robot.executive.promised:
            self._inboxes.put(robot.id, Promised(self.time, promised))

    def _promised_to(self, robot: RobotId) -> frozenset[Fact]:
        """What the others have promised about things that the robot minds."""
        promised = (facts for other, facts in self._promises.items() if other != robot)
        return self._interests.minded(robot, chain.from_iterable(promised))

    def _meets(self, robot: Robot) -> tuple[Flip, ...]:
        """How the places to meet others, as announced, differ from what a giver believes."""
        if robot.id in self.radio.lost:
            return ()
        words = self._words
        now: set[Fact] = {
            fact
            for other, gifts in self._gifts(robot).items()
            if other in self._announced
            for meeting in meeting_places(self._announced[other], gifts, words)
            if self._site.is_room(PlaceId(meeting.place))
            and meeting.until >= self.questions.earliest(robot.id, robot.executive.beliefs, gifts, meeting.place)
            for fact in words.facts(SensorKind.MEETS, other, meeting.place)
        }
        believed = {fact: about for fact in robot.executive.beliefs if (about := words.read(fact, SensorKind.MEETS))}
        here = self._site.place(robot.id)
        now |= {fact for fact, (other, at) in believed.items() if at == here == self._site.place(RobotId(other))}
        return tuple(Flip(fact, fact in now) for fact in sorted(now ^ believed.keys()))

    def _gifts(self, robot: Robot) -> dict[RobotId, list[ObjectId]]:
        """What the robot is to bring into the hands of others, by the other."""
        gifts: dict[RobotId, list[ObjectId]] = {}
        for goal in robot.spec.goals:
            taker, item = self._words.read(goal, SensorKind.HOLDING) or (robot.id, "")
            if taker != robot.id:
                gifts.setdefault(RobotId(taker), []).append(ObjectId(item))
        return gifts

    # ---- telling and obeying -------------------------------------------------------------------------------

    def _deliver(self, reply: Reply) -> None:
        robot = self._robots[reply.robot]
        self._inboxes.stir(robot.id)
        if reply.actions is not None:
            self._tell(robot, PlanArrived(self.time, reply.actions), reply)
            return
        self._record(events.PlanFailed(robot.id, reply.failure.value, reply.detail))
        self._tell(robot, PlanMissing(self.time, reply.failure))

    def _tell(self, robot: Robot, event: Event, reply: Reply | None = None) -> None:
        """Give the executive an event and carry out its commands."""
        begin = clock.perf_counter()
        commands = robot.executive.handle(event)
        self.wall_deciding[robot.id] += clock.perf_counter() - begin
        self._interests.renew(robot.id)
        self._dull.discard(robot.id)
        for command in commands:
            self._obey(robot, command, reply)
        if any(map(changes_plan, commands)):
            self._record(plan_linked(robot))

    def _obey(self, robot: Robot, command: Command, reply: Reply | None) -> None:
        match command:
            case StartAction(step):
                started = self._record(events.ActionStarted(robot.id, step.id, step.action.name))
                doomed = self.mishaps.strikes(robot.id, step.action.schema, self.time)
                robot.begin(step, started, self._words, self._world.skills, mishap=self.time if doomed else None)
            case CancelAction():
                robot.cancel()
            case AskPlan(why):
                self._record(events.PlanRequested(robot.id, why))
                if flips := self._meets(robot):
                    robot.executive.handle(Observed(self.time, flips))
                self.questions.ask(robot.id, robot.executive.planning_state, robot.spec.goals, self.time)
            case AcceptOffer(offer):
                self.offers.answer(offer, accepted=True)
            case RefuseOffer(offer, why):
                self.offers.answer(offer, accepted=False, why=why)
            case _:
                self._record(decision_told(robot.id, command, reply.expansions if reply is not None else 0))

    def _point(self, robot: RobotId) -> Point:
        return self._site.pose(robot).point

    def _record(self, event: events.Event) -> int:
        return self._recorder.record(self.time, event)


def _in_order(time: float, inbox: list[Event]) -> list[Event]:
    """What was seen, heard and promised as one event, and before the rest: nobody acts on what it knows better."""
    flips = tuple(flip for event in inbox if isinstance(event, Observed) for flip in event.flips)
    promised = [event.facts for event in inbox if isinstance(event, Promised)]
    rest = [event for event in inbox if not isinstance(event, Observed | Promised)]
    news = [Observed(time, flips, promised[-1] if promised else None)] if flips or promised else []
    return [*news, *rest]
