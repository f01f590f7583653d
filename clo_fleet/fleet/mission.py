"""A mission: several robots in one world, tick by tick, until their goals hold or the run ends otherwise.

Theory of operation
-------------------
``Mission.step`` is the loop of the whole system, on one page. In every tick, in this order: disturbances; every
robot's skill, in the order of the robots' ids; physics, then traffic, then the change-overs between the two; the
truth is derived; every robot senses the same snapshot; the radio; and every executive is told what its robot
learnt and answers with commands (``conversation.py``). The tick is the only clock.

Executives that ask for a plan are served at the end of the tick: all questions go to the planner processes
together, the simulation waits for the answers, and each answer is due after the simulated planning time. With
none, the answer is due at once and the loop goes round until nobody asks any more.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clo_fleet import __version__
from clo_fleet.clo.executive import Executive
from clo_fleet.clo.messages import ActionCancelled, ActionFailed, ActionFinished
from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.strategies import Strategy
from clo_fleet.clo.task import Fact
from clo_fleet.fleet.conversation import Conversation
from clo_fleet.fleet.crowds import Crowds
from clo_fleet.fleet.disturbances import Disturbances
from clo_fleet.fleet.journeys import Journeys
from clo_fleet.fleet.judge import Judge, patience
from clo_fleet.fleet.outcome import Outcome
from clo_fleet.fleet.questions import Questions
from clo_fleet.fleet.robot_view import RobotView
from clo_fleet.fleet.saved import Saved
from clo_fleet.fleet.standing import Standing
from clo_fleet.fleet.tracks import Tracks
from clo_fleet.fleet.waits import Waits
from clo_fleet.planning.pool import PlannerPool
from clo_fleet.planning.repertoire import Repertoire
from clo_fleet.robot.robot import Robot
from clo_fleet.robot.skill import Cancelled, Done, Failed, Progress, Under
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.world import events
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.chance import varied
from clo_fleet.world.events import EVENTS_FORMAT, Recorder, credit
from clo_fleet.world.model import RobotId, RobotSpec, World
from clo_fleet.world.vocabulary import vocabulary

__all__ = ["TICK", "Mission"]

TICK = 0.2  # [s]
TRACK_EVERY = 5  # ticks between two records of where everything is


class Mission:
    """One run of one world with one strategy. A context manager: it closes SUMO and ends the planners."""

    def __init__(
        self,
        world: World,
        strategy: Strategy,
        recorder: Recorder,
        planners: PlannerPool | None = None,
        *,
        checkpoint_every: float | None = None,
        saved: Saved | None = None,
    ) -> None:
        """A mission that is yet to be entered.

        Args:
            world: what is run.
            strategy: of all robots.
            recorder: takes the events.
            planners: others' to ask and to end, if they fit the world.
            checkpoint_every: for the first event; whoever steps the mission keeps to it [s].
            saved: where to go on, instead of at the beginning.
        """
        self.world = world
        self.outcome: Outcome | None = None
        self.why = ""
        self._strategy = strategy
        self._recorder = recorder
        self._checkpoint_every = checkpoint_every
        self._words = vocabulary(world)
        self._questions = Questions(world, self._words, planners)
        self._make(saved)

    def _make(self, saved: Saved | None) -> None:
        """Make all parts anew, so that what a state leaves out is forgotten in whatever process goes on from it."""
        world, state = self.world, saved.state if saved else None
        self._ticks: int = state["ticks"] if state else 0
        self.time = round(self._ticks * TICK, 3)
        self._site = (
            Site.from_state(
                world.map, world.robots, world.objects, state["site"], saved.traffic, seed=world.seed, tick=TICK
            )
            if saved and state
            else Site(world.map, world.robots, world.objects, seed=world.seed, tick=TICK)
        )
        self._truth = Truth(self._site, self._words)
        specs = sorted(world.robots, key=lambda spec: spec.id)
        of_all = self._truth.of_all
        self._robots = {
            spec.id: self._robot(spec, of_all, state["robots"][spec.id] if state else None) for spec in specs
        }
        self._conversation = Conversation(world, self._site, self._truth, self._robots, self._recorder, self._questions)
        self._conversation.time = self.time
        goals = frozenset(goal for spec in world.robots for goal in spec.goals)
        self._judge = Judge(goals, patience=patience(world.radio))
        self._tracks = Tracks(self._site, tuple(self._robots), tuple(sorted(spec.id for spec in world.objects)))
        self._waits = Waits.from_state(state["waits"]) if state else Waits()
        self._standing = Standing(self._site, self._waits)
        self._journeys = Journeys(self._site, self._robots)
        self._crowds = Crowds(self._site, self._robots)
        if saved and state:
            self._truth.restore(state["truth"])
            self._conversation.restore(state["conversation"])
            self._judge.restore(state["judge"])
            self._tracks.restore(state["tracks"])
            self._standing.restore(state["standing"])
            self.questions.restore_wall(saved.wall["planning"])
            self.wall_deciding.update(saved.wall["deciding"])
        elif spread := world.skills.speed_spread:
            for spec in world.robots:
                self._site.slow(spec.id, varied(spec.max_speed, spread, world.seed, f"{spec.id}/speed"))
        self._disturbances = Disturbances(world, self._site, self._truth, self._robots, self._conversation)
        if state:
            self._disturbances.restore(state["disturbances"])

    def _robot(self, spec: RobotSpec, of_all: frozenset[Fact], state: Mapping[str, Any] | None) -> Robot:
        actions, partly = Repertoire(spec.id, self._questions.scene), self.world.planning.partly
        if state is None:
            beliefs = of_all.union(self._words.facts(SensorKind.PLACE, spec.id, self._site.place(spec.id)))
            executive = Executive(self._strategy, beliefs, goals_of(spec.goals), actions, partly=partly)
            return Robot(spec, executive, seed=self.world.seed)
        executive = Executive.from_state(self._strategy, state["executive"], actions, partly=partly)
        robot = Robot(spec, executive, seed=self.world.seed)
        robot.restore(state)
        return robot

    def __enter__(self) -> Self:
        self.questions.__enter__()
        try:
            self._site.__enter__()
        except BaseException:
            self.questions.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._site.close()
        self.questions.close()

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
    def waits(self) -> Waits:
        """Who waits for whom, and how long each robot has waited for what."""
        return self._waits

    @property
    def site(self) -> Site:
        """The space, for those who look closely."""
        return self._site

    def robot(self, robot: str) -> Robot:
        """The robot of that id."""
        self._journeys.settle(self._ticks)
        return self._robots[RobotId(robot)]

    @property
    def robots(self) -> tuple[RobotView, ...]:
        """All robots as they are now."""
        return tuple(self.view(robot) for robot in self._robots)

    def view(self, robot: str) -> RobotView:
        """One robot as it is now."""
        return RobotView.of(self._robots[RobotId(robot)], self._site)

    @property
    def questions(self) -> Questions:
        """The planner's desk: what it was asked, and what that took."""
        return self._questions

    def looked(self, robot: str) -> int:
        """How many facts the robot has looked at so far."""
        return self._conversation.senses.looked.get(RobotId(robot), 0)

    @property
    def wall_deciding(self) -> dict[RobotId, float]:
        """The real time that each executive has taken [s]."""
        return self._conversation.wall_deciding

    # ---- running -------------------------------------------------------------------------------------------

    def step(self, until: float | None = None) -> None:
        """One tick, or nothing once the run has ended. The first call makes the first plans as well."""
        if self.outcome is not None:
            return
        if self._ticks == 0:
            self._begin()
        self._ticks += 1
        self.time = self._conversation.time = round(self._ticks * TICK, 3)
        self._disturbances.step(self.time, self._recorder)
        self._act()
        self._site.step()
        self._derive()
        self._conversation.perceive()
        self._disturbances.notice(self.time, self._waits.now, self._recorder)
        self._conversation.pass_offers_on()
        self._conversation.serve()
        self._track()
        self._end(self.world.until if until is None else until)

    def state(self) -> dict[str, Any]:
        """All that the mission remembers, as plain data."""
        self._journeys.settle(self._ticks)
        return {
            "time": self.time,
            "ticks": self._ticks,
            "site": self._site.state(),
            "truth": self._truth.state(),
            "conversation": self._conversation.state(),
            "robots": {robot.id: robot.state() for robot in self._robots.values()},
            "judge": self._judge.state(),
            "tracks": self._tracks.state(),
            "standing": self._standing.state(),
            "waits": self._waits.state(),
            "disturbances": self._disturbances.state(),
        }

    def wall(self) -> dict[str, dict[RobotId, float]]:
        """The real time that planning and deciding have taken each robot [s]: kept with a state, but not part of it."""
        planning = {robot: desk.wall_seconds for robot, desk in self.questions.desks.items()}
        return {"planning": planning, "deciding": dict(self.wall_deciding)}

    def save_traffic(self, path: Path) -> None:
        """Write SUMO's half of the state to a file, ``.xml`` or ``.xml.gz``; a building without corridors has none."""
        self._site.corridors.save(path)

    def rebuild(self, saved: Saved) -> None:
        """Go on from what was saved, as a mission in another process will.

        Engines go on a little differently from a saved state than without having been saved; so a mission that saves
        itself must be rebuilt from that at the same moment.
        """
        self._site.close()
        self._make(saved)
        self._site.__enter__()

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
                checkpoint_every=self._checkpoint_every,
            )
        )
        self._track()
        self._disturbances.step(self.time, self._recorder)
        self._conversation.begin()

    def _act(self) -> None:
        """Step every skill; steer those robots that are bodies."""
        wanted: dict[RobotId, Under] = {}
        for robot, at_rest in self._journeys.turns(self._ticks, self.time):
            if at_rest is not None:
                wanted[robot.id] = at_rest
                continue
            progress = robot.step(self._site, self._truth, self._conversation.offers, self.world.skills, self.time)
            if isinstance(progress, Under):
                wanted[robot.id] = progress
                if progress.rerouted:
                    self._record(events.Rerouted(robot.id, progress.rerouted))
                self._journeys.begin(robot, self._ticks, progress)
            else:
                wanted[robot.id] = Under()
                self._end_action(robot, progress)
            robot.measure_distance(self._site)
        for event in self._standing.note(self.time, wanted):
            self._record(event)
        self._crowds.steer(wanted)

    def _end_action(self, robot: Robot, progress: Progress) -> None:
        step, cause = robot.executive.running, robot.cause
        assert step is not None
        assert cause is not None
        reason = progress.reason if isinstance(progress, Failed) else ""
        ending = {Done: "finished", Failed: "failed", Cancelled: "cancelled"}[type(progress)]
        self._record(events.ActionEnded(robot.id, step.id, step.action.name, ending, reason, cause.event))
        self._judge.lively_at = self.time
        if isinstance(progress, Done):
            self._conversation.effects.end(step.action, cause, self.time)
            self._conversation.put(robot.id, ActionFinished(self.time, step.id))
        elif isinstance(progress, Failed):
            self._conversation.put(robot.id, ActionFailed(self.time, step.id, progress.reason, progress.learnt))
        else:
            self._conversation.put(robot.id, ActionCancelled(self.time, step.id))

    def _derive(self) -> None:
        running = {robot.id: robot.cause for robot in self._robots.values() if robot.cause is not None}
        flips = self._truth.step(running)
        for flip in flips:
            self._record(events.FactChanged(flip.fact, flip.value, *credit(flip.cause)))
            self._judge.lively_at = self.time
        self._conversation.note(flip.fact for flip in flips)

    def _track(self) -> None:
        """Write down, now and then, where everything that moved is."""
        if self._ticks % TRACK_EVERY and self.outcome is None:
            return
        moved = self._tracks.moved()
        if moved is not None:
            self._record(moved)
            if moved.robots:
                self._judge.lively_at = self.time

    def _end(self, until: float) -> None:
        """End the run if it has come to an end; what the schedule still has in store, and may help, is waited for."""
        executives = {str(robot.id): robot.executive for robot in self._robots.values()}
        if self._disturbances.help_may_come:
            self._judge.idle_since, self._judge.lively_at = None, self.time
        waits = None if self._disturbances.help_may_come else self._waits
        verdict = self._judge.verdict(self.time, until, self._truth.facts, executives, self._standing.texts, waits)
        if verdict is None:
            return
        self.outcome, self.why = verdict
        self._journeys.settle(self._ticks)
        self._track()
        self._record(events.RunEnded(self.outcome.value, self.why))

    def _record(self, event: events.Event) -> int:
        return self._recorder.record(self.time, event)
