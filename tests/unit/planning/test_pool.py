"""The planner pool, with Fast Downward itself."""

import itertools
import json
import os
import select
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from clo_fleet.clo.task import Fact, apply, unmet
from clo_fleet.planning import wire
from clo_fleet.planning.planner import NoPlan, PlanFound, PlannerDied, PlannerOutOfMemory, PlannerOutOfTime
from clo_fleet.planning.pool import JobError, PlannerPool
from clo_fleet.planning.problem import PlanningTask, PlanningTaskError, Scene, planning_task
from clo_fleet.planning.problem_file import read_problem
from clo_fleet.world.domain_file import fleet_binding
from clo_fleet.world.model import SkillSettings
from clo_fleet.world.pddl import fleet_domain, read_domain
from clo_fleet.world.vocabulary import Names, Vocabulary

ROOMS = ("l1", "l2", "l3")


def words(
    *, robots: tuple[str, ...], objects: tuple[str, ...], rooms: tuple[str, ...], zones: tuple[str, ...] = ()
) -> Vocabulary:
    """The fleet's domain for these."""
    return Vocabulary(fleet_binding(), Names(robots=robots, objects=objects, rooms=rooms, zones=zones))


SCENE = Scene(
    words=words(robots=("r1", "r2"), objects=("o1", "o2"), rooms=ROOMS, zones=("z1",)),
    travel=dict.fromkeys(itertools.permutations(ROOMS, 2), 100) | {("z1", "l2"): 50},
    skills=SkillSettings(),
)
BELIEFS = frozenset({("at-robot", "r1", "l3"), ("at-object", "o1", "l1"), ("at-object", "o2", "l2")})
PAPER_PLAN = [
    "move(r1, l3, l1)",
    "prepare(r1, o1, l1)",
    "grasp(r1, o1, l1)",
    "move(r1, l1, l2)",
    "prepare(r1, o2, l2)",
    "grasp(r1, o2, l2)",
]
PATIENCE = 20.0  # [s] after which a test gives up on the operating system


def ask(*goals: Fact, beliefs: frozenset[Fact] = BELIEFS, meets: tuple[Fact, ...] = ()) -> PlanningTask:
    """What r1 asks in the paper's building."""
    return planning_task("r1", SCENE, beliefs, goals, meets)


PAPER_TASK = ask(("holding", "r1", "o1"), ("holding", "r1", "o2"))


def collect_all(rooms: int) -> PlanningTask:
    """A task with an object in each of so many rooms, all joined, and r1 in the last of them."""
    names, items = tuple(f"l{i}" for i in range(rooms)), tuple(f"o{i}" for i in range(rooms))
    travel = dict.fromkeys(itertools.permutations(names, 2), 50)
    scene = Scene(words=words(robots=("r1", "r2"), objects=items, rooms=names), travel=travel, skills=SkillSettings())
    beliefs = {("at-robot", "r1", names[-1]), *(("at-object", *pair) for pair in zip(items, names, strict=True))}
    return planning_task("r1", scene, frozenset(beliefs), [("holding", "r1", item) for item in items])


# Two tiles of the fifteen puzzle swapped: half of its 10^13 states to search, and no plan among them.
PUZZLE = read_domain("""
    (define (domain puzzle) (:types tile cell)
      (:predicates (next ?a ?b - cell) (free ?c - cell) (at ?t - tile ?c - cell))
      (:action slide :parameters (?t - tile ?a ?b - cell) :precondition (and (next ?a ?b) (at ?t ?a) (free ?b))
        :effect (and (at ?t ?b) (free ?a) (not (at ?t ?a)) (not (free ?b)))))""")
CELLS = {(x, y): f"c{x}{y}" for x in range(4) for y in range(4)}
TILES = tuple(f"t{i}" for i in range(1, 16))
HARD_TASK = PlanningTask(
    robot="nobody",
    objects=(("tile", TILES), ("cell", tuple(CELLS.values()))),
    facts=frozenset(
        {("free", "c00")}
        | {("at", tile, cell) for tile, cell in zip(TILES, tuple(CELLS.values())[1:], strict=True)}
        | {("next", CELLS[a], CELLS[b]) for a in CELLS for b in CELLS if abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1}
    ),
    goals=tuple(
        ("at", tile, cell) for tile, cell in zip(("t2", "t1", *TILES[2:]), tuple(CELLS.values())[1:], strict=True)
    ),
)


