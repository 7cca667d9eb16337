"""Sobol' indices of a Kriging model with posterior bands, from draws of the whole function.

A draw of the process given the runs is a prior draw corrected at the runs (Matheron's rule):

    path(x) = g(x) + f(x)' b(y - g - e) + r(x)' v(y - g - e)

with g a prior draw, e a draw of the run noise, and b, v the generalised least squares of the corrected
responses. The prior draw is a sum of random Fourier features (Rahimi and Recht 2007), so a path is a sum of
products over the inputs, and its main, total and pair variances under independent inputs are quadratic forms
of products of one-dimensional sums: no sampling of x. Sobol' (1993), Mathematical Modelling and Computational
Experiments 1, 407-414; Marrel et al. (2009), Reliability Engineering and System Safety 94, 742-751.

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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from ..kriging.estimator import Kriging
from ..kriging.posterior import Posterior
from ..kriging.theta_posterior import drawn_fits
from ..kriging.validation import NORMAL_975
from ..likelihood.correlation import Correlation
from ..likelihood.likelihood import _solve
from .effects import _Averages, column
from .left_out_groups import jackknife_error, posteriors_without_groups
from .measure import Measure, resolve

__all__ = ["Indices", "SobolIndices", "sobol_indices"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

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
    parts: list[_Shares] = []
    models = _models(kriging, thetas, rng)
    for at, (model, diagonal) in enumerate(models):
        count = draws // len(models) + (at < draws % len(models))
        if count:
            averages = _Averages(model, weights)
            paths = _Paths(model, averages, diagonal, draws=count, features=features, rng=rng)
            parts.append(_shares(paths, named))
    uncertain = len(models) > 1
    moved = _refitted(kriging, weights, named) if uncertain else []
    beyond = INTO_ONE * _unexplained(kriging) if uncertain else 0.0
    return SobolIndices(
        main=_indices([p.main for p in parts], [p.main for p in moved], beyond),
        total=_indices([p.total for p in parts], [p.total for p in moved], beyond),
        pairs=named,
        interaction=_indices([p.interaction for p in parts], [p.interaction for p in moved], beyond),
        variance=posterior.scale**2 * np.concatenate([p.variance for p in parts]),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shares:
    """Shares of the variance (k, 1 + draws), those of the mean path first; `variance` (draws,)."""

    main: Array
    total: Array
    interaction: Array
    variance: Array


def _shares(paths: "_Paths", named: Sequence[tuple[int, int]]) -> _Shares:
    mean, main = paths.mains()
    total = np.empty(main.shape)
    everything = paths.whole()
    variance = np.maximum(everything - mean**2, 0.0)
    for k, without in paths.all_without(list(range(len(main)))):
        # Var of E[path | all but k]
        total[k] = everything - paths.quadratic(without, paths.means[k])
    positive = np.where(variance > 1e-14 * np.maximum(mean**2, 1e-300), variance, np.inf)
    interaction = np.empty((len(named), len(mean)))
    for at, (i, j) in enumerate(named):
        interaction[at] = paths.pair(i, j) - mean**2 - main[i] - main[j]
    return _Shares(
        main=main / positive,
        total=total / positive,
        interaction=interaction / positive,
        variance=variance[1:],
    )


def _refitted(
    kriging: Kriging, weights: Sequence[Measure], named: Sequence[tuple[int, int]]
) -> list[_Shares]:
    """Shares of the mean path, of the model and then of refits without a tenth of the runs each."""
    found = []
    for posterior in (kriging.posterior_, *posteriors_without_groups(kriging)):
        paths = _Paths(
            posterior, _Averages(posterior, weights), 0.0, draws=1, features=1, rng=np.random.default_rng(0)
        )
        found.append(_shares(paths, named))
    return found


def _unexplained(kriging: Kriging) -> float:
    """Share of the runs' variance that left-out runs leave unexplained, nugget and noise apart."""
    left_out = kriging.leave_one_out()
    if not np.isfinite(left_out.q2):
        return 0.0  # a constant response
    posterior = kriging.posterior_
    noise = float(posterior.scale**2 * posterior.sigma2 * np.mean(kriging._diagonal))
    return float(np.clip(1.0 - left_out.q2 - noise / left_out.observed.var(), 0.0, 1.0))


def _indices(parts: Sequence[Array], moved: Sequence[Array], beyond: float) -> Indices:
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
    upper = np.minimum(np.maximum(upper, mean + beyond), 1.0)
    return Indices(mean=mean, lower=np.maximum(lower, 0.0), upper=upper)


