"""Leave-one-out validation of a Kriging model in closed form.

    y_i - m_(i) = v_i / P_ii,     s_(i)^2 = sigma^2 / P_ii

with v and P of `likelihood`: Dubrule (1983), Mathematical Geology 15, 687-699. The trend is estimated anew
without run i; theta, sigma^2 and the nugget stay.
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .posterior import Posterior
from .runs import Runs

__all__ = ["LeaveOneOut", "leave_one_out", "left_out"]

Array = NDArray[np.float64]
NORMAL_975 = 1.959963984540054


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaveOneOut:
    """Every run predicted from the others.

    Attributes:
        run_ids: (n,) as given to `fit`, else 0, 1, ...
        observed, prediction, std: (n,) in the unit of y; `std` includes the nugget and the noise of the run.
        variance: std squared.
        standardised: (observed - prediction) / std.
        q2: 1 - sum of squared errors / sum of squared deviations from the mean; nan for a constant response.
        coverage95: share of runs inside prediction +- 1.96 std.
        log_score: mean log density of the observed values, the larger the better.
    """

    run_ids: tuple[Hashable, ...]
    observed: Array
    prediction: Array
    std: Array
    standardised: Array
    q2: float
    coverage95: float
    log_score: float

    @property
    def variance(self) -> Array:
        """Predictive variance of each run."""
        return self.std**2


def leave_one_out(observed: Array, error: Array, std: Array, *, run_ids: tuple[Hashable, ...]) -> LeaveOneOut:
    """The record from leave-one-out errors and deviations (inf where the others cannot predict a run)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        standardised = np.where(std > 0.0, error / std, 0.0)
    usable = np.isfinite(std)
    deviation = observed - observed.mean()
    unit = float(np.abs(deviation).max()) or 1.0  # squares of a response of 1e-200 would be zero
    spread = float(((deviation / unit) ** 2)[usable].sum())
    squares = float(((error / unit)[usable] ** 2).sum())
    log_score = float("nan")
    if usable.any() and (std[usable] > 0.0).all():
        s = std[usable]
        log_score = float((-0.5 * standardised[usable] ** 2 - np.log(s) - 0.5 * np.log(2 * np.pi)).mean())
    for array in (observed, error, std, standardised):
        array.flags.writeable = False
    return LeaveOneOut(
        run_ids=run_ids,
        observed=observed,
        prediction=observed - error,
        std=std,
        standardised=standardised,
        q2=1.0 - squares / spread if spread > 0.0 else float("nan"),
        coverage95=float(np.mean(np.abs(standardised[usable]) <= NORMAL_975))
        if usable.any()
        else float("nan"),
        log_score=log_score,
    )


def left_out(posterior: Posterior, runs: Runs) -> LeaveOneOut:
    """Every one of the runs that the posterior rests on predicted from the others."""
    factor, scale = posterior.factor, runs.scale
    inverse = factor.inverse_diagonal()
    g = factor.trend_in_runs()
    diagonal = inverse - np.einsum("ij,ij->i", g, g)
    # a run that alone carries a trend term has P_ii = 0: the others cannot predict it
    lone = diagonal <= 1e-10 * inverse
    safe = np.where(lone, 1.0, diagonal)
    error = scale * np.where(lone, 0.0, posterior.weights / safe)
    std = scale * np.where(lone, np.inf, np.sqrt(posterior.sigma2 / safe))
    return leave_one_out(runs.observed.copy(), error, std, run_ids=runs.ids)
