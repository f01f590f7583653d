"""A sheet to draw on: SVG with light and dark colours, built as a tree so that every text is escaped.

Colours are those of Okabe and Ito, which people with any colour vision can tell apart; nothing is said by colour alone.
Rules name classes and spell out each colour twice, for light and for dark: viewers that know no variables and no media
queries show the light one, on a ground of its own.
"""

import re
from xml.etree import ElementTree

__all__ = ["CHARACTER", "LINE", "Sheet", "text_width"]

FONT = 12  # [px]
CHARACTER = 7.2  # [px] the width that each character of a text is given: 0.6 of the font's size, as in most of them
LINE = 18  # [px] from one line of text to the next

NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

COLOURS = {  # name: on light, on dark
    "ground": ("#ffffff", "#16181d"),
    "ink": ("#1b1f24", "#e6e8eb"),
    "faint": ("#6b7280", "#9aa2ad"),
    "line": ("#4b5563", "#aeb6c0"),
    "box": ("#f1f3f5", "#262a31"),
    "good": ("#0072b2", "#56b4e9"),
    "bad": ("#b34700", "#f08a4b"),
}
RULES = (  # selector, property, colour
    (".ground", "fill", "ground"),
    ("text", "fill", "ink"),
    (".faint", "fill", "faint"),
    (".good", "fill", "good"),
    (".bad", "fill", "bad"),
    (".box", "fill", "box"),
    (".box", "stroke", "line"),
    (".box.gone", "fill", "ground"),
    (".box.gone", "stroke", "faint"),
    (".box.new", "stroke", "good"),
    (".end", "fill", "line"),
    (".end-name", "fill", "ground"),
    (".under", "stroke", "ground"),
    (".edge", "stroke", "line"),
    (".edge.gone", "stroke", "faint"),
    (".edge.new", "stroke", "good"),
    (".edge.broken", "stroke", "bad"),
    (".head", "fill", "line"),
    (".head.gone", "fill", "faint"),
    (".head.new", "fill", "good"),
    (".head.broken", "fill", "bad"),
    (".strike", "stroke", "bad"),
)
SHAPES = f"""
text {{ font: {FONT}px "DejaVu Sans Mono", Menlo, Consolas, "Liberation Mono", monospace; }}
text.title {{ font-size: {FONT + 3}px; font-weight: bold; }}
text.name, text.end-name {{ font-weight: bold; }}
.box {{ stroke-width: 1.2; }}
.box.gone {{ stroke-dasharray: 4 3; }}
.box.new {{ stroke-width: 2.5; }}
.edge, .under {{ fill: none; }}
.edge {{ stroke-width: 1.4; }}
.under {{ stroke-width: 4.5; }}
.edge.gone {{ stroke-dasharray: 4 3; stroke-width: 1; }}
.edge.new {{ stroke-width: 2.8; }}
.edge.broken {{ stroke-dasharray: 2 3; stroke-width: 2; }}
.strike {{ stroke-width: 1.4; }}
"""


def text_width(text: str) -> float:
    """How wide the text is drawn [px]."""
    return CHARACTER * len(text)


class Sheet:
    """One drawing. Coordinates in pixels, x to the right, y down."""

    def __init__(self, width: float, height: float, title: str) -> None:
        size = {"width": _number(width), "height": _number(height)}
        self._root = ElementTree.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", **size, "role": "img"})
        self._root.set("viewBox", f"0 0 {size['width']} {size['height']}")
        self._at = [self._root]
        self._add("title").text = _clean(title)
        self._add("style").text = _style()
        self._add("rect", {"class": "ground", **size})

    def open(self, title: str) -> None:
        """Begin a group; whoever points at any part of it reads its title."""
        self._at.append(self._add("g"))
        self._add("title").text = _clean(title)

    def close(self) -> None:
        """End the group begun last."""
        self._at.pop()

    def label(self, x: float, y: float, text: str, kind: str) -> None:
        """A line of text that interrupts the line under it."""
        self.box(x - 3, y - FONT / 2, text_width(text) + 6, FONT, "ground", corner=0)
        self.text(x, y, text, kind)

    def text(self, x: float, y: float, text: str, kind: str = "", anchor: str = "start") -> None:
        """A line of text, its middle line at height ``y``, as wide as `text_width` says whatever the font."""
        place = {"x": _number(x), "y": _number(y + FONT / 3)}
        size = {"textLength": _number(text_width(text)), "lengthAdjust": "spacingAndGlyphs"} if kind != "title" else {}
        if anchor != "start":
            place["text-anchor"] = anchor
        self._add("text", {**place, **size, **_class(kind)}).text = _clean(text)

    def box(self, x: float, y: float, width: float, height: float, kind: str, corner: float = 5) -> None:
        """A rectangle."""
        sizes = {"x": x, "y": y, "width": width, "height": height, "rx": corner}
        self._add("rect", {**{key: _number(value) for key, value in sizes.items()}, **_class(kind)})

    def line(self, path: str, kind: str) -> None:
        """A line along a path in SVG's notation."""
        self._add("path", {"d": path, **_class(kind)})

    def head(self, x: float, y: float, direction: int, kind: str) -> None:
        """An arrow's head, its tip at (x, y), pointing right (1) or left (-1)."""
        back = _number(x - 8 * direction)
        points = f"{_number(x)},{_number(y)} {back},{_number(y - 4)} {back},{_number(y + 4)}"
        self._add("polygon", {"points": points, **_class(f"head {kind}".strip())})

    def to_svg(self) -> str:
        """The drawing as the text of an SVG file."""
        ElementTree.indent(self._root)
        return ElementTree.tostring(self._root, encoding="unicode", xml_declaration=False) + "\n"

    def _add(self, tag: str, attributes: dict[str, str] | None = None) -> ElementTree.Element:
        return ElementTree.SubElement(self._at[-1], tag, attributes or {})


def _style() -> str:
    light = "".join(f"{rule} {{ {what}: {COLOURS[colour][0]}; }}\n" for rule, what, colour in RULES)
    dark = "".join(f"  {rule} {{ {what}: {COLOURS[colour][1]}; }}\n" for rule, what, colour in RULES)
    return f"{SHAPES}{light}@media (prefers-color-scheme: dark) {{\n{dark}}}\n"


def _class(kind: str) -> dict[str, str]:
    return {"class": kind} if kind else {}


def _number(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


def _clean(text: str) -> str:
    """The text without characters that no XML file may hold."""
    return NOT_IN_XML.sub("\N{REPLACEMENT CHARACTER}", text)
