"""Sobol' indices of a Kriging model with posterior bands, from draws of the whole function.

A path is a sum of products over the inputs (`surrogates.analysis.paths`), so its main, total and pair
variances under independent inputs are quadratic forms of products of one-dimensional sums: no sampling of x.
Sobol' (1993), Mathematical Modelling and Computational Experiments 1, 407-414; Marrel et al. (2009),
Reliability Engineering and System Safety 94, 742-751. Where the model is of the response on another scale,
paths are carried back and points are drawn (`surrogates.analysis.path_shares`): indices are of the response
either way, and bands reach as far as two halves of the points differ.

theta is drawn, too (`surrogates.kriging.theta_posterior`): at the likeliest theta bands are too narrow. And a
path is the mean m of the paths plus a deviation that has variances and interactions of its own, so that a
draw of an index of a plain response is mostly too large: with s = mean of the draws - index of m, a band
is widened from [q, q'] to [min(q, q - s), max(q', q' - s)].

A response that no path resembles moves the indices of m by more than paths tell: a band holds index of m +-
1.96 se, too, with se of the delete-a-group jackknife (`surrogates.analysis.left_out_groups`).

What no model of this form says, none of its refits says either: a weak input that bends is nearly a straight
line to a smooth product, whatever runs are left out. With u the share of the variance that left-out runs
leave unexplained, beyond the nugget and the noise, an upper end reaches the mean of the draws + u / 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from ..kriging.estimator import Kriging
from ..kriging.posterior import Posterior
from ..kriging.theta_posterior import drawn_fits
from ..kriging.validation import NORMAL_975
from .averages import Averages
from .effects import column
from .left_out_groups import jackknife_error, posteriors_without_groups
from .measure import Measure, resolve
from .path_shares import Shares, carried_shares, exact_shares
from .paths import Paths
from .response_map import ResponseMap

__all__ = ["Indices", "SobolIndices", "sobol_indices"]

Array = NDArray[np.float64]

THETAS, MANY_RUNS = 10, 300
INTO_ONE = 0.5  # of what is unexplained: how much of it one index may take


@dataclass(frozen=True, slots=True, kw_only=True)
class Indices:
    """Shares of the variance, (k,): posterior mean, and the ends of a 95 % band."""

    mean: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SobolIndices:
    """Result of `sobol_indices`.

    Attributes:
        main, total: one entry per input.   pairs: which pairs, `interaction` one entry per pair.
        variance: (draws,) variance of each draw over the inputs, unit of y squared.
        draws: number of draws.
    """

    main: Indices
    total: Indices
    pairs: tuple[tuple[int, int], ...]
    interaction: Indices
    variance: Array
    draws: int


def sobol_indices(
    kriging: Kriging,
    *,
    draws: int = 100,
    pairs: Sequence[tuple[int, int]] = (),
    measures: Sequence[Measure | None] | None = None,
    features: int = 200,
    thetas: int | None = None,
    carried: ResponseMap | None = None,
    rng: np.random.Generator,
) -> SobolIndices:
    """Main, total and pair indices of the modelled response over independent inputs, with 95 % bands.

    Args:
        draws: paths drawn from the posterior.   pairs: interactions wanted.
        measures: weights of the inputs, see `surrogates.analysis.measure`; None is uniform.
        features: Fourier features of the prior draws.
        thetas: draws of theta that the paths are shared among; 0 takes the model as it is: neither refits nor
            what left-out runs leave unexplained widen the bands. None is 10, and 0 where theta was given or
            hardly moves: above 300 runs, or where the trend is exact.
        carried: the map of a response y that `kriging` is a model of, `carried.forward(y)`: indices are of y.

    Returns indices of zero when the response is constant.

    >>> x = np.random.default_rng(0).random((40, 3))
    >>> y = x[:, 0] + 2 * (x[:, 1] - 0.5) * (x[:, 2] - 0.5)    # shares 3/4, 0, 0 and 1/4 together
    >>> s = sobol_indices(Kriging().fit(x, y), pairs=[(1, 2)], rng=np.random.default_rng(1))
    >>> print(s.main.mean.round(2) + 0.0, s.total.mean.round(2), s.interaction.mean.round(2))
    [0.75 0.   0.  ] [0.75 0.25 0.25] [0.25]
    """
    if draws < 2:
        raise ValueError(f"draws needs at least 2, got {draws}")
    check_is_fitted(kriging)
    posterior = kriging.posterior_
    d = posterior.u.shape[1]
    named = tuple((column(i, d, "pairs"), column(j, d, "pairs")) for i, j in pairs)
    for i, j in named:
        if i == j:
            raise ValueError(f"pairs needs two different inputs, got ({i}, {j})")
    weights = resolve(posterior, measures)
    parts: list[Shares] = []
    models = _models(kriging, thetas, rng)
    for at, (model, diagonal) in enumerate(models):
        count = draws // len(models) + (at < draws % len(models))
        if count:
            averages = Averages(model, weights)
            paths = Paths(model, averages, diagonal, draws=count, features=features, rng=rng)
            parts.append(_shares(paths, named, carried))
    uncertain = len(models) > 1
    moved = _refitted(kriging, weights, named, carried) if uncertain else []
    beyond = INTO_ONE * _unexplained(kriging, carried) if uncertain else 0.0
    rounding = float(np.mean([p.rounding for p in parts]))

    def indices(kind: str) -> Indices:
        return _indices(
            [getattr(p, kind) for p in parts], [getattr(p, kind) for p in moved], beyond, rounding
        )

    return SobolIndices(
        main=indices("main"),
        total=indices("total"),
        pairs=named,
        interaction=indices("interaction"),
        variance=np.concatenate([p.variance for p in parts]),
        draws=draws,
    )


def _models(
    kriging: Kriging, thetas: int | None, rng: np.random.Generator
) -> list[tuple[Posterior, Array | float]]:
    """Posteriors, each with its diagonal of C: at the fitted theta, or at draws of it."""
    if thetas is not None and thetas < 0:
        raise ValueError(f"thetas needs a number >= 0, got {thetas}")
    runs = kriging._runs
    if thetas is None:
        sure = kriging.theta is not None or len(runs.u) > MANY_RUNS
        thetas = 0 if sure else THETAS
    if thetas == 0 or runs.degenerate:
        return [(kriging.posterior_, kriging._diagonal)]
    factor = kriging.interval_factor_
    return [
        (replace(fit.posterior, sigma2=factor**2 * fit.posterior.sigma2), fit.diagonal)
        for fit in drawn_fits(runs, kriging._found, thetas, rng=rng)
    ]


def _shares(paths: Paths, named: Sequence[tuple[int, int]], carried: ResponseMap | None) -> Shares:
    """Shares of paths, of what they are carried back to; variances in the unit of y squared."""
    posterior = paths.averages.posterior
    if carried is None or carried.scale == "none":
        shares = exact_shares(paths, named)
        return replace(shares, variance=posterior.scale**2 * shares.variance)
    return carried_shares(
        paths, named, lambda values: carried.inverse(posterior.shift + posterior.scale * values)
    )


def _refitted(
    kriging: Kriging,
    weights: Sequence[Measure],
    named: Sequence[tuple[int, int]],
    carried: ResponseMap | None,
) -> list[Shares]:
    """Shares of the mean path, of the model and then of refits without a tenth of the runs each."""
    found = []
    for posterior in (kriging.posterior_, *posteriors_without_groups(kriging)):
        paths = Paths(
            posterior, Averages(posterior, weights), 0.0, draws=1, features=1, rng=np.random.default_rng(0)
        )
        found.append(_shares(paths, named, carried))
    return found


def _unexplained(kriging: Kriging, carried: ResponseMap | None = None) -> float:
    """Share of the runs' variance that left-out runs leave unexplained, nugget and noise apart."""
    left_out = kriging.leave_one_out()
    if not np.isfinite(left_out.q2):
        return 0.0  # a constant response
    posterior = kriging.posterior_
    noise = float(posterior.scale**2 * posterior.sigma2 * np.mean(kriging._diagonal))
    q2, kept = left_out.q2, np.isfinite(left_out.std)
    if carried is not None:
        q2 = carried.q2(left_out.observed[kept], left_out.prediction[kept])
    return float(np.clip(1.0 - q2 - noise / left_out.observed.var(), 0.0, 1.0))


