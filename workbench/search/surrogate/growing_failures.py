"""The chance of success where failures grow out of the response: a Gaussian process classifier by
expectation propagation.

    P(success at x) = E[Phi(f(x))],   f ~ GP(0, k)
    k(x, x') = a (1 + x x'/p) + q s(x) s(x')/p + b M(|x - x'|/l) + c g(x) g(x'),      s(x) = x^2 - 1/3

with the probit Phi, the Matern 3/2 correlation M, p centred features x in [-1, 1], and the growth g: what the
Kriging of the search predicts, standardised over the runs. The first part is a plane, the second bends it
along every feature, as a sphere is bent, and the third anywhere, but little: what bends anywhere says nothing
of the border away from the runs. The fourth says that runs fail where the response itself is large: with it a
border across a known slope needs a handful of runs in any dimension. (q, b) are averaged over a grid by their
evidence and their weight before any run, which takes a border for a plane until the runs contradict one.
The posterior is that of expectation propagation, algorithms 3.5 and 3.6 of Rasmussen and Williams 2006: with
labels that have no noise it is as wide as the truth, where Laplace's is too flat (Kuss and Rasmussen 2005).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.spatial.distance import cdist
from scipy.special import erfcx, log_ndtr, ndtr

__all__ = ["GrowingFailures", "growth_of"]

Scales = tuple[float, float]  # q, b
Growth = Callable[[np.ndarray], np.ndarray]

PLANE = 1000.0  # a: of a border this steep a label is certain
# q and b with their weight before any run: a plane is told by a handful of runs, and contradicted by as many
BENDS = ((0.0, 0.1, 1.0), (1000.0, 10.0, 0.1), (10000.0, 10.0, 0.1))
LENGTH = 2.0  # l in units of sqrt(p/6), the mean distance in the cube
GROWTH = 1000.0  # c: as much along the response as along any feature, and no more than that is said
MOST_GROWTH = 4.0  # deviations of the predictions
SWEEPS, SETTLED = 12, 1e-3  # of the sites, relative to the largest precision
LEAST_WEIGHT = 0.03  # of the likeliest: a less likely one is left out of the average
MOST_RUNS = 200  # the latest


def growth_of(predict: Growth, features: np.ndarray) -> Growth:
    """The predictions `predict` (m, p) -> (m,), standardised over the runs at `features` (n, p) that gave a
    value, and held within four deviations.
    """
    at_runs = predict(features)
    centre, spread = float(at_runs.mean()), float(at_runs.std()) or 1.0

    def growth(points: np.ndarray) -> np.ndarray:
        return np.clip((predict(points) - centre) / spread, -MOST_GROWTH, MOST_GROWTH)

    return growth


@dataclass(frozen=True, slots=True, kw_only=True)
class _Posterior:
    """One posterior: bends (q, b), the coefficients (n,) of its mean, the roots (n,) of the
    sites' precisions, the factor (n, n) of 1 + root K root, and its log evidence."""

    scales: Scales
    coefficients: np.ndarray
    root: np.ndarray
    factor: np.ndarray
    evidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GrowingFailures:
    """Posteriors with their weights (k,), after runs at the centred `features` (n, p) of `growth` (n,)."""

    features: np.ndarray
    growth: np.ndarray
    grows: Growth
    posteriors: tuple[_Posterior, ...]
    weights: np.ndarray

    @classmethod
    def of(cls, features: np.ndarray, ok: np.ndarray, grows: Growth) -> "GrowingFailures":
        """The chance after runs at `features` (n, p), in [0, 1], of which `ok` (n,) succeeded; `grows`:
        features (m, p) -> growth (m,).

        >>> ok = np.array([True, True, False, False])
        >>> runs = np.array([[0.0], [0.3], [0.7], [1.0]])
        >>> failures = GrowingFailures.of(runs, ok, growth_of(lambda x: x[:, 0], runs[ok]))
        >>> failures.probability(np.array([[0.0], [0.5], [1.0]])).round(1).tolist()
        [1.0, 0.2, 0.0]
        """
        runs = features[-MOST_RUNS:]
        x, g = 2 * runs - 1, grows(runs)
        y = np.where(ok[-MOST_RUNS:], 1.0, -1.0)
        fitted = [_posterior(_covariance(x, x, g, g, (q, b)), y, (q, b)) for q, b, _ in BENDS]
        prior = np.log([weight for _, _, weight in BENDS])
        evidence = np.array([one.evidence for one in fitted]) + prior
        weights = np.exp(evidence - evidence.max())
        kept = np.flatnonzero(weights >= LEAST_WEIGHT)
        return cls(
            features=x,
            growth=g,
            grows=grows,
            posteriors=tuple(fitted[i] for i in kept),
            weights=weights[kept] / weights[kept].sum(),
        )

    def probability(self, features: np.ndarray) -> np.ndarray:
        """Chance of success at (m, p)."""
        x, g = 2 * features - 1, self.grows(features)
        chance = np.zeros(len(x))
        for one, weight in zip(self.posteriors, self.weights, strict=True):
            q, b = one.scales
            k = _covariance(x, self.features, g, self.growth, one.scales)
            v = solve_triangular(one.factor, one.root[:, None] * k.T, lower=True)
            prior = PLANE * (1 + (x**2).mean(axis=1)) + q * (_bent(x) ** 2).mean(axis=1) + b + GROWTH * g**2
            variance = np.maximum(prior - (v * v).sum(axis=0), 0.0)
            chance += weight * ndtr(k @ one.coefficients / np.sqrt(1 + variance))
        return chance


