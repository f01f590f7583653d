"""How a run can end: exactly one of these, judged on the truth."""

from enum import Enum

__all__ = ["ADVICE", "Outcome"]


class Outcome(Enum):
    """The named outcomes of a run."""

    GOALS_REACHED = "goals_reached"
    NO_PLAN = "no_plan"
    STUCK = "stuck"
    CONFLICT = "conflict"
    PLANNER_FAILED = "planner_failed"
    GRIDLOCK = "gridlock"
    MISTAKEN = "mistaken"
    OUT_OF_TIME = "out_of_time"


ADVICE = {
    Outcome.NO_PLAN: "a goal cannot be reached as the robot believes the world to be: check the goal, the map's "
    "connections, and who holds the object",
    Outcome.STUCK: "an action failed again and again: look at its reasons in events.jsonl",
    Outcome.CONFLICT: "robots undo each other's goals: give them goals that can hold together",
    Outcome.PLANNER_FAILED: "the planner ran out of time or memory, or died: raise planning.wall_limit_s or "
    "planning.memory_limit_mb, or make the world smaller",
    Outcome.GRIDLOCK: "nothing moves any more: look at who waits for whom in events.jsonl",
    Outcome.MISTAKEN: "every robot believes that its goals hold, but they do not: widen perception or radio",
    Outcome.OUT_OF_TIME: "the time ran out: raise until_s, or look at what the robots were waiting for",
}
