"""The chance that a run succeeds: a Gaussian process classifier of the runs, calibrated by its likelihood.

    P(success at x) = E[Phi(s f(x))],   f ~ GP(0, k),    k(x, x') = a (1 + x x'/p) + b M(|x - x'|/l)

with the probit Phi, the Matern 3/2 correlation M, and p features. The first part of k is a border that is a
plane: failures grow into the space from one side more often than not, and a plane needs few runs in many
dimensions. The second bends it. (a, b, l) are averaged over a small grid, weighted by their marginal
likelihood, since a few runs do not tell them. The posterior is Laplace's, algorithms 3.1 and 3.2 of
Rasmussen and Williams 2006; it is too flat for labels without noise, and s makes up for that:
without it 0.69 was said where 0.92 came.

Failed runs enter a search through this chance and never as invented numbers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.spatial.distance import cdist
from scipy.special import log_ndtr, ndtr

__all__ = ["SuccessChance"]

PLANES = (0.0, 100.0, 1000.0)  # a
BENDS = (1.0, 30.0, 1000.0)  # b
LENGTHS = (0.3, 1.0)  # l, in units of sqrt(p/6), the mean distance of two points of the cube
SHARPNESS = 2.4  # s, on 80 random planes in 4 and 8 inputs: what is said to be 0.69 came in 0.75 of the cases
NEWTON_STEPS, SETTLED = 60, 1e-6
LEAST_WEIGHT = 0.02  # of the best model: a less likely one is left out of the average
MOST_RUNS = 400  # the latest failures and successes; more would cost n^3 for a border that is known


@dataclass(frozen=True, slots=True, kw_only=True)
class _Classifier:
    """One posterior: features (n, p), the gradient (n,) of the log likelihood, sqrt(W) (n,), the factor
    (n, n) of B = 1 + sqrt(W) K sqrt(W), and its log marginal likelihood."""

    features: np.ndarray
    scales: tuple[float, float, float]
    gradient: np.ndarray
    root: np.ndarray
    factor: np.ndarray
    evidence: float

    def chance(self, features: np.ndarray) -> np.ndarray:
        """P(success) at (m, p)."""
        k = _covariance(features, self.features, self.scales)
        mean = k @ self.gradient
        a, b, _ = self.scales
        v = solve_triangular(self.factor, self.root[:, None] * k.T, lower=True)
        prior = a * (1 + (features**2).mean(axis=1)) + b
        variance = np.maximum(prior - (v * v).sum(axis=0), 0.0)
        chance: np.ndarray = ndtr(SHARPNESS * mean / np.sqrt(1 + variance))
        return chance


@dataclass(frozen=True, slots=True, kw_only=True)
class SuccessChance:
    """Posteriors with their weights (k,); without any, all runs so far succeeded, or all failed."""

    classifiers: tuple[_Classifier, ...]
    weights: np.ndarray
    constant: float

    @classmethod
    def of(cls, features: np.ndarray, ok: np.ndarray) -> "SuccessChance":
        """The chance after runs at `features` (n, p), in [0, 1], of which `ok` (n,) succeeded.

        >>> ok = np.array([True, True, False, False])
        >>> runs = SuccessChance.of(np.array([[0.0], [0.2], [0.8], [1.0]]), ok)
        >>> runs.probability(np.array([[0.0], [0.5], [1.0]])).round(1).tolist()
        [0.9, 0.5, 0.1]
        """
        if ok.all() or not ok.any():
            return cls(classifiers=(), weights=np.empty(0), constant=1.0 if ok.all() else 0.5)
        centred = 2 * features[-MOST_RUNS:] - 1
        labels = np.where(ok[-MOST_RUNS:], 1.0, -1.0)
        reach = float(np.sqrt(features.shape[1] / 6))
        grid = [(a, b, 2 * length * reach) for a in PLANES for b in BENDS for length in LENGTHS]
        fitted = [_posterior(centred, labels, scales) for scales in grid]
        evidence = np.array([one.evidence for one in fitted])
        weights = np.exp(evidence - evidence.max())
        kept = np.flatnonzero(weights >= LEAST_WEIGHT)
        return cls(
            classifiers=tuple(fitted[i] for i in kept),
            weights=weights[kept] / weights[kept].sum(),
            constant=1.0,
        )

    def probability(self, features: np.ndarray) -> np.ndarray:
        """Chance of success at (m, p); ones when no run has failed, a half when none has succeeded."""
        if not self.classifiers:
            return np.full(len(features), self.constant)
        centred = 2 * features - 1
        chances = np.array([one.chance(centred) for one in self.classifiers])
        average: np.ndarray = self.weights @ chances
        return average


def _covariance(x: np.ndarray, z: np.ndarray, scales: tuple[float, float, float]) -> np.ndarray:
    """k (m, n) between the centred features x (m, p) and z (n, p)."""
    a, b, length = scales
    r = np.sqrt(3) * cdist(x, z) / length
    k: np.ndarray = b * (1 + r) * np.exp(-r)
    if a > 0:
        k += a * (1 + x @ z.T / x.shape[1])
    return k


def _posterior(x: np.ndarray, y: np.ndarray, scales: tuple[float, float, float]) -> _Classifier:
    """Laplace's posterior of f at x (n, p) given the signs y (n,): Newton's method with halved steps."""
    k = _covariance(x, x, scales)
    a, f = np.zeros(len(y)), np.zeros(len(y))
    objective = float(log_ndtr(y * f).sum())
    for _ in range(NEWTON_STEPS):
        gradient, w = _slopes(y, f)
        root = np.sqrt(w)
        factor = cholesky(np.eye(len(y)) + root[:, None] * k * root, lower=True)
        b = w * f + gradient
        target = b - root * cho_solve((factor, True), root * (k @ b))
        step = 1.0
        while True:
            trial = a + step * (target - a)
            reached = k @ trial
            value = float(-0.5 * trial @ reached + log_ndtr(y * reached).sum())
            if value > objective or step < 1e-3:
                break
            step /= 2
        gain = value - objective
        a, f, objective = trial, reached, max(value, objective)
        if gain < SETTLED:
            break
    gradient, w = _slopes(y, f)
    root = np.sqrt(w)
    factor = cholesky(np.eye(len(y)) + root[:, None] * k * root, lower=True)
    evidence = objective - float(np.log(np.diag(factor)).sum())
    return _Classifier(
        features=x, scales=scales, gradient=gradient, root=root, factor=factor, evidence=evidence
    )


def _slopes(y: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First derivative of the log likelihood log Phi(y f) and minus its second, (n,) each."""
    ratio = np.exp(-0.5 * f * f - 0.5 * np.log(2 * np.pi) - log_ndtr(y * f))
    gradient = y * ratio
    return gradient, np.maximum(ratio * (ratio + y * f), 1e-12)
