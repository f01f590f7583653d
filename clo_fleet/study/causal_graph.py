"""The causal graph of a plan as a picture: what makes which step possible, and what a surprise changes about that.

Steps stand in the plan's order from top to bottom, *now* on the left and the *goal* on the right. What a step takes
from now comes in from the left. What it gets from other steps, and what it does for them or for the goal, stands on its
right. A vertical lane joins the line on which a step makes a fact true with the lines on which later steps need it.
"""

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from clo_fleet.errors import CloFleetError
from clo_fleet.study.causal_layout import (
    END,
    MARGIN,
    NOW,
    STUB,
    Edge,
    Kind,
    Layout,
    Source,
    edges_of,
    layout_of,
    name_of,
    short,
)
from clo_fleet.study.explanation import Explanation, OpportunityRow
from clo_fleet.study.svg import LINE, Sheet, text_width

__all__ = ["GraphFileError", "causal_graph", "check_place", "write_graph"]

MOST_CHANGES = 8  # told above the picture
CORNER = 6.0  # [px]
NAME_AGAIN = 600.0  # [px] after which a bar says its name again
STYLES = {Kind.GONE: "gone", Kind.KEPT: "", Kind.NEW: "new", Kind.BROKEN: "broken"}
LABELS = {Kind.GONE: "faint", Kind.KEPT: "", Kind.NEW: "good", Kind.BROKEN: "bad"}
LEGEND = {
    Kind.KEPT: "gives what the other needs",
    Kind.GONE: "was needed, and is not any more",
    Kind.NEW: "gives it instead",
    Kind.BROKEN: "needed, and nothing makes it true",
}


class GraphFileError(CloFleetError):
    """A picture cannot be written where it should.

    Attributes:
        path: the file.
    """

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path}: {why}")
        self.path = path


def check_place(path: Path, *, overwrite: bool = False) -> None:
    """See that a picture can be written there, before work is done for it.

    Raises:
        GraphFileError: if there is no such folder, or a file that must not be overwritten.
    """
    if not path.parent.is_dir():
        raise GraphFileError(path, "there is no such folder")
    if path.is_dir() or (path.exists() and not overwrite):
        raise GraphFileError(path, "exists already; choose another name, or overwrite a file with --force")


def write_graph(explanation: Explanation, path: Path) -> None:
    """Write the causal graph as an SVG file, whole or not at all."""
    text = causal_graph(explanation)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".graph-", suffix=".svg")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    Path(temporary).chmod(0o644)
    Path(temporary).replace(path)


def causal_graph(explanation: Explanation) -> str:
    """The picture of a plan's links as SVG; of the repaired plan as well, where there is one."""
    edges = edges_of(explanation)
    head = _headline(explanation)
    layout = layout_of(explanation, edges, MARGIN + LINE * (len(head) + 1))
    kinds = sorted({edge.kind for edge in edges}, key=lambda kind: (kind is not Kind.KEPT, kind))
    width = max(layout.goal + END, *(MARGIN + 1.3 * text_width(line) for line in head)) + MARGIN
    sheet = Sheet(width, layout.bottom + LINE * (len(kinds) + 1) + MARGIN, head[0])
    for number, line in enumerate(head):
        sheet.text(MARGIN, MARGIN + LINE * number + LINE / 2, line, "title" if number == 0 else "")
    _draw_ends(sheet, layout)
    _draw_links(sheet, layout, edges, {row.fact: row for row in explanation.opportunities})
    _draw_steps(sheet, layout, explanation)
    for number, kind in enumerate(kinds, start=1):
        height = layout.bottom + LINE * (number + 0.5)
        _arrow(sheet, MARGIN, MARGIN + 40, height, STYLES[kind])
        sheet.text(MARGIN + 50, height, LEGEND[kind], LABELS[kind])
    return sheet.to_svg()


def _headline(explanation: Explanation) -> list[str]:
    """What is drawn, and what happened."""
    lines = [f"{explanation.task}: {len(explanation.steps)} steps, cost {explanation.cost}"]
    if explanation.executed:
        lines.append(f"after step {explanation.executed}")
    repair = explanation.repair
    if repair is not None:
        lines += map(str, repair.changes[:MOST_CHANGES])
        if len(repair.changes) > MOST_CHANGES:
            lines.append(f"and {len(repair.changes) - MOST_CHANGES} more")
        lines.append(repair.refused or f"cost left: {repair.cost_before}, repaired {repair.cost_after}")
    return lines


def _draw_ends(sheet: Sheet, layout: Layout) -> None:
    """The bars for now and for the goal."""
    for name, x in (("now", MARGIN), ("goal", layout.goal)):
        sheet.box(x, layout.top, END, layout.bottom - layout.top, "end")
        height = layout.top + min(LINE, (layout.bottom - layout.top) / 2)
        while height < layout.bottom:
            sheet.text(x + END / 2, height, name, "end-name", anchor="middle")
            height += NAME_AGAIN