def _bent(x: np.ndarray) -> np.ndarray:
    """s(x) of centred features (m, p)."""
    return x**2 - 1 / 3


def _covariance(x: np.ndarray, z: np.ndarray, gx: np.ndarray, gz: np.ndarray, scales: Scales) -> np.ndarray:
    """k (m, n) between the centred features x (m, p) with growth gx (m,) and z (n, p) with gz (n,)."""
    q, b = scales
    p = x.shape[1]
    r = np.sqrt(3) * cdist(x, z) / (2 * LENGTH * np.sqrt(p / 6))
    k: np.ndarray = PLANE * (1 + x @ z.T / p) + b * (1 + r) * np.exp(-r)
    k += GROWTH * np.outer(gx, gz)
    if q > 0:
        k += q * (_bent(x) @ _bent(z).T) / p
    return k


def _posterior(k: np.ndarray, y: np.ndarray, scales: Scales) -> _Posterior:
    """Expectation propagation for the covariance k (n, n) and the signs y (n,): algorithm 3.5."""
    n = len(y)
    precision, shift = np.zeros(n), np.zeros(n)  # of the sites: tau and nu
    covariance, mean = k.copy(), np.zeros(n)
    for _ in range(SWEEPS):
        before = precision.copy()
        for i in range(n):
            own = covariance[i, i]
            cavity, cavity_shift = 1 / own - precision[i], mean[i] / own - shift[i]
            if cavity <= 0:
                continue
            m, v = cavity_shift / cavity, 1 / cavity
            z = y[i] * m / np.sqrt(1 + v)
            ratio = np.sqrt(2 / np.pi) / erfcx(-z / np.sqrt(2))  # phi(z)/Phi(z)
            tilted_mean = m + y[i] * v * ratio / np.sqrt(1 + v)  # (3.58)
            tilted = v - v * v * ratio * (z + ratio) / (1 + v)
            site = max(1 / tilted - cavity, 0.0)
            step = site - precision[i]
            precision[i], shift[i] = site, tilted_mean / tilted - cavity_shift
            column = covariance[:, i].copy()
            covariance -= step / (1 + step * own) * np.outer(column, column)
            mean = covariance @ shift
        root = np.sqrt(precision)
        factor = cholesky(np.eye(n) + root[:, None] * k * root, lower=True)
        v_ = solve_triangular(factor, root[:, None] * k, lower=True)
        covariance = k - v_.T @ v_
        mean = covariance @ shift
        if np.abs(precision - before).max() <= SETTLED * precision.max():
            break
    return _Posterior(
        scales=scales,
        coefficients=shift - root * cho_solve((factor, True), root * (k @ shift)),
        root=root,
        factor=factor,
        evidence=_evidence(covariance, mean, precision, shift, factor, y),
    )


def _evidence(
    covariance: np.ndarray,
    mean: np.ndarray,
    precision: np.ndarray,
    shift: np.ndarray,
    factor: np.ndarray,
    y: np.ndarray,
) -> float:
    """log Z of (3.65), by (3.73) and (3.74)."""
    own = np.diag(covariance)
    cavity = np.maximum(1 / own - precision, 1e-12)
    m = (mean / own - shift) / cavity
    z = y * m / np.sqrt(1 + 1 / cavity)
    total = log_ndtr(z).sum() + 0.5 * np.log1p(precision / cavity).sum() - np.log(np.diag(factor)).sum()
    total += 0.5 * float(shift @ covariance @ shift) - 0.5 * (shift**2 / (cavity + precision)).sum()
    total += 0.5 * (m * cavity / (precision + cavity) * (precision * m - 2 * shift)).sum()
    return float(total)
