"""Figures of time histories of many runs: bands with the worst runs, and modes."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from workbench.figures.parts import BLUE, GREEN, GREY, PALE, VERMILLION, any_label, axis_label, current_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["QUANTILES", "plot_bands", "plot_modes"]

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
LINES = ((BLUE, "-"), (VERMILLION, "--"), (GREEN, ":"))


@any_label
def plot_bands(
    times: np.ndarray,
    quantiles: np.ndarray,
    *,
    runs: Sequence[np.ndarray] = (),
    worst: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None,
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Bands over time: `quantiles` (7, m) at QUANTILES over `times`.

    `runs`: lines (m,) drawn thin behind them.    `worst`: times and values of single runs by name.
    """
    ax = current_axes(ax)
    for row in runs:
        ax.plot(times, row, color=GREY, lw=0.35, alpha=0.5)
    for low, high, alpha, words in ((0, 6, 0.12, "all"), (1, 5, 0.22, "90 %"), (2, 4, 0.35, "50 %")):
        ax.fill_between(
            times,
            quantiles[low],
            quantiles[high],
            color=BLUE,
            alpha=alpha,
            lw=0,
            label=f"{words} of the runs",
        )
    ax.plot(times, quantiles[3], color=BLUE, lw=1.4, label="median")
    for (name, (t, y)), dashes in zip((worst or {}).items(), ("-", "--", ":"), strict=False):
        ax.plot(t, y, color=VERMILLION, lw=1.0, ls=dashes, label=name)
    ax.set(xlabel="time", ylabel=axis_label(label, unit), xlim=(times[0], times[-1]))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


@any_label
def plot_modes(
    times: np.ndarray,
    modes: np.ndarray,
    *,
    names: Sequence[str],
    label: str = "response",
    unit: str = "1",
    ax: "Axes | None" = None,
) -> "Axes":
    """Modes (k, m) over time, each as large as one standard deviation of its score."""
    ax = current_axes(ax)
    ax.axhline(0.0, color=PALE, lw=0.8)
    for row, name, (colour, dashes) in zip(modes, names, LINES, strict=False):
        ax.plot(times, row, color=colour, ls=dashes, label=name)
    ax.set(xlabel="time", ylabel=axis_label(f"deviation of {label}", unit), xlim=(times[0], times[-1]))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax
