"""Rebinding: the same plan with another object in the place of one that a surprise has taken.

A plan names a hand, a slot or a level where any other would do. When the named one is gone, no step is needless and
nothing new has to be done: only the name is wrong. Two ways, each checked by running the plan forward:

- *onwards*: another object in the broken step, and in the later steps that handle what it handled (the drop that
  empties the hand which the pick has filled);
- *exchanged*: two objects trade places in all steps that are left.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from clo_fleet.clo.bridge import Breach, Way, detour
from clo_fleet.clo.operators import Operator

__all__ = ["exchanged", "rebound"]

MOST_ONWARDS = 100_000  # steps of all plans tried: about 30 ms
MOST_EXCHANGED = 20_000  # the same, where a detour is looked for through each of them: about 0.2 s


def rebound(breach: Breach) -> Way | None:
    """The plan with another object from its first broken step onwards; ``None`` if no other fits there.

    A step further on may then want another object too: that is tried in turn, never going back.
    """
    plan = tuple(breach.plan)
    place, state = _first_broken(plan, breach.state)
    tried = 0
    while place < len(plan) and tried <= MOST_ONWARDS:
        best = plan, place, state
        for other in _onwards(breach, plan, place, state):
            tried += len(plan) - place
            reached, there = _first_broken(other[place:], state)
            if place + reached > best[1]:
                best = other, place + reached, there
            if best[1] == len(plan) or tried > MOST_ONWARDS:
                break
        if best[1] == place:
            return None
        plan, place, state = best
    whole = place == len(plan) and state & breach.goals == breach.goals
    return _changed(breach, plan, range(len(plan))) if whole else None


def exchanged(breach: Breach) -> Way | None:
    """The plan, some steps left out, with two objects exchanged: one that its first broken step names, and another."""
    place, _ = _first_broken(breach.plan, breach.state)
    tried = 0
    for old, new in _pairs(breach, breach.plan[place]) if place < len(breach.plan) else ():
        other = _all_renamed(breach, {old: new, new: old})
        tried += len(other)
        if len(other) == len(breach.plan):
            found = detour(replace(breach, plan=other))
            if found is not None:
                return _changed(breach, other, found)
        if tried > MOST_EXCHANGED:
            break
    return None


def _changed(breach: Breach, other: Sequence[Operator], way: Iterable[int | Operator]) -> Way:
    """The way through the ``other`` plan, in which some steps of the plan have got other objects."""
    return tuple(
        step if isinstance(step, Operator) or other[step].action == breach.plan[step].action else other[step]
        for step in way
    )


def _first_broken(plan: Sequence[Operator], state: int) -> tuple[int, int]:
    """The place of the first step that cannot be done, and the state there; the plan's length if all can."""
    for place, operator in enumerate(plan):
        if operator.needs & state != operator.needs:
            return place, state
        state = state & ~operator.ends | operator.gains
    return len(plan), state


def _pairs(breach: Breach, broken: Operator) -> Iterator[tuple[str, str]]:
    """An object that the broken step names, and one that could stand in the same place of such a step."""
    action = broken.action
    for position, old in enumerate(action.args):
        for new in breach.operators.objects(action.schema, position):
            if new not in action.args:
                yield old, new


def _onwards(breach: Breach, plan: tuple[Operator, ...], place: int, state: int) -> Iterator[tuple[Operator, ...]]:
    """The plans in which the step at ``place`` can be done with another object, which later steps then handle too."""
    for old, new in _pairs(breach, plan[place]):
        names = {old: new}
        first = _renamed(breach, plan[place], names)
        if first is None or first.needs & state != first.needs:
            continue
        about = breach.operators.about(old)
        carried = plan[place].gains & about
        changed = [*plan[:place], first]
        for operator in plan[place + 1 :]:
            if operator.needs & carried:
                renamed = _renamed(breach, operator, names)
                if renamed is None:
                    break
                changed.append(renamed)
                carried = carried & ~operator.ends | operator.gains & about
            else:
                changed.append(operator)
                carried &= ~(operator.ends | operator.gains)
        else:
            yield tuple(changed)


def _all_renamed(breach: Breach, names: dict[str, str]) -> tuple[Operator, ...]:
    """The plan with other objects, up to the first step of which there is no such action."""
    found = []
    for operator in breach.plan:
        renamed = _renamed(breach, operator, names)
        if renamed is None:
            break
        found.append(renamed)
    return tuple(found)


def _renamed(breach: Breach, operator: Operator, names: dict[str, str]) -> Operator | None:
    """The operator with other objects; ``None`` if there is no such action, or others need what it would end."""
    action = operator.action
    args = tuple(names.get(arg, arg) for arg in action.args)
    if args == action.args:
        return operator
    other = breach.operators.named(action.schema, args)
    return None if other is None or other.ends & breach.spared else other
