"""Figures of a layout: data in, axes out, labelled; the data are the mappings of `layout.json`.

Lines differ in style as well as colour, so that a grey print tells them apart.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREY,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_density", "plot_front", "plot_layout", "plot_layout_history"]


@any_label
def plot_layout_history(
    history: Sequence[Mapping[str, Any]],
    *,
    label: str = "objective",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Every evaluation as a dot, refused ones hollow, the best so far as a stair; log scale when it spans
    much."""
    ax = current_axes(ax)
    number = np.array([h["evaluation"] for h in history])
    value = np.array([h["value"] for h in history], dtype=float)
    best = np.array([np.nan if h["best"] is None else h["best"] for h in history], dtype=float)
    taken = np.array([bool(h.get("accepted", True)) for h in history])
    ax.plot(number[taken], value[taken], "o", color=BLUE, markersize=3.5, label="evaluated")
    ax.plot(number[~taken], value[~taken], "o", mfc="none", color=GREY, markersize=3.5, label="refused")
    ax.step(number, best, where="post", color=VERMILLION, linewidth=1.6, label="best feasible")
    if value.min() > 0 and value.max() > 10 * np.nanmin(best):
        ax.set_yscale("log")
    ax.set_xlabel("evaluation")
    ax.set_ylabel(axis_label(label, unit))
    ax.legend(frameon=False)
    return ax


@any_label
def plot_density(density: Sequence[float], *, ax: "Axes | None" = None) -> "Axes":
    """Density of every member by its number, as in figures 7.4, 7.7, 7.10 and 7.13 of the dissertation."""
    ax = current_axes(ax)
    a = np.asarray(density, dtype=float)
    ax.vlines(np.arange(len(a)), 0, a, color=BLUE, linewidth=0.7)
    ax.set_xlim(-0.5, len(a) - 0.5)
    ax.set_ylim(0, max(1.0, 1.02 * a.max()))
    ax.set_xlabel("member")
    ax.set_ylabel("density")
    return ax


@any_label
def plot_layout(
    members: Sequence[Mapping[str, Any]], *, thickest: float = 1.8, unit: str = "m", ax: "Axes | None" = None
) -> "Axes":
    """Members as lines whose thickness is their density relative to the largest; every end is drawn.

    No threshold decides what is there: thin members are thin. Spatial members are seen along z.
    """
    from matplotlib.collections import LineCollection

    ax = current_axes(ax)
    density = np.array([m["density"] for m in members], dtype=float)
    ends = np.array([[m["point_a"][:2], m["point_b"][:2]] for m in members], dtype=float)
    share = density / max(float(density.max()), 1e-300)
    order = np.argsort(share)
    seen = order[share[order] > 1e-4]
    lines = LineCollection(
        list(ends[seen]), linewidths=thickest * share[seen], colors=BLUE, alpha=0.8, capstyle="round"
    )
    ax.add_collection(lines)
    for side, (colour, marker, name) in enumerate(((VERMILLION, "o", "body a"), (GREY, "s", "body b"))):
        points = np.unique(ends[:, side], axis=0)
        ax.plot(points[:, 0], points[:, 1], marker, color=colour, markersize=3, label=name)
    ax.set_aspect("equal")
    ax.margins(0.05)
    ax.locator_params(nbins=5)
    ax.set_xlabel(f"x [{unit}]")
    ax.set_ylabel(f"y [{unit}]")
    return ax


@any_label
def plot_front(
    points: Sequence[Sequence[float]],
    *,
    labels: tuple[str, str] = ("objective 1", "objective 2"),
    units: tuple[str, str] = ("1", "1"),
    knee: int | None = None,
    utopia: Sequence[float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """A front of two objectives, its knee ringed, the utopia point starred."""
    ax = current_axes(ax)
    front = np.asarray(points, dtype=float)
    order = np.argsort(front[:, 0])
    ax.plot(front[order, 0], front[order, 1], "o-", color=BLUE, markersize=4, linewidth=1, label="front")
    if knee is not None:
        ax.plot(*front[knee], "o", mfc="none", color=VERMILLION, markersize=11, label="knee")
    if utopia is not None:
        ax.plot(utopia[0], utopia[1], "*", color=GREY, markersize=9, label="utopia")
    ax.set_xlabel(axis_label(labels[0], units[0]))
    ax.set_ylabel(axis_label(labels[1], units[1]))
    ax.legend(frameon=False)
    return ax
