"""The additive heuristic and its relaxed plans."""

from clo_fleet.clo.operators import Operators, bits
from clo_fleet.clo.relaxation import FARTHEST, INFINITE, Relaxation
from clo_fleet.clo.task import Action, Condition, Fact


def action(name: str, needs: str = "", adds: str = "", deletes: str = "", cost: int = 1) -> Action:
    """An action on facts of one letter or word."""
    return Action(
        schema=name, args=(), needs=tuple(Condition((word,)) for word in needs.split()), cost=cost,
        adds=frozenset((word,) for word in adds.split()), deletes=frozenset((word,) for word in deletes.split()),
    )  # fmt: skip


def distances(operators: Operators, state: set[Fact], forbidden: str = "") -> dict[str, int]:
    """How far each fact is, those that are true left out."""
    mask = operators.mask(Condition((word,)) for word in forbidden.split())
    relaxed = Relaxation.of(operators, operators.state(state), mask)
    return {operators.conditions(1 << bit)[0].fact[0]: far for bit, far in enumerate(relaxed.distance) if far}


CORRIDOR = Operators(
    [
        action("first", "l1", "l2", "l1", cost=2),
        action("second", "l2", "l3", "l2", cost=3),
        action("shortcut", "l1 key", "l3", "l1"),
        action("find", "", "key"),
        action("carry", "l3 key", "done", cost=0),
        action("never", "lost", "found"),
    ]
)


def test_distance_is_the_sum_of_the_prices_on_the_way() -> None:
    """The cheapest way counts; what needs nothing is at hand; what costs nothing has the price 1."""
    assert distances(CORRIDOR, {("l1",)}) == {
        "l2": 2,
        "key": 1,
        "l3": 2,
        "done": 1 + 2 + 1,
        "lost": INFINITE,
        "found": INFINITE,
    }


def test_cheaper_way_that_is_found_later_counts() -> None:
    """The dear one is found first, because it is but one action."""
    cab, bus, walk = action("cab", "l1", "l3", cost=9), action("bus", "l1", "l2"), action("walk", "l2", "l3")
    assert distances(Operators([cab, bus, walk]), {("l1",)}) == {"l2": 1, "l3": 2}


def test_forbidden_ends_close_ways() -> None:
    """Nobody may leave l2: the way is by the key."""
    assert distances(CORRIDOR, {("l2",)}, forbidden="l2") == {
        "l1": INFINITE,
        "l3": INFINITE,
        "key": 1,
        "done": INFINITE,
        "lost": INFINITE,
        "found": INFINITE,
    }


def test_relaxed_plan_is_made_of_the_cheapest_supporters() -> None:
    """Each only once, though two of its conditions need the key."""
    relaxed = Relaxation.of(CORRIDOR, CORRIDOR.state({("l1",)}))
    plan = relaxed.plan(CORRIDOR.mask([Condition(("done",)), Condition(("l3",)), Condition(("l1",))]))
    assert [operator.action.schema for operator in plan] == ["shortcut", "find", "carry"]
    assert relaxed.plan(CORRIDOR.mask([Condition(("l1",))])) == ()


def test_effort_is_the_conditions_looked_at() -> None:
    """Once for each operator that needs a condition within reach."""
    relaxed = Relaxation.of(CORRIDOR, CORRIDOR.state({("l1",)}))
    assert relaxed.touched == sum(operator.needs.bit_count() for operator in CORRIDOR.all) - 1


def test_what_is_very_far_is_not_out_of_reach() -> None:
    """The sum doubles with every storey of a tower in which each floor needs both halves of the one below."""
    storeys = 60
    tower = [action(f"{side}{i}", f"a{i} b{i}", f"{side}{i + 1}") for i in range(storeys) for side in "ab"]
    operators = Operators(tower)
    relaxed = Relaxation.of(operators, operators.state({("a0",), ("b0",)}))
    (top,) = bits(operators.mask([Condition((f"a{storeys}",))]))
    assert relaxed.distance[top] == FARTHEST < INFINITE
    assert len(relaxed.plan(1 << top)) == 2 * storeys - 1
