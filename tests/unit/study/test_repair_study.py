"""The study of repairs on PDDL problems."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from clo_fleet.clo.task import apply, unmet
from clo_fleet.study.repair_episodes import Kind
from clo_fleet.study.repair_story import NoEpisodeError, episode_story, retold
from clo_fleet.study.repair_study import (
    NoProblemsError,
    Prepared,
    Settings,
    Study,
    prepared,
    problems,
    study,
    trial,
)
from clo_fleet.study.repair_tables import rows, tables, write_study

FETCH = """
(define (domain fetch)
  (:requirements :strips :typing)
  (:types place box)
  (:predicates (door ?a ?b - place) (here ?p - place) (at ?b - box ?p - place) (open ?b - box) (has ?b - box))
  (:action move :parameters (?a ?b - place) :precondition (and (here ?a) (door ?a ?b))
    :effect (and (here ?b) (not (here ?a))))
  (:action unlock :parameters (?b - box ?p - place) :precondition (and (here ?p) (at ?b ?p)) :effect (open ?b))
  (:action take :parameters (?b - box ?p - place) :precondition (and (here ?p) (at ?b ?p) (open ?b))
    :effect (and (has ?b) (not (at ?b ?p))))
  (:action put :parameters (?b - box ?p - place) :precondition (and (here ?p) (has ?b))
    :effect (and (at ?b ?p) (not (has ?b)))))
"""
TWO = """
(define (problem two) (:domain fetch) (:objects p1 p2 p3 - place b1 b2 - box)
  (:init (here p1) (door p1 p2) (door p2 p1) (door p2 p3) (door p3 p2) (at b1 p2) (at b2 p3))
  (:goal (and (has b1) (has b2))))
