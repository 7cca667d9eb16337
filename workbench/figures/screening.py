"""Figures of a screening: data in, axes out, as in `workbench.figures.all`.

Accepted and rejected steps differ by hatching as well as colour.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREY,
    PALE,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_likelihood_path", "plot_main_effect", "plot_theta", "plot_waterfall"]


@any_label
def plot_waterfall(
    path: Sequence[Mapping[str, Any]], *, threshold: float | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Gain of the restricted log-likelihood of every release; a rejected step is hatched and empty.

    The bars hang on the likelihood itself, so a step starts where the one before it ended. `threshold`, in
    units of the likelihood, is drawn above every step's start as a tick.
    """
    ax = current_axes(ax)
    level = None
    for k, step in enumerate(path):
        height = float(step.get("gain") or 0.0)
        top = float(step["log_likelihood"])
        base = top - height
        accepted = bool(step.get("accepted", True))
        ax.bar(
            k, height, bottom=base, width=0.62, color=BLUE if accepted else "white", zorder=2,
            edgecolor=BLUE if accepted else VERMILLION, hatch=None if accepted else "////",
        )  # fmt: skip
        if not height:
            ax.plot([k - 0.31, k + 0.31], [top, top], color=BLUE if accepted else VERMILLION, lw=2, zorder=3)
        if level is not None:
            ax.plot([k - 0.69, k + 0.31], [base, base], color=GREY, lw=0.8, ls=":", zorder=1)
        if threshold is not None and height:
            ax.plot([k - 0.4, k + 0.4], [base + threshold] * 2, color="#1b1f24", lw=1.1, zorder=4)
        if height:
            ax.annotate(
                f"{height:+.2f}", (k, max(top, base, base + (threshold or 0.0))), xytext=(0, 3),
                textcoords="offset points", ha="center", fontsize=8, zorder=5,
            )  # fmt: skip
        level = top
    ax.set_xticks(range(len(path)), [_step_label(step) for step in path])
    ax.set(xlabel="released at this step", ylabel="restricted log-likelihood l")
    ax.margins(y=0.12)
    ax.grid(axis="x", visible=False)
    if threshold is not None:
        ax.plot([], [], color="#1b1f24", lw=1.1, label=f"gain needed: {threshold:.3g}")
        ax.legend(loc="upper left")
    return ax


def _step_label(step: Mapping[str, Any]) -> str:
    added = step.get("added") or []
    if not added:
        return "common θ"
    text = added if isinstance(added, str) else "\n".join(added)
    return text if step.get("accepted", True) else f"({text})"


@any_label
def plot_likelihood_path(
    path: Sequence[Mapping[str, Any]], *, threshold: float | None = None, ax: "Axes | None" = None
) -> "Axes":
    """The restricted log-likelihood over the number of inputs with a range of their own, kept step marked."""
    ax = current_axes(ax)
    counts = [len(step["selected"]) for step in path]
    values = [float(step["log_likelihood"]) for step in path]
    ax.plot(counts, values, "-", color=GREY, lw=1)
    for kept, marker in ((True, "o"), (False, "X")):
        some = [k for k, step in enumerate(path) if bool(step.get("accepted", True)) == kept]
        if some:
            ax.plot(
                [counts[k] for k in some], [values[k] for k in some], marker,
                color=BLUE if kept else VERMILLION, label="accepted" if kept else "rejected",
            )  # fmt: skip
    if threshold is not None:
        ax.set_title(f"gain needed per input: {threshold:.3g}")
    ax.set(xlabel="inputs with a θ of their own", ylabel="restricted log-likelihood l")
    ax.legend(loc="lower right")
    return ax


@any_label
def plot_theta(
    theta: Mapping[str, float],
    *,
    selected: Sequence[str],
    at_bound: Sequence[str] = (),
    ax: "Axes | None" = None,
) -> "Axes":
    """Correlation parameters on a log axis, selected inputs filled; a value at the optimiser's bound is `<`.

    A dot chart, not bars: a logarithmic axis has no zero for a bar to stand on.
    """
    ax = current_axes(ax)
    names = sorted(theta, key=lambda name: -theta[name])
    values = np.array([theta[name] for name in names])
    positive = values[values > 0]
    floor = float(positive.min()) / 10 if len(positive) else 1e-6
    chosen = set(selected)
    for row, (name, value) in enumerate(zip(names, values, strict=True)):
        colour = BLUE if name in chosen else GREY
        bounded = name in at_bound or value <= 0
        ax.plot([floor, max(value, floor)], [row, row], color=PALE, lw=1)
        ax.plot(
            max(value, floor), row, "<" if bounded else "o", color=colour,
            mfc=colour if name in chosen else "white", ms=6,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set(xlabel="θ in the unit cube: larger is more active")
    ax.plot([], [], "o", color=BLUE, label="selected")
    ax.plot([], [], "o", color=GREY, mfc="white", label="not selected")
    ax.legend(loc="lower right")
    ax.grid(axis="y", visible=False)
    return ax


@any_label
def plot_main_effect(
    effect: Mapping[str, Sequence[float]],
    *,
    name: str,
    unit: str = "1",
    response: str = "response",
    response_unit: str = "1",
    limits: tuple[float, float] | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Mean response over one input, the others averaged out, with the 95 % band of that average."""
    ax = current_axes(ax)
    x = effect["x"]
    if all(isinstance(v, (int, float)) for v in x):
        ax.fill_between(x, effect["lower"], effect["upper"], color=BLUE, alpha=0.18, lw=0, label="95 % band")
        ax.plot(x, effect["mean"], color=BLUE)
    else:
        place, mean = np.arange(len(x)), np.asarray(effect["mean"])
        bars = [mean - np.asarray(effect["lower"]), np.asarray(effect["upper"]) - mean]
        ax.errorbar(place, mean, yerr=bars, fmt="o", color=BLUE, capsize=3)
        ax.set_xticks(place, [str(v) for v in x])
    ax.set(xlabel=axis_label(name, unit), ylabel=axis_label(response, response_unit))
    if limits is not None:
        ax.set_ylim(limits)
    return ax
