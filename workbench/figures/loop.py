"""Figures of the loop from a worst case to a layout and back: data in, axes out, as in
`workbench.figures.all`.

Members differ in form as well as colour, so that a grey print tells them apart: a belt is a plain line, an
airbag a row of beads, a retractor dashes.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    PURPLE,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from workbench.motion.frames import History

__all__ = [
    "plot_convergence",
    "plot_differences",
    "plot_distributions",
    "plot_history",
    "plot_layout_matrix",
    "plot_members",
    "plot_rounds",
]

KIND_COLOURS = {"belt": VERMILLION, "airbag": BLUE, "retractor": "#735605"}
WIDEST = 5.0  # points, at density 1
SQUARE = 60**0.5  # points, the edge of the square of the largest density
BEADS = 11.0  # points from one bead of an airbag to the next
FINEST = 0.05  # points: members whose widths differ by less are drawn as one line
THINNEST = 1e-3  # of the largest density: what no line can show
DASHES = ("-", "--", ":", "-.")
COLOURS = (VERMILLION, BLUE, GREEN, PURPLE, ORANGE)


@any_label
def plot_history(history: "History", *, times: np.ndarray, ax: "Axes | None" = None) -> "Axes":
    """A response over time, one line per run, told apart by dashes too; the limit dotted."""
    ax = current_axes(ax)
    for k, (label, values) in enumerate(history.series.items()):
        ax.plot(times, values, DASHES[k % 4], color=COLOURS[k % 5], label=label)
    if history.limit is not None:
        ax.axhline(history.limit, color="#1b1f24", lw=1, ls=(0, (1, 2)), label="limit")
    low, high = (end(float(end(values)) for values in history.series.values()) for end in (min, max))
    if history.drawn_to < high:
        ax.set_ylim(low - 0.05 * (history.drawn_to - low), history.drawn_to)
    ax.set(xlabel="time [s]", ylabel=axis_label(history.name, history.unit))
    ax.legend(loc="best")
    return ax


@any_label
def plot_convergence(
    history: Sequence[Mapping[str, Any]],
    *,
    baselines: Mapping[str, float] | None = None,
    label: str = "objective",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Every evaluated layout and the best so far; trivial layouts as level lines."""
    from matplotlib.ticker import MaxNLocator

    ax = current_axes(ax)
    number = [h.get("evaluation", k + 1) for k, h in enumerate(history)]
    best = np.minimum.accumulate([h.get("best", h["value"]) for h in history])
    ax.plot(number, [h["value"] for h in history], "o", color=PALE, mfc="none", label="evaluated")
    ax.step(number, best, where="post", color=BLUE, label="best so far")
    for k, (name, value) in enumerate((baselines or {}).items()):
        ax.axhline(value, color=GREY, lw=1.2, ls=DASHES[1 + k % 3], label=name)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlabel="evaluation", ylabel=axis_label(label, unit))
    ax.legend(loc="best")
    return ax


