"""Fleets with domains of their own: who helps whom, and what effects are caused by."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.testing.assertions import assert_goals_reached, assert_helped, assert_sound
from clo_fleet.world.events import ActionEnded, ActionStarted, AlsoHappened, FactChanged, Sensed
from clo_fleet.world.model import World
from clo_fleet.world.world_file import read_world


def world(name: str) -> World:
    """A world that comes with the package."""
    return read_world(shipped("worlds") / f"{name}.yaml")


def played(world: World, strategy: str = "clo") -> tuple[Run, RunResult]:
    """The world's run, at its end."""
    with Run(world, strategy) as run:
        return run, run.finish()


def helps(result: RunResult) -> set[tuple[str, str, str]]:
    """Who spared whom a step, by which fact."""
    return {(help_.by, help_.robot, help_.fact) for help_ in result.helps}


SILENT = ("chance: 0.2", "chance: 0")  # nobody says more than they are asked
TALKATIVE = ("chance: 0.2", "chance: 1")

Changed = Callable[..., World]


@pytest.fixture
def dialog(tmp_path: Path) -> Changed:
    """The world of dialog with some things changed in its file."""

    def changed(*changes: tuple[str, str]) -> World:
        for part in ("maps", "worlds"):
            shutil.copytree(shipped(part), tmp_path / part)
        path = tmp_path / "worlds" / "dialog.yaml"
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path.write_text(text, encoding="utf-8")
        return read_world(path)

    return changed


@pytest.mark.parametrize("strategy", ["clo", "clo-improve"])
def test_what_a_person_told_one_robot_the_other_need_not_ask(strategy: str, dialog: Changed) -> None:
    """Both ask Ann; what r2 has asked r1 leaves out, or stops asking, and it asks what is left."""
    _, result = played(dialog(SILENT), strategy)
    assert {("r2", "r1", f"(answered ann {question})") for question in ("name", "age", "job")} <= helps(result)
    assert (result.robots["r1"].executed, result.robots["r1"].cancelled) == (6, 2)
    assert result.robots["r1"].planner_calls == 1


def test_the_cuts_of_one_cook_are_the_others_too() -> None:
    """c1 cuts the pumpkin for both, c2 the leek."""
    _, result = played(world("cooking"))
    assert {("c1", "c2", f"(has-cut pumpkin n{n})") for n in (1, 2, 3)} <= helps(result)
    assert ("c2", "c1", "(has-cut leek n1)") in helps(result)


def test_an_effect_comes_with_the_end_of_its_action_and_by_nothing_else(dialog: Changed) -> None:
    """Every answer but those that Cem gives unasked is the doing of one `ask`, finished then, after its time."""
    run, _ = played(dialog(SILENT))
    log = run.log
    answers = [
        (time, event) for _, time, event in log if isinstance(event, FactChanged) and event.fact[0] == "answered"
    ]
    unasked = [(time, event.fact) for time, event in answers if event.cause is None]
    assert unasked == [(40.0, ("answered", "cem", "age")), (40.0, ("answered", "cem", "name"))]
    assert len(answers) > 8
    for time, event in answers:
        if event.cause is None:
            continue
        _, started, start = log[event.cause]
        assert isinstance(start, ActionStarted)
        assert start.action.startswith(f"ask({event.by}, {event.fact[1]}, {event.fact[2]}, ")
        assert time - started >= 5.0 - 1e-9
        ends = [t for _, t, e in log if isinstance(e, ActionEnded) and (e.robot, e.step) == (start.robot, start.step)]
        assert ends == [time]


def test_what_is_for_the_doer_alone_nobody_else_learns(dialog: Changed) -> None:
    """Without sight and radio of answers both robots ask everything, and the answers help nobody."""
    run, result = played(dialog(SILENT, ("seen: p", "seen: doer")))
    assert result.outcome == "goals_reached"
    assert result.helps == ()
    assert not [event for _, _, event in run.log if isinstance(event, Sensed) and event.fact[0] == "answered"]


def test_work_without_an_object_can_be_done_anywhere_in_the_room(dialog: Changed) -> None:
    """Robots that need not be near a person ask from where they have come in, and drive less."""
    _, far = played(dialog(SILENT, ("robot: r, at: p,", "robot: r,")))
    assert far.outcome == "goals_reached"
    assert far.robots["r2"].distance_m < 36.0, "it was 37.5 when it went up to people"


