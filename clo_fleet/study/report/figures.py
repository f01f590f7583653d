"""A report's figures as SVG, fit for a paper: text as text, colours that everybody can tell apart, no dates."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from clo_fleet.study.report.comparing import METRICS, OVERALL, Difference, Setting
from clo_fleet.study.report.counting import Helps
from clo_fleet.study.report.growing import FIGURES, SHARE, Growth

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["difference_figure", "growth_figure", "help_figure"]

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#e69f00", "#4b4b9b")  # Okabe and Ito
MARKERS = "osD^vPX*"
COLUMNS = 3
WIDE = 10  # the largest fleet is so many times the smallest: its axis is logarithmic


def difference_figure(found: Sequence[Difference], metric: str) -> str | None:
    """Each strategy's mean paired difference to the baseline with its interval, a line a setting.

    ``None`` if there are none, or the figure is zero in all runs.
    """
    chosen = [one for one in found if one.metric == metric]
    if not any(one.worth_showing for one in chosen):
        return None
    strategies = sorted({one.strategy for one in chosen})
    settings = sorted({one.setting for one in chosen}, key=lambda setting: (setting == OVERALL, setting))
    figure = _figure(6.5, 1.1 + 0.28 * len(chosen))
    axes = figure.subplots()
    named: set[str] = set()
    for one in chosen:
        number = strategies.index(one.strategy)
        height = -settings.index(one.setting) - 0.6 * (number - (len(strategies) - 1) / 2) / max(1, len(strategies))
        axes.errorbar(
            one.difference,
            height,
            xerr=[[one.difference - one.low], [one.high - one.difference]],
            color=COLOURS[number % len(COLOURS)],
            marker=MARKERS[number % len(MARKERS)],
            capsize=2,
            label=None if one.strategy in named else one.strategy,
        )
        named.add(one.strategy)
    axes.axvline(0.0, color="#888888", linewidth=1)
    axes.set_yticks([-index for index in range(len(settings))], [str(setting) for setting in settings])
    axes.locator_params(axis="x", nbins=6)
    whose = f" of {strategies[0]}" if len(strategies) == 1 else ""
    axes.set_xlabel(f"{METRICS[metric]}: difference{whose} to {chosen[0].baseline}")
    if len(strategies) > 1:
        figure.legend(frameon=False, loc="outside right upper")
    return _svg(figure)


def growth_figure(found: Sequence[Growth], setting: Setting) -> str:
    """How each figure grows with the fleet in a setting: each strategy's mean with its interval for every size.

    Figures that are zero in all runs are left out, but not the share of runs that reached their goals.
    """
    chosen = [one for one in found if one.setting == setting]
    drawn = [name for name in FIGURES if name == SHARE or any(one.mean for one in chosen if one.figure == name)]
    strategies, sizes = sorted({one.strategy for one in chosen}), sorted({one.robots for one in chosen})
    lines = -(-len(drawn) // COLUMNS)
    figure = _figure(9.0, 2.2 * lines + 0.4)
    grid = figure.subplots(lines, COLUMNS, squeeze=False)
    for axes, name in zip(grid.flat, drawn, strict=False):
        for number, strategy in enumerate(strategies):
            points = sorted(
                (one.robots, one.mean, one.mean - one.low, one.high - one.mean)
                for one in chosen
                if (one.figure, one.strategy) == (name, strategy)
            )
            robots, means, *below_above = zip(*points, strict=True) if points else ((), (), (), ())
            style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
            axes.errorbar(robots, means, yerr=below_above, label=strategy, markersize=4, capsize=2, **style)
        if sizes[-1] >= WIDE * sizes[0]:
            axes.set_xscale("log")
        axes.set_xticks(sizes, [str(size) for size in sizes])
        axes.minorticks_off()
        axes.set_xlabel("robots")
        axes.set_title(FIGURES[name])
        axes.set_ylim(0.0, 1.08 * max(one.high for one in chosen if one.figure == name) or 1.0)
        axes.grid(visible=True, alpha=0.3)
    for axes in grid.flat[len(drawn) :]:
        axes.set_axis_off()
    figure.legend(strategies, frameon=False, loc="outside lower center", ncols=len(strategies))
    return _svg(figure)


def help_figure(found: Sequence[Helps]) -> str | None:
    """Who helped whom, as a graph: an arrow from helper to helped, with how often a run; ``None`` if nobody did."""
    import networkx as nx

    graph: nx.DiGraph[str] = nx.DiGraph()
    for one in found:
        before = graph.get_edge_data(one.by, one.robot, {"weight": 0.0})["weight"]
        graph.add_edge(one.by, one.robot, weight=before + one.times / one.runs)
    if not graph:
        return None
    ordered: nx.DiGraph[str] = nx.DiGraph()
    ordered.add_nodes_from(sorted(graph))
    ordered.add_edges_from(graph.edges(data=True))
    places = {robot: (float(x), float(y)) for robot, (x, y) in nx.circular_layout(ordered).items()}
    edges: list[tuple[str, str, float]] = list(ordered.edges(data="weight"))
    side = max(4.2, 0.16 * len(ordered))
    figure = _figure(side, side)
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set_aspect("equal")
    most = max(weight for _, _, weight in edges)
    for by, robot, weight in edges:
        axes.annotate(
            "",
            xy=places[robot],
            xytext=places[by],
            arrowprops={
                "arrowstyle": "-|>",
                "connectionstyle": "arc3,rad=0.15",
                "color": COLOURS[0],
                "linewidth": 0.6 + 3.0 * weight / most,
                "shrinkA": 14,
                "shrinkB": 14,
            },
        )
        (x0, y0), (x1, y1) = places[by], places[robot]
        dx, dy = x1 - x0, y1 - y0
        axes.text(
            x0 + 0.42 * dx + 0.073 * dy,
            y0 + 0.42 * dy - 0.073 * dx,
            f"{weight:.2g}",
            fontsize=8,
            ha="center",
            va="center",
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"},
        )
    for robot, (x, y) in places.items():
        axes.text(x, y, robot, ha="center", va="center", bbox={"boxstyle": "circle", "fc": "white", "ec": "#444444"})
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.3, 1.3)
    return _svg(figure)


def _figure(width: float, height: float) -> "Figure":
    """An empty figure [inches]."""
    from matplotlib.figure import Figure  # heavy, and of use here only

    return Figure(figsize=(width, height), layout="constrained")


def _svg(figure: "Figure") -> str:
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "clo-fleet", "svg.fonttype": "none", "font.size": 9}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue()[text.getvalue().index("<svg") :]