def _draw_links(sheet: Sheet, layout: Layout, edges: Iterable[Edge], worth: Mapping[str, OpportunityRow]) -> None:
    """All links: those that share a lane together, what is gone beneath what is there."""
    together: dict[Source, list[Edge]] = {}
    for edge in edges:
        together.setdefault(edge.key, []).append(edge)
    for (source, fact), links in sorted(together.items(), key=lambda item: max(edge.kind for edge in item[1])):
        links.sort(key=lambda edge: edge.kind)
        giver = "now" if source == NOW else f"step {source}"
        takers = ", ".join(str(edge.target) for edge in links)
        saves = f"; saves {worth[fact].saves} if it turns true now" if fact in worth else ""
        sheet.open(f"{fact} from {giver} for {takers}{saves}")
        paths: dict[Kind, str] = {}
        for edge in links:
            paths[edge.kind] = paths.get(edge.kind, "") + _path(layout, edge)
        sheet.line("".join(paths.values()), "under")
        for kind, path in paths.items():
            sheet.line(path, f"edge {STYLES[kind]}".strip())
        if source != NOW:
            _label(sheet, layout.box_end + STUB, layout.rows[source].line(links[0].key), links[-1])
        for edge in links:
            _draw_arrival(sheet, layout, edge)
        sheet.close()


def _draw_arrival(sheet: Sheet, layout: Layout, edge: Edge) -> None:
    """The head of an arrow, and beside a step the label."""
    style = STYLES[edge.kind]
    if isinstance(edge.target, str):
        height = layout.through[edge.fact] if edge.source == NOW else layout.rows[edge.source].line(edge.key)
        sheet.head(layout.goal, height, 1, style)
    else:
        height = layout.rows[edge.target].line(edge.key)
        sheet.head(layout.box if edge.source == NOW else layout.box_end, height, 1 if edge.source == NOW else -1, style)
        if edge.source != NOW:
            _label(sheet, layout.box_end + STUB, height, edge)
    if edge.source == NOW:
        _label(sheet, MARGIN + END + STUB, height, edge)


def _label(sheet: Sheet, x: float, height: float, edge: Edge) -> None:
    sheet.label(x, height, short(edge.fact), LABELS[edge.kind])


def _path(layout: Layout, edge: Edge) -> str:
    """The way of a link, with rounded corners where it enters and leaves its lane."""
    if isinstance(edge.target, str):
        if edge.source == NOW:
            return f"M{MARGIN + END} {layout.through[edge.fact]}H{layout.goal}"
        return f"M{layout.box_end} {layout.rows[edge.source].line(edge.key)}H{layout.goal}"
    end = layout.rows[edge.target].line(edge.key)
    if edge.source == NOW:
        return f"M{MARGIN + END} {end}H{layout.box}"
    start = layout.rows[edge.source].line(edge.key)
    lane = layout.lane(edge.key)
    turn = CORNER if end > start else -CORNER
    return (
        f"M{layout.box_end} {start}H{lane - CORNER}Q{lane} {start} {lane} {start + turn}"
        f"V{end - turn}Q{lane} {end} {lane - CORNER} {end}H{layout.box_end}"
    )


def _arrow(sheet: Sheet, start: float, end: float, height: float, style: str) -> None:
    sheet.line(f"M{start} {height}H{end}", f"edge {style}".strip())
    sheet.head(end, height, 1, style)


def _draw_steps(sheet: Sheet, layout: Layout, explanation: Explanation) -> None:
    """The steps that are done as lines of text, the others as boxes, dropped ones struck out."""
    for done in explanation.steps[: explanation.executed]:
        height = layout.top + LINE * (done.step - 0.5)
        sheet.text(layout.box + 12, height, short(f"{done.step} {done.action} (done)"), "faint")
    styles = {"kept": "box", "dropped": "box gone", "added": "box new"}
    for row in layout.rows.values():
        fate = row.step
        because = f", because of {' and '.join(fate.because)}" if fate.because else ""
        told = "" if fate.fate == "kept" else f"; {fate.fate}: {fate.reason}{because}"
        sheet.open(f"step {fate.step}: {fate.action}, cost {fate.cost}{told}")
        width = layout.box_end - layout.box
        sheet.box(layout.box, row.top, width, row.height, styles[fate.fate])
        middle = row.top + row.height / 2
        name = name_of(fate)
        sheet.text(layout.box + 12, middle, name, "name faint" if fate.fate == "dropped" else "name")
        if fate.fate == "dropped":
            sheet.line(f"M{layout.box + 8} {middle}H{layout.box + 16 + text_width(name)}", "edge strike")
        sheet.close()
