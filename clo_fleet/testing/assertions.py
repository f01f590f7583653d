"""Assertions about runs. A failure says what did happen instead: the helps that there were, the outcome and why.

Each takes a ``Run``; those that need no more than the result take a ``RunResult`` as well.
"""

from collections.abc import Iterable
from typing import NoReturn

from clo_fleet.clo.task import fact_text
from clo_fleet.study.metrics import helps
from clo_fleet.study.result import Help, RunResult
from clo_fleet.study.run import Run
from clo_fleet.study.story import story
from clo_fleet.study.witness import BrokenInvariantError, Witness, watched
from clo_fleet.world.events import ActionEnded, PlanRequested, StepsLeftOut

__all__ = [
    "assert_dropped",
    "assert_goals_reached",
    "assert_helped",
    "assert_no_contacts",
    "assert_outcome",
    "assert_replanned",
    "assert_sound",
]

SHOWN = 10  # sentences of a robot's story in a failure's message


def assert_goals_reached(run: Run | RunResult) -> None:
    """All goals of all robots hold, and every robot knows it."""
    __tracebackhide__ = True
    assert_outcome(run, "goals_reached")


def assert_outcome(run: Run | RunResult, outcome: str) -> None:
    """The run ended so: ``goals_reached``, ``no_plan``, ``stuck``, ... (``clo_fleet.fleet.outcome``)."""
    __tracebackhide__ = True
    result = _result(run)
    if result.outcome == outcome:
        return
    lines = [f"expected outcome {outcome}, but {_ending(result)}"]
    for name, robot in result.robots.items():
        if not robot.goals_reached:
            true = set(map(fact_text, run.facts)) if isinstance(run, Run) else set()
            missed = [goal for goal in robot.goals if goal not in true]
            lines += [f"{name} wants {', '.join(missed)}", *_story(run, name)]
    _fail(lines)


def assert_helped(
    run: Run | RunResult,
    *,
    by: str | None = None,
    robot: str | None = None,
    fact: str | None = None,
    kind: str | None = None,
) -> Help:
    """An action of one robot made steps of another's plan needless; returns the first such help.

    Args:
        run: a run, or its result.
        by: who helped.
        robot: whom.
        fact: by which fact, as ``(holding r1 o2)``.
        kind: ``prepared``, ``delivered``, ``handed_over`` or ``other``.
    """
    __tracebackhide__ = True
    given = helps(run.log) if isinstance(run, Run) else run.helps
    wanted = {"by": by, "robot": robot, "fact": fact, "kind": kind}
    for help_ in given:
        if all(value in (None, getattr(help_, name)) for name, value in wanted.items()):
            return help_
    what = f"{by or 'nobody'} {'did not help' if by else 'helped'} {robot or 'anybody'}"
    what += f" with {fact}" if fact else ""
    what += f" ({kind})" if kind else ""
    lines = [f"{what}; {_ending(_result(run))}"]
    lines.append("who helped whom:" if given else "nobody helped anybody")
    lines += [f"  {_help_text(help_)}" for help_ in given]
    if robot is not None:
        lines += _story(run, robot)
    return _fail(lines)


def assert_no_contacts(run: Run | RunResult, *kinds: str) -> None:
    """Nobody touched anything: of ``robot_robot``, ``robot_wall`` and ``robot_item``, or of those that are named."""
    __tracebackhide__ = True
    result = _result(run)
    if any(count for kind, count in result.contacts.items() if not kinds or kind in kinds):
        counts = ", ".join(f"{kind} {count}" for kind, count in result.contacts.items())
        _fail([f"expected no contacts{' of ' + ', '.join(kinds) if kinds else ''}, but there were: {counts}"])


def assert_dropped(run: Run, *, robot: str, action: str) -> None:
    """A step left the robot's plan because it had become needless: ``move(r1, l1, l2)``, or any ``move``."""
    __tracebackhide__ = True
    dropped: list[tuple[float, str, str]] = []
    for _, time, event in run.log:
        if isinstance(event, StepsLeftOut) and event.robot == robot:
            dropped += [(time, name, event.reason) for _, name in event.steps]
    if any(_is(action, name) for _, name, _ in dropped):
        return
    lines = [f"{robot} dropped no {action}; {_ending(_result(run))}"]
    lines.append("what it dropped:" if dropped else "it dropped nothing")
    lines += [f"  {time:.1f} s: {name} ({reason})" for time, name, reason in dropped]
    for _, time, event in run.log:
        if isinstance(event, ActionEnded) and event.robot == robot and _is(action, event.action):
            because = f" ({event.reason})" if event.reason else ""
            lines.append(f"{event.action} was begun, and {event.ending} at {time:.1f} s{because}")
    _fail([*lines, *_story(run, robot)])


def assert_replanned(run: Run, robot: str, times: int = 0) -> None:
    """After its first plan the robot asked its planner so often again; by default never."""
    __tracebackhide__ = True
    asked = [
        (time, event.why) for _, time, event in run.log if isinstance(event, PlanRequested) and event.robot == robot
    ]
    again = asked[1:]
    if len(again) == times:
        return
    lines = [f"expected {robot} to plan again {_times(times)}, but it did so {_times(len(again))}"]
    lines += [f"  {time:.1f} s: {why}" for time, why in again]
    _fail([*lines, *_story(run, robot)])


def assert_sound(run: Run) -> None:
    """The simulation itself is right: nothing impossible happens (``clo_fleet.study.witness``).

    Steps the run to its end and looks after every tick; of a run that has ended, checks the log and how it is left.
    """
    __tracebackhide__ = True
    try:
        if run.done:
            Witness(run).look()
        else:
            for _ in watched(run):
                pass
    except BrokenInvariantError as broken:
        lines = [f"an invariant is broken, {broken}", f"seed {run.mission.world.seed}, {run.mission.strategy.name}"]
        for name in broken.who:
            lines += _story(run, name)
        _fail(lines)


def _result(run: Run | RunResult) -> RunResult:
    return run.result() if isinstance(run, Run) else run


def _ending(result: RunResult) -> str:
    if result.outcome == "running":
        return f"the run has not ended yet, at {result.makespan_s:.1f} s: call run.finish() first"
    return f"the run ended as {result.outcome} after {result.makespan_s:.1f} s ({result.why})"


def _help_text(given: Help) -> str:
    gone = ", ".join(given.dropped)
    return f"{given.time_s:.1f} s: {given.by} helped {given.robot} with {given.fact} ({given.kind}); needless: {gone}"


def _story(run: Run | RunResult, robot: str) -> list[str]:
    """The end of a robot's story, where there is a log to tell it from."""
    if not isinstance(run, Run):
        return []
    told = story(run.log, robot)
    if not told:
        return []
    left = f", the last {SHOWN} of {len(told)} sentences" if len(told) > SHOWN else ""
    return [f"the story of {robot}{left}:", *told[-SHOWN:]]


def _is(action: str, name: str) -> bool:
    """Whether ``name`` is the action, or of the schema that ``action`` names."""
    return action in (name, name.partition("(")[0])


def _times(count: int) -> str:
    return {0: "never", 1: "once"}.get(count, f"{count} times")


def _fail(lines: Iterable[str]) -> NoReturn:
    __tracebackhide__ = True
    raise AssertionError("\n".join(lines))
