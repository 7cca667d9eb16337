"""How wide prediction intervals must be to keep their promise: a factor from cross-validation with refits.

Plug-in intervals take theta as known and are mostly too narrow for few runs: on seven test functions with 30
to 80 runs nominal 95 % intervals held 71 to 93 % of new points. Where the response is much smoother than a
typical path of the process they are too wide. Leave-one-out at fixed theta does not show it, because every
run helped to choose theta. Here each tenth of the runs is predicted by a model refitted to the rest. The
factor is the (1 + 1/n) 95 % quantile of standardised errors over 1.96, as in split-conformal prediction. One
below 1 is drawn towards 1, as by twenty more runs that ask for no change: with few runs it rests on one
error.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from .errors import NotPositiveDefinite, TooFewRuns
from .runs import Runs
from .starts import canonical_rows
from .validation import NORMAL_975

if TYPE_CHECKING:
    from .kriging import Kriging

__all__ = ["interval_factor"]

FOLDS = 10
SCEPTIC = 20  # runs that ask for no change, where the others ask for narrower intervals
FEWEST = 10  # runs; below, a 95 % quantile is not worth the name


def interval_factor(kriging: "Kriging", runs: Runs, *, noise: NDArray[np.float64] | None) -> float:
    """Factor > 0 on the standard deviations of a fitted model.

    1.0 for fewer than ten runs, and for a response that every refit reproduces.
    """
    n = len(runs.u)
    if n < FEWEST or runs.degenerate:
        return 1.0
    x = (runs.u + 0.5) * runs.scaling.width + runs.scaling.low
    model = clone(kriging).set_params(calibration="none", theta_start=kriging.theta_, n_starts=1)
    # the folds are dealt along the canonical order: each sees all of the range of y, in any order of the rows
    order = canonical_rows(runs.u, runs.z)
    shuffled = np.random.default_rng(kriging.seed).permuted(_dealt(n), axis=1).ravel()
    fold = np.empty(n, dtype=np.intp)
    fold[order] = shuffled[:n]
    errors: list[float] = []
    for i in range(FOLDS):
        out = fold == i
        part = None if noise is None else noise[~out]
        try:
            model.fit(x[~out], runs.observed[~out], noise=part)
        except (TooFewRuns, NotPositiveDefinite):
            continue  # the trend needs almost all runs
        mean, std = model.predict(x[out], return_std=True)
        variance = std**2 + model.nugget_ * model.sigma2_ + (0.0 if noise is None else noise[out])
        usable = variance > 0.0
        errors += (np.abs(runs.observed[out] - mean)[usable] / np.sqrt(variance[usable])).tolist()
    if len(errors) < FEWEST:
        return 1.0
    rank = min(len(errors), int(np.ceil(0.95 * (len(errors) + 1))))
    factor = float(np.sort(errors)[rank - 1]) / NORMAL_975
    return factor if factor > 1.0 else factor ** (n / (n + SCEPTIC)) or 1.0


def _dealt(n: int) -> NDArray[np.intp]:
    """Fold numbers in hands of ten, enough for n runs."""
    return np.tile(np.arange(FOLDS), (-(-n // FOLDS), 1))
