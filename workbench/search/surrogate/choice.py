"""Which Kriging the runs of a search call for: trend, output transform, smoothness and nugget.

Linear trend first, where the response can be predicted at all: with d + 2 runs it is all that can be
estimated, and on monotone responses it names the worst corner at once. Where left-out runs are not predicted
from the others, a trend through them is chance. Once runs are left over, leave-one-out decides between the
trends.
"""

from dataclasses import replace

import numpy as np

from surrogates.analysis.search_scale import IDENTITY, NamedScale, OutputTransform, candidates, named_scale
from workbench.search.surrogate.kriging import Form, fitted
from workbench.search.surrogate.model import SearchModel

__all__ = ["chosen_model", "prediction_score"]

SPARE_RUNS = 6  # beyond the terms of the trend: fewer cannot tell a transform from chance
TRANSFORM_GAIN = 2.0  # log-likelihood a transform must win to replace the identity
# share of the transformed values' variance that leave-one-out may explain less than of the plain
Q2_LOSS = 0.1
NOISE_RUNS = 12
NOISE_GAIN = 2.0  # log-likelihood that a free nugget must win
GROWTH = 1.25


def chosen_model(
    features: np.ndarray,
    v: np.ndarray,
    *,
    previous: SearchModel | None,
    seed: int,
    scale: str = "auto",
    sign: float = 1.0,
) -> SearchModel:
    """The model of values v = sign y (n,) at features (n, p), chosen anew when the runs grew by a quarter.

    In between the choices are kept and the ranges start from the previous optimum. `scale`: one of
    SEARCH_SCALES; one that the values do not admit gives way to the response itself.
    """
    n, p = features.shape
    if previous is not None and n < GROWTH * previous.chosen_at and n > p + 4 and previous.transform.holds(v):
        form = Form(
            trend=previous.trend,
            transform=previous.transform.anchored(v),
            nugget=previous.kriging.nugget,
            correlation=previous.correlation,
        )
        kept = fitted(features, v, form, seed=seed, previous=previous)
        return replace(kept, chosen_at=previous.chosen_at, likelier_by=previous.likelier_by)
    transform = IDENTITY if scale == "auto" else named_scale(scale, v, sign)
    chosen = _with_trend(features, v, transform, seed=seed)
    terms = p + 1 if chosen.trend == "linear" else 1
    if n - terms >= max(SPARE_RUNS, p // 2):
        chosen = _smoother(features, v, chosen, seed=seed)
        if scale == "auto":
            chosen = _with_transform(features, v, chosen, seed=seed)
    if n >= NOISE_RUNS:
        form = Form(
            trend=chosen.trend,
            transform=chosen.transform,
            nugget="estimate",
            correlation=chosen.correlation,
        )
        noisy = fitted(features, v, form, seed=seed, previous=chosen)
        if noisy.kriging.log_likelihood_ > chosen.kriging.log_likelihood_ + NOISE_GAIN:
            chosen = replace(noisy, likelier_by=chosen.likelier_by)
    return replace(chosen, chosen_at=n)


def _with_trend(
    features: np.ndarray, v: np.ndarray, transform: OutputTransform | NamedScale, *, seed: int
) -> SearchModel:
    """The linear trend where the runs can tell one and it predicts better, else the constant."""
    n, p = features.shape
    constant = fitted(features, v, Form(trend="constant", transform=transform), seed=seed)
    if n < p + 2:
        return constant
    linear = fitted(features, v, Form(trend="linear", transform=transform), seed=seed)
    if n < p + 1 + _spare_to_compare(p):
        return constant if constant.q2 <= 0.0 else linear
    if linear.kriging.diagnosis_.degenerate:
        return linear  # it gives every run to rounding, and leaves no deviations to score it by
    return constant if prediction_score(constant) > prediction_score(linear) else linear


def _with_transform(features: np.ndarray, v: np.ndarray, plain: SearchModel, *, seed: int) -> SearchModel:
    """The transform that makes the values likeliest, where it wins enough over the plain ones."""
    at_first = _likelihood_of_the_rest(plain, v)
    chosen, bar = plain, at_first + TRANSFORM_GAIN
    for transform in candidates(v)[1:]:
        form = Form(trend=plain.trend, transform=transform, correlation=plain.correlation)
        rival = fitted(features, v, form, seed=seed, previous=plain)
        score = _likelihood_of_the_rest(rival, v)
        if score > bar and rival.q2 > plain.q2 - Q2_LOSS:
            bar, chosen = score, rival
    if chosen is plain:
        return plain
    # ranges and smoothness of the plain response say little about those of the transformed one
    cold = fitted(features, v, Form(trend=plain.trend, transform=chosen.transform), seed=seed)
    return replace(_smoother(features, v, cold, seed=seed), likelier_by=bar - at_first)


def _smoother(features: np.ndarray, v: np.ndarray, model: SearchModel, *, seed: int) -> SearchModel:
    """The model with a Gaussian correlation where that is more likely."""
    form = Form(trend=model.trend, transform=model.transform, correlation="gaussian")
    smooth = fitted(features, v, form, seed=seed)
    return smooth if smooth.kriging.log_likelihood_ > model.kriging.log_likelihood_ else model


def _spare_to_compare(p: int) -> int:
    """Runs beyond the terms of a linear trend in p features from which on leave-one-out judges it.

    About as many as it has slopes, where these are few: kept without a look, its error at the corners, more
    than the range of the values, sends the search there. With many inputs it is kept on less evidence.
    """
    return min(max(p - 1, 2), max(5, p // 2))


def _likelihood_of_the_rest(model: SearchModel, v: np.ndarray) -> float:
    """Log-likelihood of all values but the largest, in units of v.

    A transform may be anchored at the largest value, whose density then grows without bound as the offset
    shrinks (as in the three-parameter lognormal law): log p(all) - log p(largest | rest) leaves it out, for
    every transform alike.
    """
    top = int(np.argmax(v))
    loo = model.kriging.leave_one_out()
    rest = np.delete(v, top)
    assert isinstance(model.transform, OutputTransform)
    value = model.kriging.log_likelihood_ + model.transform.log_jacobian(rest)
    if np.isfinite(loo.std[top]) and loo.std[top] > 0:
        value += float(np.log(loo.std[top]) + 0.5 * loo.standardised[top] ** 2)
    return float(value)


def prediction_score(model: SearchModel) -> float:
    """Log predictive density of every run from the others, summed: comparable between trends."""
    loo = model.kriging.leave_one_out()
    usable = np.isfinite(loo.std) & (loo.std > 0)
    return float(-(np.log(loo.std[usable]) + 0.5 * loo.standardised[usable] ** 2).sum())