"""
SETTINGS = Settings(episodes=24, sizes=(1, 3), explain_left=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a domain, one good problem, and three that cannot be studied."""
    place: Path = tmp_path_factory.mktemp("domains")
    fetch = place / "fetch"
    fetch.mkdir()
    (place / "empty").mkdir()
    (place / "note.txt").write_text("no domain", encoding="utf-8")
    texts = {
        "domain": FETCH,
        "p1": TWO,
        "p2": TWO.replace("(door p1 p2)", ""),
        "p3": TWO.replace("(:goal (and (has b1) (has b2)))", "(:goal (here p1))"),
        "p4": TWO.replace("(here p1)", "(there p1)"),
    }
    for name, text in texts.items():
        (fetch / f"{name}.pddl").write_text(text, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def case(folder: Path) -> Prepared:
    """The good problem with its plan."""
    found = prepared(*problems([folder], "fetch/p1")[0], SETTINGS)
    assert isinstance(found, Prepared)
    return found


@pytest.fixture(scope="module")
def result(folder: Path) -> Study:
    """A whole study."""
    return study([folder], SETTINGS)


def test_problems_are_found_by_folder_and_name(folder: Path) -> None:
    """Domain folders, or folders of such; other things are passed over; all or those of one name."""
    labels = [label for label, _, _ in problems([folder])]
    assert labels == ["fetch/p1", "fetch/p2", "fetch/p3", "fetch/p4"]
    assert [label for label, _, _ in problems([folder / "fetch"], "fetch/p3")] == ["fetch/p3"]
    assert len(problems([folder], "fetch")) == 4
    with pytest.raises(NoProblemsError, match=r"no problems of fetch/p9 in .*: expected folders with domain\.pddl"):
        problems([folder], "fetch/p9")
    with pytest.raises(NoProblemsError, match="no problems in"):
        problems([folder / "empty", folder / "note.txt", folder / "missing"])


def test_problems_without_a_plan_are_left_out_with_the_reason(result: Study) -> None:
    """No plan, nothing to do, not readable: each is named, and the others are studied all the same."""
    assert {trial.label for trial in result.trials} == {"fetch/p1"}
    whys = {skipped.label: skipped.why for skipped in result.skipped}
    assert whys["fetch/p2"] == "Fast Downward found no plan (no plan proven)"
    assert whys["fetch/p3"] == "its goals hold already"
    assert "p4.pddl: unified-planning cannot read it" in whys["fetch/p4"]


def test_an_episode_follows_from_seed_label_and_number(folder: Path, case: Prepared) -> None:
    """The same again, and another with another number or seed."""
    again = prepared(*problems([folder], "fetch/p1")[0], SETTINGS)
    other = prepared(*problems([folder], "fetch/p1")[0], replace(SETTINGS, seed=1))
    assert isinstance(again, Prepared)
    assert isinstance(other, Prepared)
    assert [case.episodes.episode(i) for i in range(30)] == [again.episodes.episode(i) for i in range(30)]
    assert [case.episodes.episode(i) for i in range(30)] != [other.episodes.episode(i) for i in range(30)]
    assert len({case.episodes.episode(i).state for i in range(30)}) > 5


def test_surprises_are_what_their_kind_says(case: Prepared) -> None:
    """Others do what can be done, one does a later step of the plan, or facts turn; something always changes."""
    episodes = [case.episodes.episode(i) for i in range(60)]
    assert {episode.kind for episode in episodes} == set(Kind)
    for episode in episodes:
        state = case.grounded.task.state
        for action in case.plan[: episode.after]:
            state = apply(state, action)
        assert episode.before == state
        assert tuple(step.action for step in episode.rest) == case.plan[episode.after :] != ()
        assert episode.changed
        for action in episode.actions:
            assert not unmet(action, state)
            state = apply(state, action)
        match episode.kind:
            case Kind.FOREIGN:
                assert len(episode.actions) == episode.size in SETTINGS.sizes
                assert episode.state == state
            case Kind.OWN:
                assert episode.actions[0] in case.plan[episode.after :]
                assert episode.state == state
            case Kind.FLIP:
                assert len(episode.changed) == episode.size <= 3
                assert episode.actions == ()


def test_every_repaired_plan_is_judged_and_none_is_invalid(result: Study) -> None:
    """A trial tells what became of the plan by both strategies."""
    assert len(result.trials) == SETTINGS.episodes
    for done in result.trials:
        assert done.valid is not False
        assert done.repaired is (done.valid is True) is (done.length is not None)
        assert bool(done.means) is done.repaired
        assert done.broken or done.means == "deletion"
        assert bool(done.solvable) is not done.repaired


def test_the_rows_count_every_trial_once(result: Study) -> None:
    """By kind of surprise; what broke was repaired by one of the means, or was left."""
    other = tuple(replace(done, label="zoo/p1") for done in result.trials)
    found = rows(result.trials + other)
    assert [row.domain for row in found] == sorted(row.domain for row in found if row.domain != "all") + ["all"] * 4
    assert sum(row.episodes for row in found) == 4 * SETTINGS.episodes
    for row in found:
        assert row.broken == row.deletion + row.relinking + row.rebinding + row.bridge + row.left
        assert row.printed_valid + row.printed_invalid == row.episodes
        assert row.wall_ms_50 <= row.wall_ms_95 <= row.wall_ms_99
        assert 0 <= row.repaired <= row.repaired_of_possible <= 1
    assert not any(row.domain == "all" for row in rows(result.trials))


def test_the_tables_say_what_was_left_out_and_which_plans_were_invalid(result: Study) -> None:
    """Invalid plans are named so that they can be looked at again."""
    wrong = replace(result.trials[0], valid=False)
    console = Console(width=200, highlight=False)
    with console.capture() as capture:
        console.print(tables(replace(result, trials=(wrong, *result.trials[1:]))))
    text = capture.get()
    assert "left out: fetch/p3: its goals hold already" in text
    assert "INVALID: --seed 0 --actions 1,3 --episode fetch/p1:0" in text
    assert "plans called repaired that do not reach their goals: 1" in text
    with console.capture() as capture:
        console.print(tables(replace(result, trials=())))
    assert "left out: fetch/p3" in capture.get()


def test_the_files_hold_every_trial_and_row(result: Study, tmp_path: Path) -> None:
    """One line each."""
    episodes, summary = write_study(result, tmp_path / "new")

    def lines(path: Path) -> list[dict[str, str]]:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    assert [int(line["number"]) for line in lines(episodes)] == list(range(SETTINGS.episodes))
    assert {line["kind"] for line in lines(episodes)} == {"foreign", "own", "flip"}
    assert len(lines(summary)) == len(rows(result.trials))


def test_an_episode_can_be_told(folder: Path, case: Prepared) -> None:
    """What happened, what broke, and how it ended, of repaired plans and of refused ones."""
    stories: dict[bool, list[str]] = {}
    for number in range(SETTINGS.episodes):
        episode = case.episodes.episode(number)
        stories[trial(case, episode, SETTINGS).repaired] = list(episode_story(case, episode, SETTINGS))
    assert stories[True][0].startswith("fetch/p1, episode ")
    assert stories[True][-1] == "unified-planning judges it valid"
    assert any(line.startswith("is there a plan? ") for line in stories[False])
    assert list(retold([folder], "fetch/p1:3", SETTINGS)) == list(
        episode_story(case, case.episodes.episode(3), SETTINGS)
    )


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("fetch/p1", "expected a problem and a number"),
        ("fetch:1", "expected a problem and a number"),
        ("fetch/p3:1", "its goals hold already"),
    ],
)
def test_an_episode_that_is_none_is_named(folder: Path, name: str, why: str) -> None:
    """A wrong name, or a problem that cannot be studied."""
    with pytest.raises(NoEpisodeError, match=why) as caught:
        list(retold([folder], name, SETTINGS))
    assert caught.value.name == name