# ---- what comes along by chance ------------------------------------------------------------------------------


def test_what_a_person_says_beyond_the_question_spares_the_asker_and_others_the_asking() -> None:
    """The log says who said it while being asked what; the asker sees it, the other hears it; Ann has helped both."""
    run = Run(world("dialog"))
    with run:
        assert_sound(run)
    assert_goals_reached(run)
    log = run.log
    along = {event.fact: (number, time, event) for number, time, event in log if isinstance(event, AlsoHappened)}
    assert sorted(along) == [("answered", "ann", "job"), ("answered", "ann", "wish")]
    for fact, (number, time, event) in along.items():
        assert (event.robot, event.by, event.action) == ("r2", "ann", "ask(r2, ann, name, hello, l1)")
        assert isinstance(log[event.started][2], ActionStarted)
        (changed,) = [(at, e) for _, at, e in log if isinstance(e, FactChanged) and e.fact == fact]
        assert changed == (time, FactChanged(fact, True, "ann", number))
    learnt = [event for _, _, event in log if isinstance(event, Sensed) and event.by == "ann"]
    assert {(event.robot, event.source, event.fact[2]) for event in learnt} == {
        ("r2", "sight", "job"),
        ("r1", "radio", "job"),
        ("r1", "radio", "wish"),
    }
    assert all(event.opportunity for event in learnt)
    for robot, spared in (("r2", 2), ("r1", 4)):
        given = assert_helped(run, by="ann", robot=robot)
        assert (given.action, len(given.dropped)) == ("ask(r2, ann, name, hello, l1)", spared)
    assert run.result().robots["r2"].opportunities_by == {"ann": 1}


def test_the_asker_knows_what_only_the_asker_is_told(dialog: Changed) -> None:
    """Everybody tells all at the first question, and nobody else learns of it: each asks each of its people once."""
    run, result = played(dialog(TALKATIVE, ("seen: p", "seen: doer")))
    assert result.outcome == "goals_reached"
    asked = [e.action for _, _, e in run.log if isinstance(e, ActionStarted) and e.action.startswith("ask")]
    assert len(asked) == 4
    assert {(by, robot) for by, robot, _ in helps(result)} == {
        ("ann", "r1"),
        ("ben", "r1"),
        ("ann", "r2"),
        ("cem", "r2"),
    }


def test_where_says_what_may_come_along(dialog: Changed) -> None:
    """Who answers one question answers the next one as well, and no other: every second question is asked."""
    rule = "fact: (answered ?p ?other)"
    run, result = played(dialog(TALKATIVE, (rule, f"{rule}, where: [(follows ?other ?q)]")))
    assert result.outcome == "goals_reached"
    asked = {e.action.split(", ")[2] for _, _, e in run.log if isinstance(e, ActionStarted) and e.action[:3] == "ask"}
    assert asked == {"name", "job"}
    told = {(e.action.split(", ")[2], e.fact[2]) for _, _, e in run.log if isinstance(e, AlsoHappened)}
    assert told == {("name", "age"), ("job", "wish")}


@pytest.mark.parametrize("strategy", ["replan", "clo-as-printed"])
def test_the_same_people_say_the_same_whoever_asks_and_by_whatever_strategy(strategy: str) -> None:
    """What came along with a question that was asked in both runs came along in both."""

    def said(strategy: str) -> dict[tuple[str, ...], set[str]]:
        run, result = played(world("dialog"), strategy)
        assert result.outcome == "goals_reached"
        asked = [
            event.action for _, _, event in run.log if isinstance(event, ActionEnded) and event.ending == "finished"
        ]
        found: dict[tuple[str, ...], set[str]] = {
            tuple(action.split(", ")[1:3]): set() for action in asked if action.startswith("ask")
        }
        for _, _, event in run.log:
            if isinstance(event, AlsoHappened):
                found[tuple(event.action.split(", ")[1:3])].add(event.fact[2])
        return found

    one, other = said("clo"), said(strategy)
    both = one.keys() & other.keys()
    assert len(both) >= 3
    assert {question: one[question] for question in both} == {question: other[question] for question in both}
