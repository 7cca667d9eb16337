"""Draws of the whole process given the runs, as sums of products over the inputs.

A draw is a prior draw corrected at the runs (Matheron's rule):

    path(x) = g(x) + f(x)' b(y - g - e) + r(x)' v(y - g - e)

with g a prior draw, e a draw of the run noise, and b, v the generalised least squares of the corrected
responses. The prior draw is a sum of random Fourier features (Rahimi and Recht 2007).
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from ..kriging.posterior import Posterior
from ..likelihood.correlation import Correlation
from ..likelihood.likelihood import _solve
from .averages import Averages

__all__ = ["Paths", "Product", "Sampled", "product_of", "without_each"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Product = tuple[Array, Complex]  # of parts of some inputs, see `Paths.parts`

STUDENT = {"matern32": 3, "matern52": 5, "matern72": 7}  # degrees of freedom of the spectral density


class Paths:
    """Posterior paths as sum_l A_l prod_k G_lk(x_k).

    l runs over the correlations with the runs, the trend terms, the features and their conjugates.
    """

    def __init__(
        self,
        posterior: Posterior,
        averages: Averages,
        diagonal: Array | float,
        *,
        draws: int,
        features: int,
        rng: np.random.Generator,
    ) -> None:
        n, d = posterior.u.shape
        self.averages = averages
        self.waves = [
            Waves(posterior.correlation, float(posterior.theta[k]), k, features, rng) for k in range(d)
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

    def parts(self, k: int, u: Array) -> Product:
        """Of input k at values u (q,): factors of correlations and trend (q, n + p), of features (q, F)."""
        smooth = [self.averages.along(k, u), self.averages.powers(k, u)]
        return np.concatenate(smooth, axis=1), self.waves[k](u)

    def grid(self, rest: Product, parts: Product) -> Array:
        """Paths (m, 1 + draws, q), the mean of them first: at m points of some inputs and q of the others.

        `rest` and `parts` are products of `parts` over these and those. Of the mean alone, (m, 1, q), where
        they have no features.
        """
        size = rest[0].shape[1]
        c = self.coefficients[:size].real
        if not rest[1].shape[1]:
            return np.asarray((rest[0] * c[:, 0]) @ parts[0].T)[:, None, :]
        found = (rest[0][:, None, :] * c.T) @ parts[0].T
        drawn = rest[1][:, None, :] * self.coefficients[size : size + rest[1].shape[1]].T
        # the conjugates of the features give the same
        found += 2.0 * (drawn.real @ parts[1].real.T - drawn.imag @ parts[1].imag.T)
        return np.asarray(found)

    def drawn(self, mean_only: bool) -> int:
        """How many paths `grid` gives: the mean of them, and the draws."""
        return 1 if mean_only else self.coefficients.shape[1]

    def factor(self, k: int, u: Array) -> Complex:
        """G_lk at values u (q,) of input k, (q, M)."""
        smooth, wave = self.parts(k, u)
        return np.concatenate([smooth, wave, wave.conj()], axis=1)

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


class Waves:
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
    if correlation.kind in STUDENT:
        return np.sqrt(theta) * rng.standard_t(STUDENT[correlation.kind], features)
    # symmetric stable law: Chambers, Mallows and Stuck (1976)
    eta = correlation.eta
    angle = rng.uniform(-np.pi / 2, np.pi / 2, features)
    weight = rng.standard_exponential(features)
    stable = np.sin(eta * angle) / np.cos(angle) ** (1 / eta)
    stable *= (np.cos((1 - eta) * angle) / weight) ** ((1 - eta) / eta)
    return np.asarray(theta ** (1 / eta) * stable)


class Sampled(Sequence[Product]):
    """Parts of each input at points drawn from the laws of the inputs, the same points whatever the model.

    They are put together where they are asked for: of many inputs and runs all would be gigabytes.
    """

    def __init__(self, paths: Paths, points: int, *, mean_only: bool = False) -> None:
        cube = qmc.Sobol(len(paths.waves), rng=np.random.default_rng(0)).random(points)
        self.tables: list[Product] = []
        self.places: list[NDArray[np.intp]] = []
        for k, u in enumerate(cube.T):
            sums = np.cumsum(paths.averages.weights[k])
            self.places.append(np.minimum(np.searchsorted(sums, u), len(sums) - 1))
            smooth, wave = paths.parts(k, paths.averages.points[k])
            self.tables.append((smooth, wave[:, : 0 if mean_only else None]))

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, k: Any) -> Any:
        smooth, wave = self.tables[k]
        return smooth[self.places[k]], wave[self.places[k]]


def product_of(factors: Iterable[Product], like: Product) -> Product:
    """The product of all, entry by entry; of none ones (1, ...) with as many columns as `like`."""
    product: Product | None = None
    for smooth, wave in factors:
        product = (smooth, wave) if product is None else (product[0] * smooth, product[1] * wave)
    return (np.ones_like(like[0][:1]), np.ones_like(like[1][:1])) if product is None else product


def without_each(
    factors: Sequence[Product], inputs: Sequence[int], taken: Sequence[Product] = ()
) -> Iterator[tuple[int, list[Product]]]:
    """Each of `inputs` with factors whose product is that of all others: halves in turn."""
    if len(inputs) == 1:
        yield inputs[0], list(taken)
        return
    middle = len(inputs) // 2
    for kept, left in ((inputs[:middle], inputs[middle:]), (inputs[middle:], inputs[:middle])):
        once = product_of(chain(taken, (factors[k] for k in left)), factors[0])
        yield from without_each(factors, kept, [once])
