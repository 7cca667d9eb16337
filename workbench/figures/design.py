"""Figures of a design: every pair of parameters, correlations, distances."""

from typing import TYPE_CHECKING

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.figures.parts import any_label
from workbench.sampling.plan import Design

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_correlations", "plot_design", "plot_distances", "plot_pair", "plot_pairs"]

MOST_STRATA = 60
MOST_PAIRS = 12
MOST_NUMBERS = 12


def _axes(ax: "Axes | None") -> "Axes":
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(layout="constrained").add_subplot()


def _label(design: Design, name: str) -> str:
    p = design.space[name]
    text = p.label or p.name
    return text if p.unit in ("1", "") else f"{text} [{p.unit}]"


@any_label
def plot_pair(design: Design, x: str, y: str, *, ax: "Axes | None" = None) -> "Axes":
    """Runs over two parameters in physical values; up to 60 runs, lines mark the strata of an LHS."""
    ax = _axes(ax)
    i, j = design.space.names.index(design.space[x].name), design.space.names.index(design.space[y].name)
    physical = design.physical
    ax.scatter(physical[:, i], physical[:, j], s=16, zorder=3)
    n = len(design)
    if n <= MOST_STRATA:
        for place, line in ((i, ax.axvline), (j, ax.axhline)):
            p = design.space.parameters[place]
            if p.levels_count is None:
                for edge in p.physical(np.arange(n + 1) / n):
                    line(float(edge), color="0.9", linewidth=0.5, zorder=1)
    for place, axis in ((i, ax.xaxis), (j, ax.yaxis)):
        if design.space.parameters[place].scale == "log":
            (ax.set_xscale if axis is ax.xaxis else ax.set_yscale)("log")
    ax.set_xlabel(_label(design, x))
    ax.set_ylabel(_label(design, y))
    return ax


@any_label
def plot_pairs(design: Design, *, ax: "Axes | None" = None) -> "Axes":
    """Unit coordinates of all pairs of parameters, as a triangle of small squares in one frame.

    Raises: StudyError for more than 12 parameters: the squares would be too small.
    """
    ax = _axes(ax)
    d = design.space.dimension
    if d > MOST_PAIRS:
        raise StudyError(
            f"all pairs of {d} parameters are too many for one figure; use plot_pair for two of them"
        )
    gap = 1.12
    for row in range(d):
        for column in range(row + 1):
            left, bottom = column * gap, (d - 1 - row) * gap
            ax.plot(
                [left, left + 1, left + 1, left, left],
                [bottom, bottom, bottom + 1, bottom + 1, bottom],
                color="0.7",
                linewidth=0.6,
            )
            if row == column:
                counts = np.histogram(design.unit[:, row], bins=10, range=(0.0, 1.0))[0]
                heights = 0.9 * counts / max(counts.max(), 1)
                ax.bar(left + (np.arange(10) + 0.5) / 10, heights, width=0.1, bottom=bottom, color="0.75")
            else:
                ax.scatter(left + design.unit[:, column], bottom + design.unit[:, row], s=5, color="C0")
    ax.set_xlim(-0.1, d * gap)
    ax.set_ylim(-0.1, d * gap)
    ax.set_xticks([k * gap + 0.5 for k in range(d)], design.space.names, rotation=45, ha="right")
    ax.set_yticks([(d - 1 - k) * gap + 0.5 for k in range(d)], design.space.names)
    ax.tick_params(length=0)
    ax.grid(False)
    ax.set_frame_on(False)
    ax.set_aspect("equal")
    return ax


@any_label
def plot_correlations(design: Design, *, ax: "Axes | None" = None) -> "Axes":
    """Correlation of every pair of parameters in the unit cube, as a map from -1 to 1."""
    ax = _axes(ax)
    matrix = doe.correlations(design.unit)
    shown = np.ma.masked_where(np.eye(len(matrix), dtype=bool), matrix)
    picture = ax.imshow(shown, cmap="RdBu_r", vmin=-1, vmax=1)
    ax.grid(False)
    names = design.space.names
    ax.set_xticks(range(len(names)), names, rotation=45, ha="right")
    ax.set_yticks(range(len(names)), names)
    if len(names) <= MOST_NUMBERS:
        for i in range(len(names)):
            for j in range(len(names)):
                if i != j:
                    colour = "white" if abs(matrix[i, j]) > 0.6 else "black"
                    ax.text(
                        j,
                        i,
                        f"{matrix[i, j]:.2f}".replace("-0.00", "0.00"),
                        ha="center",
                        va="center",
                        fontsize=7,
                        color=colour,
                    )
    figure = ax.get_figure()
    if figure is not None:
        figure.colorbar(picture, ax=ax, label="correlation")
    return ax


@any_label
def plot_distances(design: Design, *, seed: int = 0, ax: "Axes | None" = None) -> "Axes":
    """Histogram of the distance of every run to its nearest neighbour, beside a random Latin hypercube's."""
    ax = _axes(ax)
    n, d = design.unit.shape
    if n < 2:
        raise StudyError("distances need at least two runs")
    own = doe.nearest_distances(design.unit)
    random = doe.nearest_distances(doe.lhs(n, d, rng=np.random.default_rng(seed)))
    low, high = min(own.min(), random.min()), max(own.max(), random.max())
    bins = np.linspace(low, high if high > low else low + 1e-6, 21).tolist()
    ax.hist(random, bins=bins, color="0.8", label="random Latin hypercube")
    ax.hist(own, bins=bins, histtype="step", linewidth=1.8, color="C0", label=design.algorithm)
    ax.set_xlabel("distance to the nearest run, side of the cube = 1")
    ax.set_ylabel("runs")
    ax.legend(frameon=False)
    return ax


@any_label
def plot_design(design: Design) -> "Figure":
    """All pairs (of at most 12 parameters), the correlation map and the distances in one figure."""
    from matplotlib import style
    from matplotlib.figure import Figure

    pairs = design.space.dimension <= MOST_PAIRS
    with style.context("workbench.style"):
        figure = Figure(figsize=(13.0 if pairs else 9.0, 4.6), layout="constrained")
        axes = list(figure.subplots(1, 3 if pairs else 2))
        if pairs:
            plot_pairs(design, ax=axes.pop(0)).set_title("pairs, unit coordinates")
        plot_correlations(design, ax=axes[0]).set_title("correlations")
        if len(design) > 1:
            plot_distances(design, ax=axes[1]).set_title("nearest runs")
    return figure
