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
from typing import Any

from clo_fleet.clo.executive import Mode
from clo_fleet.clo.messages import (
    AcceptOffer,
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
from clo_fleet.fleet.announcements import Announcement, in_hand_facts
from clo_fleet.fleet.attention import Attention
from clo_fleet.fleet.decisions import changes_plan, decision_told, plan_linked
from clo_fleet.fleet.effects import Effects
from clo_fleet.fleet.hearsay import Hearsay
from clo_fleet.fleet.inboxes import Inboxes, in_order
from clo_fleet.fleet.interests import Interests
from clo_fleet.fleet.meetings import Meetings
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
from clo_fleet.world.model import Point, RobotId, World

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
        self.effects = Effects(truth, recorder, world.seed)
        self._hearsay = Hearsay(world.radio, truth.words)
        self._inboxes = Inboxes(robots)
        self._interests = Interests(robots, truth.words)
        self._meetings = Meetings(site, truth.words, questions, self._hearsay)
        self._givers = tuple(robot for robot in robots.values() if self._meetings.gifts(robot))
        self._takers = {taker for robot in self._givers for taker in self._meetings.gifts(robot)}
        self._attention = Attention(world, site, truth.words, robots, self.senses)

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
        self._attention.wake(robot)
        self._inboxes.put(robot, event)

    def note(self, facts: Iterable[Fact]) -> None:
        """These facts have turned true or false: the robots that they are about look again, and may tell others."""
        facts = tuple(facts)
        self._attention.note(facts)
        for fact in facts:
            if own := self._words.read(fact, SensorKind.PLACE) or self._words.read(fact, SensorKind.HOLDING):
                self._inboxes.stir(RobotId(own[0]))

    def perceive(self) -> None:
        """Every robot looks at the same snapshot; what is new to it, it also tells."""
        looked = self.senses.looked
        for robot in self._attention.looking():
            before = looked.get(robot.id, 0)
            beliefs, watch = robot.executive.beliefs, robot.executive.watch
            seen = self.senses.sight(robot.id, beliefs, watch, self.time, blind=robot.blind)
            seen |= self.effects.noticed(robot.id)
            fresh = heeded(consequences(seen, beliefs, self._words), beliefs, watch, robot.id, self._words)
            flips = tuple(Flip(fact, value, self._truth.cause(fact)) for fact, value in fresh.items())
            self._learn(robot, flips, "sight")
            self._hearsay.learnt(robot.id, seen, self.time)
            self._hearsay.did(robot.id, own := self.effects.told(robot.id), self.time)
            self.radio.tell(self.time, robot.id, (*flips, *own), self._point)
            self._attention.rest(robot, looked.get(robot.id, 0) - before)
        for announcement in self._hearsay.to_repeat(self.time):
            self.radio.announce(self.time, self._hearsay.say(announcement, self.time), self._point)
        self._listen()
        for robot_id in self._hearsay.lapsed(self.time):
            self._inboxes.stir(robot_id)
        for robot_id in self._hearsay.cut_off(self.radio.lost, self.time):
            if self._robots[robot_id].executive.promised:
                self._inboxes.put(robot_id, Promised(self.time, frozenset()))

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
        """The robot's radio works again: it hears what the others mean to do now, or when they say it again."""
        said = self._hearsay.sayings(robot)
        self._take_note(self._robots[robot], [fact for each in said for fact in in_hand_facts(each, self._words)])
        for announcement in self._hearsay.to_say_again(robot):
            self.radio.announce(self.time, announcement, self._point)

    def serve(self) -> None:
        """Tell the executives what happened, and let the planner answer, until nobody has a question left.

        Robots whose action has ended come first: what they then announce is known to those who are told of its
        effects, so that nobody takes an object in good hands for one that is gone.
        """
        while True:
            for robot_id, inbox in self._inboxes.round():
                robot = self._robots[robot_id]
                for event in in_order(self.time, inbox):
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
            "hearsay": self._hearsay.state(),
            "questions": self.questions.state(),
            "senses": self.senses.state(),
            "mishaps": self.mishaps.state(),
            "effects": self.effects.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.offers.restore(state["offers"])
        self.radio.restore(state["radio"])
        self._hearsay.restore(state["hearsay"])
        self.questions.restore(state["questions"])
        self.senses.restore(state["senses"])
        self.mishaps.restore(state["mishaps"])
        self.effects.restore(state["effects"])

    # ---- learning ------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        """Bring what was told to those whom it concerns, facts first; in the order in which anything reached them."""
        messages = self.radio.due(self.time)
        told_at = self.time - self._world.radio.delay
        heard: dict[RobotId, list[Flip]] = {}
        for message in messages:
            if isinstance(message.news, Flip):
                for robot in self._interests.minders([message.news.fact]):
                    if self.radio.reaches(message, robot):
                        heard.setdefault(robot, []).append(message.news)

        def first(robot: RobotId) -> tuple[int, RobotId]:
            return next(n for n, message in enumerate(messages) if self.radio.reaches(message, robot)), robot

        for robot in sorted(heard, key=first):
            flips = self._hearsay.fresh(robot, heard[robot], told_at)
            self._hearsay.learnt(robot, (flip.fact for flip in flips), told_at)
            self._hear(self._robots[robot], flips)
        for message in messages:
            if isinstance(message.news, Announcement):
                for robot in self._robots:
                    if self.radio.reaches(message, robot):
                        self._overhear(self._robots[robot], message.news, told_at)

    def _overhear(self, robot: Robot, announcement: Announcement, told_at: float) -> None:
        """What another robot announced at that time [s], and what it has done."""
        changed = self._hearsay.heard(robot.id, announcement, self.time)
        if robot.executive.mode is Mode.NEW:
            return
        in_hand = [Flip(fact, True) for fact in in_hand_facts(announcement, self._words)]
        flips = [*self._hearsay.fresh(robot.id, in_hand, told_at), *self._hearsay.news(robot.id)]
        self._hear(robot, [flip for flip in flips if (flip.fact in robot.executive.beliefs) is not flip.value])
        self._inboxes.stir(robot.id)  # to be reminded of what is promised
        if changed:
            self._learn_meets(robot)

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

    # ---- announcing ----------------------------------------------------------------------------------------

    def _announce(self, robot: Robot) -> None:
        """Tell the others what the robot means to do, if that has changed, and what follows for them."""
        executive, running = robot.executive, robot.executive.running
        if robot.id in self.radio.lost:
            return
        before = self._hearsay.said(robot.id)
        if executive.mode in (Mode.NEW, Mode.PLANNING) and before is None:
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
        if before == announcement:
            return
        if before is None or before.plan != announcement.plan:
            self._record(events.PlanAnnounced(robot.id, tuple(step.action.name for step in announcement.plan)))
        before_promised = self._hearsay.promises_of(robot.id)
        announcement = self._hearsay.say(announcement, self.time)
        if self._world.radio.perfect:
            self._spread(announcement, self._hearsay.promises_of(robot.id) ^ before_promised)
        elif before is not None:
            self.radio.announce(self.time, announcement, self._point)
            self._listen()
        else:
            for other in self._robots.values():  # first plans are exchanged before anybody leaves
                if other is not robot:
                    self._overhear(other, announcement, self.time)

    def _spread(self, announcement: Announcement, promised: Iterable[Fact]) -> None:
        """Tell those whom it concerns what a robot has announced; ``promised``: what it has promised or taken back."""
        in_hand = in_hand_facts(announcement, self._words)
        concerned = {*self._interests.minders([*in_hand, *promised])}
        for other in sorted(concerned.union(giver.id for giver in self._givers) - {announcement.robot}):
            if self._robots[other].executive.mode is not Mode.NEW and other not in self.radio.lost:
                self._take_note(self._robots[other], in_hand)

    def _take_note(self, robot: Robot, in_hand: Iterable[Fact]) -> None:
        """What an announcement of another robot, with these facts in hand, means to this one."""
        self._inboxes.put(robot.id, Promised(self.time, self._promised_to(robot.id)))
        self._hear(robot, [Flip(fact, True) for fact in in_hand if fact not in robot.executive.beliefs])
        self._learn_meets(robot)

    def _learn_meets(self, robot: Robot) -> None:
        """Tell a giver where it can meet others now, as far as its plan depends on that, or for want of a plan."""
        stuck = robot.executive.mode is Mode.WAITING and not robot.executive.plan
        needed = {need.fact for step in robot.executive.plan for need in step.action.needs}
        self._learn(robot, tuple(flip for flip in self._meets(robot) if stuck or flip.fact in needed), "radio")

    def _meets(self, robot: Robot) -> tuple[Flip, ...]:
        return () if robot.id in self.radio.lost else self._meetings.changes(robot)

    def _remind(self, robot: Robot) -> None:
        """Tell a robot what others have promised about things that it has not minded before."""
        if robot.id in self.radio.lost:
            return
        if self._hearsay.open and (promised := self._promised_to(robot.id)) != robot.executive.promised:
            self._inboxes.put(robot.id, Promised(self.time, promised))

    def _promised_to(self, robot: RobotId) -> frozenset[Fact]:
        """What the others have promised about things that the robot minds."""
        promised = self._hearsay.promised(robot, self.time)
        return self._interests.minded(robot, promised) if promised else promised

    # ---- telling and obeying -------------------------------------------------------------------------------

    def _deliver(self, reply: Reply) -> None:
        robot = self._robots[reply.robot]
        self._inboxes.stir(robot.id)
        if reply.actions is not None:
            self._tell(robot, PlanArrived(self.time, reply.actions), reply)
            return
        self._record(events.PlanFailed(robot.id, reply.failure.value, reply.detail))
        self._tell(robot, PlanMissing(self.time, reply.failure))
        self._learn_meets(robot)  # others may have announced their plans since it asked

    def _tell(self, robot: Robot, event: Event, reply: Reply | None = None) -> None:
        """Give the executive an event and carry out its commands."""
        begin = clock.perf_counter()
        commands = robot.executive.handle(event)
        self.wall_deciding[robot.id] += clock.perf_counter() - begin
        self._interests.renew(robot.id)
        self._attention.wake(robot.id)
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
            case CancelAction(step, why, fact, cause):
                if robot.busy:  # it may just have ended
                    self._record(events.ActionCalledOff(robot.id, step.id, step.action.name, why, fact, *credit(cause)))
                robot.cancel()
            case AskPlan(why, part):
                self._record(events.PlanRequested(robot.id, why))
                if flips := self._meets(robot):
                    robot.executive.handle(Observed(self.time, flips))
                goals = [goal.fact for goal in part] or robot.spec.goals
                self.questions.ask(robot.id, robot.executive.planning_state, goals, self.time)
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