def session(leader: int) -> list[str]:
    """The names of the live processes in the leader's session."""
    names = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            head, _, tail = stat.read_text().rpartition(")")
        except (FileNotFoundError, ProcessLookupError):
            continue  # it ended meanwhile
        state, _, _, its_session = tail.split()[:4]
        if int(its_session) == leader and state != "Z":
            names.append(head.partition("(")[2])
    return names


def wait_for_processes(leader: int, low: int, high: int) -> int:
    """How many processes the session has, as soon as it has from ``low`` to ``high``."""
    end = time.monotonic() + PATIENCE
    while not low <= (count := len(session(leader))) <= high and time.monotonic() < end:
        select.select(
            [], [], [], 0.01
        )  # the operating system tells nobody when a process starts; leave it the processor
    return count


def only_worker(pool: PlannerPool) -> int:
    """The process id of the pool's one worker."""
    (worker,) = pool._workers
    return worker.process.pid


@pytest.fixture(scope="module")
def pool() -> Iterator[PlannerPool]:
    """A pool of one worker, shared for its start takes a second."""
    with PlannerPool(fleet_domain(), size=1) as pool:
        yield pool


def test_the_example_of_the_paper_gets_the_plan_of_the_paper(pool: PlannerPool) -> None:
    """Six steps, in the paper's order, that lead from the beliefs to the goals."""
    reply = pool.plan(PAPER_TASK)
    assert isinstance(reply, PlanFound)
    assert [action.name for action in reply.actions] == PAPER_PLAN
    assert reply.cost == 100 + 40 + 20 + 100 + 40 + 20
    assert reply.expansions > 0
    state = PAPER_TASK.facts
    for action in reply.actions:
        assert unmet(action, state) == ()
        state = apply(state, action)
    assert set(PAPER_TASK.goals) <= state


def test_goals_that_hold_need_an_empty_plan(pool: PlannerPool) -> None:
    """Nothing to do is a plan too."""
    reply = pool.plan(ask(("at-robot", "r1", "l3")))
    assert isinstance(reply, PlanFound)
    assert reply.actions == ()


def test_a_robot_uses_its_own_actions_and_gives_what_another_is_to_hold(pool: PlannerPool) -> None:
    """r2 comes by l2, so r1 hands it over there; if r2 comes by nowhere, it is proven that there is no plan."""
    goal = ("holding", "r2", "o1")
    reply = pool.plan(ask(goal, meets=(("meets", "r2", "l2"),)))
    assert isinstance(reply, PlanFound)
    assert [action.name for action in reply.actions][-2:] == ["move(r1, l1, l2)", "give(r1, r2, o1, l2)"]
    assert pool.plan(ask(goal)) == NoPlan(proven=True, expansions=0, wall_seconds=0)


def test_a_plan_may_start_in_a_zone(pool: PlannerPool) -> None:
    """A robot on its way plans from the corridors into a room."""
    reply = pool.plan(ask(("at-robot", "r1", "l2"), beliefs=frozenset({("at-robot", "r1", "z1")})))
    assert isinstance(reply, PlanFound)
    assert [action.name for action in reply.actions] == ["move(r1, z1, l2)"]


def test_ids_may_be_words_of_pddl(pool: PlannerPool) -> None:
    """Keywords, and names of the domain, are fine as names of robots, rooms and objects."""
    rooms = ("place", "item", "l-1_x")
    travel = dict.fromkeys(itertools.permutations(rooms, 2), 7)
    known = words(robots=("and",), objects=("move", "object"), rooms=rooms)
    scene = Scene(words=known, travel=travel, skills=SkillSettings())
    beliefs = frozenset({("at-robot", "and", "place"), ("at-object", "object", "item"), ("at-object", "move", "place")})
    reply = pool.plan(planning_task("and", scene, beliefs, [("holding", "and", "object")]))
    assert isinstance(reply, PlanFound)
    names = ["move(and, place, item)", "prepare(and, object, item)", "grasp(and, object, item)"]
    assert [action.name for action in reply.actions] == names


