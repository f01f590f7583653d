"""The picture of a plan's links."""

import re
from itertools import combinations, pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

from clo_fleet.clo.plan import goals_of
from clo_fleet.clo.task import Action, Condition, Fact
from clo_fleet.planning.ground_task import GroundTask
from clo_fleet.study.causal_graph import GraphFileError, causal_graph, check_place, write_graph
from clo_fleet.study.explaining import explain
from clo_fleet.study.explanation import Explanation
from clo_fleet.study.surprise import Surprise

SVG = "{http://www.w3.org/2000/svg}"
NOTHING = Surprise()


def action(name: str, needs: list[Fact], adds: Fact) -> Action:
    """An action that makes one fact true."""
    conditions = tuple(map(Condition, needs))
    return Action(schema=name, args=(adds[-1],), needs=conditions, adds=frozenset({adds}), deletes=frozenset())


def chain(steps: int, surprise: Surprise = NOTHING, executed: int = 0, name: str = "light") -> Explanation:
    """Lamps lit one from the other; every third step also needs the one before that, and the floor swept."""
    plan = []
    for i in range(1, steps + 1):
        needs: list[Fact] = [("lit", str(i - 1))]
        if i % 3 == 0:
            needs += [("lit", str(i - 3)), ("swept",)]
        plan.append(action(name, needs, ("lit", str(i))))
    goals = goals_of([("lit", str(steps)), ("swept",)])
    start: frozenset[Fact] = frozenset({("lit", "0"), ("swept",)})
    task = GroundTask("lamps", start, goals, tuple(sorted(plan, key=lambda step: step.args)))
    return explain(task, plan, "by hand", executed, surprise)


def drawn(explanation: Explanation) -> ElementTree.Element:
    """The picture as a tree."""
    return ElementTree.fromstring(causal_graph(explanation))


def texts(tree: ElementTree.Element, kind: str | None = None) -> list[str]:
    """The texts of the picture, all or those of one class."""
    return [text.text or "" for text in tree.iter(f"{SVG}text") if kind is None or text.get("class") == kind]


def titles(tree: ElementTree.Element) -> list[str]:
    """What is told where one points at something."""
    return [title.text or "" for title in tree.iter(f"{SVG}title")]


def test_steps_links_guards_and_ends_are_drawn() -> None:
    """A name a step, a label at both ends of a link and at each guard, now, the goal, and what is drawn how."""
    tree = drawn(chain(3))
    assert texts(tree, "name") == ["1 light(1)", "2 light(2)", "3 light(3)"]
    assert texts(tree, "end-name") == ["now", "goal"]
    assert texts(tree).count("(lit 1)") == 2  # where it is made, and where it is needed
    assert texts(tree).count("(lit 0)") == 2  # a guard of steps 1 and 3
    assert texts(tree).count("(swept)") == 2  # a guard of step 3 and of the goal
    assert "(lit 1) from step 1 for 2; saves 1 if it turns true now" in titles(tree)
    assert len(list(tree.iter(f"{SVG}polygon"))) == 2 + 1 + 2 + 2 + 1  # arrows: guards, links, goals, legend
    assert texts(tree)[-1] == "gives what the other needs"


def test_dropped_steps_are_struck_out_with_the_reason() -> None:
    """A lamp lit by somebody else: what lit the lamps before it is dropped, and now takes its place."""
    tree = drawn(chain(4, Surprise(true=frozenset({("lit", "3")}))))
    assert texts(tree, "name faint") == ["1 light(1)", "2 light(2)", "3 light(3)"]
    assert [path.get("class") for path in tree.iter(f"{SVG}path")].count("edge strike") == 3
    assert any(
        title == "step 2: light(2), cost 1; dropped: nothing that is left needs it, because of (lit 3)"
        for title in titles(tree)
    )
    assert "(lit 3) turned true by itself: an opportunity" in texts(tree)
    assert texts(tree, "good") == ["(lit 3)", "gives it instead"]


def test_steps_done_and_steps_added_are_marked() -> None:
    """A step that is done is a line of grey text; a new one has a plus and a strong frame."""
    # the other news is needed: a repair that leads back into the state before is refused
    tree = drawn(chain(6, Surprise(frozenset({("lit", "5")}), frozenset({("lit", "2")})), executed=2))
    assert "1 light(1) (done)" in texts(tree, "faint")
    assert "+ 7 light(2)" in texts(tree, "name")
    assert [box.get("class") for box in tree.iter(f"{SVG}rect")].count("box new") == 1
    assert "step 7: light(2), cost 1; added: gives (lit 2) to 3" in titles(tree)


def test_what_is_missing_is_marked_when_there_is_no_repair() -> None:
    """The floor is not swept any more, and no action sweeps it."""
    tree = drawn(chain(3, Surprise(false=frozenset({("swept",)}))))
    assert texts(tree, "bad") == ["(swept)", "(swept)", "needed, and nothing makes it true"]
    assert texts(tree, "name") == ["1 light(1)", "2 light(2)", "3 light(3)"]


