"""A report's figures as SVG, fit for a paper: text as text, colours that everybody can tell apart, no dates."""

import io
from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING

from clo_fleet.study.batch.row import Row
from clo_fleet.study.report.comparing import METRICS, REACHED, Difference, Helps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["difference_figure", "growth_figure", "help_figure"]

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#e69f00", "#4b4b9b")  # Okabe and Ito
MARKERS = "osD^vPX*"
COLUMNS = 3


def difference_figure(found: Sequence[Difference], metric: str) -> str | None:
    """Each strategy's mean paired difference to the baseline with its interval, a line a setting; ``None`` without."""
    chosen = [one for one in found if one.metric == metric]
    if not chosen:
        return None
    strategies = sorted({one.strategy for one in chosen})
    settings = sorted({one.setting for one in chosen})
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
    axes.set_xlabel(f"{METRICS[metric]}, less {chosen[0].baseline}")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return _svg(figure)


def growth_figure(rows: Sequence[Row]) -> str | None:
    """How each figure grows with the fleet: the mean of each strategy against the number of robots.

    ``None`` if all fleets are of one size. Runs without their goals are left out.
    """
    reached = [row for row in rows if row.outcome == REACHED]
    if len({row.robots for row in reached}) < 2:
        return None
    lines = -(-len(METRICS) // COLUMNS)
    figure = _figure(9.0, 2.4 * lines)
    grid = figure.subplots(lines, COLUMNS, sharex=True, squeeze=False)
    strategies = sorted({row.strategy for row in reached})
    for index, (metric, name) in enumerate(METRICS.items()):
        axes = grid[index // COLUMNS][index % COLUMNS]
        for number, strategy in enumerate(strategies):
            by_size: dict[int, list[float]] = defaultdict(list)
            for row in reached:
                if row.strategy == strategy:
                    by_size[row.robots].append(getattr(row, metric))
            sizes = sorted(by_size)
            means = [sum(by_size[size]) / len(by_size[size]) for size in sizes]
            style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
            axes.plot(sizes, means, label=strategy, markersize=4, **style)
        axes.set_title(name)
        axes.set_ylim(bottom=0.0)
        axes.grid(visible=True, alpha=0.3)
    for axes in grid.flat[len(METRICS) :]:
        axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("robots")
    grid[0][-1].legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
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
    figure = _figure(5.0, 4.2)
    axes = figure.subplots()
    axes.set_axis_off()
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
            x0 + 0.42 * dx + 0.09 * dy,
            y0 + 0.42 * dy - 0.09 * dx,
            f"{weight:.2g}",
            fontsize=8,
            ha="center",
            va="center",
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
