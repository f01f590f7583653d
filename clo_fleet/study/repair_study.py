"""Repairs on problems of any domain: plans by Fast Downward, surprises by chance, judged by unified-planning.

Each problem is planned for once. In each episode (see ``repair_episodes``) the rest of the plan is repaired by ``clo``
and by ``clo-as-printed``, and what comes out is judged by unified-planning's own validator on the original problem.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from clo_fleet.clo.operators import Operators
from clo_fleet.clo.plan import Plan, first_fault
from clo_fleet.clo.repair import Refusal, Refused, Repaired, repair
from clo_fleet.clo.strategies import Adopt, AsPrinted, Situation
from clo_fleet.clo.task import Action, apply
from clo_fleet.errors import CloFleetError
from clo_fleet.planning.first_plan import Limits
from clo_fleet.planning.planner import Verdict
from clo_fleet.planning.unified import Grounded, read
from clo_fleet.study.repair_episodes import Episode, Episodes, Kind

__all__ = [
    "NoProblemsError",
    "Prepared",
    "Settings",
    "Skipped",
    "Study",
    "Trial",
    "prepared",
    "problems",
    "study",
    "trial",
]

DOMAIN = "domain.pddl"
PLANNING = Limits(seconds=60.0)
EXPLAINING = Limits(seconds=30.0)


class NoProblemsError(CloFleetError):
    """No folder holds what the study needs.

    Attributes:
        folders: the folders looked at.
        only: the name that was asked for, if any.
    """

    def __init__(self, folders: Sequence[Path], only: str | None) -> None:
        asked = f" of {only}" if only else ""
        places = ", ".join(map(str, folders))
        super().__init__(f"no problems{asked} in {places}: expected folders with {DOMAIN} and problems beside it")
        self.folders = tuple(folders)
        self.only = only


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What to study.

    Attributes:
        episodes: how many for each problem.
        sizes: how many actions others do at once.
        seed: of all chance.
        explain_left: whether to ask Fast Downward if a plan exists where the repair was refused.
    """

    episodes: int = 200
    sizes: tuple[int, ...] = (1, 5)
    seed: int = 0
    explain_left: bool = False


@dataclass(frozen=True, slots=True)
class Skipped:
    """A problem that was not studied, and why."""

    label: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A problem with its plan.

    Attributes:
        label: its domain's folder and its file, as ``gripper/prob01``.
        operators: all actions, for the repair.
    """

    label: str
    grounded: Grounded
    plan: tuple[Action, ...]
    operators: Operators
    episodes: Episodes


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What became of one episode.

    Attributes:
        label: the problem, as ``gripper/prob01``.
        rest: how many steps were left.
        broken: whether they would not have reached the goals any more.
        means: what the repair took, if there was one.
        why: why it was refused, otherwise.
        length: the steps of the repaired plan.
        added: those that are new.
        valid: whether unified-planning's validator agrees that it reaches the goals.
        back: whether it leads through the state before the surprise.
        wall_seconds: how long the decision took.
        printed_length, printed_valid: the same of ``clo-as-printed``.
        solvable: whether a plan exists, where that was asked.
    """

    label: str
    number: int
    kind: Kind
    size: int
    after: int
    rest: int
    broken: bool
    means: str
    why: str
    length: int | None
    added: int | None
    valid: bool | None
    back: bool | None
    wall_seconds: float
    printed_length: int
    printed_valid: bool
    solvable: str

    @property
    def domain(self) -> str:
        """The folder of the problem's domain."""
        return self.label.partition("/")[0]

    @property
    def repaired(self) -> bool:
        """Whether there is a plan again."""
        return not self.why


@dataclass(frozen=True, slots=True)
class Study:
    """All trials, and what was left out."""

    settings: Settings
    trials: tuple[Trial, ...]
    skipped: tuple[Skipped, ...]


def problems(folders: Iterable[Path], only: str | None = None) -> tuple[tuple[str, Path, Path], ...]:
    """Label, domain and problem file of each problem in the folders, by name.

    Args:
        folders: each a domain's folder or a folder of such.
        only: a domain's folder, or a problem's label.

    Raises:
        NoProblemsError: if there is none.
    """
    folders = tuple(folders)
    found = []
    for folder in folders:
        for place in (folder, *sorted(folder.iterdir())) if folder.is_dir() else ():
            domain = place / DOMAIN
            if not domain.is_file():
                continue
            for path in sorted(place.glob("*.pddl")):
                label = f"{place.resolve().name}/{path.stem}"
                if path != domain and only in (None, place.resolve().name, label):
                    found.append((label, domain, path))
    if not found:
        raise NoProblemsError(folders, only)
    return tuple(found)


