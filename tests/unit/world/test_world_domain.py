"""A world's own domain: bound to skills and sensors, with every fault at its place."""

import shutil
from pathlib import Path

import pytest

from clo_fleet.study.shipped import shipped
from clo_fleet.world.binding import EVERYWHERE, SensorKind, SkillKind
from clo_fleet.world.deed_checks import deed_findings
from clo_fleet.world.domain_checks import binding_findings
from clo_fleet.world.domain_file import MAX_BYTES, fleet_binding
from clo_fleet.world.faults import FileFaultsError
from clo_fleet.world.vocabulary import Names, Vocabulary, vocabulary
from clo_fleet.world.world_file import read_world

NAMES = Names(robots=("r1", "r2"), objects=("o1",), rooms=("l1", "l2"), zones=("zone-1",), prepared=("o1",))


def written(folder: Path, world: str = "cooking", *changes: tuple[str, str]) -> Path:
    """The world with its map and its domain in a folder, after changes to the world file or else to its domain."""
    for part in ("maps", "worlds"):
        shutil.copytree(shipped(part), folder / part)
    paths = folder / "worlds" / f"{world}.yaml", folder / "worlds" / f"{world}.pddl"
    for old, new in changes:
        path = next(path for path in paths if old in path.read_text(encoding="utf-8"))
        path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    return paths[0]


def faults(path: Path) -> list[str]:
    """The faults of the world, with the files' bare names."""
    with pytest.raises(FileFaultsError) as error:
        read_world(path)
    return [str(fault).removeprefix(f"{path.parent}/") for fault in error.value.faults]


def test_the_fleets_own_domain_is_bound_as_any_other() -> None:
    """Nothing in it is at fault, and its words are those of the file."""
    binding = fleet_binding()
    assert list(binding_findings(binding, NAMES)) == []
    words = Vocabulary(binding, NAMES)
    assert list(deed_findings(binding, words)) == []
    assert words.facts(SensorKind.PLACE, "r1", "zone-1") == (("at-robot", "r1", "zone-1"),)
    assert words.read(("holding", "r1", "o1"), SensorKind.HOLDING) == ("r1", "o1")
    assert words.beginning == {("prepared", "o1")}
    assert words.domain.exogenous == {"meets"}


def test_a_domain_of_its_own_is_read_with_its_world() -> None:
    """Types are dealt out, costs are put in, and facts that never change are told from effects."""
    world = read_world(shipped("worlds") / "cooking.yaml")
    words = vocabulary(world)
    assert dict(words.types)["ingredient"] == ("egg", "leek", "pumpkin")
    assert words.domain.schemas[0].cost == ("move-time", "?a", "?b")
    assert ("cut-of", "egg", "n0", "n1") in words.given
    assert words.beginning == {("has-cut", name, "n0") for name in ("egg", "leek", "pumpkin")}
    assert words.duration("cut", world.skills) == 4.0
    assert words.duration("get", world.skills) == world.skills.grasp
    assert words.schemas(SkillKind.GRASP)[0].name == "get"
    assert words.seen_at(("has-cut", "egg", "n0")) == "egg"
    assert words.seen_at(("at-robot", "c1", "l1")) == ""


def test_arguments_may_stand_in_any_order(tmp_path: Path) -> None:
    """Roles are bound by the names of parameters, not by where they stand."""
    turned = [("(at-robot ?r - robot ?l - room)", "(at-robot ?l - room ?r - robot)")]
    path = written(tmp_path, "dialog", *turned)
    pddl = path.with_suffix(".pddl")
    text = pddl.read_text(encoding="utf-8")
    for place in ("a", "b", "l"):
        text = text.replace(f"(at-robot ?r ?{place})", f"(at-robot ?{place} ?r)")
    pddl.write_text(text, encoding="utf-8")
    words = vocabulary(read_world(path))
    assert words.facts(SensorKind.PLACE, "r1", "l3") == (("at-robot", "l3", "r1"),)
    assert words.read(("at-robot", "l3", "r1"), SensorKind.PLACE) == ("r1", "l3")


