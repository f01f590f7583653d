"""Fleets with domains of their own: who helps whom, and what effects are caused by."""

import shutil
from pathlib import Path

import pytest

from clo_fleet.study.result import RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.events import ActionEnded, ActionStarted, FactChanged, Sensed
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


@pytest.mark.parametrize("strategy", ["clo", "clo-improve"])
def test_what_a_person_told_one_robot_the_other_need_not_ask(strategy: str) -> None:
    """Both ask Ann; what r2 has asked r1 leaves out, or stops asking, and it asks what is left."""
    _, result = played(world("dialog"), strategy)
    assert ("r2", "r1", "(answered ann name)") in helps(result)
    assert (result.robots["r1"].executed, result.robots["r1"].cancelled) == (6, 2)
    assert result.robots["r1"].planner_calls == 1


def test_the_cuts_of_one_cook_are_the_others_too() -> None:
    """c1 cuts the pumpkin for both, c2 the leek."""
    _, result = played(world("cooking"))
    assert {("c1", "c2", f"(has-cut pumpkin n{n})") for n in (1, 2, 3)} <= helps(result)
    assert ("c2", "c1", "(has-cut leek n1)") in helps(result)


def test_an_effect_comes_with_the_end_of_its_action_and_by_nothing_else() -> None:
    """Every answer but those that Cem gives unasked is the doing of one `ask`, finished then, after its time."""
    run, _ = played(world("dialog"))
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


def changed(folder: Path, old: str, new: str) -> World:
    """The world of dialog with one thing changed in its file."""
    for part in ("maps", "worlds"):
        shutil.copytree(shipped(part), folder / part)
    path = folder / "worlds" / "dialog.yaml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return read_world(path)


def test_what_is_for_the_doer_alone_nobody_else_learns(tmp_path: Path) -> None:
    """Without sight and radio of answers both robots ask everything, and the answers help nobody."""
    run, result = played(changed(tmp_path, "seen: p", "seen: doer"))
    assert result.outcome == "goals_reached"
    assert result.helps == ()
    assert not [event for _, _, event in run.log if isinstance(event, Sensed) and event.fact[0] == "answered"]


def test_work_without_an_object_can_be_done_anywhere_in_the_room(tmp_path: Path) -> None:
    """Robots that need not be near a person ask from where they have come in, and drive less."""
    _, far = played(changed(tmp_path, "robot: r, at: p,", "robot: r,"))
    assert far.outcome == "goals_reached"
    assert far.robots["r2"].distance_m < 36.0, "it was 37.5 when it went up to people"
