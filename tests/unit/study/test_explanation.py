"""What is said of a plan."""

import json

import pytest

from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.task import Action, Condition, parse_fact
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.study.explaining import TooFewStepsError, explain
from clo_fleet.study.explanation import GOAL, Explanation
from clo_fleet.study.explanation_text import explanation_text
from clo_fleet.study.summary import show
from clo_fleet.study.surprise import Surprise


def action(name: str, needs: str, adds: str, deletes: str = "") -> Action:
    """An action; its facts are separated by semicolons."""

    def facts(text: str) -> list[str]:
        return [fact for fact in text.split(";") if fact]

    schema, *args = name.split()
    return Action(
        schema=schema,
        args=tuple(args),
        needs=tuple(Condition(parse_fact(f"({fact})")) for fact in facts(needs)),
        adds=frozenset(parse_fact(f"({fact})") for fact in facts(adds)),
        deletes=frozenset(parse_fact(f"({fact})") for fact in facts(deletes)),
    )


def move(start: str, end: str) -> Action:
    """The paper's ``move``."""
    return action(f"move {start} {end}", f"at-robot {start}", f"at-robot {end}", f"at-robot {start}")


def prepare(item: str, room: str) -> Action:
    """The paper's ``prepare``."""
    return action(f"prepare {item} {room}", f"at-object {item} {room};at-robot {room}", f"prepared {item}")


def grasp(item: str, room: str) -> Action:
    """The paper's ``grasp``."""
    needs = f"at-object {item} {room};at-robot {room};prepared {item}"
    return action(f"grasp {item} {room}", needs, f"holding {item}", f"at-object {item} {room}")


PLAN = (
    move("l3", "l1"), prepare("o1", "l1"), grasp("o1", "l1"), move("l1", "l2"), prepare("o2", "l2"), grasp("o2", "l2"),
)  # fmt: skip
ROOMS = ("l1", "l2", "l3")
TASK = GroundTask(
    "two-objects",
    frozenset(map(parse_fact, ["(at-robot l3)", "(at-object o1 l1)", "(at-object o2 l2)"])),
    goals_of([("holding", "o1"), ("holding", "o2")]),
    tuple(
        sorted(
            {*PLAN, *(move(a, b) for a in ROOMS for b in ROOMS if a != b)},
            key=lambda action: action.name,
        )
    ),
)


def told(executed: int = 0, true: str = "", false: str = "") -> Explanation:
    """The worked example, explained; facts are separated by semicolons."""
    turned = (frozenset(parse_fact(f"({fact})") for fact in text.split(";") if fact) for text in (true, false))
    return explain(TASK, PLAN, "by hand", executed, Surprise(*turned))


def test_worked_example_is_told_as_in_the_paper() -> None:
    """Nine links on steps 1 to 6, six opportunities; what is taken from the start are guards."""
    said = told()
    assert [(row.producer, row.fact, row.consumer) for row in said.links] == [
        (1, "(at-robot l1)", 2),
        (1, "(at-robot l1)", 3),
        (1, "(at-robot l1)", 4),
        (2, "(prepared o1)", 3),
        (3, "(holding o1)", GOAL),
        (4, "(at-robot l2)", 5),
        (4, "(at-robot l2)", 6),
        (5, "(prepared o2)", 6),
        (6, "(holding o2)", GOAL),
    ]
    assert len(said.opportunities) == 6
    assert [(row.fact, row.needed_by) for row in said.guards] == [
        ("(at-object o1 l1)", (2, 3)),
        ("(at-object o2 l2)", (5, 6)),
        ("(at-robot l3)", (1,)),
    ]
    assert [row.supports for row in said.steps] == [(2, 3, 4), (3,), (GOAL,), (5, 6), (6,), (GOAL,)]
    assert said.repair is None


def test_opportunities_come_by_value_with_their_windows() -> None:
    """Holding the second object saves the way to it as well, from now until it is taken."""
    said = told(executed=1)
    assert [(row.fact, row.saves, row.saves_steps) for row in said.opportunities[:2]] == [
        ("(holding o2)", 3, 3),
        ("(holding o1)", 2, 2),
    ]
    assert [(window.first, window.last) for window in said.opportunities[0].windows] == [(2, 6)]


def test_what_helps_now_has_a_window_now() -> None:
    """A ball that is brought saves picking it up too, though its drop also frees the hand that takes the next one."""
    plan = (
        action("pick a", "free", "carry a", "free"),
        action("drop a", "carry a", "there a;free", "carry a"),
        action("pick b", "free", "carry b", "free"),
        action("drop b", "carry b", "there b;free", "carry b"),
    )
    task = GroundTask("balls", frozenset({("free",)}), goals_of([("there", "a"), ("there", "b")]), plan)
    said = explain(task, plan, "by hand", 0, Surprise())
    brought = next(row for row in said.opportunities if row.fact == "(there a)")
    assert (brought.saves_steps, [(window.first, window.last) for window in brought.windows]) == (2, [(1, 1)])


def test_handover_drops_three_steps_with_reason_and_fact() -> None:
    """After the first move the second object is handed over: the paper's repaired plan, and why."""
    said = told(executed=1, true="holding o2")
    assert said.repair is not None
    assert [(row.step, row.fate, row.because) for row in said.repair.steps] == [
        (2, "kept", ()),
        (3, "kept", ()),
        (4, "dropped", ("(holding o2)",)),
        (5, "dropped", ("(holding o2)",)),
        (6, "dropped", ("(holding o2)",)),
    ]
    assert {row.reason for row in said.repair.steps} == {"", "nothing that is left needs it"}
    assert (said.repair.cost_before, said.repair.cost_after, said.repair.means) == (5, 2, "deletion")
    assert [str(change) for change in said.repair.changes] == ["(holding o2) turned true by itself: an opportunity"]
    assert ("(holding o2)", (GOAL,)) in [(row.fact, row.needed_by) for row in said.repair.guards]


