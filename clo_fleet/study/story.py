"""One robot's story in sentences, told from the event log."""

from collections.abc import Sequence

from clo_fleet.clo.task import Fact, fact_text
from clo_fleet.study.befallen import disturbance_told
from clo_fleet.study.event_log import Recorded
from clo_fleet.world import events

__all__ = ["story"]


def story(log: Sequence[Recorded], robot: str) -> tuple[str, ...]:
    """What happened to ``robot``, a sentence an event, each with its time."""
    told = []
    for _, time, event in log:
        sentence = _sentence(event, robot, log)
        if sentence:
            told.append(f"{time:7.1f} s: {sentence}")
    return tuple(told)


def _sentence(event: events.Event, robot: str, log: Sequence[Recorded]) -> str:  # noqa: C901  # one case a kind
    if getattr(event, "robot", robot) != robot and not isinstance(event, events.OfferMade):
        return ""
    match event:
        case events.PlanRequested(_, why):
            return f"asked for a plan: {why}"
        case events.PlanFollowed(_, steps, superseded):
            instead = f" in place of {len(superseded)} steps left of the old one" if superseded else ""
            return f"follows a plan of {_counted(len(steps), 'step')}{instead}: {', '.join(name for _, name in steps)}"
        case events.PlanFailed(_, reason, detail):
            return f"got no plan: {reason} ({detail})"
        case events.ActionStarted(_, _, action):
            return f"began {action}"
        case events.ActionEnded(_, _, action, ending, reason):
            return f"{ending} {action}" + (f": {reason}" if reason else "")
        case events.AlsoHappened(_, action, fact, by):
            return f"{action} also made {fact_text(fact)} true{_doer(by) if by != robot else ''}"
        case events.Sensed(_, fact, value, source, opportunity, by) if by != robot:
            verb = "saw" if source == "sight" else "heard"
            note = ", an opportunity" if opportunity else ""
            return f"{verb} that {_claim(fact, value)}{_doer(by)}{note}"
        case events.StepsLeftOut(_, steps, reason, fact, by, cause):
            names = " and ".join(name for _, name in steps)
            because = _because(fact, by, cause, log) if fact else reason
            return f"dropped {names}, because {because}"
        case events.ActionCalledOff(_, _, action, reason, fact, by, cause):
            return f"stops {action}, because {_because(fact, by, cause, log) if fact else reason}"
        case events.PlanMended(_, added, steps, means):
            new = " and ".join(name for _, name in added)
            what = f"with {new}" if new else "in another order"
            return f"mended its plan by {means}, {what}: {', '.join(name for _, name in steps)}"
        case events.RepairFailed(_, why):
            return f"could not repair its plan: {why}"
        case events.Waiting(_, why):
            return f"waits for {why.removeprefix('for ')}"
        case events.Rerouted(_, why):
            return f"takes another way: {why}"
        case events.GoalsReached():
            return "has all it wanted"
        case events.GaveUp(_, outcome, why):
            return f"gave up ({outcome}): {why}"
        case events.OfferMade(_, giver, to, item, place) if robot in (giver, to):
            return (
                f"offered {item} to {to} in {place}" if giver == robot else f"was offered {item} by {giver} in {place}"
            )
        case events.Disturbed(_, subject) if subject == robot or subject not in _robots(log):
            return disturbance_told(event)
        case events.FactChanged(("at-robot", who, place), True) if who == robot:
            return f"is in {place}"
    return ""


def _robots(log: Sequence[Recorded]) -> tuple[str, ...]:
    first = log[0][2]
    return first.robots if isinstance(first, events.RunStarted) else ()


def _because(fact: Fact, by: str | None, cause: int | None, log: Sequence[Recorded]) -> str:
    """``r2 gave o2``, where an action is known; else the fact."""
    action = log[cause][2] if cause is not None else None
    if isinstance(action, events.AlsoHappened):
        return f"{fact_text(fact)} came along with {action.action}"
    if by is None or not isinstance(action, events.ActionStarted):
        return f"{fact_text(fact)} was true"
    past = {"give": "gave", "prepare": "prepared", "place": "brought", "grasp": "took", "move": "moved"}
    schema, arguments = action.action.rstrip(")").split("(", 1)
    if schema not in past or len(fact) < 2:
        return f"{by} did {action.action}"
    item = fact[2] if fact[0] == "holding" else fact[1]
    where = f" to {fact[2]}" if fact[0] == "at-object" else ""
    assert arguments, "every action of the fleet names its robot"
    return f"{by} {past[schema]} {item}{where}"


def _claim(fact: Fact, value: bool) -> str:
    return f"{fact_text(fact)} is {'true' if value else 'false'}"


def _doer(by: str | None) -> str:
    return f", by {by}" if by else ""


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
