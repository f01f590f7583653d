"""The conversation: what robots learn, hear and announce, and what their executives answer.

Theory of operation
-------------------
Every robot has an inbox of events for its executive, filled in the course of a tick: how its action ended, what it
sees, what it hears, what is offered to it. ``serve`` empties the inboxes and carries out what the executives answer,
goes round as long as somebody has something new to say, and lets the planner answer in between. What an executive
means to do it announces at once, so that those who are told of its deeds know its intentions as well.
"""

import time as clock
from collections.abc import Mapping
from typing import Any

from clo_fleet.clo.executive import Mode
from clo_fleet.clo.messages import (
    AcceptOffer,
    ActionCancelled,
    ActionFailed,
    ActionFinished,
    AskPlan,
    Begin,
    CancelAction,
    Command,
    Event,
    Finished,
    Flip,
    Observed,
    Offered,
    OfferEnded,
    PlanAdopted,
    PlanArrived,
    PlanMended,
    PlanMissing,
    Promised,
    RefuseOffer,
    RepairRefused,
    StartAction,
    StepsDropped,
    Waits,
)
from clo_fleet.clo.plan import Plan, cost
from clo_fleet.clo.task import Condition, Fact, fact_text
from clo_fleet.fleet.announcements import Announcement, meeting_places, promises
from clo_fleet.fleet.offers import Offers
from clo_fleet.fleet.questions import Questions, Reply
from clo_fleet.fleet.radio import Listener, RadioChannel
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.senses import Senses, consequences, heeded
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world import events
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.events import Recorder, credit
from clo_fleet.world.model import ObjectId, PlaceId, RobotId, World

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
        self._radio = RadioChannel(world.radio, seed=world.seed)
        self._announced: dict[RobotId, Announcement] = {}
        self._inbox: dict[RobotId, list[Event]] = {robot: [] for robot in robots}

    def begin(self) -> None:
        """The first plans: first of robots that work for themselves, then of those that are to meet others.

        A robot that is to hand something to another has to know where the other will come by.
        """
        givers = [robot for robot in self._robots.values() if self._gifts(robot)]
        for wave in ([robot for robot in self._robots.values() if robot not in givers], givers):
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
        self._inbox[robot].append(event)

    def perceive(self) -> None:
        """Every robot looks at the same snapshot; what is new to it, it also tells."""
        listeners = [Listener(robot.id, self._site.pose(robot.id).point) for robot in self._robots.values()]
        for robot, listener in zip(self._robots.values(), listeners, strict=True):
            beliefs = robot.executive.beliefs
            watch = robot.executive.watch
            seen = self.senses.sight(robot.id, beliefs, watch, self.time)
            fresh = heeded(consequences(seen, beliefs, self._words), beliefs, watch, robot.id, self._words)
            flips = tuple(Flip(fact, value, self._truth.cause(fact)) for fact, value in fresh.items())
            self._learn(robot, flips, "sight")
            own = self._effects(robot)
            self._radio.tell(self.time, listener, (*flips, *own), listeners)
        for robot_id, flips_heard in self._radio.due(self.time).items():
            self._hear(self._robots[robot_id], flips_heard)

    def pass_offers_on(self) -> None:
        """Ask the executives about new offers, and tell them which have ended."""
        for robot in self._robots.values():
            inbox = self._inbox[robot.id]
            inbox += [OfferEnded(self.time, offer) for offer in self.offers.ended(robot.id)]
            for offer in self.offers.untold(robot.id):
                words = self._words
                there = words.facts(SensorKind.PLACE, robot.id, str(offer.place))
                gift = (
                    *(Flip(fact, True) for fact in words.facts(SensorKind.HOLDING, robot.id, offer.item)),
                    *(Flip(fact, False) for fact in words.facts(SensorKind.HOLDING, offer.giver, offer.item)),
                )
                inbox.append(Offered(self.time, offer.id, offer.giver, gift, tuple(map(Condition, there))))

    def serve(self) -> None:
        """Tell the executives what happened, and let the planner answer, until nobody has a question left.

        Robots whose action has ended come first: what they then announce is known to those who are told of its
        effects, so that nobody takes an object in good hands for one that is gone.
        """
        while True:
            ended = [robot for robot in self._robots.values() if any(map(_is_ending, self._inbox[robot.id]))]
            for robot in (*ended, *(robot for robot in self._robots.values() if robot not in ended)):
                inbox, self._inbox[robot.id] = self._inbox[robot.id], []
                for event in _in_order(self.time, inbox):
                    self._tell(robot, event)
                self._announce(robot)
            replies = self.questions.due(self.time)
            for reply in replies:
                self._deliver(reply)
            if not replies and not any(self._inbox.values()):
                return

    def state(self) -> dict[str, Any]:
        """Plain data; between ticks all inboxes are empty."""
        return {
            "offers": self.offers.state(),
            "radio": self._radio.state(),
            "announced": [announcement.state() for announcement in self._announced.values()],
            "questions": self.questions.state(),
            "senses": self.senses.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up what ``state()`` gave."""
        self.offers.restore(state["offers"])
        self._radio.restore(state["radio"])
        announced = map(Announcement.from_state, state["announced"])
        self._announced = {announcement.robot: announcement for announcement in announced}
        self.questions.restore(state["questions"])
        self.senses.restore(state["senses"])

    # ---- learning ------------------------------------------------------------------------------------------

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
        waiting = {flip.fact for event in self._inbox[robot.id] if isinstance(event, Observed) for flip in event.flips}
        flips = tuple(flip for flip in flips if flip.fact not in waiting)
        if not flips:
            return
        opportunities = robot.executive.links.opportunities
        for flip in flips:
            by, cause = credit(flip.cause)
            helpful = Condition(flip.fact, flip.value) in opportunities and by != robot.id
            self._record(events.Sensed(robot.id, flip.fact, flip.value, source, helpful, by, cause))
        self._inbox[robot.id].append(Observed(self.time, flips))

    def _effects(self, robot: Robot) -> tuple[Flip, ...]:
        """What the robot's action that ended in this tick has truly changed, to be told to others."""
        finished = [event for event in self._inbox[robot.id] if isinstance(event, ActionFinished)]
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
        if executive.mode in (Mode.NEW, Mode.PLANNING) and robot.id not in self._announced:
            return
        announcement = Announcement(
            robot=robot.id,
            place=self._site.place(robot.id),
            plan=tuple(step for step in executive.plan if step.id not in executive.suspended),
            moving=running is not None and self._words.is_drive(running.action.schema),
            goals=executive.goals,
            beliefs=executive.beliefs,
            in_hand=self._site.rooms.carried(robot.id),
        )
        before = self._announced.get(robot.id)
        if before == announcement:
            return
        self._announced[robot.id] = announcement
        if before is None or before.plan != announcement.plan:
            self._record(events.PlanAnnounced(robot.id, tuple(step.action.name for step in announcement.plan)))
        for other in self._robots.values():
            if other is not robot and other.executive.mode is not Mode.NEW:
                self._take_note(other, announcement)

    def _take_note(self, robot: Robot, announcement: Announcement) -> None:
        """What an announcement of another robot means to this one."""
        known = [other for other in self._announced.values() if other.robot != robot.id]
        self._inbox[robot.id].append(Promised(self.time, promises(known)))
        robot_, items = announcement.robot, announcement.in_hand
        in_hand = (fact for item in items for fact in self._words.facts(SensorKind.HOLDING, robot_, item))
        self._hear(robot, [Flip(fact, True) for fact in in_hand if fact not in robot.executive.beliefs])
        needed = {need.fact for step in robot.executive.plan for need in step.action.needs}
        self._learn(robot, tuple(flip for flip in self._meets(robot) if flip.fact in needed), "radio")

    def _meets(self, robot: Robot) -> tuple[Flip, ...]:
        """How the places to meet others, as announced, differ from what a giver believes."""
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
        for command in commands:
            self._obey(robot, command, reply)
        if any(isinstance(command, PlanAdopted | StepsDropped | PlanMended) for command in commands):
            self._record(_linked(robot))

    def _obey(self, robot: Robot, command: Command, reply: Reply | None) -> None:
        match command:
            case StartAction(step):
                started = self._record(events.ActionStarted(robot.id, step.id, step.action.name))
                robot.begin(step, started, self._words, self._world.skills)
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
                self._record(_decision(robot.id, command, reply))

    def _record(self, event: events.Event) -> int:
        return self._recorder.record(self.time, event)


def _decision(robot: RobotId, decision: Command, reply: Reply | None) -> events.Event:
    """The event that says what an executive has decided. ``reply``: the planner's, if it decided about that."""
    match decision:
        case PlanAdopted(plan, superseded, _):
            expansions = reply.expansions if reply is not None else 0
            gone = tuple(step.action.name for step in superseded)
            return events.PlanFollowed(robot, _named(plan), gone, expansions, cost(plan))
        case StepsDropped(plan, reason, fact, cause):
            return events.StepsLeftOut(robot, _named(plan), reason, fact, *credit(cause))
        case PlanMended(added, plan, means):
            return events.PlanMended(robot, _named(added), _named(plan), means)
        case RepairRefused(why):
            return events.RepairFailed(robot, why)
        case Waits(why):
            return events.Waiting(robot, why)
        case Finished(outcome, why):
            return events.GaveUp(robot, outcome, why)
        case _:
            return events.GoalsReached(robot)


def _linked(robot: Robot) -> events.PlanLinked:
    """The event that says what holds the robot's plan together."""
    executive = robot.executive
    watch = executive.watch
    return events.PlanLinked(
        robot.id,
        tuple(
            (link.producer, str(link.condition), link.consumer if isinstance(link.consumer, int) else None)
            for link in executive.links.links
        ),
        tuple(sorted(map(fact_text, watch))) if isinstance(watch, frozenset) else None,
    )


def _named(plan: Plan) -> tuple[tuple[int, str], ...]:
    return tuple((step.id, step.action.name) for step in plan)


def _is_ending(event: Event) -> bool:
    return isinstance(event, ActionFinished | ActionFailed | ActionCancelled)


def _in_order(time: float, inbox: list[Event]) -> list[Event]:
    """What was seen, heard and promised as one event, and before the rest: nobody acts on what it knows better."""
    flips = tuple(flip for event in inbox if isinstance(event, Observed) for flip in event.flips)
    promised = [event.facts for event in inbox if isinstance(event, Promised)]
    rest = [event for event in inbox if not isinstance(event, Observed | Promised)]
    news = [Observed(time, flips, promised[-1] if promised else None)] if flips or promised else []
    return [*news, *rest]
