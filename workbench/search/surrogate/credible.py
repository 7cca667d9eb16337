"""Krigings of other trends, correlations and ranges, each as credible as it predicts left-out runs.

One fit of the ranges to a few dozen runs is one of many that the runs allow. Beside the likeliest of every
form stand those with all theta a few times larger or smaller; their weights are their leave-one-out
densities (Geisser and Eddy 1979), flattened by a power.
"""

from dataclasses import replace

import numpy as np

from workbench.search.surrogate.choice import prediction_score
from workbench.search.surrogate.kriging import NUGGET, Form, fitted
from workbench.search.surrogate.model import SearchModel

__all__ = ["credible_models", "deviation_factor"]

TRENDS, CORRELATIONS = ("constant", "linear"), ("matern52", "gaussian")
FACTORS = (0.4, 2.5, 6.0)  # of theta, beside the likeliest
SPARE = 3  # runs beyond the terms of a linear trend before it is tried
MOST_FACTOR = 2.0


def credible_models(
    features: np.ndarray,
    v: np.ndarray,
    *,
    nugget: float | str = NUGGET,
    trends: tuple[str, ...] = TRENDS,
    correlations: tuple[str, ...] = CORRELATIONS,
    factors: tuple[float, ...] = FACTORS,
    temper: float = 1.0,
    seed: int,
) -> tuple[list[SearchModel], np.ndarray]:
    """The models of values v (n,) at features (n, p), and their weights (k,), in sum 1.

    A weight is the leave-one-out density to the power of 1/temper.
    """
    n, p = features.shape
    found = []
    for trend in trends if n >= p + 1 + SPARE else ("constant",):
        for kind in correlations:
            form = Form(trend=trend, nugget=nugget, correlation=kind)
            best = fitted(features, v, form, seed=seed)
            scaled = (replace(form, theta=factor * best.kriging.theta_) for factor in factors)
            found += [best, *(fitted(features, v, one, seed=seed) for one in scaled)]
    scores = np.array([prediction_score(model) for model in found])
    weights = np.exp((scores - scores.max()) / temper)
    return found, weights / weights.sum()


def deviation_factor(model: SearchModel) -> float:
    """What leave-one-out makes of a model's deviations: the root mean square of the standardised errors,
    no less than 1 and no more than 2.
    """
    errors = model.kriging.leave_one_out()
    usable = np.isfinite(errors.std) & (errors.std > 0)
    spread = float(np.sqrt(np.mean(errors.standardised[usable] ** 2))) if usable.any() else 1.0
    return float(np.clip(spread, 1.0, MOST_FACTOR))
