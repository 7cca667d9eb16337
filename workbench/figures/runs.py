"""Figures of runs and of the quality of a design: data in, axes out, as in `workbench.figures.all`."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREY,
    ORANGE,
    PALE,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["beats", "plot_failures", "plot_percentiles", "plot_response"]


@any_label
def plot_response(
    values: Sequence[float | None],
    *,
    stages: Sequence[str],
    numbers: Sequence[int] | None = None,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Every run's response in the order run, by stage; a failed run is a cross on the axis.

    `numbers`: of the runs, where these are some of many.
    """
    ax = current_axes(ax)
    number = np.arange(1, len(values) + 1) if numbers is None else np.array(numbers)
    y = np.array([np.nan if v is None else v for v in values], dtype=float)
    for stage, marker in zip(dict.fromkeys(stages), "osD^vP*X<>" * len(stages), strict=False):
        of_stage = np.array([s == stage for s in stages]) & np.isfinite(y)
        if of_stage.any():
            ax.plot(number[of_stage], y[of_stage], marker, mfc="none", label=stage)
    failed = ~np.isfinite(y)
    if failed.any():
        ax.plot(
            number[failed], np.zeros(failed.sum()), "x", color="#1b1f24", clip_on=False, label="failed",
            transform=ax.get_xaxis_transform(),
        )  # fmt: skip
    ax.set(xlabel="run", ylabel=axis_label(label, unit))
    ax.legend(loc="best")
    return ax


@any_label
def plot_failures(
    parameters: Sequence[str], *, passed: np.ndarray, failed: np.ndarray, ax: "Axes | None" = None
) -> "Axes":
    """Where runs failed: per parameter the unit coordinates of good runs (n, d) and failed runs (m, d)."""
    ax = current_axes(ax)
    rows = np.arange(len(parameters))
    for j in rows:
        ax.plot(passed[:, j], np.full(len(passed), j + 0.12), "|", color=PALE, ms=7)
        ax.plot(failed[:, j], np.full(len(failed), j - 0.12), "x", color=VERMILLION, ms=5)
    ax.plot([], [], "|", color=PALE, ms=7, label="gave a value")
    ax.plot([], [], "x", color=VERMILLION, label="failed")
    ax.set(xlim=(-0.02, 1.02), xlabel="position between lower (0) and upper (1) bound")
    ax.set_yticks(rows, parameters)
    ax.set_ylim(len(parameters) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return ax


def beats(quality: Mapping[str, Any]) -> float | None:
    """Per cent of random Latin hypercubes that a design is better than, from {percentile, better}.

    `percentile` is the share of them with a smaller value, as `doe.Quality.to_dict` writes it.

    >>> beats({"percentile": 93.0, "better": "high"}), beats({"percentile": 31.0, "better": "low"})
    (93.0, 69.0)
    """
    below = quality.get("percentile")
    if below is None:
        return None
    return float(below) if quality["better"] == "high" else 100.0 - float(below)


@any_label
def plot_percentiles(quality: Mapping[str, Mapping[str, Any]], *, ax: "Axes | None" = None) -> "Axes":
    """Bars of the share of random Latin hypercubes that a design is better than, per quality."""
    ax = current_axes(ax)
    named = {name: share for name, q in quality.items() if (share := beats(q)) is not None}
    rows = range(len(named))
    shares = list(named.values())
    ax.barh(rows, shares, height=0.6, color=[BLUE if s >= 50 else ORANGE for s in shares])
    ax.axvline(50, color=GREY, lw=1, ls="--")
    for row, share in zip(rows, shares, strict=True):
        inside = share > 85
        ax.text(
            share + (-1.5 if inside else 1.5), row, f"{share:.0f} %", va="center",
            ha="right" if inside else "left", color="white" if inside else "#1b1f24", fontsize=8,
        )  # fmt: skip
    ax.set(xlim=(0, 100), xlabel="better than this share of random Latin hypercubes [%]")
    ax.set_yticks(rows, [name.replace("_", " ") for name in named])
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    return ax
