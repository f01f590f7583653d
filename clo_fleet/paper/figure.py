"""The paper's figure from our rows: total time against problem on a logarithmic axis, and REPLAN's over CLO's."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from clo_fleet.paper.catalogue import PROBABILITIES, SETTINGS, SIZES
from clo_fleet.paper.settings import problem_name
from clo_fleet.paper.summary import Cell, Key, later_time, ratios, spread_at, total_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw"]

COLOURS: Mapping[str, str] = MappingProxyType({"clo": "#1b7837", "replan": "#762a83"})
MARKERS: Mapping[float, str] = MappingProxyType(dict(zip(PROBABILITIES, "os^", strict=True)))
STYLES: Mapping[float, str] = MappingProxyType(dict(zip(PROBABILITIES, ("-", "--", ":"), strict=True)))


def draw(found: Mapping[Key, Cell], paths: tuple[Path, ...]) -> None:
    """Draw the figure into each of the files; their suffixes say in which format.

    A line ends where most runs met a limit, as in the paper.
    """
    import matplotlib as mpl  # heavy, and of use here only
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context({"svg.hashsalt": "clo-fleet", "font.size": 9}):
        figure = Figure(figsize=(10.0, 6.5), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(2, len(SETTINGS), sharex=True, sharey="row")
        for column, domain in enumerate(SETTINGS):
            _times(axes[0][column], found, domain)
            _ratios(axes[1][column], found, domain)
        axes[0][0].set_ylabel("total time [s]")
        axes[1][0].set_ylabel("REPLAN / CLO")
        for row in axes:
            row[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
        for path in paths:
            figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else {})


def _times(axes: "Axes", found: Mapping[Key, Cell], domain: str) -> None:
    """Planning and deciding of a whole run."""
    for strategy, colour in COLOURS.items():
        for p in PROBABILITIES:
            times = {size: spread_at(found, (domain, size, p), strategy, total_time) for size in SIZES}
            label = f"{strategy.upper()} {p:g}"
            _line(axes, {size: spread.mean for size, spread in times.items() if spread}, p, colour, label)
    axes.set_title(domain.upper())


def _ratios(axes: "Axes", found: Mapping[Key, Cell], domain: str) -> None:
    """How many times CLO's time REPLAN's is, with and without the first plan."""
    for figure, colour, what in ((total_time, "#000000", "total"), (later_time, "#e08214", "later")):
        by_place = ratios(found, figure)
        for p in PROBABILITIES:
            known = {size: by_place[domain, size, p] for size in SIZES if (domain, size, p) in by_place}
            _line(axes, known, p, colour, f"{what} {p:g}")


def _line(axes: "Axes", values: Mapping[int, float], p: float, colour: str, label: str) -> None:
    places = [SIZES.index(size) for size in values]
    heights = list(values.values())
    axes.plot(places, heights, label=label, color=colour, linestyle=STYLES[p], marker=MARKERS[p], markersize=4)
    axes.set_yscale("log")
    axes.set_xticks(range(len(SIZES)), [problem_name(size) for size in SIZES])
    axes.set_xlim(-0.3, len(SIZES) - 0.7)
    axes.grid(visible=True, which="major", alpha=0.3)