def test_jobs_are_answered_by_key_in_any_order(pool: PlannerPool) -> None:
    """Results belong to their keys, whichever is fetched first; what is unfetched is the pool's state."""
    tasks = {f"l{i}": ask(("at-robot", "r1", f"l{i}")) for i in (1, 2, 3)}
    for key, task in tasks.items():
        pool.submit(key, task)
    state = json.loads(json.dumps(pool.state()))
    replies = {key: pool.result(key) for key in ("l3", "l1", "l2")}
    assert [len(reply.actions) for reply in replies.values() if isinstance(reply, PlanFound)] == [0, 1, 1]
    pool.resume(state)
    assert {key: pool.result(key) for key in replies} == replies


def test_misuse_is_refused_before_a_job_is_sent(pool: PlannerPool) -> None:
    """An unknown object, a key in use and a key without a job each raise, and leave the pool as it was."""
    with pytest.raises(PlanningTaskError, match="unknown object o9"):
        pool.submit("a", ask(("holding", "r1", "o9")))
    pool.submit("a", PAPER_TASK)
    with pytest.raises(JobError, match="submitted twice"):
        pool.submit("a", PAPER_TASK)
    assert isinstance(pool.result("a"), PlanFound)
    with pytest.raises(JobError, match="never submitted"):
        pool.result("a")


