"""The Kriging behind a worst-case search: trend and output warp chosen by the data, refitted after every
batch.

The search maximises v = +y or -y. The model predicts w(v), w a monotone warp (see
`workbench.search.surrogate.output_transform`), so the maximiser of v and the expected improvement carry over;
bounds in units of y go through the inverse warp.

Linear trend first, where the response can be predicted at all: with d + 2 runs it is all that can be
    estimated, and on monotone responses it names the worst corner at once. Where left-out runs are not
    predicted from the others, a trend through them is chance. Once runs are left over, leave-one-out decides
    between the trends.

Ranges by a weak prior: with hardly more runs than inputs the likelihood is often largest where most inputs
    are inert, and a prediction that holds them for inert is wrong by many of its standard deviations. theta
    is the mode of its posterior under a lognormal prior, whose median gives points half a side apart in
    every input the same small correlation in any dimension.
"""

from dataclasses import dataclass, replace

import numpy as np

from surrogates import Kriging
from workbench.search.runs.noticeable_gain import noticeable_gain
from workbench.search.surrogate import output_transform as warps
from workbench.search.surrogate.expected_improvement import log_expected_improvement
from workbench.search.surrogate.output_transform import Warp

__all__ = ["SearchModel", "believing", "fit_local_model", "fit_rough_model", "fit_search_model"]