def test_who_sees_an_effect_is_everybody_if_nothing_is_said(tmp_path: Path) -> None:
    """`seen` may be left out."""
    words = vocabulary(read_world(written(tmp_path, "cooking", ("{sensor: effects, seen: i}", "{sensor: effects}"))))
    assert words.seen_at(("has-cut", "egg", "n0")) == EVERYWHERE


@pytest.mark.parametrize(
    ("old", "new", "start", "words"),
    [
        # the file
        ("file: cooking.pddl", "file: none.pddl", "cooking.yaml:7:3: domain.file: got 'none.pddl'", "that exists"),
        ("file: cooking.pddl", "file: ../cooking.pddl", "cooking.yaml:7:3: domain.file: got", "folder or below"),
        ("file: cooking.pddl", "file: /etc/passwd", "cooking.yaml:7:3: domain.file: got", "folder or below"),
        ("file: cooking.pddl", "file: hello.yaml", "cooking.yaml:7:3: domain.file: got 'hello.yaml'", "(.pddl)"),
        ("  file: cooking.pddl\n", "", "cooking.yaml:6:1: domain.file: got nothing", "required"),
        (
            ":effect (has-cut ?i ?m)))",
            ":effect (has-cut ?i ?x)))",
            "cooking.pddl:31:3: (the file): got '(:action cut'",
            "?x",
        ),
        ("(:requirements", "(:durative", "cooking.pddl:4:3: (the file): got", ":durative is not supported"),
        (":effect (has-cut ?i ?m)))", ":effect (has-cut ?i ?m))", "cooking.pddl:3:1: (the file): got", "never closed"),
        # types
        (
            "    amount: [",
            "    amounts: [",
            "cooking.yaml:12:5: domain.types.amounts: got 'amounts'",
            "did you mean amount?",
        ),
        ("    amount: [", "    room2: [", "cooking.yaml:8:3: domain.types: got none for amount", "every type"),
        ("amount: [n0,", "amount: [n0, n0,", "cooking.yaml:12:5: domain.types.amount", "each name once"),
        ("room: rooms", "room: corridors", "cooking.yaml:10:5: domain.types.room: got 'corridors'", "robots, objects"),
        (
            "ingredient: objects",
            "ingredient: [egg, leek]",
            "cooking.yaml:45:3: objects.pumpkin: got none",
            "a type for",
        ),
        ("ingredient: objects", "ingredient: robots", "cooking.yaml:11:5: domain.types.ingredient", "a list of names"),
        # skills
        ("    cut: {", "    cutt: {", "cooking.yaml:17:5: domain.skills.cutt: got 'cutt'", "did you mean cut?"),
        ("    cut: {", "    cutt: {", "cooking.yaml:13:3: domain.skills: got none for cut", "every action"),
        ("skill: work", "skill: chop", "cooking.yaml:17:11: domain.skills.cut.skill: got 'chop'", "'work'"),
        (
            "skill: work, robot: r,",
            "skill: work,",
            "cooking.yaml:17:5: domain.skills.cut.robot: got nothing",
            "required",
        ),
        (
            "at: i, in: l, takes_s",
            "at: x, in: l, takes_s",
            "cooking.yaml:17:34: domain.skills.cut.at: got 'x'",
            "(r, i, n, m, l)",
        ),
        (
            "at: i, in: l, takes_s",
            "at: n, in: l, takes_s",
            "cooking.yaml:17:34: domain.skills.cut.at: got 'n'",
            "amount has n0",
        ),
        ("takes_s: 4", "takes: 4", "cooking.yaml:17:48: domain.skills.cut.takes: got 4", "did you mean takes_s?"),
        ("takes_s: 4", "takes_s: -4", "cooking.yaml:17:48: domain.skills.cut.takes_s: got -4", "at least 0"),
        # what may come along
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i ?x)}]}",
            "cooking.yaml:17:71: domain.skills.cut.may_also[0].chance: got nothing",
            "required",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i ?x), chance: 1.5}]}",
            "cooking.yaml:17:",
            "domain.skills.cut.may_also[0].chance: got 1.5, expected a number of at most 1",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cat ?i ?x), chance: 1}]}",
            "cooking.yaml:17:",
            "did you mean has-cut?",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i), chance: 1}]}",
            "cooking.yaml:17:",
            "(has-cut OBJECT AMOUNT)",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i n9), chance: 1}]}",
            "cooking.yaml:17:",
            "for 'n9' a name of type amount",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?l ?m), chance: 1}]}",
            "cooking.yaml:17:",
            "for ?l a parameter that stands for something of type ingredient, not room",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has ?r ?i), chance: 1}]}",
            "cooking.yaml:17:",
            "one of (has-cut OBJECT AMOUNT)",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i ?x), chance: 1, by: x}]}",
            "cooking.yaml:17:",
            "one of the action's parameters in the PDDL file (r, i, n, m, l)",
        ),
        (
            "takes_s: 4}",
            "takes_s: 4, may_also: [{fact: (has-cut ?i ?x), chance: 1, where: [(has-cut ?i ?x)]}]}",
            "cooking.yaml:17:",
            "domain.skills.cut.may_also[0].where[0]: got '(has-cut ?i ?x)', expected one of (kitchen ROOM), (cut-of",
        ),
        # sensors
        (
            "    kitchen: {sensor: given}\n",
            "",
            "cooking.yaml:18:3: domain.sensors: got none for kitchen",
            "every predicate",
        ),
        (
            "{sensor: given}",
            "{sensor: told}",
            "cooking.yaml:21:15: domain.sensors.kitchen.sensor: got 'told'",
            "'given'",
        ),
        (
            "place: l}\n    has",
            "place: r}\n    has",
            "cooking.yaml:23:",
            "one of its parameters in the PDDL file (i, l)",
        ),
        (
            "object: i, place: l}",
            "object: l, place: l}",
            "cooking.yaml:23:5: domain.sensors.at-ingredient: got ?i in 0",
            "roles",
        ),
        (
            "seen: i}",
            "seen: n}",
            "cooking.yaml:26:32: domain.sensors.has-cut.seen: got 'n'",
            "robots, objects or rooms",
        ),
        ("seen: i}", "seen: q}", "cooking.yaml:26:32: domain.sensors.has-cut.seen: got 'q'", "one of its parameters"),
        (
            "kitchen: {sensor: given}",
            "kitchen: {sensor: room, place: l}",
            "cooking.yaml:28:7: domain.facts[0]",
            "one of (cut-of",
        ),
        (
            "has-cut: {sensor: effects, seen: i}",
            "has-cut: {sensor: given}",
            "cooking.yaml:26:15: domain.sensors.has-cut.sensor",
            "cut does",
        ),
        # facts
        (
            "(kitchen l2)",
            "(kitchen l9)",
            "cooking.yaml:29:7: domain.facts[1]: got '(kitchen l9)'",
            "for 'l9' the name of a room",
        ),
        (
            "(kitchen l2)",
            "(kitchen n2)",
            "cooking.yaml:29:7: domain.facts[1]: got '(kitchen n2)'",
            "the name of a room",
        ),
        (
            "(cut-of leek n0 n1)",
            "(cut-of leek n0)",
            "cooking.yaml:35:7: domain.facts[7]",
            "(cut-of OBJECT AMOUNT AMOUNT)",
        ),
        (
            "(cut-of leek n0 n1)",
            "(cut-of leek n0 n9)",
            "cooking.yaml:35:7: domain.facts[7]",
            "for 'n9' a name of type amount",
        ),
        ("(cut-of leek n0 n1)", "(cut-off leek n0 n1)", "cooking.yaml:35:7: domain.facts[7]", "did you mean cut-of?"),
        ("(kitchen l2)", "(at-robot c1 l2)", "cooking.yaml:29:7: domain.facts[1]", "one of (kitchen ROOM)"),
        # goals and objects
        (
            "(has-cut leek n1)]",
            "(has-cut leek n7)]",
            "cooking.yaml:42:",
            "for 'n7' a name of type amount (n0, n1, n2, n3, n4, n5)",
        ),
        ("(has-cut leek n1)]", "(kitchen l1)]", "cooking.yaml:42:", "(has-cut OBJECT AMOUNT)"),
        ("mass_kg: 0.06}", "prepared: true}", "cooking.yaml:47:", "no effect (prepared egg)"),
        # what the actions say
        ("(self ?r) (kitchen ?l)", "(kitchen ?l)", "cooking.yaml:17:5: domain.skills.cut: got none such", "(self ?r)"),
        ("(cut-of ?i ?n ?m) (has-cut ?i ?n))", "(has-cut ?i ?n))", "", ""),
        ("(self ?r) (way ?a ?b)", "(self ?r)", "cooking.yaml:14:5: domain.skills.move: got none such", "(way ?a ?b)"),
        (
            "(not (at-robot ?r ?a)) ",
            "",
            "cooking.yaml:14:5: domain.skills.move: got none",
            "the effect not (at-robot ?r ?a)",
        ),
        (
            "(and (has ?r ?i) (not",
            "(and (not",
            "cooking.yaml:15:5: domain.skills.get: got none",
            "the effect (has ?r ?i)",
        ),
        (
            ":effect (has-cut ?i ?m)",
            ":effect (has ?r ?i)",
            "cooking.yaml:17:5: domain.skills.cut: got work",
            "(has ?r ?i)",
        ),
        (
            "(:predicates",
            "(:functions (total-cost) (f ?x - robot)) (:predicates",
            "",
            "",
        ),
    ],
)
def test_a_fault_of_a_binding_is_told_with_its_place(
    tmp_path: Path, old: str, new: str, start: str, words: str
) -> None:
    """Of the world file or the PDDL file, with line, column, key, value and what was expected."""
    path = written(tmp_path, "cooking", (old, new))
    if not start:
        read_world(path)
        return
    found = [fault for fault in faults(path) if fault.startswith(start) and words in fault]
    assert found, faults(path)


