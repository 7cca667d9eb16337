"""How far an index moves with the runs: the delete-a-group jackknife.

A posterior knows how a response may go on between the runs, if it is a path of the process. Where it is not,
as with waves of one input that others shift, indices of the mean are off by more than paths vary. What the
runs themselves say of it: with S_i the index of the mean of a model refitted without group i of K,

    se^2 = (K - 1)/K sum_i (S_i - mean S)^2          (Kott, J. Official Statistics 17, 2001)

The groups are dealt along the values of the runs, so that another order of the rows gives the same.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from ..errors import NotPositiveDefinite, TooFewRuns
from ..kriging.calibration import dealt_groups
from ..kriging.estimator import Kriging
from ..kriging.posterior import Posterior

__all__ = ["jackknife_error", "posteriors_without_groups"]

Array = NDArray[np.float64]

GROUPS = 10
FEWEST = 5  # refits that a standard error is taken from


def posteriors_without_groups(kriging: Kriging) -> list[Posterior]:
    """Posteriors of the same form, each without a tenth of the runs: theta climbs anew, the nugget is kept.

    Fewer where too few runs are left for the trend.
    """
    runs = kriging._runs
    x = (runs.u + 0.5) * runs.scaling.width + runs.scaling.low
    noise = kriging._found.likelihood.noise
    variances = None if noise is None else noise * runs.scale**2
    model = clone(kriging).set_params(
        correlation=kriging.correlation_,
        trend=kriging.trend_,
        eta=kriging.eta_,
        nugget=kriging.nugget_,
        theta_start=kriging.theta_,
        n_starts=1,
        intervals="plug-in",
    )
    group = dealt_groups(runs, GROUPS, seed=kriging.seed)
    found = []
    for i in range(GROUPS):
        kept = group != i
        if kept.all():
            continue  # fewer runs than groups
        try:
            model.fit(x[kept], runs.observed[kept], noise=None if variances is None else variances[kept])
        except (TooFewRuns, NotPositiveDefinite):
            continue
        found.append(model.posterior_)
    return found


def jackknife_error(without: Sequence[Array]) -> Array:
    """Standard error (k,) of indices from those without each group, (k,) each; 0 from fewer than five.

    >>> means = [np.array([(21 - x) / 6]) for x in range(1, 7)]    # of six numbers, 3.5 with all
    >>> bool(np.isclose(jackknife_error([m * 6 / 5 for m in means])[0], np.sqrt(3.5 / 6)))
    True
    """
    if len(without) < FEWEST:
        return np.zeros(len(without[0]) if without else 1)
    shares = np.stack(without)
    return np.asarray(np.sqrt((len(shares) - 1) * shares.var(axis=0)))
