"""Figures of what a Kriging predicts of runs left out: data in, axes out, as in `workbench.figures.all`."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.figures.parts import (
    BLUE,
    GREY,
    NORMAL_95,
    VERMILLION,
    any_label,
    axis_label,
    current_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_predicted", "plot_quantiles", "plot_standardised"]


@any_label
def plot_predicted(
    leave_one_out: Mapping[str, Any], *, label: str = "response", unit: str = "1", ax: "Axes | None" = None
) -> "Axes":
    """Every run against the prediction of a Kriging that did not see it, with its 95 % bar."""
    ax = current_axes(ax)
    observed = np.asarray(leave_one_out["observed"], dtype=float)
    predicted = np.asarray(leave_one_out["predicted"], dtype=float)
    bar = NORMAL_95 * np.asarray(leave_one_out["std"], dtype=float)
    missed = np.abs(observed - predicted) > bar
    ends = [float(min(observed.min(), predicted.min())), float(max(observed.max(), predicted.max()))]
    ax.plot(ends, ends, color=GREY, lw=1, ls="--", zorder=1)
    for outside, colour, marker in ((False, BLUE, "o"), (True, VERMILLION, "s")):
        some = missed == outside
        if some.any():
            ax.errorbar(
                predicted[some], observed[some], xerr=bar[some], fmt=marker, ms=4, color=colour,
                elinewidth=0.8, alpha=0.9, label="outside its bar" if outside else "inside its bar",
            )  # fmt: skip
    ax.set(xlabel=axis_label("predicted without the run", unit), ylabel=axis_label(f"true {label}", unit))
    ax.legend(loc="upper left")
    return ax


@any_label
def plot_standardised(leave_one_out: Mapping[str, Any], *, ax: "Axes | None" = None) -> "Axes":
    """Leave-one-out errors in standard deviations over the prediction: no pattern, few beyond 2."""
    ax = current_axes(ax)
    predicted = np.asarray(leave_one_out["predicted"], dtype=float)
    z = np.asarray(leave_one_out["standardised"], dtype=float)
    ax.axhspan(-NORMAL_95, NORMAL_95, color=BLUE, alpha=0.08, lw=0)
    ax.axhline(0, color=GREY, lw=1)
    out = np.abs(z) > NORMAL_95
    ax.plot(predicted[~out], z[~out], "o", color=BLUE, ms=4)
    ax.plot(predicted[out], z[out], "s", color=VERMILLION, ms=4)
    ax.set(xlabel="predicted without the run", ylabel="error in standard deviations")
    return ax


@any_label
def plot_quantiles(leave_one_out: Mapping[str, Any], *, ax: "Axes | None" = None) -> "Axes":
    """Ordered standardised errors against those of a normal law: on the line, the stated bars are right."""
    from statistics import NormalDist

    ax = current_axes(ax)
    z = np.sort(np.asarray(leave_one_out["standardised"], dtype=float))
    law = NormalDist()
    expected = [law.inv_cdf((k + 0.5) / len(z)) for k in range(len(z))]
    ends = [expected[0], expected[-1]]
    ax.plot(ends, ends, color=GREY, lw=1, ls="--")
    ax.plot(expected, z, "o", color=BLUE, ms=4)
    ax.set(xlabel="expected of a normal law", ylabel="error in standard deviations")
    return ax
