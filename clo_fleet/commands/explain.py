"""``clo-fleet explain``: what holds a plan together, and what would help it."""

import argparse
import sys
from pathlib import Path

from clo_fleet.commands.arguments import count
from clo_fleet.commands.exit_codes import OTHER_OUTCOME, REACHED

__all__ = ["HELP", "command", "options"]

HELP = "say what holds a plan together, and what would help it"


def options(parser: argparse.ArgumentParser) -> None:
    """Its arguments."""
    parser.add_argument("domain", type=Path, help="a PDDL domain")
    parser.add_argument("problem", type=Path, help="a PDDL problem")
    parser.add_argument(
        "--plan", type=Path, metavar="FILE", help="one (action object ...) a line; default: ask for one"
    )
    parser.add_argument("--after", type=count, default=0, metavar="N", help="the first N steps have been done")
    parser.add_argument(
        "--true", action="append", default=[], metavar="FACT", help="turns true by itself, e.g. '(on a b)'"
    )
    parser.add_argument("--false", action="append", default=[], metavar="FACT", help="turns false by itself")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of tables")
    parser.add_argument("--graph", type=Path, metavar="FILE.svg", help="draw the causal graph")
    parser.add_argument("--force", action="store_true", help="overwrite FILE.svg")


def command(chosen: argparse.Namespace) -> int:
    """Do it; returns the exit code."""
    from clo_fleet.planning.planner import Verdict
    from clo_fleet.planning.unified import read
    from clo_fleet.study.causal_graph import check_place, write_graph
    from clo_fleet.study.explaining import explain
    from clo_fleet.study.explanation_text import explanation_text
    from clo_fleet.study.plan_file import no_plan_because, read_plan
    from clo_fleet.study.summary import show
    from clo_fleet.study.surprise import predicates, read_surprise

    if chosen.graph:
        check_place(chosen.graph, overwrite=chosen.force)
    grounded = read(chosen.domain, chosen.problem)
    surprise = read_surprise(chosen.true, chosen.false, grounded.task, predicates(chosen.domain))
    if chosen.plan:
        actions, source = read_plan(chosen.plan, grounded), f"from {chosen.plan}"
    else:
        answer = grounded.plan()
        if answer.verdict is not Verdict.PLAN:
            print(f"clo-fleet: Fast Downward found no plan: {no_plan_because(answer)}", file=sys.stderr)
            return OTHER_OUTCOME
        actions = grounded.actions_of((step[0], step[1:]) for step in answer.steps)
        source = "by Fast Downward (lama-first)"
    explanation = explain(grounded.task_with(surprise.true), actions, source, chosen.after, surprise)
    if chosen.graph:
        write_graph(explanation, chosen.graph)
    if chosen.json:
        print(explanation.to_json(), end="")
    else:
        show(explanation_text(explanation))
    return OTHER_OUTCOME if explanation.repair and explanation.repair.refused else REACHED
