"""Which facts may come along with an action, as a binding says it with a pattern."""

import shutil
from pathlib import Path

import pytest

from clo_fleet.clo.task import Action, parse_fact
from clo_fleet.study.shipped import shipped
from clo_fleet.world.binding import MayAlso
from clo_fleet.world.may_also import may_also_facts
from clo_fleet.world.vocabulary import vocabulary
from clo_fleet.world.world_file import read_world

WORDS = vocabulary(read_world(shipped("worlds") / "cooking.yaml"))
CUT = Action(
    schema="cut", args=("c1", "leek", "n0", "n1", "l1"), needs=(), adds=frozenset(), deletes=frozenset()
)  # parameters ?r ?i ?n ?m ?l


def may(fact: str, *where: str) -> list[str]:
    """The facts of a rule for a cut of the leek."""
    rule = MayAlso(parse_fact(fact), 0.5, "?r", tuple(map(parse_fact, where)))
    return [" ".join(found[1:]) for found in may_also_facts(rule, CUT, WORDS)]


@pytest.mark.parametrize(
    ("fact", "where", "expected"),
    [
        ("(has-cut ?i n2)", (), ["leek n2"]),
        ("(has-cut ?i ?m)", (), ["leek n1"]),
        ("(has-cut ?i ?more)", (), [f"leek n{n}" for n in range(6)]),
        ("(has-cut ?other n1)", (), ["egg n1", "leek n1", "pumpkin n1"]),
        ("(has-cut ?i ?more)", ("(cut-of ?i ?m ?more)",), ["leek n2"]),
        ("(has-cut ?i ?last)", ("(cut-of ?i ?m ?more)", "(cut-of ?i ?more ?last)"), []),
        ("(has-cut ?other ?last)", ("(cut-of ?other ?m ?x)", "(cut-of ?other ?x ?last)"), ["pumpkin n3"]),
        ("(has-cut ?l ?m)", (), []),
        ("(has-cut ?i n1)", ("(kitchen ?l)",), ["leek n1"]),
        ("(has-cut ?i n1)", ("(kitchen l3)",), []),
    ],
)
def test_a_pattern_stands_for_these_facts(fact: str, where: tuple[str, ...], expected: list[str]) -> None:
    """Parameters are the action's; other variables are anything that fits the type and the given facts."""
    assert may(fact, *where) == expected


@pytest.mark.parametrize(("written", "by"), [("", "?r"), (", by: p", "?p"), (', by: "?q"', "?q")])
def test_who_did_it_is_the_robot_if_nothing_is_said(written: str, by: str, tmp_path: Path) -> None:
    """`by` may be left out, and so may the question mark of what it names."""
    for part in ("maps", "worlds"):
        shutil.copytree(shipped(part), tmp_path / part)
    path = tmp_path / "worlds" / "dialog.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace(", by: p}", f"{written}}}"), encoding="utf-8")
    rules = vocabulary(read_world(path)).may_also("ask")
    assert rules == (MayAlso(("answered", "?p", "?other"), 0.2, by),)
