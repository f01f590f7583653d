"""Mending: how a plan that its own steps, in their order, cannot save goes on. The means in their order.

A step under way is left to end if it can: what is mended is the plan after it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from clo_fleet.clo.bridge import Breach, Bridge, NoBridge, Refusal, Way, detour, long_bridge, short_bridge
from clo_fleet.clo.improvement import Focus, eliminated, improved
from clo_fleet.clo.operators import Operator
from clo_fleet.clo.rebinding import exchanged, rebound

__all__ = ["Means", "Mended", "composed", "mended", "shortened"]


class Means(Enum):
    """What a repair took, each more than those before it."""

    DELETION = "deletion"
    RELINKING = "relinking"
    REBINDING = "rebinding"
    BRIDGE = "bridge"


@dataclass(frozen=True, slots=True)
class Mended:
    """The way on, by what means, and how many states and conditions were looked at."""

    way: Way
    means: Means
    effort: int = 0


def mended(breach: Breach, *, under_way: bool) -> Mended | NoBridge:
    """The plan mended by the first means that serves, less what it does not need then."""
    rest, whole = _rest(breach, under_way=under_way)
    found = _by_any_means(rest)
    if isinstance(found, NoBridge):
        return found
    return replace(found, way=whole(eliminated(rest, found.way)))


def shortened(breach: Breach, way: Way, focus: Focus | None = None, *, under_way: bool) -> Way:
    """The way, which has to reach the goals, with shorter and cheaper ones in the place of some of its windows."""
    if not under_way or way[:1] != (0,):
        return improved(breach, way, focus=focus)
    rest, whole = _rest(breach, under_way=True)
    behind = tuple(step if isinstance(step, Operator) else step - 1 for step in way[1:])
    return whole(improved(rest, behind, focus=focus and focus.behind_first()))


def composed(way: Way, then: Way) -> Way:
    """The way that ``then`` makes of the plan that ``way`` makes.

    >>> composed((3, 4, 5), (0, 2))
    (3, 5)
    """
    return tuple(step if isinstance(step, Operator) else way[step] for step in then)


def _by_any_means(breach: Breach) -> Mended | NoBridge:
    way = detour(breach)
    if way is not None:
        return Mended(way, Means.RELINKING)
    way = rebound(breach)
    if way is not None:
        return Mended(way, Means.REBINDING)
    found = short_bridge(breach)
    effort = found.effort
    if isinstance(found, NoBridge) and found.why is Refusal.BUDGET:
        way = exchanged(breach)
        if way is not None:
            return Mended(way, Means.REBINDING, effort)
        found = long_bridge(breach)
        effort += found.effort
    if isinstance(found, Bridge):
        return Mended(found.way(len(breach.plan)), Means.BRIDGE, effort)
    return replace(found, effort=effort)


def _rest(breach: Breach, *, under_way: bool) -> tuple[Breach, Callable[[Way], Way]]:
    """What is to be mended when a step under way has ended, or been stopped because it cannot end well.

    With it, how a way through that becomes one through the whole plan.
    """
    if not under_way or not breach.plan:
        return breach, lambda way: way
    first, *rest = breach.plan
    goes_on = first.needs & breach.state == first.needs
    begun: Way = (0,) if goes_on else ()
    shift = tuple(range(1, len(breach.plan)))
    following = replace(breach, plan=tuple(rest))
    if goes_on:
        before = None if breach.before is None else breach.before & ~first.ends | first.gains
        following = replace(following, state=breach.state & ~first.ends | first.gains, before=before)
    return following, lambda way: (*begun, *composed(shift, way))
