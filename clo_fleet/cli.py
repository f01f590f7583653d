"""The command ``clo-fleet``. Engines are imported by the subcommand that needs them, never for ``--help``."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from clo_fleet import __version__
from clo_fleet.clo.strategies import STRATEGIES
from clo_fleet.errors import CloFleetError

if TYPE_CHECKING:
    from clo_fleet.study.result import RunResult
    from clo_fleet.study.run import Run
    from clo_fleet.world.model import World

__all__ = ["main"]

REACHED, OTHER_OUTCOME, BAD_INPUT = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code: 0 goals reached, 1 another outcome, 2 bad input."""
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    try:
        return command(options)
    except CloFleetError as error:
        from clo_fleet.world.faults import FileFaultsError

        of_a_file = isinstance(error, FileFaultsError)  # each line begins with its place, for editors to jump to
        print(error if of_a_file else f"clo-fleet: {error}", file=sys.stderr)
        return BAD_INPUT
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OTHER_OUTCOME
    except OSError as error:
        print(f"clo-fleet: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("clo-fleet: interrupted; events.jsonl holds what happened so far", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="clo-fleet", description="Fleets of robots that repair their plans when others help them."
    )
    parser.add_argument("--version", action="version", version=f"clo-fleet {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="run a world and say what happened")
    run.add_argument("world", type=Path, help="a world file (YAML)")
    run.add_argument("--strategy", default="clo", help=f"default: clo; also {', '.join(sorted(STRATEGIES))}")
    run.add_argument("--seed", type=_count, help="overrides the world's seed")
    run.add_argument("--until", type=_seconds, metavar="SECONDS", help="longest simulated time")
    run.add_argument("--out", type=Path, metavar="DIR", help="default: runs/<world>-<strategy>-<seed>/")
    run.add_argument("--force", action="store_true", help="overwrite an earlier run in DIR")
    run.add_argument("--json", action="store_true", help="print result.json instead of tables")
    run.add_argument("--explain", metavar="ROBOT", help="tell the story of one robot")
    run.set_defaults(command=_run)

    compare = commands.add_parser("compare", help="run a world with several strategies: one table")
    compare.add_argument("world", type=Path)
    compare.add_argument("--strategies", default="clo,replan", help="names, separated by commas")
    compare.add_argument("--seed", type=_count, help="overrides the world's seed")
    compare.add_argument("--until", type=_seconds, metavar="SECONDS", help="longest simulated time")
    compare.add_argument("--json", action="store_true", help="print the results as a JSON list")
    compare.set_defaults(command=_compare)

    validate = commands.add_parser("validate", help="check world and map files")
    validate.add_argument("files", type=Path, nargs="+", metavar="FILE")
    validate.set_defaults(command=_validate)

    import_map = commands.add_parser("import-map", help="make a map of an Open-RMF building")
    import_map.add_argument("building", type=Path, metavar="FILE.building.yaml")
    import_map.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for the map")
    import_map.add_argument("--level", help="which level, if there are several")
    import_map.add_argument("--force", action="store_true", help="overwrite a map of that name")
    import_map.set_defaults(command=_import_map)

    build = commands.add_parser("build-network", help="build the SUMO network of a map")
    build.add_argument("map", type=Path)
    build.set_defaults(command=_build_network)

    explain = commands.add_parser("explain", help="say what holds a plan together, and what would help it")
    explain.add_argument("domain", type=Path, help="a PDDL domain")
    explain.add_argument("problem", type=Path, help="a PDDL problem")
    explain.add_argument(
        "--plan", type=Path, metavar="FILE", help="one (action object ...) a line; default: ask for one"
    )
    explain.add_argument("--after", type=_count, default=0, metavar="N", help="the first N steps have been done")
    explain.add_argument(
        "--true", action="append", default=[], metavar="FACT", help="turns true by itself, e.g. '(on a b)'"
    )
    explain.add_argument("--false", action="append", default=[], metavar="FACT", help="turns false by itself")
    explain.add_argument("--json", action="store_true", help="print one JSON document instead of tables")
    explain.add_argument("--graph", type=Path, metavar="FILE.svg", help="draw the causal graph")
    explain.add_argument("--force", action="store_true", help="overwrite FILE.svg")
    explain.set_defaults(command=_explain)

    repairs = commands.add_parser(
        "study-repair", help="break plans of any PDDL domains and count how they are repaired"
    )
    repairs.add_argument(
        "folders", type=Path, nargs="+", metavar="FOLDER", help="holds domain.pddl and problems, or folders that do"
    )
    repairs.add_argument("--episodes", type=_count, default=200, help="for each problem (default: 200)")
    repairs.add_argument("--actions", type=_counts, default=(1, 5), metavar="1,5", help="how many others do at once")
    repairs.add_argument("--seed", type=_count, default=0)
    repairs.add_argument("--only", metavar="NAME", help="one domain's folder, or one problem, such as gripper/prob01")
    repairs.add_argument("--explain-left", action="store_true", help="ask Fast Downward for a plan where repair failed")
    repairs.add_argument("--episode", metavar="PROBLEM:N", help="tell one episode, such as gripper/prob01:17")
    repairs.add_argument("--out", type=Path, metavar="DIR", help="write episodes.csv and summary.csv")
    repairs.set_defaults(command=_study_repair)

    paper = commands.add_parser("paper", help="run the paper's study again: rows, tables and a figure beside its own")
    paper.add_argument("--quick", action="store_true", help="p-05 and p-10, 3 seeds: minutes instead of hours")
    paper.add_argument("--problems", default="", help="such as rooms,p-05,cooking/p-40; default: all")
    paper.add_argument("--seeds", type=_count, metavar="N", help="runs a cell; costly ones fewer (default: 20)")
    paper.add_argument("--strategies", default="", help="names, separated by commas; default: all")
    paper.add_argument("--out", type=Path, required=True, metavar="DIR", help="goes on with a study begun in DIR")
    paper.set_defaults(command=_paper)

    init = commands.add_parser("init", help="copy the maps and worlds that come with the package")
    init.add_argument("folder", type=Path, metavar="DIR")
    init.set_defaults(command=_init)

    schema = commands.add_parser("schema", help="print a JSON schema, for editors and tools")
    schema.add_argument("of", choices=("world", "map", "result"))
    schema.set_defaults(command=_schema)
    return parser


def _run(options: argparse.Namespace) -> int:
    from clo_fleet.study.run import Run, UnknownRobotError, strategy_named

    strategy = strategy_named(options.strategy)
    world = _world(options)
    if options.explain is not None and options.explain not in {spec.id for spec in world.robots}:
        raise UnknownRobotError(options.explain, tuple(spec.id for spec in world.robots))
    out = options.out or Path("runs") / f"{world.name}-{strategy.name}-{world.seed}"
    with Run(world, strategy, out=out, force=options.force) as run:
        result = _with_progress(run, options)
        log = run.log
    from clo_fleet.study.expectations import disappointments
    from clo_fleet.study.story import story
    from clo_fleet.study.summary import show, summary

    if options.json:
        print(result.to_json(), end="")
    else:
        if options.explain is not None:
            print("\n".join(story(log, options.explain)))
        show(summary(result))
        for disappointment in disappointments(world, result):
            print(f"not as the world expects: {disappointment}")
        print(f"written to {out}/events.jsonl and {out}/result.json")
    return REACHED if result.outcome == "goals_reached" else OTHER_OUTCOME


def _compare(options: argparse.Namespace) -> int:
    import json

    from clo_fleet.study.run import Run, strategy_named
    from clo_fleet.study.summary import comparison, show

    strategies = [strategy_named(name.strip()) for name in options.strategies.split(",")]
    world = _world(options)
    results = []
    for strategy in strategies:
        with Run(world, strategy) as run:
            results.append(_with_progress(run, options))
    if options.json:
        print(json.dumps([json.loads(result.to_json()) for result in results], indent=2))
    else:
        show(comparison(results))
    return REACHED if all(result.outcome == "goals_reached" for result in results) else OTHER_OUTCOME


def _validate(options: argparse.Namespace) -> int:
    from clo_fleet.sim.network import check_network
    from clo_fleet.world.any_file import read_any
    from clo_fleet.world.model import World

    faulty = False
    for path in options.files:
        try:
            found = read_any(path)
        except CloFleetError as error:
            print(error, file=sys.stderr)
            faulty = True
            continue
        building = found.map if isinstance(found, World) else found
        differences = check_network(building, building.network) if building.network else ()
        for difference in differences:
            print(f"{building.network}: {difference}; build it anew with clo-fleet build-network", file=sys.stderr)
        faulty = faulty or bool(differences)
        if not differences:
            print(f"{path}: a sound {'world' if isinstance(found, World) else 'map'}")
    return BAD_INPUT if faulty else REACHED


def _import_map(options: argparse.Namespace) -> int:
    from clo_fleet.bridges.open_rmf import import_to_folder

    imported, path = import_to_folder(options.building, options.out, level=options.level, force=options.force)
    building = imported.building
    print(f"{path}: {len(building.rooms)} rooms, {len(building.doors)} doors, {len(building.corridors)} corridors,")
    print(f"  {len(building.spawn_points)} spawn points; the building has {imported.cells} cells;")
    print(f"  a pixel is {imported.scale_m_per_px:.5f} m")
    for skipped in imported.skipped:
        print(f"  left out: {skipped}")
    return REACHED


def _build_network(options: argparse.Namespace) -> int:
    from clo_fleet.sim.network import build_network
    from clo_fleet.world.map_file import read_map

    building = read_map(options.map, network_required=False)
    path = building.network or options.map.with_suffix(".net.xml.gz")
    build_network(building, path)
    print(f"{path}: {len(building.corridors)} corridors")
    return REACHED


def _explain(options: argparse.Namespace) -> int:
    from clo_fleet.planning.planner import Verdict
    from clo_fleet.planning.unified import read
    from clo_fleet.study.causal_graph import check_place, write_graph
    from clo_fleet.study.explaining import explain
    from clo_fleet.study.explanation_text import explanation_text
    from clo_fleet.study.plan_file import no_plan_because, read_plan
    from clo_fleet.study.summary import show
    from clo_fleet.study.surprise import predicates, read_surprise

    if options.graph:
        check_place(options.graph, overwrite=options.force)
    grounded = read(options.domain, options.problem)
    surprise = read_surprise(options.true, options.false, grounded.task, predicates(options.domain))
    if options.plan:
        actions, source = read_plan(options.plan, grounded), f"from {options.plan}"
    else:
        answer = grounded.plan()
        if answer.verdict is not Verdict.PLAN:
            print(f"clo-fleet: Fast Downward found no plan: {no_plan_because(answer)}", file=sys.stderr)
            return OTHER_OUTCOME
        actions = grounded.actions_of((step[0], step[1:]) for step in answer.steps)
        source = "by Fast Downward (lama-first)"
    explanation = explain(grounded.task_with(surprise.true), actions, source, options.after, surprise)
    if options.graph:
        write_graph(explanation, options.graph)
    if options.json:
        print(explanation.to_json(), end="")
    else:
        show(explanation_text(explanation))
    return OTHER_OUTCOME if explanation.repair and explanation.repair.refused else REACHED


def _study_repair(options: argparse.Namespace) -> int:
    from rich.console import Console

    from clo_fleet.study.repair_story import retold
    from clo_fleet.study.repair_study import Settings, study
    from clo_fleet.study.repair_tables import tables, write_study
    from clo_fleet.study.summary import show

    settings = Settings(
        episodes=options.episodes, sizes=options.actions, seed=options.seed, explain_left=options.explain_left
    )
    if options.episode is not None:
        print("\n".join(retold(options.folders, options.episode, settings)))
        return REACHED
    with Console(stderr=True).status("reading") as status:  # shows nothing where that is no terminal
        result = study(options.folders, settings, options.only, progress=status.update)
    show(tables(result))
    if options.out is not None:
        for path in write_study(result, options.out):
            print(f"written to {path}")
    return OTHER_OUTCOME if any(trial.valid is False for trial in result.trials) else REACHED


def _paper(options: argparse.Namespace) -> int:
    from clo_fleet.paper.progress import bar
    from clo_fleet.paper.runs import Selection, narrowed, quick
    from clo_fleet.paper.study import study

    def named(names: str) -> list[str]:
        return [name.strip() for name in names.split(",") if name.strip()]

    selected = narrowed(
        quick() if options.quick else Selection(),
        problems=named(options.problems),
        strategies=named(options.strategies),
        seeds=options.seeds,
    )
    try:
        with bar() as progress:
            rows = study(selected, options.out, progress=progress)
    except KeyboardInterrupt:
        print(f"clo-fleet: interrupted; the same command goes on with {options.out}", file=sys.stderr)
        return 130
    done = sum(row.done for row in rows)
    print(f"{done} of {len(rows)} runs reached their goals; written to {options.out}/table.md and beside it")
    return REACHED


def _init(options: argparse.Namespace) -> int:
    from clo_fleet.study.shipped import copy_out

    for path in copy_out(options.folder):
        print(path)
    return REACHED


def _schema(options: argparse.Namespace) -> int:
    import json

    from clo_fleet.study.result import result_schema
    from clo_fleet.world.map_file import map_schema
    from clo_fleet.world.world_file import world_schema

    schemas = {"world": world_schema, "map": map_schema, "result": result_schema}
    print(json.dumps(schemas[options.of](), indent=2))
    return REACHED


def _world(options: argparse.Namespace) -> "World":
    from dataclasses import replace

    from clo_fleet.world.world_file import read_world

    world = read_world(options.world)
    if options.seed is not None:
        world = replace(world, seed=options.seed)
    if options.until is not None:
        world = replace(world, until=options.until)
    return world


def _with_progress(run: "Run", options: argparse.Namespace) -> "RunResult":
    """The result of a run; on a terminal, a line says how far it is."""
    if options.json or not sys.stderr.isatty():
        return run.finish()
    from rich.console import Console

    with Console(stderr=True).status("planning") as status:
        return run.finish(
            progress=lambda mission: status.update(
                f"{mission.strategy.name}: {mission.time:.0f} s; "
                + ", ".join(f"{robot.id} {robot.running or robot.mode.value}" for robot in mission.robots[:8])
            )
        )


def _count(text: str) -> int:
    number = int(text)
    if number < 0:
        raise ValueError(text)
    return number


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 < seconds < 1e7:
        raise ValueError(text)
    return seconds


def _counts(text: str) -> tuple[int, ...]:
    numbers = tuple(map(_count, text.split(",")))
    if not all(numbers):
        raise ValueError(text)
    return numbers


_counts.__name__ = "list of counts such as 1,5"
_count.__name__, _seconds.__name__ = "count from 0", "number of seconds above 0"

if __name__ == "__main__":
    sys.exit(main())