@any_label
def plot_rounds(
    rounds: Sequence[Mapping[str, Any]], *, label: str = "response", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """Of every round of a robust loop the bound of the known cases and the worst case found, joined."""
    from matplotlib.ticker import MaxNLocator

    ax = current_axes(ax)
    number = np.arange(1, len(rounds) + 1)
    bound, worst = (np.array([r[key] for r in rounds], dtype=float) for key in ("bound", "worst"))
    ax.vlines(number, bound, worst, color=GREY, lw=1)
    ax.plot(number, worst, "^", color=VERMILLION, label="worst case found")
    ax.plot(number, bound, "_", color=BLUE, ms=14, mew=2, label="bound of the known cases")
    ax.set(xlabel="round", ylabel=axis_label(label, unit), ylim=(0, 1.1 * float(worst.max())))
    ax.set_xlim(0.5, len(rounds) + 0.5)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend(loc="best")
    return ax


@any_label
def plot_layout_matrix(
    density: np.ndarray,
    *,
    rows: Sequence[str],
    columns: Sequence[str],
    largest: float = 1.0,
    ax: "Axes | None" = None,
) -> "Axes":
    """Densities (rows, columns) as squares whose area is the density; NaN where no member may be.

    Areas and a dot for an empty place read in grey print as well as on a screen.
    """
    ax = current_axes(ax)
    there = np.argwhere(~np.isnan(density))
    size = np.array([density[i, j] for i, j in there]) / (largest or 1.0)
    ax.plot(there[:, 1], there[:, 0], ".", ms=1.4, mew=0, color=GREY)
    side = np.rint(SQUARE * np.sqrt(np.maximum(size, 0.0)) / FINEST) * FINEST
    for edge in np.unique(side[side > 0.0]):
        row, column = there[side == edge].T
        ax.plot(column, row, "s", ms=edge, mew=0, color="#1b1f24")
    ax.set_yticks(range(len(rows)), rows, fontsize=7)
    ax.set_xticks(range(len(columns)), columns, fontsize=6, rotation=90)
    ax.set(xlim=(-0.7, len(columns) - 0.3), ylim=(len(rows) - 0.3, -0.7))
    ax.grid(visible=False)
    return ax


def _hull(points: np.ndarray) -> np.ndarray:
    """Corners of the convex hull of points (k, 2) in order; the two ends of points on a line."""
    from scipy.spatial import ConvexHull

    centred = points - points.mean(axis=0)
    strength = np.linalg.svd(centred, full_matrices=False)[1]
    if len(points) < 3 or strength[-1] <= 1e-9 * max(strength[0], 1e-300):
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        return points[[int(along.argmin()), int(along.argmax())]]
    return points[ConvexHull(points).vertices]


def _apart(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments (n, 2, 2) as one line with gaps: what it looks like is then written once."""
    with_gaps = np.concatenate([segments, np.full((len(segments), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    return with_gaps[:, 0], with_gaps[:, 1]


@any_label
def plot_members(
    members: Sequence[Mapping[str, Any]],
    *,
    outlines: Sequence[Sequence[Sequence[float]]] = (),
    bodies: Sequence[Mapping[str, Any]] = (),
    axes: tuple[int, int] = (0, 1),
    unit: str = "m",
    ax: "Axes | None" = None,
) -> "Axes":
    """Members between their ends `a` and `b`, seen along the axis that is not in `axes`.

    Behind them outlines (x, y), and `bodies` (name, points) as the hulls of their points. The width is the
    density relative to the largest; no threshold decides what is there.
    """
    ax = current_axes(ax)
    seen = list(axes)
    for outline in outlines:
        points = np.asarray(outline, dtype=float)
        ax.fill(points[:, 0], points[:, 1], facecolor="#eef1f4", edgecolor=GREY, lw=1, zorder=1)
    for body in bodies:
        points = np.asarray(body["points"], dtype=float)[:, seen]
        hull = _hull(points)
        ax.fill(hull[:, 0], hull[:, 1], facecolor="#eef1f4", edgecolor=GREY, lw=1, alpha=0.6, zorder=1)
        ax.plot(points[:, 0], points[:, 1], ".", color=GREY, ms=2, zorder=1)
        ax.annotate(str(body["name"]), points.mean(axis=0), color=GREY, ha="center", va="bottom", zorder=4)
    largest = max((float(m["density"]) for m in members), default=0.0) or 1.0
    # a thousand members are drawn finer than ten
    widest = WIDEST / max(1.0, len(members) / 100) ** 0.5
    ends: dict[tuple[int, str], list[Any]] = {}  # of members that look as wide
    for m in members:
        share = float(m["density"]) / largest
        if share >= THINNEST:
            level = math.ceil(widest * share / FINEST)
            ends.setdefault((level, str(m["kind"])), []).append([[m[end][k] for k in seen] for end in "ab"])
    thickest: dict[str, Any] = {}  # of each kind, for the legend
    for (level, kind), some in sorted(ends.items()):
        x, y = _apart(np.array(some, dtype=float))
        colour, width = KIND_COLOURS.get(kind, "#1b1f24"), FINEST * level
        if kind == "airbag":
            ax.plot(x, y, "-", color=colour, lw=0.6, zorder=2)
            beads = (0, (0.01, BEADS / (2 + width)))  # in widths; of members behind each other in one place
            (thickest[kind],) = ax.plot(
                x, y, ls=beads, dash_capstyle="round", color=colour, lw=2 + width, zorder=3
            )
        else:
            dash = (0, (2.2, 1.4)) if kind == "retractor" else "-"
            (thickest[kind],) = ax.plot(x, y, ls=dash, color=colour, lw=width, zorder=3)
    ax.set_aspect("equal")
    ax.set(xlabel=axis_label("xyz"[seen[0]], unit), ylabel=axis_label("xyz"[seen[1]], unit))
    if thickest:
        ax.legend(thickest.values(), thickest, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


@any_label
def plot_distributions(
    values: Mapping[str, Sequence[float | None]],
    *,
    limit: float | None = None,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Share of scenarios at or below a value, one stair per design; the limit dotted."""
    ax = current_axes(ax)
    for k, (name, given) in enumerate(values.items()):
        y = np.sort([v for v in given if v is not None])
        if len(y):
            share = np.arange(1, len(y) + 1) / len(y) * 100
            ax.step(y, share, DASHES[k % 4], where="post", color=COLOURS[k % 5], label=name)
    if limit is not None:
        ax.axvline(limit, color="#1b1f24", lw=1, ls=(0, (1, 2)), label="limit")
    ax.set(ylim=(0, 101), xlabel=axis_label(label, unit), ylabel="scenarios at or below [%]")
    ax.legend(loc="best")
    return ax


@any_label
def plot_differences(
    first: Sequence[float | None],
    second: Sequence[float | None],
    *,
    names: tuple[str, str],
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Two designs in the same scenarios: below the diagonal the second has the smaller value."""
    ax = current_axes(ax)
    pairs = np.array([(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None])
    ends = [float(pairs.min()), float(pairs.max())]
    ax.plot(ends, ends, color=GREY, lw=1, ls="--")
    worse = pairs[:, 1] > pairs[:, 0]
    ax.plot(*pairs[~worse].T, "o", ms=3, color=BLUE, alpha=0.6, label=f"{names[1]} smaller: {(~worse).sum()}")
    ax.plot(
        *pairs[worse].T, "x", ms=4, color=VERMILLION, alpha=0.8, label=f"{names[1]} larger: {worse.sum()}"
    )
    ax.set(xlabel=axis_label(names[0], unit), ylabel=axis_label(names[1], unit))
    ax.legend(loc="upper left")
    return ax
