"""What comes along with an action by chance: drawn for what was done, not for who did it."""

import json
from collections.abc import Mapping

from clo_fleet.clo.messages import Cause
from clo_fleet.clo.task import Action, Fact
from clo_fleet.fleet.effects import Effects
from clo_fleet.sim.site import Site
from clo_fleet.sim.truth import Truth
from clo_fleet.study.event_log import EventLog
from clo_fleet.study.shipped import shipped
from clo_fleet.world.events import AlsoHappened
from clo_fleet.world.model import RobotId
from clo_fleet.world.vocabulary import vocabulary
from clo_fleet.world.world_file import read_world

WORLD = read_world(shipped("worlds") / "dialog.yaml")
QUESTIONS = ("name", "age", "job", "wish")


class Scene:
    """The world of dialog with robots that ask; nobody moves."""

    def __init__(self, state: Mapping[str, object] | None = None, seed: int = 0) -> None:
        site = Site(WORLD.map, WORLD.robots, WORLD.objects, seed=0, tick=0.2)
        self.truth = Truth(site, vocabulary(WORLD))
        self.log = EventLog()
        self.effects = Effects(self.truth, self.log, seed)
        if state is not None:
            self.effects.restore(state)

    def ask(self, robot: str, person: str, question: str = "name") -> set[str]:
        """What the person says beyond the question; it is forgotten at once."""
        fact: Fact = ("answered", person, question)
        action = Action(
            schema="ask",
            args=(robot, person, question, "hello", "l1"),
            needs=(),
            adds=frozenset({fact}),
            deletes=frozenset(),
        )
        before = len(self.log.events)
        cause = Cause(robot, action.name, 7)
        self.truth.come_about({fact: True}, cause)
        self.effects.end(action, cause, 1.0)
        said = {event.fact[2] for _, _, event in self.log.events[before:] if isinstance(event, AlsoHappened)}
        self.truth.step({})
        self.noticed = self.effects.noticed(RobotId(robot))
        self.told = self.effects.told(RobotId(robot))
        self.truth.come_about(dict.fromkeys(self.truth.effects, False), None)
        return said


def test_the_draw_is_for_the_deed_and_how_often_it_was_done() -> None:
    """Another robot hears the same; the next time, or with another seed, it may be something else."""
    first = {person: Scene().ask("r1", person) for person in ("ann", "ben", "cem")}
    assert first == {person: Scene().ask("r2", person) for person in ("ann", "ben", "cem")}
    scene = Scene()
    again = [scene.ask("r1", "ann") for _ in range(300)]
    assert len({frozenset(said) for said in again}) > 3
    count = sum(map(len, again))
    assert 0.15 < count / (300 * len(QUESTIONS[1:]) + 300) < 0.25, "hello is forgotten and may be said again as well"
    assert [Scene(seed=seed).ask("r1", "ann") for seed in range(9)] != [again[0]] * 9


def test_who_did_it_notices_it_and_tells_it_with_its_own_effects_once() -> None:
    """Whose doing it was is the person's; the cause is the event in the log."""
    scene = Scene()
    said = scene.ask("r2", "ann")
    assert said == {"job", "wish"}
    assert scene.noticed == {("answered", "ann", question): True for question in said}
    causes = {flip.fact[2]: flip.cause for flip in scene.told}
    assert causes["name"] == Cause("r2", "ask(r2, ann, name, hello, l1)", 7)
    number, _, event = scene.log.events[0]
    assert isinstance(event, AlsoHappened)
    assert (event.robot, event.by, event.started) == ("r2", "ann", 7)
    assert causes[event.fact[2]] == Cause("ann", "ask(r2, ann, name, hello, l1)", number)
    assert scene.effects.told(RobotId("r2")) == ()


def test_what_is_true_already_does_not_come_about_again() -> None:
    """Nobody is told twice, and the first who said it has the credit."""
    scene = Scene()
    scene.truth.come_about({("answered", "ann", question): True for question in QUESTIONS}, None)
    assert scene.ask("r2", "ann") == set()


def test_a_saved_state_goes_on_alike() -> None:
    """How often what was done is remembered, as plain data."""
    scene = Scene()
    for _ in range(5):
        scene.ask("r1", "ann")
    other = Scene(json.loads(json.dumps(scene.effects.state())))
    assert [scene.ask("r2", "ann") for _ in range(9)] == [other.ask("r1", "ann") for _ in range(9)]
    assert scene.effects.state() == other.effects.state() == {"ask ann name hello l1": 14}
