"""Where everything stands in the picture of a plan's links, and what becomes of each link.

Each fact that a step takes or gives has a line of its own beside the step, so that no label can cover another. Links
from step to step run in vertical lanes: the innermost that is free, short links first.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from itertools import count

from clo_fleet.study.explanation import GOAL, Explanation, FateRow, Place, RepairRow
from clo_fleet.study.svg import LINE, text_width

__all__ = [
    "END",
    "MARGIN",
    "NOW",
    "STUB",
    "Edge",
    "Kind",
    "Layout",
    "Row",
    "Source",
    "edges_of",
    "layout_of",
    "name_of",
    "short",
]

NOW = 0  # the place before all steps
LONGEST = 60  # characters of a label; the whole text is told when one points at it
MARGIN = 20.0  # [px] round the picture
END = 44.0  # [px] width of the bars for now and the goal
GAP = 12.0  # [px] from one step to the next
LANE = 11.0  # [px] from one lane to the next
STUB = 18.0  # [px] of line before and after a label


class Kind(IntEnum):
    """What became of a link; later kinds are drawn over earlier ones."""

    GONE = 0
    KEPT = 1
    NEW = 2
    BROKEN = 3


Source = tuple[int, str]
"""A fact and who gives it: a step's number, or `NOW`."""


@dataclass(frozen=True, slots=True)
class Edge:
    """A link from ``source`` (a step, or `NOW`) to ``target``."""

    source: int
    fact: str
    target: Place
    kind: Kind

    @property
    def key(self) -> Source:
        """What the label says."""
        return self.source, self.fact


@dataclass(frozen=True, slots=True)
class Row:
    """A step's place: ``left`` and ``right`` are its lines, each for one fact."""

    step: FateRow
    top: float
    left: tuple[Source, ...]
    right: tuple[Source, ...]

    @property
    def height(self) -> float:
        """Room for the fuller side [px]."""
        return LINE * max(1, len(self.left), len(self.right)) + 6

    def line(self, key: Source) -> float:
        """The height of the middle of a line [px]."""
        side = self.left if key[0] == NOW else self.right
        return self.top + 3 + LINE * (side.index(key) + 0.5)


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is [px]. ``lanes``: the lane of each fact that steps give to steps; ``through``: now to goal."""

    rows: Mapping[int, Row]
    lanes: Mapping[Source, int]
    through: Mapping[str, float]
    top: float
    bottom: float
    box: float
    box_end: float
    lanes_from: float
    goal: float

    def lane(self, key: Source) -> float:
        """How far right the lane runs [px]."""
        return self.lanes_from + LANE * self.lanes[key]


def edges_of(explanation: Explanation) -> tuple[Edge, ...]:
    """Every link and guard, before and after the surprise, with what became of it."""
    before = _links(explanation)
    repair = explanation.repair
    if repair is None:
        return tuple(Edge(*link, Kind.KEPT) for link in before)
    if repair.refused:
        missing = {(row.fact, place) for row in repair.missing for place in row.needed_by}
        known = {link[1:] for link in before}
        kinds = {link: Kind.BROKEN if link[1:] in missing else Kind.KEPT for link in before}
        kinds |= {(NOW, *lost): Kind.BROKEN for lost in sorted(missing - known, key=str)}
    else:
        after = _links(repair)
        kinds = {link: Kind.KEPT if link in after else Kind.GONE for link in before}
        kinds |= {link: Kind.NEW for link in after if link not in before}
    return tuple(Edge(*link, kind) for link, kind in kinds.items())


def layout_of(explanation: Explanation, edges: Iterable[Edge], top: float) -> Layout:
    """Where everything stands, from height ``top`` [px] downwards."""
    left: dict[Place, dict[Source, None]] = {}
    into: dict[Place, dict[Source, None]] = {}
    out: dict[Place, dict[Source, None]] = {}
    for edge in edges:
        if edge.source == NOW:
            left.setdefault(edge.target, {})[edge.key] = None
        else:
            into.setdefault(edge.target, {})[edge.key] = None
            out.setdefault(edge.source, {})[edge.key] = None
    height = top + LINE * explanation.executed + (GAP if explanation.executed else 0)
    rows = {}
    for fate in _fates(explanation):
        number = fate.step
        row = Row(fate, height, tuple(left.get(number, ())), (*into.get(number, ()), *out.get(number, ())))
        rows[number] = row
        height += row.height + GAP
    through = {fact: height + LINE * (place + 0.5) for place, (_, fact) in enumerate(left.get(GOAL, ()))}
    lanes = _lanes(edges, rows)
    box = MARGIN + END + _widest(key[1] for keys in left.values() for key in keys) + 2 * STUB
    box_end = box + _widest(name_of(row.step) for row in rows.values()) + 24
    lanes_from = box_end + _widest(key[1] for row in rows.values() for key in row.right) + 2 * STUB
    return Layout(
        rows=rows,
        lanes=lanes,
        through=through,
        top=top,
        bottom=height + LINE * len(through),
        box=box,
        box_end=box_end,
        lanes_from=lanes_from,
        goal=lanes_from + LANE * max(lanes.values(), default=0) + 2 * STUB,
    )


def name_of(fate: FateRow) -> str:
    """What a box says."""
    return short(f"{'+ ' if fate.fate == 'added' else ''}{fate.step} {fate.action}")


def short(text: str) -> str:
    """The text, cut off where it would make the picture too wide."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}\N{HORIZONTAL ELLIPSIS}"


def _links(plan: Explanation | RepairRow) -> dict[tuple[int, str, Place], None]:
    guards = ((NOW, guard.fact, place) for guard in plan.guards for place in guard.needed_by)
    return dict.fromkeys((*guards, *((link.producer, link.fact, link.consumer) for link in plan.links)))


def _fates(explanation: Explanation) -> tuple[FateRow, ...]:
    """The steps still to be done, in the order in which they are drawn."""
    if explanation.repair is not None and not explanation.repair.refused:
        return explanation.repair.steps
    return tuple(
        FateRow(step=row.step, action=row.action, cost=row.cost, fate="kept", reason="", because=())
        for row in explanation.steps
        if not row.done
    )


def _lanes(edges: Iterable[Edge], rows: Mapping[int, Row]) -> dict[Source, int]:
    """For each fact that steps give to steps the innermost lane that is free for its length, short ones first."""
    heights: dict[Source, list[float]] = {}
    for edge in edges:
        if edge.source != NOW and isinstance(edge.target, int):
            ends = heights.setdefault(edge.key, [rows[edge.source].line(edge.key)])
            ends.append(rows[edge.target].line(edge.key))
    spans = {key: (min(ends), max(ends)) for key, ends in heights.items()}
    taken: list[list[tuple[float, float]]] = []
    lanes = {}
    for key, (start, end) in sorted(spans.items(), key=lambda span: (span[1][1] - span[1][0], span[1])):
        for lane in count():
            if lane == len(taken):
                taken.append([])
            if all(end < begun or start > ended for begun, ended in taken[lane]):
                break
        taken[lane].append((start, end))
        lanes[key] = lane
    return lanes


def _widest(texts: Iterable[str]) -> float:
    return max((text_width(short(text)) for text in texts), default=0.0)