def prepared(label: str, domain: Path, problem: Path, settings: Settings) -> Prepared | Skipped:
    """The problem, planned for; or why that could not be done."""
    try:
        grounded = read(domain, problem)
    except CloFleetError as error:
        return Skipped(label, str(error))
    answer = grounded.plan(limits=PLANNING)
    if answer.verdict is not Verdict.PLAN:
        why = f": {answer.reason}" if answer.reason else ""
        return Skipped(label, f"Fast Downward found no plan ({answer.verdict.value.replace('_', ' ')}{why})")
    if not answer.steps:
        return Skipped(label, "its goals hold already")
    task = grounded.task
    plan = grounded.actions_of((step[0], step[1:]) for step in answer.steps)
    deeds = Operators(action for action in task.actions if grounded.original(action))
    return Prepared(
        label=label,
        grounded=grounded,
        plan=plan,
        operators=Operators(task.actions, task.goals),
        episodes=Episodes(label, task.state, plan, operators=deeds, seed=settings.seed, sizes=settings.sizes),
    )


def study(
    folders: Iterable[Path],
    settings: Settings,
    only: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Study:
    """Every episode of every problem. ``progress`` is told what is being done.

    Raises:
        NoProblemsError: if there is no problem.
    """
    trials: list[Trial] = []
    skipped: list[Skipped] = []
    for label, domain, problem in problems(folders, only):
        progress(f"{label}: planning")
        case = prepared(label, domain, problem, settings)
        if isinstance(case, Skipped):
            skipped.append(case)
            continue
        for place in range(settings.episodes):
            progress(f"{label}: episode {place}")
            trials.append(trial(case, case.episodes.episode(place), settings))
    return Study(settings, tuple(trials), tuple(skipped))


def trial(case: Prepared, episode: Episode, settings: Settings) -> Trial:
    """What becomes of the episode."""
    task, rest = case.grounded.task, episode.rest
    found, seconds = decision(case, episode)
    printed = _as_printed(case, episode)
    plan = found.plan if isinstance(found, Repaired) else None
    return Trial(
        label=case.label,
        number=episode.number,
        kind=episode.kind,
        size=episode.size,
        after=episode.after,
        rest=len(rest),
        broken=first_fault(episode.state, rest, task.goals) is not None,
        means=found.means.value if isinstance(found, Repaired) else "",
        why=found.why.name.lower() if isinstance(found, Refused) else "",
        length=len(plan) if plan is not None else None,
        added=len(found.added) if isinstance(found, Repaired) else None,
        valid=_valid(case, episode, plan) if plan is not None else None,
        back=episode.before in _states(episode, plan) if plan is not None else None,
        wall_seconds=seconds,
        printed_length=len(printed),
        printed_valid=_valid(case, episode, printed),
        solvable=_solvable(case, episode, found) if settings.explain_left and isinstance(found, Refused) else "",
    )


def decision(case: Prepared, episode: Episode) -> tuple[Repaired | Refused, float]:
    """What ``clo`` makes of the rest of the plan, and how long that took [s]."""
    goals = case.grounded.task.goals
    start = time.perf_counter()
    found = repair(episode.state, episode.rest, goals, changed=episode.changed, operators=case.operators)
    return found, time.perf_counter() - start


def _as_printed(case: Prepared, episode: Episode) -> Plan:
    """What the paper's pseudo-code makes of the rest of the plan."""
    goals = case.grounded.task.goals
    situation = Situation(
        state=episode.state,
        plan=episode.rest,
        goals=goals,
        changed=episode.changed,
        since=episode.changed,
        past=episode.before,
        promised=frozenset(),
    )
    revision = AsPrinted().revise(situation)
    return revision.repaired.plan if isinstance(revision, Adopt) else episode.rest


def _valid(case: Prepared, episode: Episode, plan: Plan) -> bool:
    return case.grounded.valid(episode.state, (step.action for step in plan))


def _states(episode: Episode, plan: Plan) -> Iterator[frozenset[object]]:
    """The states that the plan leads through after the first."""
    state = episode.state
    for step in plan:
        state = apply(state, step.action)
        yield state


def _solvable(case: Prepared, episode: Episode, found: Refused) -> str:
    """Whether a plan exists, as far as Fast Downward can tell."""
    if found.why is Refusal.UNSOLVABLE:
        return "no"
    verdict = case.grounded.plan(episode.state, limits=EXPLAINING).verdict
    return {Verdict.PLAN: "yes", Verdict.NO_PLAN_PROVEN: "no"}.get(verdict, verdict.value.replace("_", " "))
