"""Points of the likelihood over partitions of the units, and what a search asks of that surface.

Coordinates: log theta of each group, log nugget last; the nugget is fixed where its bounds meet.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "FAILED",
    "HIGHEST",
    "LOWEST",
    "Landscape",
    "Optimum",
    "Partition",
    "bounds_of",
    "left_out_errors",
    "left_out_q2",
    "log_reach",
    "standard_scores",
]

Array = NDArray[np.float64]
Partition = tuple[tuple[int, ...], ...]  # units of each group; a unit in none has theta = 0

LOWEST, HIGHEST = -16.0, 6.0  # log theta on [0, 1]: a range of 3000 box widths, and of a twentieth
FAILED = -1e300  # l where the correlation matrix has no factor, as the compiled kernels say it


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """A point of the landscape: where an ascent ended.

    Attributes:
        partition: units of each group.
        phi: (m + 1,) log theta of each group, log nugget.
        value: l of the standardised response.
        sigma2: process variance of the standardised response.
        evaluations: how many likelihoods it took.
    """

    partition: Partition
    phi: Array
    value: float
    sigma2: float
    evaluations: int

    def log_theta(self, n_units: int) -> Array:
        """(u,) log theta of every unit; that of one without a group lies on the lower bound."""
        out = np.full(n_units, LOWEST)
        for group, value in zip(self.partition, self.phi, strict=False):
            out[list(group)] = value
        return out

    def log_effect(self, reach: Array) -> Array:
        """(u,) log of theta times the `reach` of every unit of a landscape, -inf where that is 0."""
        return self.log_theta(len(reach)) + log_reach(reach)

    def theta(self, n_units: int) -> Array:
        """(u,) theta of every unit, 0 on the lower bound."""
        log_theta = self.log_theta(n_units)
        return np.where(log_theta <= LOWEST, 0.0, np.exp(log_theta))


def log_reach(reach: Array) -> Array:
    """Logarithm of the reach of units, -inf for those that are constant."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(reach))


def bounds_of(m: int, nugget: tuple[float, float]) -> tuple[Array, Array]:
    """Lowest and highest (m + 1,) log theta of m groups and log nugget."""
    lower, upper = np.full(m + 1, LOWEST), np.full(m + 1, HIGHEST)
    lower[m], upper[m] = np.log(nugget[0]), np.log(nugget[1])
    return lower, upper


class Landscape(Protocol):
    """What a search needs."""

    n_units: int
    n_runs: int
    y: Array
    reach: Array
    """(u,) mean distance of each unit: theta times reach says how far a unit lowers the mean correlation.

    It is 0 for a unit that a part of the runs leaves constant, which has no effect there.
    """

    def climb(
        self,
        partition: Partition,
        start: Array,
        *,
        nugget: tuple[float, float],
        tolerance: float,
        max_evaluations: int,
    ) -> Optimum:
        """Climb from start; `nugget` bounds the nugget."""

    def value(self, partition: Partition, phi: Array) -> float:
        """l at phi."""

    def slopes(self, optimum: Optimum) -> tuple[Array, Array]:
        """dl / dlog theta and average information of every unit's own log theta, each (u,)."""

    def correlation(self, optimum: Optimum) -> Array:
        """R + nugget I, (n, n)."""


def standard_scores(landscape: Landscape, optimum: Optimum) -> Array:
    """(u,) for every unit: dl / dlog theta of its own, in standard deviations by the average information."""
    gradient, information = landscape.slopes(optimum)
    # both vanish with theta (as theta and theta^2), so the ratio has a limit at theta = 0
    return np.asarray(gradient / np.sqrt(np.maximum(information, 1e-300)))


def left_out_errors(landscape: Landscape, optimum: Optimum) -> Array:
    """(n,) errors of the leave-one-out predictions at an optimum, v_i / P_ii.

    nan for a run that the others do not inform about: the trend is fitted to it.
    """
    c, y = landscape.correlation(optimum), landscape.y.ravel()
    b = np.linalg.solve(c, np.column_stack([np.ones(len(y)), y]))
    inverse = np.linalg.inv(c)
    s11 = b[:, 0].sum()
    p = np.diagonal(inverse) - b[:, 0] ** 2 / s11
    v = b[:, 1] - b[:, 0] * (b[:, 1].sum() / s11)
    usable = p > 1e-12 * p.max()
    return np.where(usable, v / np.where(usable, p, 1.0), np.nan)


def left_out_q2(landscape: Landscape, optimum: Optimum) -> float:
    """Q^2 of the leave-one-out predictions at an optimum: 1 - sum (v_i / P_ii)^2 / sum y_i^2."""
    errors, y = left_out_errors(landscape, optimum), landscape.y.ravel()
    usable = np.isfinite(errors)
    spread = y[usable] - y.mean()
    return float(1.0 - (errors[usable] ** 2).sum() / (spread @ spread))