def test_added_steps_say_what_they_are_for() -> None:
    """Somebody took the robot along and gave it o2: it has to go back, and the new step is numbered on."""
    said = told(executed=1, true="at-robot l2;holding o2", false="at-robot l1;at-object o2 l2")
    assert said.repair is not None
    assert [(row.step, row.action, row.fate, row.reason) for row in said.repair.steps[:2]] == [
        (7, "move(l2, l1)", "added", "gives (at-robot l1) to 2, 3"),
        (2, "prepare(o1, l1)", "kept", ""),
    ]
    assert [row.step for row in said.repair.steps] == [7, 2, 3, 4, 5, 6]
    assert (said.repair.means, said.repair.cost_before, said.repair.cost_after) == ("bridge", 5, 3)
    assert [str(change) for change in said.repair.changes] == [
        "(at-robot l2) turned true by itself: an opportunity",
        "(holding o2) turned true by itself: an opportunity",
        "(at-object o2 l2) turned false by itself: a guard broken",
        "(at-robot l1) turned false by itself: a guard broken",
    ]


def test_refused_repair_says_what_is_missing() -> None:
    """The object is gone and no action brings it back: no repaired plan, but what lacks it."""
    said = told(executed=1, false="at-object o2 l2")
    assert said.repair is not None
    assert said.repair.refused
    assert (said.repair.steps, said.repair.cost_after, said.repair.means) == ((), None, "")
    assert [(row.fact, row.needed_by) for row in said.repair.missing] == [("(at-object o2 l2)", (5, 6))]


@pytest.mark.parametrize(
    ("true", "false", "words"),
    [
        ("prepared o2", "", "(prepared o2) turned true by itself: an opportunity"),
        ("at-object o1 l1", "", "(at-object o1 l1) was true already"),
        ("", "holding o1", "(holding o1) was false already"),
        ("at-robot l3", "", "(at-robot l3) turned true by itself: nothing that the plan relies on"),
        ("holding l3", "", "(holding l3) turned true by itself: no action that could be done before has to do with it"),
    ],
)
def test_change_is_told_with_what_the_plan_makes_of_it(true: str, false: str, words: str) -> None:
    """News or not, opportunity, broken guard or nothing."""
    said = told(executed=1, true=true, false=false)
    assert said.repair is not None
    assert [str(change) for change in said.repair.changes] == [words]


def test_needless_steps_are_no_credit_to_opportunities() -> None:
    """A detour that the planner did not need supports nothing, and no fact's value counts it."""
    plan = (move("l3", "l2"), move("l2", "l3"), *PLAN)
    said = explain(TASK, plan, "by hand", 0, Surprise())
    assert max(row.saves for row in said.opportunities) == 3
    assert all(window.first > 2 for row in said.opportunities for window in row.windows)


def test_more_steps_than_there_are_cannot_have_been_done() -> None:
    """The error says how many there are; all of them may have been done."""
    assert told(executed=6).links == ()
    with pytest.raises(TooFewStepsError, match="expected a number from 0 to 6") as caught:
        told(executed=7)
    assert (caught.value.executed, caught.value.steps) == (7, 6)


def test_json_holds_what_is_told() -> None:
    """One object of a named format; steps by number, the goal by its word."""
    said = told(executed=1, true="holding o2")
    document = json.loads(said.to_json())
    assert (document["format"], document["task"], document["executed"]) == ("clo-fleet/explanation/1", "two-objects", 1)
    assert document["links"][1] == {"producer": 3, "fact": "(holding o1)", "consumer": "goal"}
    assert [row["fate"] for row in document["repair"]["steps"]].count("dropped") == 3


def test_tables_say_all_of_it_in_order(capsys: pytest.CaptureFixture[str]) -> None:
    """Headline, plan, links, opportunities, guards, what happened, the repaired plan, the cost."""
    show(explanation_text(told(executed=1, true="holding o2")))
    printed = capsys.readouterr().out
    places = [
        printed.index(words)
        for words in (
            "two-objects: a plan of 6 steps, cost 6, by hand;\nstep 1 has been done, 5 steps left, cost 5",
            "the plan\n",
            "1  move(l3, l1)        1  done",
            "causal links",
            "4  move(l1, l2)     (at-robot l2)  5 prepare(o2, l2)",
            "opportunities",
            "(holding o2)                3                3  2-6",
            "guards",
            "(at-robot l1)      2 prepare(o1, l1); 3 grasp(o1, l1); 4 move(l1, l2)",
            "(holding o2) turned true by itself",
            "the repaired plan",
            "4  move(l1, l2)        1  dropped: nothing that is left needs it, because (holding o2) is true",
            "cost left: 5 before, 2 after; means: deletion",
        )
    ]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (told(executed=6), "causal links: none"),
        (told(executed=1, true="at-robot l3"), "the plan stays as it is"),
        (told(executed=1, false="at-object o2 l2"), "nothing brings about (at-object o2 l2) for 5 prepare(o2, l2); 6"),
    ],
)
def test_tables_say_when_there_is_nothing_to_tabulate(
    said: Explanation, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """No links, no difference, no repair."""
    show(explanation_text(said))
    assert words in capsys.readouterr().out
