"""The Kriging of runs with noise: the nugget is the variance of a run about its mean, and is estimated.

What is searched is the mean, the process without the nugget: predictions, deviations and the value to beat
are those of the process, and no single run counts for more than its share.
"""

from dataclasses import replace

import numpy as np

from workbench.search.runs.noticeable_gain import noticeable_gain
from workbench.search.surrogate.choice import prediction_score
from workbench.search.surrogate.credible import credible_models
from workbench.search.surrogate.kriging import Form, fitted
from workbench.search.surrogate.model import SearchModel

__all__ = ["SLIGHT", "credible_noisy_models", "fit_noisy_model", "looks_noisy"]

# a nugget is suspect from a quarter of the values' standard deviation on, where the rest is explained; of 156
# searches without noise 8 on rough functions (Ackley's, Levy's) reach that, and are asked in vain
SUSPECT, EXPLAINED = 0.25, 0.3
# from here on a slight noise is possible; smooth functions without noise stay below it
SLIGHT = 0.03
GROWTH = 1.25  # of the number of runs, after which trend and correlation are chosen anew
MOST_INFLATION = 3.0
# noise hides whether a peak is smooth or kinked: log-likelihoods of a Gaussian and a Matern 3/2 correlation
# differ by less than 3 in 181 of 192 searches, and of kinked responses two in three are likelier Gaussian.
# Bounds come from the rougher; about a linear trend of unknown slopes they are no wider where all is smooth
ROUGH = "matern32"
ROUGHER = (0.4, 2.5, 6.0)  # factors of theta that are tried beside the likeliest
TEMPER = 4.0  # of the leave-one-out densities: a few dozen noisy runs do not tell one model from another
SPARE = 3  # runs beyond the terms of a linear trend before it is tried


def fit_noisy_model(
    features: np.ndarray, v: np.ndarray, *, previous: SearchModel | None, seed: int
) -> SearchModel:
    """The model of values v (n,) with noise at features (n, p), equal ones among them.

    `best` of the model is the largest mean that it predicts at a run.
    """
    n, p = features.shape
    if previous is not None and n < GROWTH * previous.chosen_at:
        form = Form(trend=previous.trend, nugget="estimate", correlation=previous.correlation)
        found = fitted(features, v, form, seed=seed, previous=previous)
        return _of_the_mean(found, features, chosen_at=previous.chosen_at)
    trends = ("constant", "linear") if n >= p + 1 + SPARE else ("constant",)
    rivals = [
        _likelier([fitted(features, v, Form(trend=trend, nugget="estimate", correlation=kind), seed=seed)
                   for kind in ("matern52", "gaussian")])
        for trend in trends
    ]  # fmt: skip
    return _of_the_mean(max(rivals, key=prediction_score), features, chosen_at=n)


def credible_noisy_models(
    features: np.ndarray, v: np.ndarray, *, seed: int
) -> tuple[list[SearchModel], np.ndarray]:
    """Rough models of other ranges, and how much each is believed (k,), in sum 1."""
    found, weights = credible_models(
        features,
        v,
        nugget="estimate",
        trends=("linear",),
        correlations=(ROUGH,),
        factors=ROUGHER,
        temper=TEMPER,
        seed=seed,
    )
    return [_of_the_mean(model, features, chosen_at=len(v)) for model in found], weights


def looks_noisy(model: SearchModel, least: float = SUSPECT) -> bool:
    """Whether a model with a free nugget, chosen by its likelihood, explains values but for noise, of which
    the standard deviation is more than the share `least` of theirs.
    """
    if model.kriging.nugget != "estimate" or model.q2 < EXPLAINED:
        return False
    deviation = float(np.sqrt(model.kriging.nugget_ * model.kriging.sigma2_))
    return deviation > least * model.scale


def _likelier(models: list[SearchModel]) -> SearchModel:
    return max(models, key=lambda model: model.kriging.log_likelihood_)


def _of_the_mean(model: SearchModel, features: np.ndarray, *, chosen_at: int) -> SearchModel:
    mean = model.mean(features)
    loo = model.kriging.leave_one_out()
    usable = np.isfinite(loo.std) & (loo.std > 0)
    spread = float(np.sqrt(np.mean(loo.standardised[usable] ** 2))) if usable.any() else 1.0
    return replace(
        model,
        best=float(mean.max()),
        noticeable=noticeable_gain(mean),
        inflation=float(np.clip(spread, 1.0, MOST_INFLATION)),
        chosen_at=chosen_at,
    )
