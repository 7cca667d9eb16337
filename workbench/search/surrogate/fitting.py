"""The models that a search fits: its own with a cautious twin, one around a peak, the roughest credible."""

from dataclasses import replace

import numpy as np

from workbench.search.surrogate.choice import chosen_model
from workbench.search.surrogate.kriging import NUGGET, Form, fitted
from workbench.search.surrogate.model import SearchModel

__all__ = ["believing", "fit_local_model", "fit_rough_model", "fit_search_model"]

ROUGHER, ROUGHEST_STEPS = 1.35, 12  # all theta are raised by this factor, at most so often,
CREDIBLE = 2.0  # while the log-likelihood falls by less than this: half the 95 % point of chi^2_1
LOCAL_RUNS, FEWEST_LOCAL_RUNS = 5, 10  # of the model around a peak: per feature, and at least
CAUTION = 0.1  # smallest theta of the cautious model, of the mean theta


def fit_search_model(
    features: np.ndarray,
    v: np.ndarray,
    *,
    previous: SearchModel | None,
    seed: int,
    scale: str = "auto",
    sign: float = 1.0,
) -> SearchModel:
    """Fit to features (n, p) and values v = sign y (n,) to be maximised, with its cautious twin beside it."""
    model = chosen_model(features, v, previous=previous, seed=seed, scale=scale, sign=sign)
    before = None if previous is None else previous.cautious
    return replace(model, cautious=_cautious(features, v, model, before, seed=seed))


def believing(model: SearchModel, features: np.ndarray, v: np.ndarray) -> SearchModel:
    """The model as if runs that are under way had given what it predicts: v (n,) at features (n, p), the
    believed ones last. Ranges, trend, transform and nugget are kept.

    The kriging believer of Ginsbourger, Le Riche and Carraro (2010): the mean stays, its deviation falls
    where runs are under way, so that the rest of a batch goes elsewhere.
    """
    form = Form(
        trend=model.trend,
        transform=model.transform,
        nugget=model.kriging.nugget_,
        correlation=model.correlation,
        theta=model.kriging.theta_,
    )
    # a believed run is predicted without error, which says nothing about the errors of the model
    return replace(
        fitted(features, v, form, seed=model.kriging.seed),
        inflation=model.inflation,
        noticeable=model.noticeable,
        scale=model.scale,
        chosen_at=model.chosen_at,
        cautious=None if model.cautious is None else believing(model.cautious, features, v),
    )


def _cautious(
    features: np.ndarray, v: np.ndarray, model: SearchModel, before: SearchModel | None, *, seed: int
) -> SearchModel:
    """A model that takes no input for inert and no response for smooth.

    Matern 5/2 on the plain values; every theta at least a tenth of their mean. Runs that crowd around one
    peak can make an input look inert that decides about another peak; a search and a gap that believe it miss
    that peak.
    """
    form = Form(trend=model.trend, transform=model.transform)
    if before is not None and model.chosen_at != model.n_runs:
        # between two choices of the model the ranges are kept: caution needs no fine tuning
        return fitted(features, v, replace(form, theta=before.kriging.theta_), seed=seed)
    # cold: a warm start would keep the endless ranges that a few runs on a slope once suggested
    plain = fitted(features, v, form, seed=seed)
    theta = plain.kriging.theta_
    floor = CAUTION * float(theta.mean())
    if (theta >= floor).all():
        return plain
    return fitted(features, v, replace(form, theta=np.maximum(theta, floor)), seed=seed)


def fit_local_model(features: np.ndarray, v: np.ndarray, centre: np.ndarray, *, seed: int) -> SearchModel:
    """A model of the runs nearest to `centre` (p,), five per feature, on the plain values.

    Runs that crowd around another peak can make an input look inert that decides here.
    """
    count = max(LOCAL_RUNS * features.shape[1], FEWEST_LOCAL_RUNS)
    near = np.sort(np.argsort(((features - centre) ** 2).sum(axis=1), kind="stable")[:count])
    return fitted(features[near], v[near], Form(trend="constant"), seed=seed)


def fit_rough_model(features: np.ndarray, v: np.ndarray, model: SearchModel, *, seed: int) -> SearchModel:
    """The roughest response that the runs do not refute, for bounds.

    Matern 5/2 on the values as they are, a constant trend, no input inert, and all theta raised together as
    long as the log-likelihood stays within its 95 % interval. A transform or a trend that fits the runs so
    far may promise that nothing more is to come; this model makes no such promise.
    """
    form = Form(trend="constant", nugget=max(model.kriging.nugget_, NUGGET))
    plain = fitted(features, v, replace(form, prior=False), seed=seed)
    theta = np.maximum(plain.kriging.theta_, CAUTION * float(plain.kriging.theta_.mean()))
    rough = first = fitted(features, v, replace(form, theta=theta), seed=seed)
    for _ in range(ROUGHEST_STEPS):
        theta = ROUGHER * theta
        rougher = fitted(features, v, replace(form, theta=theta), seed=seed)
        if rougher.kriging.log_likelihood_ < first.kriging.log_likelihood_ - CREDIBLE:
            break
        rough = rougher
    return rough