@pytest.mark.parametrize(
    "explanation",
    [
        chain(0),
        chain(6),
        chain(6, Surprise(true=frozenset({("lit", "4"), ("lit", "2")})), executed=1),
        chain(120),
        chain(120, Surprise(true=frozenset({("lit", "50")}), false=frozenset({("lit", "20")})), executed=20),
        chain(6, name="a-name-that-goes-on-and-on-much-longer-than-anybody-wants-to-read-it-in-a-picture"),
    ],
    ids=["none", "six", "surprise", "many", "many with a surprise", "long"],
)
def test_no_text_covers_another_and_all_are_on_the_sheet(explanation: Explanation) -> None:
    """Whatever the plan: every label has a place of its own, and steps have too."""
    tree = drawn(explanation)
    width, height = float(tree.get("width", 0)), float(tree.get("height", 0))
    spots = []
    for text in tree.iter(f"{SVG}text"):
        x, y = float(text.get("x", 0)), float(text.get("y", 0))
        wide = float(text.get("textLength", 9 * len(text.text or "")))
        left = x - wide / 2 if text.get("text-anchor") == "middle" else x
        assert left >= 0
        assert left + wide <= width
        assert 12 <= y <= height
        spots.append((left, left + wide, y - 10, y + 2))
    for one, other in combinations(spots, 2):
        assert one[1] <= other[0] or other[1] <= one[0] or one[3] <= other[2] or other[3] <= one[2]
    boxes = sorted(
        (float(box.get("y", 0)), float(box.get("height", 0)))
        for box in tree.iter(f"{SVG}rect")
        if (box.get("class") or "").startswith("box")
    )
    assert all(top + tall < below for (top, tall), (below, _) in pairwise(boxes))


def test_lanes_are_shared_and_never_by_two_facts_at_one_height() -> None:
    """A hundred and twenty steps need few lanes, and a line stands for one fact only."""
    tree = drawn(chain(120))
    taken: dict[str, list[tuple[float, float]]] = {}
    for path in tree.iter(f"{SVG}path"):
        if path.get("class") == "edge":
            turns = re.findall(r"Q([\d.]+) ([\d.]+) [\d.]+ [\d.]+V([\d.]+)Q[\d.]+ ([\d.]+)", path.get("d", ""))
            if turns:
                heights = [float(height) for turn in turns for height in (turn[1], turn[3])]
                taken.setdefault(turns[0][0], []).append((min(heights), max(heights)))
    assert 1 < len(taken) < 5
    for spans in taken.values():
        spans.sort()
        assert all(end < start for (_, end), (start, _) in pairwise(spans))


def test_strange_names_stay_text() -> None:
    """Nothing in a name is markup, and what no XML file may hold is replaced."""
    tree = drawn(chain(2, name="<b>&\"'\x07"))
    assert texts(tree, "name") == ["1 <b>&\"'\N{REPLACEMENT CHARACTER}(1)", "2 <b>&\"'\N{REPLACEMENT CHARACTER}(2)"]


def test_every_colour_has_a_dark_form() -> None:
    """The same rules for a light and for a dark page, with other colours."""
    style = drawn(chain(1)).findtext(f"{SVG}style") or ""
    light, dark = style.split("@media (prefers-color-scheme: dark)")
    rules = [re.findall(r"^ *(\S.*) \{ (fill|stroke): (#\w+); \}$", part, re.MULTILINE) for part in (light, dark)]
    assert rules[0]
    assert [rule[:2] for rule in rules[0]] == [rule[:2] for rule in rules[1]]
    assert all(one[2] != other[2] for one, other in zip(*rules, strict=True))


def test_many_changes_are_counted() -> None:
    """Above the picture stand the first few."""
    facts = frozenset(("swept", str(i)) for i in range(20))
    assert "and 12 more" in texts(drawn(chain(1, Surprise(true=facts))))


def test_picture_is_written_only_where_it_can_be(tmp_path: Path) -> None:
    """A file is overwritten only if that is said, a folder never; a folder that is not there is named."""
    path = tmp_path / "graph.svg"
    check_place(path)
    write_graph(chain(2), path)
    assert path.read_text(encoding="utf-8") == causal_graph(chain(2))
    assert [file.name for file in tmp_path.iterdir()] == ["graph.svg"]
    with pytest.raises(GraphFileError, match="--force"):
        check_place(path)
    check_place(path, overwrite=True)
    with pytest.raises(GraphFileError, match="exists already"):
        check_place(tmp_path, overwrite=True)
    with pytest.raises(GraphFileError, match="no such folder") as caught:
        check_place(tmp_path / "nowhere" / "graph.svg")
    assert caught.value.path == tmp_path / "nowhere" / "graph.svg"
