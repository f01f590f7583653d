"""How long linking and repairing take, and how that grows with the plan. Run with ``pytest tests/bench -m bench -s``.

Times are of the processor, not of the wall, and the garbage collector is left on. Nothing is asserted about them.
"""

import gc
import math
import random
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from statistics import median

import pytest

from clo_fleet.clo.deletion import delete
from clo_fleet.clo.links import causal_links
from clo_fleet.clo.plan import Plan, goals_of, number
from clo_fleet.clo.supports import Supports
from clo_fleet.clo.task import Action, Condition, Fact

LENGTHS = (40, 400, 4_000, 40_000, 120_000)
OPPORTUNITIES = 1_000

pytestmark = [pytest.mark.bench, pytest.mark.timeout(1800)]


@dataclass(frozen=True)
class LongTask:
    """A state, a plan and goals."""

    state: frozenset[Fact]
    plan: Plan
    goals: tuple[Condition, ...]


def act(schema: str, *args: str, needs: Iterable[Fact], adds: Iterable[Fact], deletes: Iterable[Fact] = ()) -> Action:
    """An action with positive preconditions."""
    return Action(
        schema=schema, args=args, needs=goals_of(needs), adds=frozenset(adds), deletes=frozenset(deletes)
    )  # fmt: skip


def rooms(length: int) -> LongTask:
    """The paper's ROOMS as a star: to each room, prepare and take what lies there, and back to the hub."""
    actions: list[Action] = []
    count = length // 4
    hub = ("at-robot", "hub")
    for i in range(count):
        room, item = f"l{i}", f"o{i}"
        here, lies = ("at-robot", room), ("at-object", item, room)
        prepared = ("prepared", item)
        actions += [
            act("move", "hub", room, needs=[hub], adds=[here], deletes=[hub]),
            act("prepare", item, room, needs=[lies, here], adds=[prepared]),
            act("grasp", item, room, needs=[lies, here, prepared], adds=[("holding", item)], deletes=[lies]),
            act("move", room, "hub", needs=[here], adds=[hub], deletes=[here]),
        ]
    state = frozenset([hub, *(("at-object", f"o{i}", f"l{i}") for i in range(count))])
    return LongTask(state, number(actions[:-1]), goals_of(("holding", f"o{i}") for i in range(count)))


def balls(length: int) -> LongTask:
    """One hand carries balls from room to room: every step reads or changes the hand or the room."""
    actions: list[Action] = []
    count = length // 4
    hand, a, b = ("handempty",), ("at-robot", "a"), ("at-robot", "b")
    for i in range(count):
        ball = f"b{i}"
        here, there, carried = ("at", ball, "a"), ("at", ball, "b"), ("carry", ball)
        actions += [
            act("pick", ball, needs=[hand, a, here], adds=[carried], deletes=[hand, here]),
            act("move", "a", "b", needs=[a], adds=[b], deletes=[a]),
            act("drop", ball, needs=[b, carried], adds=[hand, there], deletes=[carried]),
            act("move", "b", "a", needs=[b], adds=[a], deletes=[b]),
        ]
    state = frozenset([hand, a, *(("at", f"b{i}", "a") for i in range(count))])
    return LongTask(state, number(actions[:-1]), goals_of(("at", f"b{i}", "b") for i in range(count)))


def parcels(length: int) -> LongTask:
    """As in logistics: a truck takes parcels through fifty towns, three at each stop, and unloads them at the next."""
    draw = random.Random(7)
    actions: list[Action] = []
    parcels_at: dict[str, list[str]] = {}
    town, made = "t0", 0
    start = {("at", "truck", town)}
    goals: list[Fact] = []
    while len(actions) + 7 <= max(length, 7):
        there = f"t{draw.randrange(50)}"
        if there == town:
            continue
        loaded = [f"p{made + i}" for i in range(3)]
        made += 3
        here, next_ = ("at", "truck", town), ("at", "truck", there)
        for parcel in loaded:
            lies, inside, arrives = ("at", parcel, town), ("in", parcel), ("at", parcel, there)
            start.add(lies)
            goals.append(arrives)
            actions.append(act("load", parcel, town, needs=[here, lies], adds=[inside], deletes=[lies]))
        actions.append(act("drive", town, there, needs=[here], adds=[next_], deletes=[here]))
        for parcel in loaded:
            inside, arrives = ("in", parcel), ("at", parcel, there)
            actions.append(act("unload", parcel, there, needs=[next_, inside], adds=[arrives], deletes=[inside]))
        parcels_at.setdefault(there, []).extend(loaded)
        town = there
    return LongTask(frozenset(start), number(actions), goals_of(goals))