SPARE_RUNS = 6  # beyond the terms of the trend: fewer cannot tell a warp from chance
WARP_GAIN = 2.0  # log-likelihood a warp must win to replace the identity
Q2_LOSS = 0.1  # share of the warped values' variance that leave-one-out may explain less than of the plain
NOISE_RUNS = 12
NOISE_GAIN = 2.0  # log-likelihood that a free nugget must win
GROWTH = 1.25
NUGGET = 1e-8  # relative to the process variance: the runs are taken as exact
COLD_STARTS, WARM_STARTS = 5, 1
MOST_INFLATION = 4.0
RARE = 2.5  # deviations: the worst run is taken for no rarer an event
ROUGHER, ROUGHEST_STEPS = 1.35, 12  # all theta are raised by this factor, at most so often,
CREDIBLE = 2.0  # while the log-likelihood falls by less than this: half the 95 % point of chi^2_1
PRIOR_SUM = 15.0  # every theta of p is taken for PRIOR_SUM/p, give or take a factor e,
PRIOR_INPUTS = 6  # and e^(p/PRIOR_INPUTS) when there are more: of many inputs most are inert
LOCAL_RUNS = 5  # per feature, of the model around a hill
CAUTION = 0.1  # smallest theta of the cautious model, of the mean theta


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchModel:
    """A fitted Kriging of w(v) with the runs it saw. `inflation` scales its standard deviations by leave-
    one-out.
    """

    kriging: Kriging
    warp: Warp
    trend: str
    best: float  # largest v among the runs
    noticeable: float  # gain of v over `best` that is worth a run
    scale: float  # standard deviation of w(v) over the runs
    inflation: float
    q2: float
    n_runs: int
    chosen_at: int = 0  # number of runs when trend, warp and nugget were chosen
    cautious: "SearchModel | None" = None

    def predict(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of w(v), (n,) each."""
        return self.kriging.posterior_.mean_and_std(np.ascontiguousarray(features))

    @property
    def correlation(self) -> str:
        """Kind of the correlation in force."""
        return str(self.kriging.correlation)

    def mean(self, features: np.ndarray) -> np.ndarray:
        """Predicted v (the median of its predictive law when a warp is in force)."""
        return self.warp.inverse(self.predict(features)[0])

    def bound(self, features: np.ndarray, k: float) -> np.ndarray:
        """Upper bound of v, k inflated standard deviations above the mean, in units of v."""
        mean, std = self.predict(features)
        return self.warp.inverse(mean + k * self.inflation * std)

    def warped_bound(self, features: np.ndarray, k: float) -> np.ndarray:
        """The same bound in warped units, for ranking."""
        mean, std = self.predict(features)
        return mean + k * self.inflation * std

    def promises(self, features: np.ndarray, k: float) -> bool:
        """Whether any of the points may exceed the best run by a noticeable amount, k deviations allowed."""
        return bool((self.bound(features, k) > self.best + self.noticeable).any())

    def in_units(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predicted v and half the width of its one-standard-deviation interval, in units of v."""
        mean, std = self.predict(features)
        low, high = self.warp.inverse(mean - std), self.warp.inverse(mean + std)
        return self.warp.inverse(mean), 0.5 * (high - low)

    def log_ei(self, features: np.ndarray, target: float | None = None) -> np.ndarray:
        """Log expected improvement, warped: over the best run by a noticeable gain, or over `target`.

        A smaller gain is worth no run, and to seek it keeps a search at a peak that it knows.
        """
        mean, std = self.predict(features)
        over = self.best + self.noticeable if target is None else target
        return log_expected_improvement(mean, std, float(self.warp.forward(np.array([over]))[0]))


def fit_search_model(
    features: np.ndarray, v: np.ndarray, *, previous: SearchModel | None, seed: int
) -> SearchModel:
    """Fit to features (n, p) and values v (n,) to be maximised, with its cautious twin beside it."""
    model = _chosen(features, v, previous=previous, seed=seed)
    before = None if previous is None else previous.cautious
    return replace(model, cautious=_cautious(features, v, model, before, seed=seed))


def believing(model: SearchModel, features: np.ndarray, v: np.ndarray) -> SearchModel:
    """The model as if runs that are under way had given what it predicts: v (n,) at features (n, p), the
    believed ones last. Ranges, trend, warp and nugget are kept.

    The kriging believer of Ginsbourger, Le Riche and Carraro (2010): the mean stays, its deviation falls
    where runs are under way, so that the rest of a batch goes elsewhere.
    """
    fitted = _fit(
        features,
        v,
        model.trend,
        model.warp,
        seed=model.kriging.seed,
        nugget=model.kriging.nugget_,
        correlation=model.correlation,
        theta=model.kriging.theta_,
    )
    # a believed run is predicted without error, which says nothing about the errors of the model
    return replace(
        fitted,
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
    if before is not None and model.chosen_at != model.n_runs:
        # between two choices of the model the ranges are kept: caution needs no fine tuning
        return _fit(features, v, model.trend, model.warp, seed=seed, theta=before.kriging.theta_)
    # cold: a warm start would keep the endless ranges that a few runs on a slope once suggested
    plain = _fit(features, v, model.trend, model.warp, seed=seed)
    theta = plain.kriging.theta_
    floor = CAUTION * float(theta.mean())
    if (theta >= floor).all():
        return plain
    return _fit(features, v, model.trend, model.warp, seed=seed, theta=np.maximum(theta, floor))


def fit_local_model(features: np.ndarray, v: np.ndarray, centre: np.ndarray, *, seed: int) -> SearchModel:
    """A model of the runs nearest to `centre` (p,), five per feature, on the plain values.

    Runs that crowd around another peak can make an input look inert that decides here.
    """
    count = max(LOCAL_RUNS * features.shape[1], SPARE_RUNS + 4)
    near = np.sort(np.argsort(((features - centre) ** 2).sum(axis=1), kind="stable")[:count])
    return _fit(features[near], v[near], "constant", warps.IDENTITY, seed=seed)


def fit_rough_model(features: np.ndarray, v: np.ndarray, model: SearchModel, *, seed: int) -> SearchModel:
    """The roughest response that the runs do not refute, for bounds.

    Matern 5/2 on the values as they are, a constant trend, no input inert, and all theta raised together as
    long as the log-likelihood stays within its 95 % interval. A warp or a trend that fits the runs so far may
    promise that nothing more is to come; this model makes no such promise.
    """
    nugget = max(model.kriging.nugget_, NUGGET)
    plain = _fit(features, v, "constant", warps.IDENTITY, seed=seed, nugget=nugget, prior=False)
    theta = np.maximum(plain.kriging.theta_, CAUTION * float(plain.kriging.theta_.mean()))
    rough = first = _fit(features, v, "constant", warps.IDENTITY, seed=seed, nugget=nugget, theta=theta)
    for _ in range(ROUGHEST_STEPS):
        theta = ROUGHER * theta
        rougher = _fit(features, v, "constant", warps.IDENTITY, seed=seed, nugget=nugget, theta=theta)
        if rougher.kriging.log_likelihood_ < first.kriging.log_likelihood_ - CREDIBLE:
            break
        rough = rougher
    return rough


def _chosen(features: np.ndarray, v: np.ndarray, *, previous: SearchModel | None, seed: int) -> SearchModel:
    """Trend, warp and nugget are chosen anew when the number of runs has grown by a quarter.

    In between they are kept and the ranges start from the previous optimum.
    """
    n, p = features.shape
    if previous is not None and n < GROWTH * previous.chosen_at and n > p + 4 and previous.warp.holds(v):
        warp = _moved(previous.warp, v)
        kept = _fit(
            features,
            v,
            previous.trend,
            warp,
            seed=seed,
            previous=previous,
            nugget=previous.kriging.nugget,
            correlation=previous.correlation,
        )
        return replace(kept, chosen_at=previous.chosen_at)
    trend = "linear" if n >= p + 2 else "constant"
    chosen = _fit(features, v, trend, warps.IDENTITY, seed=seed)
    if trend == "linear":
        rival = _fit(features, v, "constant", warps.IDENTITY, seed=seed)
        few = n < p + 1 + _spare_to_compare(p)
        if rival.q2 <= 0.0 if few else _prediction_score(rival) > _prediction_score(chosen):
            chosen = rival
    terms = p + 1 if chosen.trend == "linear" else 1
    if n - terms >= max(SPARE_RUNS, p // 2):
        chosen = _smoother(features, v, chosen, seed=seed)
        plain, bar = chosen, _likelihood_of_the_rest(chosen, v) + WARP_GAIN
        for warp in warps.candidates(v)[1:]:
            rival = _fit(
                features, v, plain.trend, warp, seed=seed, previous=plain, correlation=plain.correlation
            )
            score = _likelihood_of_the_rest(rival, v)
            if score > bar and rival.q2 > plain.q2 - Q2_LOSS:
                bar, chosen = score, rival
        if chosen is not plain:
            # ranges and smoothness of the plain response say little about those of the warped one
            cold = _fit(features, v, plain.trend, chosen.warp, seed=seed)
            chosen = _smoother(features, v, cold, seed=seed)
    if n >= NOISE_RUNS:
        noisy = _fit(
            features,
            v,
            chosen.trend,
            chosen.warp,
            seed=seed,
            previous=chosen,
            nugget="estimate",
            correlation=chosen.correlation,
        )
        if noisy.kriging.log_likelihood_ > chosen.kriging.log_likelihood_ + NOISE_GAIN:
            chosen = noisy
    return replace(chosen, chosen_at=n)


def _spare_to_compare(p: int) -> int:
    """Runs beyond the terms of a linear trend in p features from which on leave-one-out judges it.

    About as many as it has slopes, where these are few: kept without a look, its error at the corners, more
    than the range of the values, sends the search there. With many inputs it is kept on less evidence.
    """
    return min(max(p - 1, 2), max(5, p // 2))


def _smoother(features: np.ndarray, v: np.ndarray, model: SearchModel, *, seed: int) -> SearchModel:
    """The model with a Gaussian correlation where that is more likely."""
    smooth = _fit(features, v, model.trend, model.warp, seed=seed, correlation="gaussian")
    return smooth if smooth.kriging.log_likelihood_ > model.kriging.log_likelihood_ else model


def _likelihood_of_the_rest(model: SearchModel, v: np.ndarray) -> float:
    """Log-likelihood of all values but the largest, in units of v.

    A warp may be anchored at the largest value, whose density then grows without bound as the offset shrinks
    (as in the three-parameter lognormal law): log p(all) - log p(largest | rest) leaves it out, for every
    warp alike.
    """
    top = int(np.argmax(v))
    loo = model.kriging.leave_one_out()
    rest = np.delete(v, top)
    value = model.kriging.log_likelihood_ + model.warp.log_jacobian(rest)
    if np.isfinite(loo.std[top]) and loo.std[top] > 0:
        value += float(np.log(loo.std[top]) + 0.5 * loo.standardised[top] ** 2)
    return float(value)


def _fit(
    features: np.ndarray,
    v: np.ndarray,
    trend: str,
    warp: Warp,
    *,
    seed: int,
    previous: SearchModel | None = None,
    nugget: float | str = NUGGET,
    correlation: str = "matern52",
    theta: np.ndarray | None = None,
    prior: bool = True,
) -> SearchModel:
    """Kriging of w(v); ranges start from the previous optimum where there is one."""
    w, p = warp.forward(v), features.shape[1]
    kriging = Kriging(
        trend=trend,
        correlation=correlation,
        nugget=nugget,
        theta=theta,
        theta_start=None if previous is None else previous.kriging.theta_,
        theta_prior=(PRIOR_SUM / p, max(1.0, p / PRIOR_INPUTS)) if prior else None,
        n_starts=COLD_STARTS if previous is None else WARM_STARTS,
        seed=seed,
    )
    kriging.fit(features, w)
    residual = kriging.leave_one_out()
    usable = np.isfinite(residual.std) & (residual.std > 0)
    rarity = 0.0  # a peak as high as the one that was found may hide where no run is near
    if trend == "constant" and warp.kind == "identity" and kriging.sigma2_ > 0:
        rarity = float(w.max() - kriging.beta_[0]) / (RARE * float(np.sqrt(kriging.sigma2_)))
    spread = np.sqrt(np.mean(residual.standardised[usable] ** 2)) if usable.any() else 1.0
    return SearchModel(
        kriging=kriging,
        warp=warp,
        trend=trend,
        n_runs=len(v),
        best=float(v.max()),
        noticeable=noticeable_gain(v),
        scale=float(np.std(w)) or 1.0,
        inflation=float(np.clip(max(spread, rarity), 1.0, MOST_INFLATION)),
        q2=float(residual.q2),
    )


def _moved(warp: Warp, v: np.ndarray) -> Warp:
    """The warp anchored at the values seen by now."""
    return (
        warp
        if warp.kind == "identity" or warp.is_anchored_at_zero
        else replace(warp, anchor=float(v.max() if warp.is_towards_max else v.min()))
    )


def _prediction_score(model: SearchModel) -> float:
    """Log predictive density of every run from the others, summed: comparable between trends."""
    loo = model.kriging.leave_one_out()
    usable = np.isfinite(loo.std) & (loo.std > 0)
    return float(-(np.log(loo.std[usable]) + 0.5 * loo.standardised[usable] ** 2).sum())
