"""One episode of a study of repairs, told step by step."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from clo_fleet.clo.plan import first_fault
from clo_fleet.clo.repair import Refused
from clo_fleet.clo.task import fact_text
from clo_fleet.errors import CloFleetError
from clo_fleet.study.repair_episodes import Episode
from clo_fleet.study.repair_study import Prepared, Settings, Skipped, decision, prepared, problems, trial

__all__ = ["NoEpisodeError", "episode_story", "retold"]


class NoEpisodeError(CloFleetError):
    """There is no such episode to tell of.

    Attributes:
        name: the episode as asked for.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"episode {name}: {why}")
        self.name = name


def retold(folders: Iterable[Path], name: str, settings: Settings) -> Iterator[str]:
    """The story of the episode that is called as ``gripper/prob01:17``.

    Raises:
        NoEpisodeError: if the name is none, or the problem has no plan.
        NoProblemsError: if there is no such problem.
    """
    label, _, number = name.rpartition(":")
    if "/" not in label or not number.isdecimal():
        raise NoEpisodeError(name, "expected a problem and a number, such as gripper/prob01:17")
    case = prepared(*problems(folders, label)[0], settings)
    if isinstance(case, Skipped):
        raise NoEpisodeError(name, case.why)
    yield from episode_story(case, case.episodes.episode(int(number)), settings)


def episode_story(case: Prepared, episode: Episode, settings: Settings) -> Iterator[str]:
    """What happened, what was left of the plan, and what becomes of it."""
    yield f"{case.label}, episode {episode.number}: {episode.kind.value}"
    yield f"{episode.after} of {len(case.plan)} steps had been done, {len(episode.rest)} were left:"
    yield from (f"  {step.id:3} {step}" for step in episode.rest)
    if episode.actions:
        yield "others did: " + ", ".join(action.name for action in episode.actions)
    for fact in sorted(episode.changed):
        yield f"turned {'true' if fact in episode.state else 'false'}: {fact_text(fact)}"
    if fault := first_fault(episode.state, episode.rest, case.grounded.task.goals):
        place = f"step {fault.step.id}, {fault.step}," if fault.step else "its end, which"
        yield f"the plan breaks at {place} lacks {', '.join(map(str, fault.missing))}"
    else:
        yield "the plan still reaches its goals"
    found, _ = decision(case, episode)
    result = trial(case, episode, settings)
    if isinstance(found, Refused):
        yield f"refused: {found.why.value}"
        if result.solvable:
            yield f"is there a plan? {result.solvable}"
        return
    for drop in found.dropped:
        yield f"left out {drop.step.id}, {drop.step}: {drop.reason.value}"
    added = {step.id for step in found.added}
    yield f"repaired by {found.means.value}, {len(found.plan)} steps:"
    yield from (f"  {step.id:3} {step}{' (new)' if step.id in added else ''}" for step in found.plan)
    yield f"unified-planning judges it {'valid' if result.valid else 'INVALID'}"
