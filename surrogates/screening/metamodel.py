"""The Kriging of the inputs that a screening selected: what prediction, effects and intervals rest on."""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..errors import TooFewRuns
from ..kriging.estimator import Kriging
from .screener import KrigingScreener

__all__ = ["selected_kriging"]

STARTS = 4  # the screening has found the maximum already
# twenty refits of larger designs take long, and there plug-in intervals are hardly too narrow
CALIBRATED_RUNS = 300


def selected_kriging(
    screener: KrigingScreener,
    X: ArrayLike,
    y: ArrayLike,
    *,
    minor: bool = False,
    calibrated: bool = True,
    run_ids: Sequence[Hashable] | None = None,
) -> Kriging:
    """A Kriging of the selected columns of the runs X (n, d), y (n,) that the screener was fitted to.

    It starts from the theta of the screening. The nugget is estimated anew: noise is not interpolated, the
    floor of the screening does not blur what is smooth, and a screening of ranks says nothing about the noise
    of the response. Up to 300 runs that starts from a ladder, and deviations are those of a new run, scaled
    by cross-validation (see `surrogates.kriging.calibration`): `interval_factor_` says by how much. Predict
    with `mean, std = model.predict(screener.transform(X), return_std=True)`; mean +- 1.96 std is the 95 %
    interval of a run. Larger designs keep the plug-in deviation of the process, about which a new run
    scatters by nugget_ * sigma2_ more.

    `calibrated` off leaves deviations plug-in at any size and saves twenty refits: leave-one-out predictions
    are the same.

    `minor` takes those that are listed apart, too: below 1 % of the variance, and yet a better prediction.
    The model then takes X[:, columns] with the columns of `selected_` and `minor_`, ascending.

    Raises TooFewRuns when nothing was selected.

    >>> x = np.random.default_rng(1).random((30, 6))
    >>> y = np.sin(5 * x[:, 2]) + x[:, 4] ** 2
    >>> model = selected_kriging(KrigingScreener().fit(x, y), x, y)
    >>> model.n_features_in_, bool(model.diagnosis_.q2 > 0.99)
    (2, True)
    """
    check_is_fitted(screener)
    apart = screener.minor_.tolist() if minor else []
    columns = sorted([*screener.selected_.tolist(), *apart])
    if not columns:
        raise TooFewRuns("no input was selected, so there is nothing to model: add runs and screen again")
    labels = {int(k) % screener.n_features_in_ for k in screener.categorical}
    small = len(np.asarray(y)) <= CALIBRATED_RUNS
    model = Kriging(
        correlation="gaussian" if screener.eta_ == 2.0 else "power_exponential",
        eta=screener.eta_,
        nugget="ladder" if small else "estimate",
        theta_start=np.maximum(screener.theta_[columns], 1e-8),
        n_starts=STARTS,
        categorical=[i for i, k in enumerate(columns) if k in labels] or None,
        trend="constant",
        intervals="calibrated" if small and calibrated else "plug-in",
        seed=screener.seed,
    )
    return model.fit(screener.columns(X, columns), y, run_ids=run_ids)
