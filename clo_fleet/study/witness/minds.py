"""Invariants of the executives: no step is lost, links fit the plan, and nobody follows a broken plan unaware."""

from clo_fleet.clo.deliberation import under_way
from clo_fleet.clo.executive import Executive, Mode
from clo_fleet.clo.links import Links, causal_links
from clo_fleet.clo.plan import Plan, Step
from clo_fleet.clo.state import ExecutiveState
from clo_fleet.clo.task import Condition, Fact, holds
from clo_fleet.fleet.mission import Mission
from clo_fleet.study.witness.broken import BrokenInvariantError
from clo_fleet.world.binding import SensorKind
from clo_fleet.world.model import RobotId
from clo_fleet.world.vocabulary import vocabulary

__all__ = ["Minds"]

HEEDFUL = ("clo", "clo-improve")  # strategies that look at every change that touches the plan
Key = tuple[frozenset[Fact], Plan, Step | None, tuple[Condition, ...]]


class Minds:
    """Looks at what the robots believe and mean to do."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._words = vocabulary(mission.world)
        self._ids = [spec.id for spec in mission.world.robots]
        self._seen: dict[RobotId, tuple[Key, Links]] = {}

    def look(self) -> None:
        """Check everything.

        Raises:
            BrokenInvariantError: for the first thing that is not so.
        """
        for robot in self._ids:
            executive = self._mission.robot(robot).executive
            broken = self._plan(executive) or self._body(robot, executive) or self._links(robot, executive)
            if broken:
                raise BrokenInvariantError(broken, (robot,), self._mission.time)

    def _plan(self, executive: Executive) -> str:
        """What is wrong with its plan as a list of steps."""
        plan, running = executive.plan, executive.running
        ids = [step.id for step in plan]
        if len(set(ids)) != len(ids):
            return f"steps {ids} share ids"
        if not executive.tally.adds_up:
            return f"its steps do not add up: {executive.tally}"
        if any(getattr(executive.tally, name) < 0 for name in ("executed", "dropped", "superseded", "pending")):
            return f"fewer than no steps: {executive.tally}"
        if running is not None and running not in plan:
            return f"carries out {running}, which is not in its plan"
        if not executive.suspended.issubset(ids):
            return f"has put off steps that are not in its plan: {sorted(executive.suspended - set(ids))}"
        if executive.mode is Mode.SATISFIED:
            missed = [str(goal) for goal in executive.goals if not holds(goal, executive.beliefs)]
            if missed or plan:
                return f"satisfied, without {', '.join(missed) or 'having emptied its plan'}"
        return ""

    def _body(self, robot: RobotId, executive: Executive) -> str:
        """Where mind and body differ."""
        if (executive.running is not None) is not self._mission.robot(robot).busy:
            return f"its executive carries out {executive.running}, and its body something else"
        hands = (self._words.read(fact, SensorKind.HOLDING) for fact in executive.beliefs)
        held = {item for holder, item in filter(None, hands) if holder == robot}
        carried = set(self._mission.site.rooms.carried(robot))
        if held != carried and executive.mode is not Mode.NEW:
            return f"believes to hold {sorted(held)}, and holds {sorted(carried)}"
        return ""

    def _links(self, robot: RobotId, executive: Executive) -> str:
        """Whether the links are those of the plan, and the plan stands or is known not to."""
        key = (executive.beliefs, executive.plan, executive.running, executive.goals)
        links = executive.links
        before = self._seen.get(robot)
        self._seen[robot] = (key, links)
        if before is not None and before[0] == key:
            return "" if links == before[1] else "its links have changed, and neither its beliefs nor its plan"
        memory = ExecutiveState.from_state(executive.state())
        rest = tuple(under_way(step) if step.id == memory.running else step for step in memory.plan)
        if links != causal_links(memory.beliefs, rest, memory.goals, memory.unknown):
            return "its links are not those of its plan"
        if links.unsupported and executive.mode is Mode.ACTING and executive.strategy.name in HEEDFUL:
            return self._unaware(memory, rest)
        return ""

    def _unaware(self, memory: ExecutiveState, rest: Plan) -> str:
        """Whether it goes on with a plan that lacks something although nobody has promised it, unaware of that."""
        if memory.cancelling or memory.unsolvable is not None:
            return ""
        hoped, unknown = memory.beliefs | memory.promised, memory.unknown - memory.promised
        kept = tuple(step for step in rest if step.id not in memory.suspended)
        lacking = causal_links(hoped, kept, memory.goals, unknown).unsupported
        if not lacking or not causal_links(hoped, rest, memory.goals, unknown).unsupported:
            return ""
        what = ", ".join(f"{lack.condition} for {lack.consumer}" for lack in lacking)
        return f"goes on with a plan that lacks {what}"
