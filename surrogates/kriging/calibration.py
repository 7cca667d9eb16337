"""How wide prediction intervals must be to keep their promise: a factor from cross-validation with refits.

Plug-in intervals take theta as known and are mostly too narrow for few runs: on seven test functions with 30
to 80 runs nominal 95 % intervals held 71 to 93 % of new points. Where the response is much smoother than a
typical path of the process they are too wide. Leave-one-out at fixed theta does not show it, because every
run helped to choose theta. Here each twentieth of the runs is predicted by a model refitted to the rest.

    wider       the (1 + 1/n) 95 % quantile of the n standardised errors over 1.96, as in split-conformal
                prediction
    narrower    sqrt((a + n s^2)/(a + n)) t_{a + n}/1.96, where that quantile is below 1.96; s^2 is the mean
                square of the standardised errors. The 95 % point of the next one when errors are normal
                with unknown variance and a = 1.5 of variance one were seen before: the quantile of few runs
                rests on one error, which may be small by luck
    chosen      f^(n/(n + 20)) 1.45^(20/(n + 20)) where correlation and trend were chosen by the same runs:
                the likeliest of several forms claims too much, and one sample tells its factor poorly
"""

from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from sklearn.base import clone

from ..errors import NotPositiveDefinite, TooFewRuns
from ..likelihood.starts import canonical_rows
from .runs import Runs
from .validation import NORMAL_975

__all__ = ["MOST_REFITS", "Refittable", "conformal_factor_of", "dealt_groups", "interval_factor"]

FOLDS = 20  # ten leave a refit without a tenth of the runs, where it knows its own errors less well
PRIOR_ERRORS = 1.5  # of variance one, which count beside the observed where these are small
MOST_REFITS = 300  # runs; above, twenty refits take long and move theta no more
TYPICAL, RUNS_BEFORE = 1.45, 20.0  # factor of a form chosen by the runs, and how many runs it counts as
FEWEST = 10  # runs; below, a 95 % quantile is not worth the name


class Refittable(Protocol):
    """A fitted Kriging estimator, as far as its refits need it; deviations in the unit of y."""

    correlation_: str
    trend_: Any
    theta_: NDArray[np.float64]
    sigma2_: float
    nugget_: float
    seed: int

    def set_params(self, **parameters: Any) -> Self:
        """Other parameters of the estimator, as scikit-learn has it."""
        ...

    def fit(
        self, X: NDArray[np.float64], y: NDArray[np.float64], *, noise: NDArray[np.float64] | None
    ) -> Self:
        """Fit to runs X (n, d), y (n,) with known noise variances (n,)."""
        ...

    def predict(self, X: NDArray[np.float64], return_std: bool) -> Any:
        """Mean (m,) and deviation (m,) at X (m, d)."""
        ...


def interval_factor(
    kriging: Refittable, runs: Runs, *, noise: NDArray[np.float64] | None, chosen: bool = False
) -> float:
    """Factor > 0 on the standard deviations of a fitted model, whose form may have been `chosen` by the runs.

    1.0 for fewer than ten runs, and where the refits give fewer than ten errors to judge by.
    """
    n = len(runs.u)
    if n < FEWEST or runs.degenerate:
        return 1.0
    x = (runs.u + 0.5) * runs.scaling.width + runs.scaling.low
    model = clone(kriging).set_params(
        correlation=kriging.correlation_,
        trend=kriging.trend_,
        intervals="plug-in",
        theta_start=kriging.theta_,
        n_starts=1,
    )
    errors = _errors_of_refits(model, x, runs.observed, noise, dealt_groups(runs, FOLDS, seed=kriging.seed))
    if len(errors) < FEWEST:
        return 1.0
    wider = _conformal_factor(errors)
    factor = wider if wider >= 1.0 else min(1.0, _predictive_factor(errors))
    if not chosen:
        return factor
    share = n / (n + RUNS_BEFORE)
    return float(factor**share * TYPICAL ** (1.0 - share))


def dealt_groups(runs: Runs, count: int, *, seed: int) -> NDArray[np.intp]:
    """A group 0 to count - 1 for each run, (n,), in sizes that differ by one at most.

    They are dealt along the canonical order: each sees all of the range of y, in any order of the rows.
    """
    n = len(runs.u)
    order = canonical_rows(runs.u, runs.z)
    hands = np.tile(np.arange(count), (-(-n // count), 1))
    shuffled = np.random.default_rng(seed).permuted(hands, axis=1).ravel()
    group = np.empty(n, dtype=np.intp)
    group[order] = shuffled[:n]
    return group


def conformal_factor_of(standardised: NDArray[np.float64]) -> float:
    """Factor from the standardised leave-one-out errors (n,) of many runs at fixed theta."""
    return _conformal_factor(np.abs(standardised[np.isfinite(standardised)]))


def _errors_of_refits(
    model: Refittable,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    noise: NDArray[np.float64] | None,
    fold: NDArray[np.intp],
) -> NDArray[np.float64]:
    """Absolute standardised errors (<= n,) at the runs of each fold, predicted by a refit to the others."""
    errors: list[float] = []
    for i in range(FOLDS):
        out = fold == i
        if not out.any():
            continue  # fewer runs than folds
        try:
            model.fit(x[~out], y[~out], noise=None if noise is None else noise[~out])
        except (TooFewRuns, NotPositiveDefinite):
            continue  # the trend needs almost all runs
        mean, std = model.predict(x[out], return_std=True)
        variance = std**2 + model.nugget_ * model.sigma2_ + (0.0 if noise is None else noise[out])
        usable = variance > 0.0
        errors += (np.abs(y[out] - mean)[usable] / np.sqrt(variance[usable])).tolist()
    return np.array(errors)


def _conformal_factor(errors: NDArray[np.float64]) -> float:
    """The 95 % quantile of errors (m,) for one more of them, over that of the normal law."""
    rank = min(len(errors), int(np.ceil(0.95 * (len(errors) + 1))))
    return float(np.sort(errors)[rank - 1]) / NORMAL_975


def _predictive_factor(errors: NDArray[np.float64]) -> float:
    """The 95 % point of the predictive law of one more of the normal errors (m,), over that of their law."""
    count = PRIOR_ERRORS + len(errors)
    spread = np.sqrt((PRIOR_ERRORS + float(np.sum(errors**2))) / count)
    return float(spread * stats.t.ppf(0.975, count)) / NORMAL_975