def test_the_same_task_gets_the_same_plan_in_any_process(pool: PlannerPool) -> None:
    """Neither the parent's hash seed nor what a worker planned before reaches a plan."""
    script = """
        import json, sys
        from clo_fleet.planning import wire
        from clo_fleet.world.pddl import fleet_domain
        from clo_fleet.planning.pool import PlannerPool
        with PlannerPool(fleet_domain(), size=1) as pool:
            reply = pool.plan(wire.task_of(json.loads(sys.stdin.read())))
            print(reply.expansions, *(action.name for action in reply.actions), sep="\\n")
    """
    task = collect_all(8)
    ours = pool.plan(task)
    assert isinstance(ours, PlanFound)
    theirs = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        input=json.dumps(wire.task_json(task)),
        env=os.environ | {"PYTHONHASHSEED": "7"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert theirs.stdout.splitlines() == [str(ours.expansions), *(action.name for action in ours.actions)]


def test_a_killed_worker_leaves_no_planner_behind_and_is_replaced() -> None:
    """The job is answered as died, all that it started is gone, and the next job has a new worker."""
    with PlannerPool(PUZZLE, size=1) as pool:
        pool.submit("hard", HARD_TASK)
        leader = only_worker(pool)
        assert wait_for_processes(leader, 3, 9) >= 3  # worker, driver, and translator or search
        pool.kill_one()
        assert isinstance(pool.result("hard"), PlannerDied)
        assert session(leader) == []
        assert isinstance(pool.plan(replace(HARD_TASK, goals=())), PlanFound)


def test_a_job_whose_planner_is_killed_is_answered_so_whenever_that_is() -> None:
    """Under way, waiting in the queue, or answered already: the reply is the same, and the process is gone."""
    with PlannerPool(PUZZLE, size=1) as pool:
        for key in ("hard", "queued"):
            pool.submit(key, HARD_TASK)
        leader = only_worker(pool)
        assert wait_for_processes(leader, 3, 9) >= 3
        pool.kill("queued")
        pool.kill("hard")
        assert session(leader) == []
        replies = [pool.result(key) for key in ("hard", "queued")]
        assert replies == [PlannerDied(reason="killed", wall_seconds=0.0)] * 2
        pool.submit("easy", replace(HARD_TASK, goals=()))
        pool.plan(replace(HARD_TASK, goals=()))
        pool.kill("easy")
        assert isinstance(pool.result("easy"), PlannerDied)
        with pytest.raises(JobError, match="never submitted"):
            pool.kill("easy")


def test_the_wall_limit_ends_the_planner_and_spares_the_worker() -> None:
    """Out of time is a reply of the same worker; closing in the middle of a job leaves no process behind."""
    with PlannerPool(PUZZLE, size=1, wall_limit=1.0) as pool:
        pool.submit("hard", HARD_TASK)
        leader = only_worker(pool)
        assert isinstance(pool.result("hard"), PlannerOutOfTime)
        assert only_worker(pool) == leader
        assert wait_for_processes(leader, 1, 1) == 1
        pool.submit("again", HARD_TASK)
        assert wait_for_processes(leader, 2, 9) >= 2
    assert session(leader) == []


def test_the_memory_limit_is_met_by_the_planner_alone() -> None:
    """Out of memory is a reply, and the worker goes on."""
    with PlannerPool(fleet_domain(), size=1, memory_limit=40 << 20) as pool:
        assert isinstance(pool.plan(collect_all(60)), PlannerOutOfMemory)
        assert isinstance(pool.plan(PAPER_TASK), PlanFound)


def test_nothing_outlives_a_killed_parent(tmp_path: Path) -> None:
    """When the process that owns the pool is killed, its workers and planners end by themselves."""
    script = """
        import json, os, signal, sys
        from clo_fleet.planning import wire
        from clo_fleet.world.pddl import read_domain
        from clo_fleet.planning.pool import PlannerPool
        pool = PlannerPool(read_domain(json.loads(sys.stdin.readline())), size=1)
        pool.submit("hard", wire.task_of(json.loads(sys.stdin.readline())))
        print(pool._workers[0].process.pid, flush=True)
        sys.stdin.readline()
        os.kill(os.getpid(), signal.SIGKILL)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, env=environment) as parent:
        assert parent.stdin is not None
        assert parent.stdout is not None
        parent.stdin.write(json.dumps(PUZZLE.text).encode() + b"\n" + wire.task_line(HARD_TASK))
        leader = int(parent.stdout.readline())
        assert wait_for_processes(leader, 3, 9) >= 3
        parent.stdin.write(b"now\n")
        parent.wait()
    assert wait_for_processes(leader, 0, 0) == 0
    assert list(tmp_path.glob("clo-fleet-planner-*")) == []


def test_any_strips_domain_is_planned() -> None:
    """Types, constants, negative preconditions and equality reach the planner; without costs an action costs 1."""
    domain = read_domain("""
        (define (domain lamps) (:types lamp - thing thing) (:constants hub - lamp)
          (:predicates (on ?l - lamp) (broken ?l - thing))
          (:action light :parameters (?from ?l - lamp)
            :precondition (and (on ?from) (not (broken ?l)) (not (= ?l ?from))) :effect (and (on ?l) (broken ?from)))
          (:action mend :parameters (?l - lamp) :precondition (broken ?l) :effect (not (broken ?l))))""")
    task = read_problem(
        """(define (problem p) (:domain lamps) (:objects a b - lamp) (:init (on hub) (broken a))
          (:goal (and (on a) (on b))))""",
        domain,
    )
    with PlannerPool(domain, size=1) as pool:
        reply = pool.plan(task)
    assert isinstance(reply, PlanFound)
    assert reply.cost == len(reply.actions) >= 3
    state = task.facts
    for action in reply.actions:
        assert unmet(action, state) == ()
        state = apply(state, action)
    assert set(task.goals) <= state


def test_jobs_forgotten_cost_only_the_workers_that_have_them() -> None:
    """Whoever asks next finds the idle workers, and none of the answers to what was forgotten."""
    with PlannerPool(fleet_domain(), size=2) as pool:
        pool.plan(PAPER_TASK)
        pool.submit("r1", PAPER_TASK)
        pool.forget()
        assert pool.state() == {"jobs": []}
        pool.submit("r1", PAPER_TASK)
        assert isinstance(found := pool.result("r1"), PlanFound)
        assert [action.name for action in found.actions] == PAPER_PLAN


def test_pools_are_alike_that_plan_the_same_within_the_same_limits() -> None:
    """A limit that differs makes another pool."""
    pool = PlannerPool(fleet_domain())
    assert pool.like(PlannerPool(fleet_domain(), size=1))
    assert not pool.like(PlannerPool(fleet_domain(), wall_limit=1.0))
    assert not pool.like(PlannerPool(fleet_domain(), memory_limit=1 << 20))