class _Paths:
    """Posterior paths as sum_l A_l prod_k G_lk(x_k).

    l runs over the correlations with the runs, the trend terms, the features and their conjugates.
    """

    def __init__(
        self,
        posterior: Posterior,
        averages: _Averages,
        diagonal: Array | float,
        *,
        draws: int,
        features: int,
        rng: np.random.Generator,
    ) -> None:
        n, d = posterior.u.shape
        self.averages = averages
        self.waves = [
            _waves(posterior.correlation, float(posterior.theta[k]), k, features, rng) for k in range(d)
        ]
        at_runs: Complex = np.ones((n, features), dtype=np.complex128)
        for k in range(d):
            at_runs *= self.waves[k](posterior.u[:, k])
        size = np.sqrt(posterior.sigma2 / features)
        amplitude = size * (
            rng.standard_normal((features, draws)) - 1j * rng.standard_normal((features, draws))
        )
        noise = np.sqrt(posterior.sigma2 * np.broadcast_to(np.asarray(diagonal), (n,)))
        prior = (at_runs @ amplitude).real + noise[:, None] * rng.standard_normal((n, draws))
        # correction b(-g - e), v(-g - e) on top of the posterior mean, which is linear in the responses
        factor = posterior.factor
        z = _solve(factor.lower, -prior, lower=True)
        b = _solve(factor.rf, factor.q.T @ z)
        rest = z - factor.q @ (factor.q.T @ z)
        v = _solve(factor.lower, rest, lower=True, transposed=True)
        drawn = np.concatenate(
            [
                posterior.weights[:, None] + v,
                posterior.coefficients[:, None] + b,
                0.5 * amplitude,
                0.5 * amplitude.conj(),
            ]
        ).astype(np.complex128)
        # the mean of the paths first
        centre = np.zeros((len(drawn), 1), dtype=np.complex128)
        centre[: n + len(posterior.coefficients), 0] = np.append(posterior.weights, posterior.coefficients)
        self.coefficients: Complex = np.concatenate([centre, drawn], axis=1)
        self.means = [self.averages.weights[k] @ self.factor(k, self.averages.points[k]) for k in range(d)]

    def factor(self, k: int, u: Array) -> Complex:
        """G_lk at values u (q,) of input k, (q, M)."""
        wave = self.waves[k](u)
        return np.concatenate(
            [self.averages.along(k, u), self.averages.powers(k, u), wave, wave.conj()], axis=1
        )

    def moments(self, k: int) -> Complex:
        """Sum of conj(G_lk) G_mk over the measure of input k, (M, M)."""
        g = self.factor(k, self.averages.points[k])
        return np.asarray((g.conj().T * self.averages.weights[k]) @ g)

    def quadratic(self, matrix: Complex, scale: Complex | float = 1.0) -> Array:
        """conj(c)' matrix c for c = scale * coefficients, one number per draw."""
        c = self.coefficients * np.reshape(scale, (-1, 1))
        return np.asarray(np.einsum("ij,ij->j", c.conj(), matrix @ c).real)

    def whole(self) -> Array:
        """Mean square of each path."""
        product = self.moments(0)
        for k in range(1, len(self.waves)):
            product *= self.moments(k)
        return self.quadratic(product)

    def others(self, *without: int) -> Complex:
        """Product of the means of all inputs but some, (M,)."""
        product = np.ones(len(self.coefficients), dtype=np.complex128)
        for k, mean in enumerate(self.means):
            if k not in without:
                product *= mean
        return product

    def mains(self) -> tuple[Array, Array]:
        """Mean (draws,) and main-effect variance (d, draws) of each path."""
        mean = (self.others() @ self.coefficients).real
        main = []
        for k in range(len(self.waves)):
            g = self.factor(k, self.averages.points[k])
            curve = (g @ (self.others(k)[:, None] * self.coefficients)).real
            main.append(self.averages.weights[k] @ (curve - mean) ** 2)
        return mean, np.stack(main)

    def pair(self, i: int, j: int) -> Array:
        """Mean square of E[path | x_i, x_j]."""
        return self.quadratic(self.moments(i) * self.moments(j), self.others(i, j))

    def all_without(self, inputs: list[int], product: Complex | None = None) -> Iterator[tuple[int, Complex]]:
        """Each input with the product of the moments of all others: halves in turn, so memory stays small."""
        if len(inputs) == 1:
            size = len(self.coefficients)
            yield inputs[0], np.ones((size, size), dtype=np.complex128) if product is None else product
            return
        middle = len(inputs) // 2
        for kept, left in ((inputs[:middle], inputs[middle:]), (inputs[middle:], inputs[:middle])):
            deeper = None if product is None else product.copy()
            for k in left:
                deeper = self.moments(k) if deeper is None else deeper * self.moments(k)
            yield from self.all_without(kept, deeper)


class _waves:
    """Random factors whose mean product over the features is the correlation of one input."""

    def __init__(
        self, correlation: Correlation, theta: float, k: int, features: int, rng: np.random.Generator
    ) -> None:
        self.label = k in correlation.labels
        if self.label:
            # exp(-theta) of the features do not see the label, the others give each label its own sign
            self.blind = rng.random(features) < np.exp(-theta)
            self.signs: dict[float, Array] = {}
            self.rng = rng
            return
        self.frequency = _frequencies(correlation, theta, features, rng)

    def __call__(self, u: Array) -> Complex:
        if not self.label:
            return np.asarray(np.exp(1j * u[:, None] * self.frequency))
        for code in np.unique(u):
            if float(code) not in self.signs:
                sign = np.where(self.rng.random(len(self.blind)) < 0.5, -1.0, 1.0)
                self.signs[float(code)] = np.where(self.blind, 1.0, sign)
        return np.stack([self.signs[float(code)] for code in u]).astype(np.complex128)


def _frequencies(correlation: Correlation, theta: float, features: int, rng: np.random.Generator) -> Array:
    """Draws from the spectral density of the one-dimensional correlation."""
    if correlation.kind == "gaussian":
        return np.sqrt(2.0 * theta) * rng.standard_normal(features)
    if correlation.kind == "matern32":
        return np.sqrt(theta) * rng.standard_t(3, features)
    if correlation.kind == "matern52":
        return np.sqrt(theta) * rng.standard_t(5, features)
    # symmetric stable law: Chambers, Mallows and Stuck (1976)
    eta = correlation.eta
    angle = rng.uniform(-np.pi / 2, np.pi / 2, features)
    weight = rng.standard_exponential(features)
    stable = np.sin(eta * angle) / np.cos(angle) ** (1 / eta)
    stable *= (np.cos((1 - eta) * angle) / weight) ** ((1 - eta) / eta)
    return np.asarray(theta ** (1 / eta) * stable)