def test_a_large_pddl_file_is_refused_unread(tmp_path: Path) -> None:
    """Files come from strangers."""
    path = written(tmp_path, "cooking")
    path.with_suffix(".pddl").write_text(";" * (MAX_BYTES + 1), encoding="utf-8")
    assert "at most 1 MB" in faults(path)[0]


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    """Whatever its name: a world's domain lies beside the world or below."""
    path = written(tmp_path, "cooking")
    shutil.move(path.with_suffix(".pddl"), tmp_path / "cooking.pddl")
    path.with_suffix(".pddl").symlink_to(tmp_path / "cooking.pddl")
    assert "a PDDL file (.pddl) that exists" in faults(path)[0]


def test_costs_that_the_domain_writes_itself_must_be_travel_and_durations(tmp_path: Path) -> None:
    """A number will do as well; what has other parameters is refused."""
    plain = ("(:action move", "(:functions (total-cost) (way-time ?a ?b - room))\n  (:action move")
    costly = ("(at-robot ?r ?b)))", "(at-robot ?r ?b) (increase (total-cost) (way-time ?a ?b))))")
    words = vocabulary(read_world(written(tmp_path / "sound", "dialog", plain, costly)))
    assert [schema.cost for schema in words.domain.schemas] == [("way-time", "?a", "?b"), 0]
    turned = (costly[0], costly[1].replace("?a ?b)", "?b ?a)"))
    assert "(NAME ?a ?b)" in faults(written(tmp_path / "faulty", "dialog", plain, turned))[0]
