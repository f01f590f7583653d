"""``clo-fleet explain``, with the real planner: the paper's worked example, and domains of the competitions."""

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from clo_fleet.cli import main

DOMAIN = """
(define (domain rooms)
  (:requirements :strips :typing)
  (:types room item)
  (:predicates (at-robot ?l - room) (at-object ?o - item ?l - room) (prepared ?o - item) (holding ?o - item)
    (lit ?l - room))
  (:action move
    :parameters (?a ?b - room)
    :precondition (and (at-robot ?a) (lit ?b))
    :effect (and (not (at-robot ?a)) (at-robot ?b)))
  (:action prepare
    :parameters (?o - item ?l - room)
    :precondition (and (at-object ?o ?l) (at-robot ?l))
    :effect (prepared ?o))
  (:action grasp
    :parameters (?o - item ?l - room)
    :precondition (and (at-object ?o ?l) (at-robot ?l) (prepared ?o))
    :effect (and (holding ?o) (not (at-object ?o ?l)))))
"""
PROBLEM = """
(define (problem two-objects)
  (:domain rooms)
  (:objects l1 l2 l3 - room o1 o2 - item)
  (:init (at-robot l3) (at-object o1 l1) (at-object o2 l2) (lit l1) (lit l2) (lit l3))
  (:goal (and (holding o1) (holding o2))))
"""
PLAN = """; as in the paper
(move l3 l1)
(prepare o1 l1)
(grasp o1 l1)
(move l1 l2)
(prepare o2 l2)
(grasp o2 l2)
"""
FOREIGN = Path(__file__).resolve().parents[3] / "shared" / "pddl"
Printed = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The worked example in files, and us among them."""
    for name, text in (("rooms.pddl", DOMAIN), ("two.pddl", PROBLEM), ("two.plan", PLAN)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def explained(*arguments: str) -> int:
    """The exit code of the command for the worked example with its plan."""
    return main(["explain", "rooms.pddl", "two.pddl", "--plan", "two.plan", *arguments])


def test_worked_example_is_explained_from_the_planner_to_the_repaired_plan(folder: Path) -> None:
    """Typed as a user types it: Fast Downward plans, the object is handed over after step 1, three steps go."""
    words = ["explain", "rooms.pddl", "two.pddl", "--after", "1", "--true", "(holding o2)", "--graph", "two.svg"]
    done = subprocess.run(
        [sys.executable, "-m", "clo_fleet.cli", *words],
        cwd=folder, capture_output=True, text=True, timeout=110, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "two-objects: a plan of 6 steps, cost 6, by Fast Downward (lama-first);" in done.stdout
    assert "(holding o2) turned true by itself: an opportunity" in done.stdout
    assert done.stdout.count("dropped: nothing that is left needs it, because (holding o2) is true") == 3
    assert done.stdout.endswith("cost left: 5 before, 2 after; means: deletion\n")
    tree = ElementTree.parse(folder / "two.svg").getroot()
    assert tree.tag == "{http://www.w3.org/2000/svg}svg"


def test_json_is_one_document(capsys: Printed) -> None:
    """``--json`` prints what the tables say, and nothing else."""
    assert explained("--after", "1", "--true", "(holding o2)", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert document["format"] == "clo-fleet/explanation/1"
    assert document["source"] == "from two.plan"
    assert document["opportunities"][0] == {
        "fact": "(holding o2)",
        "saves": 3,
        "saves_steps": 3,
        "windows": [{"first": 2, "last": 6}],
    }
    assert (document["repair"]["cost_before"], document["repair"]["cost_after"]) == (5, 2)


def test_without_a_surprise_there_is_only_analysis(capsys: Printed) -> None:
    """Nine links; no repaired plan; the same text every time."""
    assert explained() == 0
    first = capsys.readouterr().out
    assert "repaired" not in first
    assert first.count("(at-robot l1)  ") == 4  # three links and the opportunity
    assert explained() == 0
    assert capsys.readouterr().out == first


def test_several_facts_are_one_observation(capsys: Printed) -> None:
    """The robot was carried to the other room: it fell out of one and is in the other at once."""
    assert explained("--after", "1", "--true", "(at-robot l2)", "--false", "(at-robot l1)") == 0
    printed = capsys.readouterr().out
    assert "added: gives (at-robot l1) to 2, 3, 4" in printed
    assert "means: bridge" in printed


def test_repair_that_is_refused_is_another_outcome(capsys: Printed) -> None:
    """The object is gone: exit code 1, and what is missing."""
    assert explained("--after", "1", "--false", "(at-object o2 l2)") == 1
    assert "nothing brings about (at-object o2 l2) for 5 prepare(o2, l2); 6 grasp(o2, l2)" in capsys.readouterr().out


def test_problem_without_a_plan_is_another_outcome(folder: Path, capsys: Printed) -> None:
    """The planner proves that there is none: exit code 1, no traceback, no picture."""
    (folder / "two.pddl").write_text(PROBLEM.replace("(lit l2)", ""), encoding="utf-8")
    assert main(["explain", "rooms.pddl", "two.pddl", "--graph", "two.svg"]) == 1
    assert "Fast Downward found no plan: it has proved that there is none" in capsys.readouterr().err
    assert not (folder / "two.svg").exists()


def test_picture_is_overwritten_only_when_told_to(folder: Path, capsys: Printed) -> None:
    """As with runs: ``--force``."""
    (folder / "two.svg").write_text("mine", encoding="utf-8")
    assert explained("--graph", "two.svg") == 2
    assert "--force" in capsys.readouterr().err
    assert (folder / "two.svg").read_text(encoding="utf-8") == "mine"
    assert explained("--graph", "two.svg", "--force") == 0
    assert (folder / "two.svg").read_text(encoding="utf-8").startswith("<svg")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--true", "(hodling o2)"), "did you mean holding?"),
        (("--true", "(holding o3)"), "unknown object o3; expected one of l1, l2, l3, o1, o2"),
        (("--true", "holding o2"), "expected one fact such as"),
        (("--false", "(lit l2)"), "lit is static"),
        (("--true", "(holding o2)", "--false", "(holding o2)"), "both true and false"),
        (("--after", "7"), "expected a number from 0 to 6"),
        (("--plan", "rooms.pddl"), "rooms.pddl:2:1: step 1: got"),
        (("--plan", "none.plan"), "none.plan"),
        (("--graph", "nowhere/two.svg"), "there is no such folder"),
    ],
)
def test_bad_input_is_refused_with_what_was_expected(capsys: Printed, arguments: tuple[str, ...], says: str) -> None:
    """Exit code 2, nothing printed but the reason."""
    assert explained(*arguments) == 2
    printed = capsys.readouterr()
    assert says in printed.err
    assert printed.out == ""


@pytest.mark.skipif(not FOREIGN.exists(), reason=f"needs the competition's domains in {FOREIGN}")
@pytest.mark.parametrize(
    ("domain", "problem", "surprise", "says"),
    [
        ("gripper", "prob01", "(at ball4 roomb)", "dropped: nothing that is left needs it, because (at ball4 roomb)"),
        ("miconic-simpleadl", "s1-0", "(served p0)", "because (served p0) is true"),
        ("logistics00", "probLOGISTICS-4-0", "(at obj11 apt1)", "(at obj11 apt1) turned true by itself"),
    ],
)
def test_problems_that_others_wrote_are_explained(
    domain: str, problem: str, surprise: str, says: str, capsys: Printed
) -> None:
    """Old and untyped domains, conditional effects, and names that readers stumble over."""
    files = [str(FOREIGN / domain / f"{name}.pddl") for name in ("domain", problem)]
    assert main(["explain", *files, "--true", surprise, "--graph", "graph.svg"]) == 0
    printed = capsys.readouterr().out
    assert says in printed
    assert "the repaired plan" in printed
    ElementTree.parse("graph.svg")
