"""A mission: several robots in one world, tick by tick, until their goals hold or the run ends otherwise.

Theory of operation
-------------------
``Mission.step`` is the loop of the whole system, on one page. In every tick, in this order: disturbances; every
robot's skill, in the order of the robots' ids; physics, then traffic, then the change-overs between the two; the
truth is derived; every robot senses the same snapshot; the radio; and every executive is told what its robot
learnt and answers with commands. The tick is the only clock.

Executives that ask for a plan are served at the end of the tick: all questions go to the planner processes
together, the simulation waits for the answers, and each answer is due after the simulated planning time. With
none, the answer is due at once and the loop goes round until nobody asks any more.

The first plans are made in two waves: robots whose goals lie in their own hands, then those that are to hand
something to another, because they need to know where the other will come by.
"""

import time as clock
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import Any, Self

from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.links import Links
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
    GoalsMet,
    Observed,
    Offered,
    OfferEnded,
    PlanAdopted,
    PlanArrived,
    PlanFailure,
    PlanMissing,
    Promised,
    RefuseOffer,
    RepairRefused,
    StartAction,
    StepsDropped,
    Waits,
)
from clo_fleet.clo.plan import Plan, goals_of
from clo_fleet.clo.strategies import Strategy
from clo_fleet.clo.task import Condition, Fact
from clo_fleet.fleet.announcements import Announcement, meeting_places, promises
from clo_fleet.fleet.offers import Offers
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.fleet.questions import Questions, Reply
from clo_fleet.fleet.radio import Listener, RadioChannel
from clo_fleet.robot.avoidance import Agent, Avoidance
from clo_fleet.robot.robot import Robot, draw
from clo_fleet.robot.senses import consequences, news, sight
from clo_fleet.robot.skill import Cancelled, Done, Failed, Progress, Under
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet import __version__
from clo_fleet.world import events
from clo_fleet.world.events import EVENTS_FORMAT, Recorder
from clo_fleet.world.model import ObjectMoved, PlaceId, Pose, RobotId, World

__all__ = ["TICK", "Mission", "RobotView"]

TICK = 0.2  # [s]
POSES_EVERY = 5  # ticks between two records of where everything is
PATIENCE = 30.0  # [s] for which nobody has had anything to do before the run ends
GRIDLOCK_AFTER = 180.0  # [s] for which no action has ended and nobody has moved before the run ends


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotView:
    """A robot as one can see it while a mission runs."""

    id: RobotId
    pose: Pose
    place: str
    mode: Mode
    plan: Plan
    running: str
    links: Links
    beliefs: frozenset[Fact]
    carried: tuple[str, ...]


