"""One Kriging of a search: what it is built of, and its fit.

Ranges by a weak prior: with hardly more runs than inputs the likelihood is often largest where most inputs
are inert, and a prediction that holds them for inert is wrong by many of its standard deviations. theta is
the mode of its posterior under a lognormal prior, whose median gives points half a side apart in every input
the same small correlation in any dimension.
"""

from dataclasses import dataclass

import numpy as np

from surrogates import Kriging
from surrogates.analysis.search_scale import IDENTITY, NamedScale, OutputTransform
from workbench.search.runs.noticeable_gain import noticeable_gain
from workbench.search.surrogate.model import SearchModel

__all__ = ["NUGGET", "Form", "fitted"]

NUGGET = 1e-8  # relative to the process variance: the runs are taken as exact
COLD_STARTS, WARM_STARTS = 5, 1
MOST_INFLATION = 4.0
RARE = 2.5  # deviations: the worst run is taken for no rarer an event
PRIOR_SUM = 15.0  # every theta of p is taken for PRIOR_SUM/p, give or take a factor e,
PRIOR_INPUTS = 6  # and e^(p/PRIOR_INPUTS) when there are more: of many inputs most are inert


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """What a Kriging is built of; `theta` (p,) where the ranges are given, else they are fitted, with the
    weak prior unless `prior` is False.
    """

    trend: str
    transform: OutputTransform | NamedScale = IDENTITY
    correlation: str = "matern52"
    nugget: float | str = NUGGET
    theta: np.ndarray | None = None
    prior: bool = True


def fitted(
    features: np.ndarray, v: np.ndarray, form: Form, *, seed: int, previous: SearchModel | None = None
) -> SearchModel:
    """Kriging of w(v) for values v (n,) at features (n, p); ranges start from those of `previous`."""
    w, p = form.transform.forward(v), features.shape[1]
    kriging = Kriging(
        trend=form.trend,
        correlation=form.correlation,
        nugget=form.nugget,
        theta=form.theta,
        theta_start=None if previous is None else previous.kriging.theta_,
        theta_prior=(PRIOR_SUM / p, max(1.0, p / PRIOR_INPUTS)) if form.prior else None,
        intervals="plug-in",
        n_starts=COLD_STARTS if previous is None else WARM_STARTS,
        seed=seed,
    )
    kriging.fit(features, w)
    residual = kriging.leave_one_out()
    usable = np.isfinite(residual.std) & (residual.std > 0)
    rarity = 0.0  # a peak as high as the one that was found may hide where no run is near
    if form.trend == "constant" and form.transform.kind == "identity" and kriging.sigma2_ > 0:
        rarity = float(w.max() - kriging.beta_[0]) / (RARE * float(np.sqrt(kriging.sigma2_)))
    spread = np.sqrt(np.mean(residual.standardised[usable] ** 2)) if usable.any() else 1.0
    return SearchModel(
        kriging=kriging,
        transform=form.transform,
        trend=form.trend,
        n_runs=len(v),
        best=float(v.max()),
        noticeable=noticeable_gain(v),
        scale=float(np.std(w)) or 1.0,
        inflation=float(np.clip(max(spread, rarity), 1.0, MOST_INFLATION)),
        q2=float(residual.q2),
    )
