"""A witness: looks at a run from outside after every tick, and says who broke which invariant, and when.

>>> from clo_fleet.study.witness import watched            # doctest: +SKIP
>>> with Run(world) as run:                                # doctest: +SKIP
...     for _ in watched(run):                             # steps the run until it ends
...         pass

What holds in every tick of every world, judged from poses and not by what the simulation says of itself:

- space: every robot is a body or a vehicle, nobody jumps, nothing is in a wall, nobody overlaps with anybody
- facts: they follow from where everybody and everything is, and the log's changes add up to them
- minds: each step is accounted for, links are those of the plan, who acts has a plan that stands or is being mended
- record: ids are dense, times go on, and what refers to an event refers to one that is there and of the right kind
"""

from collections.abc import Iterator

from clo_fleet.fleet.outcome import Outcome
from clo_fleet.study.run import Run
from clo_fleet.study.witness.broken import BrokenInvariantError
from clo_fleet.study.witness.facts import Facts
from clo_fleet.study.witness.minds import Minds
from clo_fleet.study.witness.record import Record
from clo_fleet.study.witness.space import Scene, Space

__all__ = ["BrokenInvariantError", "Witness", "watched"]


class Witness:
    """Looks at one run, from now on once after every tick.

    It may begin when the run has begun already: what happened before is then checked as far as the log tells it.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        mission = run.mission
        self._space = Space(mission.world, mission.site)
        self._facts = Facts(mission)
        self._minds = Minds(mission)
        self._record = Record(mission)
        self._ended = False
        self._seen = 0

    def look(self) -> None:
        """Check everything that holds between two ticks.

        Raises:
            BrokenInvariantError: with the first thing that is not as it must be.
        """
        mission = self._run.mission
        news = self._run.log_since(self._seen)
        self._seen += len(news)
        self._record.look(news)
        scene = Scene.of(mission)
        self._space.look(scene, mission.site, mission.time)
        self._facts.look(scene, news)
        self._minds.look()
        if mission.outcome is not None and not self._ended:
            self._ended = True
            self._look_at_end(mission.outcome)

    def _look_at_end(self, outcome: Outcome) -> None:
        mission = self._run.mission
        missed = [goal for spec in mission.world.robots for goal in spec.goals if goal not in mission.facts]
        if outcome is Outcome.GOALS_REACHED and missed:
            raise BrokenInvariantError(f"the run ended as {outcome.value} without goals {missed}", (), mission.time)
        if not mission.why:
            raise BrokenInvariantError(f"the run ended as {outcome.value} and does not say why", (), mission.time)
        self._record.look_at_end()


def watched(run: Run) -> Iterator[Run]:
    """Step the run until it ends, with a witness; gives the run after every tick.

    Raises:
        BrokenInvariantError: as soon as something is not as it must be.
    """
    witness = Witness(run)
    while not run.done:
        run.step()
        witness.look()
        yield run