class Mission:
    """One run of one world with one strategy. A context manager: it closes SUMO and ends the planners."""

    def __init__(self, world: World, strategy: Strategy, recorder: Recorder) -> None:
        self.world = world
        self.time = 0.0
        self.outcome: Outcome | None = None
        self.why = ""
        self._strategy = strategy
        self._recorder = recorder
        self._ticks = 0
        self._site = Site(world.map, world.robots, world.objects, seed=world.seed, tick=TICK)
        self._truth = Truth(self._site, world.robots, world.objects)
        self._offers = Offers(recorder)
        self._radio = RadioChannel(world.radio, seed=world.seed)
        self._avoidance = Avoidance()
        self._questions = Questions(world)
        self._robots = {
            spec.id: Robot(spec, Executive(strategy, self._truth.facts, goals_of(spec.goals)), seed=world.seed)
            for spec in sorted(world.robots, key=lambda spec: spec.id)
        }
        spread = world.skills.speed_spread
        for spec in world.robots if spread else ():
            self._site.slow(spec.id, spec.max_speed * (1.0 + spread * draw(world.seed, f"{spec.id}/speed")))
        self._announced: dict[RobotId, Announcement] = {}
        self._inbox: dict[RobotId, list[Event]] = {robot: [] for robot in self._robots}
        self._standing: dict[RobotId, str] = {}
        self._poses: dict[str, tuple[float, float, float]] = {}
        self._lively = 0.0  # when something last happened
        self._idle_since: float | None = None
        self._disturbances = sorted(world.disturbances, key=lambda disturbance: disturbance.time)
        self.wall_deciding: dict[RobotId, float] = dict.fromkeys(self._robots, 0.0)

    def __enter__(self) -> Self:
        self._questions.__enter__()
        self._site.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._site.close()
        self._questions.close()

    # ---- what can be asked ---------------------------------------------------------------------------------

    @property
    def facts(self) -> frozenset[Fact]:
        """The truth."""
        return self._truth.facts

    @property
    def strategy(self) -> Strategy:
        """The strategy of all robots."""
        return self._strategy

    @property
    def contacts(self) -> dict[str, int]:
        """How often bodies have touched so far."""
        return asdict(self._site.rooms.contacts())

    @property
    def site(self) -> Site:
        """The space, for those who look closely."""
        return self._site

    def robot(self, robot: str) -> Robot:
        """The robot of that id."""
        return self._robots[RobotId(robot)]

    @property
    def robots(self) -> tuple[RobotView, ...]:
        """All robots as they are now."""
        return tuple(self.view(robot) for robot in self._robots)

    def view(self, robot: str) -> RobotView:
        """One robot as it is now."""
        known = self._robots[RobotId(robot)]
        executive = known.executive
        return RobotView(
            id=known.id,
            pose=self._site.pose(known.id),
            place=self._site.place(known.id),
            mode=executive.mode,
            plan=executive.plan,
            running=executive.running.action.name if executive.running else "",
            links=executive.links,
            beliefs=executive.beliefs,
            carried=tuple(self._site.rooms.carried(known.id)),
        )

    @property
    def questions(self) -> Questions:
        """The planner's desk: what it was asked, and what that took."""
        return self._questions

    # ---- running -------------------------------------------------------------------------------------------

    def run(self, until: float | None = None) -> Outcome:
        """Step until the run ends; returns its outcome."""
        while self.outcome is None:
            self.step(until)
        return self.outcome

    def step(self, until: float | None = None) -> None:
        """One tick, or nothing once the run has ended. The first call makes the first plans as well."""
        if self.outcome is not None:
            return
        if self._ticks == 0:
            self._begin()
        self._ticks += 1
        self.time = self._offers.time = round(self._ticks * TICK, 3)
        self._disturb()
        self._act()
        for robot in self._site.step():
            self._record(events.Crossed(robot, "", self._site.place(robot)))
        self._derive()
        self._sense()
        self._converse()
        self._serve()
        self._keep_record()
        self._judge(self.world.until if until is None else until)

    def state(self) -> dict[str, Any]:
        """All that the mission remembers, as plain data."""
        return {
            "time": self.time,
            "ticks": self._ticks,
            "site": self._site.state(),
            "truth": self._truth.state(),
            "offers": self._offers.state(),
            "radio": self._radio.state(),
            "robots": {robot.id: robot.state() for robot in self._robots.values()},
            "lively": self._lively,
            "idle_since": self._idle_since,
            "standing": dict(self._standing),
            "disturbances_left": len(self._disturbances),
        }

    # ---- the parts of a tick -------------------------------------------------------------------------------

    def _begin(self) -> None:
        world = self.world
        self._record(
            events.RunStarted(
                format=EVENTS_FORMAT,
                version=__version__,
                world=world.name,
                map=world.map.name,
                strategy=self._strategy.name,
                seed=world.seed,
                until=world.until,
                robots=tuple(self._robots),
                objects=tuple(sorted(spec.id for spec in world.objects)),
            )
        )
        self._keep_record()
        givers = [robot for robot in self._robots.values() if _gifts(robot)]
        for wave in ([robot for robot in self._robots.values() if robot not in givers], givers):
            for robot in wave:
                self._tell(robot, Begin(self.time))
            self._serve()

    def _disturb(self) -> None:
        while self._disturbances and self._disturbances[0].time <= self.time + 1e-9:
            disturbance = self._disturbances.pop(0)
            if isinstance(disturbance, ObjectMoved):
                detail = "carried by a robot: left alone"
                if self._site.rooms.carrier(disturbance.object) is None:
                    self._site.rooms.move_item(disturbance.object, disturbance.position)
                    detail = f"to {disturbance.position[0]:g} {disturbance.position[1]:g}"
                self._record(events.Disturbed("object_moved", disturbance.object, detail))
            else:
                self._site.slow(disturbance.robot, disturbance.max_speed)
                self._record(events.Disturbed("robot_slowed", disturbance.robot, f"{disturbance.max_speed:g} m/s"))

    def _act(self) -> None:
        """Step every skill; steer those robots that are bodies."""
        wanted: dict[RobotId, Under] = {}
        for robot in self._robots.values():
            had_skill = robot.busy
            progress = robot.step(self._site, self._truth, self._offers, self.world.skills, self.time)
            if isinstance(progress, Under):
                wanted[robot.id] = progress
                self._note_standing(robot, progress.standing_for)
            else:
                wanted[robot.id] = Under()
                self._end_action(robot, progress)
            robot.measure_distance(self._site)
            if not had_skill and robot.executive.mode is Mode.WAITING:
                robot.measure_waiting(TICK)
        self._steer(wanted)

    def _steer(self, wanted: Mapping[RobotId, Under]) -> None:
        """Let robots in rooms avoid one another; who owns a doorway drives as it wants."""
        bodies = [robot for robot in self._robots.values() if not self._site.in_corridor(robot.id)]
        agents = [
            Agent(
                id=robot.id,
                position=self._site.pose(robot.id).point,
                velocity=self._site.rooms.velocity(robot.id) or (0.0, 0.0),
                preferred=wanted[robot.id].velocity,
                radius=robot.spec.radius,
                max_speed=self._site.max_speed(robot.id),
                group=self._site.place(robot.id),
            )
            for robot in bodies
        ]
        for robot, velocity in zip(bodies, self._avoidance.velocities(agents), strict=True):
            under = wanted[robot.id]
            self._site.rooms.drive(robot.id, under.velocity if under.direct else velocity)

    def _end_action(self, robot: Robot, progress: Progress) -> None:
        step, cause = robot.executive.running, robot.cause
        assert step is not None
        assert cause is not None
        reason = progress.reason if isinstance(progress, Failed) else ""
        ending = {Done: "finished", Failed: "failed", Cancelled: "cancelled"}[type(progress)]
        self._record(events.ActionEnded(robot.id, step.id, step.action.name, ending, reason, cause.event))
        self._lively = self.time
        if isinstance(progress, Done):
            self._inbox[robot.id].append(ActionFinished(self.time, step.id))
        elif isinstance(progress, Failed):
            self._inbox[robot.id].append(ActionFailed(self.time, step.id, progress.reason, progress.learnt))
        else:
            self._inbox[robot.id].append(ActionCancelled(self.time, step.id))

    def _note_standing(self, robot: Robot, why: str) -> None:
        if why and self._standing.get(robot.id) != why:
            self._record(events.Waiting(robot.id, why))
        self._standing[robot.id] = why

    def _derive(self) -> None:
        running = {robot.id: robot.cause for robot in self._robots.values() if robot.cause is not None}
        for flip in self._truth.step(running):
            by, cause = (flip.cause.robot, flip.cause.event) if flip.cause else (None, None)
            self._record(events.FactChanged(flip.fact, flip.value, by, cause))
            self._lively = self.time

    def _sense(self) -> None:
        """Every robot looks at the same snapshot; what is new to it, it also tells."""
        listeners = [Listener(robot.id, self._site.pose(robot.id).point) for robot in self._robots.values()]
        for robot, listener in zip(self._robots.values(), listeners, strict=True):
            executive = robot.executive
            seen = sight(self._site, self._truth, robot.id, self.world.perception, executive.beliefs)
            seen = consequences(seen, executive.beliefs)
            flips = news(seen, executive.beliefs, executive.watch, robot.id, self._truth)
            self._learn(robot, flips, "sight")
            own = self._effects(robot)
            self._radio.tell(self.time, listener, (*flips, *own), listeners)
        for robot_id, flips_heard in self._radio.due(self.time).items():
            self._hear(self._robots[robot_id], flips_heard)

    def _hear(self, robot: Robot, flips: list[Flip]) -> None:
        """Believe what was heard of things that the robot watches and does not see for itself."""
        beliefs, watch = robot.executive.beliefs, robot.executive.watch
        told = consequences({flip.fact: flip.value for flip in flips}, beliefs)
        causes = {flip.fact: flip.cause for flip in flips}
        fresh = tuple(
            Flip(fact, value, causes.get(fact) or self._truth.cause(fact))
            for fact, value in sorted(told.items())
            if (fact in beliefs) is not value and fact in watch and fact[0] != "at-robot"
        )
        self._learn(robot, fresh, "radio")

    def _learn(self, robot: Robot, flips: tuple[Flip, ...], source: str) -> None:
        waiting = {flip.fact for event in self._inbox[robot.id] if isinstance(event, Observed) for flip in event.flips}
        flips = tuple(flip for flip in flips if flip.fact not in waiting)
        if not flips:
            return
        opportunities = robot.executive.links.opportunities
        for flip in flips:
            by, cause = (flip.cause.robot, flip.cause.event) if flip.cause else (None, None)
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
        facts = {fact: True for fact in step.action.adds} | {fact: False for fact in step.action.deletes}
        return tuple(
            Flip(fact, value, robot.cause)
            for fact, value in sorted(facts.items())
            if fact[0] != "at-robot" and (fact in self._truth.facts) is value
        )

    def _converse(self) -> None:
        """Offers, and what follows from the plans that others have announced."""
        for robot in self._robots.values():
            inbox = self._inbox[robot.id]
            inbox += [OfferEnded(self.time, offer) for offer in self._offers.ended(robot.id)]
            for offer in self._offers.untold(robot.id):
                place = ("at-robot", robot.id, str(offer.place))
                gift = (
                    Flip(("holding", robot.id, offer.item), True),
                    Flip(("holding", offer.giver, offer.item), False),
                )
                inbox.append(Offered(self.time, offer.id, offer.giver, gift, (Condition(place),)))

    def _serve(self) -> None:
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
            replies = self._questions.due(self.time)
            for reply in replies:
                self._deliver(reply)
            if not replies and not any(self._inbox.values()):
                return

    def _announce(self, robot: Robot) -> None:
        """Tell the others what the robot means to do, if that has changed, and what follows for them."""
        executive, running = robot.executive, robot.executive.running
        if executive.mode in (Mode.NEW, Mode.PLANNING) and robot.id not in self._announced:
            return
        announcement = Announcement(
            robot=robot.id,
            place=self._site.place(robot.id),
            plan=tuple(step for step in executive.plan if step.id not in executive.suspended),
            moving=running is not None and running.action.schema == "move",
            goals=executive.goals,
            beliefs=executive.beliefs,
            in_hand=self._site.rooms.carried(robot.id),
        )
        before = self._announced.get(robot.id)
        if before is not None and _same(before, announcement):
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
        in_hand = (("holding", announcement.robot, item) for item in announcement.in_hand)
        self._hear(robot, [Flip(fact, True) for fact in in_hand if fact not in robot.executive.beliefs])
        needed = {need.fact for step in robot.executive.plan for need in step.action.needs}
        self._learn(robot, tuple(flip for flip in self._meets(robot) if flip.fact in needed), "radio")

    def _meets(self, robot: Robot) -> tuple[Flip, ...]:
        """How the places to meet others, as announced, differ from what a giver believes."""
        now: set[Fact] = {
            ("meets", other, meeting.place)
            for other, gifts in _gifts(robot).items()
            if other in self._announced
            for meeting in meeting_places(self._announced[other], gifts)
            if self._site.is_room(PlaceId(meeting.place))
            and meeting.until >= self._questions.earliest(robot.id, robot.executive.beliefs, gifts, meeting.place)
        }
        believed = {fact for fact in robot.executive.beliefs if fact[0] == "meets"}
        here = str(self._site.place(robot.id))
        now |= {fact for fact in believed if fact[2] == here and self._site.place(RobotId(fact[1])) == here}
        return tuple(Flip(fact, fact in now) for fact in sorted(now ^ believed))

    def _deliver(self, reply: Reply) -> None:
        robot = self._robots[reply.robot]
        if reply.actions is not None:
            self._tell(robot, PlanArrived(self.time, reply.actions), reply)
            return
        self._record(events.PlanFailed(robot.id, reply.failure.value, reply.detail))
        self._tell(robot, PlanMissing(self.time, reply.failure, reply.proven))

    def _tell(self, robot: Robot, event: Event, reply: Reply | None = None) -> None:
        """Give the executive an event and carry out its commands."""
        begin = clock.perf_counter()
        commands = robot.executive.handle(event)
        self.wall_deciding[robot.id] += clock.perf_counter() - begin
        for command in commands:
            self._obey(robot, command, event, reply)

    def _obey(self, robot: Robot, command: Command, event: Event, reply: Reply | None) -> None:
        record, name = self._record, robot.id
        match command:
            case StartAction(step):
                started = record(events.ActionStarted(name, step.id, step.action.name))
                robot.begin(step, started, self.world.skills)
            case CancelAction():
                robot.cancel()
            case AskPlan(why):
                record(events.PlanRequested(name, why))
                if flips := self._meets(robot):
                    robot.executive.handle(Observed(self.time, flips))
                self._questions.ask(robot.id, robot.executive.planning_state, robot.spec.goals, self.time)
            case AcceptOffer(offer):
                self._offers.answer(offer, accepted=True)
            case RefuseOffer(offer, why):
                self._offers.answer(offer, accepted=False, why=why)
            case PlanAdopted(plan, superseded, _):
                assert reply is not None
                steps = tuple((step.id, step.action.name) for step in plan)
                gone = tuple(step.action.name for step in superseded)
                record(events.PlanFollowed(name, steps, gone, reply.expansions, sum(s.action.cost for s in plan)))
            case StepsDropped(plan, reason, fact, cause):
                steps = tuple((step.id, step.action.name) for step in plan)
                by, because = (cause.robot, cause.event) if cause else (None, None)
                record(events.StepsLeftOut(name, steps, reason, fact, by, because))
            case RepairRefused(why):
                record(events.RepairFailed(name, why))
            case Waits(why):
                record(events.Waiting(name, why))
            case GoalsMet():
                record(events.GoalsReached(name))
            case Finished(outcome, why):
                record(events.GaveUp(name, outcome, why))

    def _keep_record(self) -> None:
        """Write down, now and then, where everything that moved is."""
        if self._ticks % POSES_EVERY and self.outcome is None:
            return
        robots, objects = [], []
        for robot in self._robots:
            pose = self._site.pose(robot)
            here = (round(pose.x, 3), round(pose.y, 3), round(pose.heading, 3))
            if self._poses.get(robot) != here:
                self._poses[robot] = here
                robots.append((str(robot), *here))
        for spec in self.world.objects:
            position = self._site.item_position(spec.id)
            if position is None:
                continue
            there = (round(position[0], 3), round(position[1], 3), 0.0)
            if self._poses.get(spec.id) != there:
                self._poses[spec.id] = there
                objects.append((str(spec.id), *there))
        if robots:
            self._lively = self.time
        if robots or objects:
            self._record(events.Poses(tuple(robots), tuple(sorted(objects))))

    def _judge(self, until: float) -> None:
        """End the run if it has come to an end."""
        executives = {robot.id: robot.executive for robot in self._robots.values()}
        if all(executive.mode is Mode.SATISFIED for executive in executives.values()) and self._fulfilled():
            self._end(Outcome.GOALS_REACHED, "all goals hold")
        elif self.time >= until - 1e-9:
            self._end(Outcome.OUT_OF_TIME, f"{until:g} s are over")
        elif self.time - self._lively > GRIDLOCK_AFTER and any(e.running for e in executives.values()):
            stuck = ", ".join(f"{robot} waits for {why}" for robot, why in sorted(self._standing.items()) if why)
            self._end(Outcome.GRIDLOCK, stuck or "nobody gets on")
        elif any(executive.running or executive.mode is Mode.PLANNING for executive in executives.values()):
            self._idle_since = None
        elif self._idle_since is None:
            self._idle_since = self.time
        elif self.time - self._idle_since > PATIENCE and not self._disturbances:
            self._end(*self._verdict(executives))

    def _verdict(self, executives: Mapping[RobotId, Executive]) -> tuple[Outcome, str]:
        """Why nobody has anything left to do, though not all goals hold."""
        for robot, executive in executives.items():
            if executive.outcome:
                known = {outcome.value: outcome for outcome in Outcome}
                return known.get(executive.outcome, Outcome.PLANNER_FAILED), f"{robot}: {executive.outcome}"
        waiting = [robot for robot, executive in executives.items() if executive.mode is not Mode.SATISFIED]
        if waiting:
            return Outcome.NO_PLAN, f"{', '.join(waiting)}: no plan exists as things are believed"
        return Outcome.MISTAKEN, "every robot believes that its goals hold, but not all do"

    def _fulfilled(self) -> bool:
        return all(goal in self._truth.facts for spec in self.world.robots for goal in spec.goals)

    def _end(self, outcome: Outcome, why: str) -> None:
        self.outcome, self.why = outcome, why
        self._keep_record()
        self._record(events.RunEnded(outcome.value, why))

    def _record(self, event: events.Event) -> int:
        return self._recorder.record(self.time, event)


def _is_ending(event: Event) -> bool:
    return isinstance(event, ActionFinished | ActionFailed | ActionCancelled)


def _in_order(time: float, inbox: list[Event]) -> list[Event]:
    """What was seen, heard and promised as one event, and before the rest: nobody acts on what it knows better."""
    flips = tuple(flip for event in inbox if isinstance(event, Observed) for flip in event.flips)
    promised = [event.facts for event in inbox if isinstance(event, Promised)]
    rest = [event for event in inbox if not isinstance(event, Observed | Promised)]
    news = [Observed(time, flips, promised[-1] if promised else None)] if flips or promised else []
    return [*news, *rest]


def _gifts(robot: Robot) -> dict[RobotId, list[Any]]:
    """What the robot is to bring into the hands of others, by the other."""
    gifts: dict[RobotId, list[Any]] = {}
    for goal in robot.spec.goals:
        if goal[0] == "holding" and goal[1] != robot.id:
            gifts.setdefault(RobotId(goal[1]), []).append(goal[2])
    return gifts


def _same(a: Announcement, b: Announcement) -> bool:
    """Whether nothing that others care about differs (beliefs may)."""
    return (a.place, a.plan, a.moving, a.in_hand) == (b.place, b.plan, b.moving, b.in_hand)
