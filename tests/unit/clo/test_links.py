"""Causal links: the table of the paper's example, and what the paper's rule gets wrong."""

from clo_fleet.clo.links import End, Guard, Link, Links, Unsupported, causal_links
from clo_fleet.clo.plan import goals_of, number
from clo_fleet.clo.task import Action, Condition, Fact, fact_text, parse_fact


def facts(*texts: str) -> frozenset[Fact]:
    """The facts that the texts write."""
    return frozenset(map(parse_fact, texts))


def act(name: str, *, needs: str = "", lacks: str = "", adds: str = "", deletes: str = "") -> Action:
    """The action ``name``; each effect and condition is one fact without objects, split by blanks."""
    return Action(
        schema=name,
        args=(),
        needs=(
            *(Condition((fact,)) for fact in needs.split()),
            *(Condition((fact,), positive=False) for fact in lacks.split()),
        ),
        adds=frozenset((fact,) for fact in adds.split()),
        deletes=frozenset((fact,) for fact in deletes.split()),
    )


def move(start: str, end: str) -> Action:
    """Go from room to room."""
    here, there = ("at-robot", start), ("at-robot", end)
    return Action(
        schema="move",
        args=(start, end),
        needs=(Condition(here),),
        adds=frozenset({there}),
        deletes=frozenset({here}),
    )


def prepare(item: str, room: str) -> Action:
    """Make the object ready to be grasped."""
    needs = goals_of([("at-object", item, room), ("at-robot", room)])
    return Action(
        schema="prepare", args=(item, room), needs=needs, adds=frozenset({("prepared", item)}), deletes=frozenset()
    )


def grasp(item: str, room: str) -> Action:
    """Take the prepared object."""
    lies = ("at-object", item, room)
    return Action(
        schema="grasp",
        args=(item, room),
        needs=goals_of([lies, ("at-robot", room), ("prepared", item)]),
        adds=frozenset({("holding", item)}),
        deletes=frozenset({lies}),
    )


START = facts("(at-robot l3)", "(at-object o1 l1)", "(at-object o2 l2)")
GOALS = goals_of([("holding", "o1"), ("holding", "o2")])
PLAN = number(
    [
        move("l3", "l1"),
        prepare("o1", "l1"),
        grasp("o1", "l1"),
        move("l1", "l2"),
        prepare("o2", "l2"),
        grasp("o2", "l2"),
    ],
    first=1,
)


def table(found: Links) -> list[tuple[int, str, int | End]]:
    """The links as the paper prints them."""
    return sorted(((k.producer, str(k.condition), k.consumer) for k in found.links), key=str)


def test_links_of_the_example_are_those_of_the_paper() -> None:
    """Borrajo and Veloso 2024, Table II: nine links on six steps."""
    assert table(causal_links(START, PLAN, GOALS)) == [
        (1, "(at-robot l1)", 2),
        (1, "(at-robot l1)", 3),
        (1, "(at-robot l1)", 4),
        (2, "(prepared o1)", 3),
        (3, "(holding o1)", End.GOAL),
        (4, "(at-robot l2)", 5),
        (4, "(at-robot l2)", 6),
        (5, "(prepared o2)", 6),
        (6, "(holding o2)", End.GOAL),
    ]


def test_opportunities_of_the_example_are_those_of_the_paper() -> None:
    """Its six facts, each to turn true."""
    assert causal_links(START, PLAN, GOALS).opportunities == {
        Condition(parse_fact(text))
        for text in (
            "(at-robot l1)",
            "(prepared o1)",
            "(holding o1)",
            "(at-robot l2)",
            "(prepared o2)",
            "(holding o2)",
        )
    }


def test_guards_are_what_the_plan_takes_from_now() -> None:
    """Where the robot starts and where the objects lie: the paper watches none of these."""
    found = causal_links(START, PLAN, GOALS)
    assert [(str(guard.condition), guard.consumer) for guard in found.guards] == [
        ("(at-robot l3)", 1),
        ("(at-object o1 l1)", 2),
        ("(at-object o1 l1)", 3),
        ("(at-object o2 l2)", 5),
        ("(at-object o2 l2)", 6),
    ]
    assert found.unsupported == ()


def test_opportunities_and_guards_are_worth_looking_at() -> None:
    """Nothing else is."""
    watched = causal_links(START, PLAN, GOALS).watched
    assert sorted(map(fact_text, watched)) == [
        "(at-object o1 l1)",
        "(at-object o2 l2)",
        "(at-robot l1)",
        "(at-robot l2)",
        "(at-robot l3)",
        "(holding o1)",
        "(holding o2)",
        "(prepared o1)",
        "(prepared o2)",
    ]


def test_room_visited_twice_has_a_link_for_each_visit() -> None:
    """Each visit is supported by its own move, though the action is the same."""
    plan = number([move("l1", "l2"), move("l2", "l1"), move("l1", "l2")])
    assert table(causal_links(facts("(at-robot l1)"), plan, goals_of([("at-robot", "l2")]))) == [
        (0, "(at-robot l2)", 1),
        (1, "(at-robot l1)", 2),
        (2, "(at-robot l2)", End.GOAL),
    ]


def test_now_supports_what_nothing_undoes() -> None:
    """A step that makes true what is true supports nothing."""
    plan = number([act("make", adds="f"), act("use", needs="f", adds="g")])
    found = causal_links({("f",)}, plan, [Condition(("g",))])
    assert found.guards == (Guard(Condition(("f",)), 1),)
    assert found.links == (Link(1, Condition(("g",)), End.GOAL),)


def test_threatened_fact_is_supported_by_the_step_that_makes_it_again() -> None:
    """It is true now, but not any more when it is needed."""
    plan = number([act("break", deletes="f"), act("make", adds="f"), act("use", needs="f")])
    found = causal_links({("f",)}, plan, ())
    assert found == Links(links=(Link(1, Condition(("f",)), 2),))


def test_of_two_producers_the_earlier_has_the_link() -> None:
    """So the later one may turn out needless."""
    plan = number([act("first", adds="f"), act("second", adds="f"), act("use", needs="f")])
    assert causal_links(frozenset(), plan, ()).links == (Link(0, Condition(("f",)), 2),)


def test_negative_conditions_are_supported_by_deleters_and_threatened_by_adders() -> None:
    """The mirror of the positive ones."""
    plan = number([act("open", deletes="shut"), act("pass", lacks="shut"), act("slam", adds="shut")])
    open_ = Condition(("shut",), positive=False)
    found = causal_links({("shut",)}, plan, [open_])
    assert found.links == (Link(0, open_, 1),)
    assert found.unsupported == (Unsupported(open_, End.GOAL),)
    assert causal_links(frozenset(), plan, ()).guards == (Guard(open_, 1),)


def test_what_nothing_makes_true_is_named() -> None:
    """With the step, or the goal, that lacks it."""
    plan = number([act("use", needs="f")])
    found = causal_links(frozenset(), plan, [Condition(("g",))])
    assert found.unsupported == (Unsupported(Condition(("f",)), 0), Unsupported(Condition(("g",)), End.GOAL))