def with_shared_actions(task: LongTask) -> LongTask:
    """The task, with one object for all actions that are equal, as a planner that grounds once gives them."""
    known: dict[Action, Action] = {}
    plan = number(known.setdefault(step.action, step.action) for step in task.plan)
    return LongTask(task.state, plan, task.goals)


def seconds(function: Callable[[], object], least: float = 0.05) -> float:
    """The shortest of some times that the function took."""
    times: list[float] = []
    while len(times) < 3 or (sum(times) < least and len(times) < 50):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times)


def bytes_of(task: LongTask) -> int:
    """The memory that the supports of the task take, without the task's own."""
    gc.collect()
    tracemalloc.start()
    supports = Supports(task.state, task.plan, task.goals)
    taken, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(supports) == len(task.plan)
    return taken


def repair_times(task: LongTask, opportunities: Sequence[Fact]) -> tuple[list[float], list[float], float]:
    """Seconds to repair for each opportunity, seconds to take each repair back, and steps dropped on average."""
    supports = Supports(task.state, task.plan, task.goals)
    repairs, undos, dropped = [], [], 0
    for fact in opportunities:
        mark = supports.mark()
        begin = time.process_time()
        deleted = delete(supports, {fact: True})
        middle = time.process_time()
        supports.undo(mark)
        end = time.process_time()
        assert not deleted.gaps
        repairs.append(middle - begin)
        undos.append(end - middle)
        dropped += len(deleted.drops)
    return sorted(repairs), sorted(undos), dropped / len(opportunities)


def advance_time(task: LongTask) -> float:
    """Seconds for one step to be taken out as done, the mean over the first of the plan."""
    supports = Supports(task.state, task.plan, task.goals)
    count = min(len(task.plan), 1_000)
    begin = time.process_time()
    for _ in range(count):
        supports.advance()
    return (time.process_time() - begin) / count


def exponent(sizes: Sequence[int], times: Sequence[float]) -> float:
    """The slope of the line fitted to the logarithms: 1 is linear, 0 constant."""
    xs, ys = [math.log(size) for size in sizes], [math.log(taken) for taken in times]
    x_mean, y_mean = sum(xs) / len(xs), sum(ys) / len(ys)
    across = sum((x - x_mean) * (y - y_mean) for x, y in zip(xs, ys, strict=True))
    return across / sum((x - x_mean) ** 2 for x in xs)


@pytest.mark.parametrize("made", [rooms, balls, parcels])
def test_costs_of_links_and_repair(made: Callable[[int], LongTask], capsys: pytest.CaptureFixture[str]) -> None:
    """One table for each kind of plan: linking, repairing, taking back, going on, and memory, by length."""
    titles = ("steps", "link µs", "shared", "bytes", "repair", "p99 µs", "undo µs", "p99 µs", "drops", "done µs")
    rows = []
    sizes, linked, repaired = [], [], []
    for length in LENGTHS:
        task = made(length)
        shared = with_shared_actions(task)
        steps = len(task.plan)
        link = seconds(lambda task=task: Supports(task.state, task.plan, task.goals))  # type: ignore[misc]  # bound now
        again = seconds(lambda task=shared: Supports(task.state, task.plan, task.goals))  # type: ignore[misc]  # the same
        found = sorted(fact.fact for fact in causal_links(task.state, task.plan, task.goals).opportunities)
        opportunities = random.Random(1).choices(found, k=OPPORTUNITIES)
        repairs, undos, drops = repair_times(task, opportunities)
        late = OPPORTUNITIES * 99 // 100
        rows.append(
            (
                f"{steps:,}",
                f"{link / steps * 1e6:.2f}",
                f"{again / steps * 1e6:.2f}",
                f"{bytes_of(task) / steps:.0f}",
                f"{median(repairs) * 1e6:.0f}",
                f"{repairs[late] * 1e6:.0f}",
                f"{median(undos) * 1e6:.0f}",
                f"{undos[late] * 1e6:.0f}",
                f"{drops:.1f}",
                f"{advance_time(task) * 1e6:.1f}",
            )
        )
        sizes.append(steps)
        linked.append(link)
        repaired.append(median(repairs))
    widths = [max(map(len, column)) for column in zip(titles, *rows, strict=True)]
    lines = ["  ".join(map(str.rjust, row, widths)) for row in chain([titles], rows)]
    lines.append(f"exponents: linking {exponent(sizes, linked):.2f}, repair {exponent(sizes, repaired):.2f}")
    with capsys.disabled():
        sys.stdout.write("\n".join(["", made.__name__, *lines, ""]))
