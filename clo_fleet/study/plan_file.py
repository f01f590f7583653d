"""Reads plans as planners and validators of the planning competitions write them: one ``(action object ...)`` a line.

What follows a semicolon is a comment. Upper and lower case are the same, as in PDDL.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clo_fleet.clo.task import Action, apply, fact_text, holds, unmet
from clo_fleet.planning.planner import Answer, Verdict
from clo_fleet.study.surprise import listed
from clo_fleet.world.faults import Fault, FileFaultsError, value_text

if TYPE_CHECKING:
    from clo_fleet.planning.unified import Grounded

__all__ = ["no_plan_because", "read_plan"]

MOST_FAULTS = 20  # told at once: a file with more is no plan of this problem
ACTION = re.compile(r"\(\s*([^\s()]+(?:\s+[^\s()]+)*)\s*\)")

NO_PLAN = {
    Verdict.PLAN: "it found one",
    Verdict.NO_PLAN_PROVEN: "it has proved that there is none",
    Verdict.NO_PLAN: "its search ended without one",
    Verdict.OUT_OF_TIME: "it came to the limit of its time",
    Verdict.OUT_OF_MEMORY: "it came to the limit of its memory",
    Verdict.DIED: "it ended without an answer",
}

Words = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Line:
    """One action as the file writes it: no ``words`` if it is none."""

    number: int
    column: int
    words: Words


def read_plan(path: Path, grounded: "Grounded") -> tuple[Action, ...]:
    """The actions of the plan in the file, which lead from the problem's start to its goals.

    Raises:
        FileFaultsError: if a line is no action of the problem, or the plan cannot be carried out, or ends too early.
        OSError: if the file cannot be read.
    """
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    known = {_lower(name): name for name in map(grounded.original, grounded.task.actions) if name is not None}
    lines: list[_Line] = []
    faults: list[Fault] = []
    for line, written in _written(text):
        lines.append(line)
        if line.words not in known:
            faults.append(_fault(path, line, len(lines), written, _expected(line.words, known)))
            if len(faults) == MOST_FAULTS:
                break
    if not faults:
        actions = grounded.actions_of(known[line.words] for line in lines)
        faults.extend(_obstacles(path, grounded, lines, actions))
    if faults:
        raise FileFaultsError(faults)
    return actions


def no_plan_because(answer: Answer) -> str:
    """Why the planner's answer holds no plan, in words."""
    return answer.reason or NO_PLAN[answer.verdict]


def _written(text: str) -> Iterator[tuple[_Line, str]]:
    """The lines that are not empty, comments left out."""
    for number, whole in enumerate(text.splitlines(), start=1):
        line = whole.partition(";")[0]
        written = line.strip()
        if written:
            match = ACTION.fullmatch(written)
            words = tuple(match[1].lower().split()) if match else ()
            yield _Line(number, line.index(written) + 1, words), written


def _expected(words: Words, known: Mapping[Words, tuple[str, Words]]) -> str:
    """What should stand there, as the problem has no such action."""
    if not words:
        return "one action such as (move l1 l2)"
    name, arguments = words[0], words[1:]
    of_name = [other for other in known if other[0] == name]
    if not of_name:
        return f"an action of this problem, {listed(name, {other[0] for other in known})}"
    lengths = sorted({len(other) - 1 for other in of_name})
    if len(arguments) not in lengths:
        return f"{' or '.join(map(str, lengths))} objects after {name}, not {len(arguments)}"
    for place, argument in enumerate(arguments, start=1):
        there = {other[place] for other in of_name if len(other) == len(words)}
        if argument not in there:
            return f"for {argument} {listed(argument, there)}"
    return f"a combination of objects for which {name} can ever be done"


def _obstacles(path: Path, grounded: "Grounded", lines: list[_Line], actions: tuple[Action, ...]) -> Iterator[Fault]:
    """Where the plan cannot be carried out, or what it does not reach."""
    state = grounded.task.state
    for step, (line, action) in enumerate(zip(lines, actions, strict=False), start=1):
        if missing := unmet(action, state):
            wanted = " and ".join(map(str, missing))
            yield _fault(path, line, step, fact_text(line.words), f"a step that can be done here: this needs {wanted}")
            return
        state = apply(state, action)
    for action in actions[len(lines) :]:  # it notes that a goal is reached
        state = state if unmet(action, state) else apply(state, action)
    if missing := tuple(goal for goal in grounded.task.goals if not holds(goal, state)):
        end = lines[-1] if lines else _Line(1, 1, ())
        wanted = " and ".join(map(str, missing))
        yield _fault(path, end, len(lines) + 1, "the end of the plan", f"more steps: the goal needs {wanted}")


def _fault(path: Path, line: _Line, step: int, value: str, expected: str) -> Fault:
    return Fault(
        file=path,
        line=line.number,
        column=line.column,
        key=f"step {step}",
        value=value_text(value),
        expected=expected,
    )


def _lower(name: tuple[str, Words]) -> Words:
    return (name[0].lower(), *(argument.lower() for argument in name[1]))
