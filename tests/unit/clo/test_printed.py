"""The paper's algorithms as printed: what they get right is the module's doctest; here is what they get wrong."""

from clo_fleet.clo.executive import Executive
from clo_fleet.clo.messages import ActionFinished, AskPlan, Begin, PlanArrived, StartAction, StepsDropped
from clo_fleet.clo.plan import first_fault, goals_of, number
from clo_fleet.clo.printed import opportunities, printed_links, printed_repair
from clo_fleet.clo.repair import Repaired, repair
from clo_fleet.clo.strategies import Adopt, AsPrinted, Clo, Keep, Situation, Strategy
from clo_fleet.clo.task import Action, Condition, Fact, parse_fact

GOALS = goals_of([("holding", "o1"), ("holding", "o2")])


def action(name: str, needs: str, adds: str, deletes: str = "") -> Action:
    """An action; facts are written one after the other, separated by semicolons."""

    def facts(text: str) -> tuple[Fact, ...]:
        return tuple(parse_fact(f"({fact})") for fact in text.split(";") if fact)

    schema, *args = name.split()
    conditions = tuple(map(Condition, facts(needs)))
    made, undone = frozenset(facts(adds)), frozenset(facts(deletes))
    return Action(schema=schema, args=tuple(args), needs=conditions, adds=made, deletes=undone)


def move(start: str, goal: str) -> Action:
    """From one room to another."""
    return action(f"move {start} {goal}", f"at {start}", f"at {goal}", f"at {start}")


def fetch(item: str, room: str) -> Action:
    """Take an object."""
    return action(f"fetch {item}", f"at {room};lies {item} {room}", f"holding {item}", f"lies {item} {room}")


# The hub is entered twice: once on the way, once for the second object.
REVISIT = (move("a", "hub"), move("hub", "b"), fetch("o1", "b"), move("b", "hub"), fetch("o2", "hub"))
START: frozenset[Fact] = frozenset({("at", "a"), ("lies", "o1", "b"), ("lies", "o2", "hub")})


def executed(strategy: Strategy) -> tuple[list[str], list[str], bool]:
    """What is carried out and what is dropped in an undisturbed world, and whether a second plan is asked for."""
    robot = Executive(strategy, START, GOALS)
    done: list[str] = []
    dropped: list[str] = []
    commands = [*robot.handle(Begin(0.0)), *robot.handle(PlanArrived(0.0, REVISIT))]
    while commands:
        command = commands.pop(0)
        if isinstance(command, StepsDropped):
            dropped += [step.action.name for step in command.steps]
        elif isinstance(command, AskPlan) and command.why != "first plan":
            return done, dropped, True
        elif isinstance(command, StartAction):
            done.append(command.step.action.name)
            commands += robot.handle(ActionFinished(0.0, command.step.id))
    return done, dropped, False


def test_second_visit_to_a_room_is_lost() -> None:
    """Printed, entering the hub the first time takes the way back there out of the plan; it has to plan again."""
    _, dropped, planned_again = executed(AsPrinted())
    assert "move(b, hub)" in dropped
    assert planned_again
    assert executed(Clo()) == ([step.name for step in REVISIT], [], False)


def test_threat_is_not_seen() -> None:
    """The lamp is lit by somebody; a step that is still to come puts it out before it is needed."""
    plan = (
        action("sweep", "", "swept", "lit"),
        action("light", "", "lit"),
        action("read", "lit;swept", "done"),
    )
    goals = goals_of([("done",)])
    links = printed_links(plan, goals)
    _, left = printed_repair(("lit",), plan, links)
    shorter = number([plan[i] for i in left])
    assert [step.action.name for step in shorter] == ["sweep()", "read()"]
    assert first_fault({("lit",)}, shorter, goals) is not None
    found = repair({("lit",)}, number(plan), goals)
    assert isinstance(found, Repaired)
    assert len(found.plan) == 3


def test_last_producer_has_the_link() -> None:
    """Where a fact is made twice, Algorithm 1 links the later one; the earlier one has none and will be dropped."""
    plan = (action("prepare one", "", "ready"), action("prepare two", "", "ready"), action("use", "ready", "done"))
    links = printed_links(plan, goals_of([("done",)]))
    assert [len(at_step) for at_step in links] == [0, 1, 1]
    assert opportunities(links) == {("ready",), ("done",)}


def test_strategy_leaves_the_plan_alone_when_nothing_changed() -> None:
    """Asked without news, or without an opportunity that is true, it keeps the plan; else it names the fact."""
    steps = number(REVISIT[1:])
    state = frozenset({("at", "hub"), ("lies", "o1", "b"), ("lies", "o2", "hub")})

    def asked(changed: frozenset[Fact], more: frozenset[Fact] = frozenset()) -> Adopt | Keep:
        situation = Situation(
            state=state | more, plan=steps, goals=GOALS, changed=changed, since=changed, past=state,
            promised=frozenset(),
        )  # fmt: skip
        revision = AsPrinted().revise(situation)
        assert isinstance(revision, Adopt | Keep)
        return revision

    assert isinstance(asked(frozenset()), Keep)
    news: frozenset[Fact] = frozenset({("holding", "o1")})
    revision = asked(news, news)
    assert isinstance(revision, Adopt)
    assert ("fetch(o1)", (("holding", "o1"),)) in [
        (drop.step.action.name, drop.because) for drop in revision.repaired.dropped
    ]