def _indices(parts: Sequence[Array], moved: Sequence[Array], beyond: float, rounding: float) -> Indices:
    """Mean and band from the shares of each model (k, 1 + draws), those of its mean path first.

    moved: the same of the model, and of refits without some of the runs each.   beyond: how far above the
    mean the upper end reaches at least.
    """
    shares = np.clip(np.concatenate([part[:, 1:] for part in parts], axis=1), 0.0, 1.0)
    if not len(shares):
        return Indices(mean=np.zeros(0), lower=np.zeros(0), upper=np.zeros(0))
    mean = shares.mean(axis=1)
    lower, upper = np.quantile(shares, [0.025, 0.975], axis=1, method="weibull")  # of one more draw
    shift = mean - np.clip(np.mean([part[:, 0] for part in parts], axis=0), 0.0, 1.0)
    lower, upper = np.minimum(lower, lower - shift), np.maximum(upper, upper - shift)
    if len(moved):
        centre, *without = (np.clip(part[:, 0], 0.0, 1.0) for part in moved)
        reach = NORMAL_975 * jackknife_error(without)
        lower, upper = np.minimum(lower, centre - reach), np.maximum(upper, centre + reach)
    lower, upper = lower - rounding, np.maximum(upper, mean + beyond) + rounding
    return Indices(mean=mean, lower=np.maximum(lower, 0.0), upper=np.minimum(upper, 1.0))
