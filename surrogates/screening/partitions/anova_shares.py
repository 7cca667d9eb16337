"""Total Sobol' indices under an ANOVA correlation: drawn from the posterior, weights and thetas known.

With A and B two samples of the inputs and A_u the first with the columns of unit u out of the second, a path
f has T_u = mean (f(A) - f(A_u))^2 / (2 Var f(A)) (Jansen, Computer Physics Communications 117, 1999,
35-43). Paths are drawn at all these points together, so that no basis cuts a correlation short.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import qmc

from ...analysis.measure import Measure
from .anova import AnovaOptimum
from .canonical import CanonicalRuns

__all__ = ["drawn_total_indices"]

Array = NDArray[np.float64]

POINTS = 128  # of each sample
JITTER = 1e-9


def drawn_total_indices(
    runs: CanonicalRuns,
    at: AnovaOptimum,
    *,
    eta: float,
    given: Array,
    measures: Sequence[Measure | None] | None,
    draws: int,
    rng: np.random.Generator,
) -> Array:
    """(draws, k) total indices of the k units of `at`, over the laws of the inputs.

    `given` (n, d) are the runs in their own coordinates, in which `measures` (d,) stand; without one an input
    is uniform over the range of its runs, and a label takes each of its values as often.
    """
    k = len(at.units)
    columns = [runs.units[u] for u in at.units]
    flat = [c for unit in columns for c in unit]
    cube = qmc.Sobol(2 * len(flat), rng=rng).random(POINTS)
    laws = [_Law(runs, c, given, measures) for c in flat]
    first = np.column_stack([law(cube[:, i]) for i, law in enumerate(laws)])
    second = np.column_stack([law(cube[:, len(flat) + i]) for i, law in enumerate(laws)])
    blocks, start = [first], 0
    for unit in columns:
        mixed = first.copy()
        mixed[:, start : start + len(unit)] = second[:, start : start + len(unit)]
        blocks.append(mixed)
        start += len(unit)
    points, x = np.concatenate(blocks), runs.x[:, flat]
    label = np.array([c in runs.labels for c in flat])
    owner = np.array([i for i, unit in enumerate(columns) for _ in unit])

    def correlation(a: Array, b: Array) -> Array:
        out = np.ones((len(a), len(b)))
        for i in range(k):
            distance = np.zeros_like(out)
            for j in np.flatnonzero(owner == i):
                h = np.abs(a[:, None, j] - b[None, :, j])
                distance += h > 0.0 if label[j] else h**eta
            out *= (1.0 + at.weight[i] * np.exp(-np.exp(at.log_theta[i]) * distance)) / (1.0 + at.weight[i])
        return out

    n = len(runs.y)
    c = correlation(x, x)
    c.flat[:: n + 1] = 1.0 + np.exp(at.log_nugget)
    factor = cho_factor(c, lower=True)
    solved = cho_solve(factor, np.column_stack([np.ones(n), runs.y]))
    level = solved[:, 1].sum() / solved[:, 0].sum()
    sigma2 = (runs.y - level) @ (solved[:, 1] - level * solved[:, 0]) / (n - 1)
    across = correlation(points, x)
    mean = level + across @ (solved[:, 1] - level * solved[:, 0])
    lack = 1.0 - across @ solved[:, 0]
    spread = correlation(points, points) - across @ cho_solve(factor, across.T)
    spread += np.outer(lack, lack) / solved[:, 0].sum()
    spread.flat[:: len(points) + 1] += JITTER
    values, vectors = np.linalg.eigh(spread)
    root = vectors * np.sqrt(np.maximum(sigma2 * values, 0.0))
    paths = mean + rng.standard_normal((draws, len(points))) @ root.T
    parts = paths.reshape(draws, k + 1, POINTS)
    moved = 0.5 * ((parts[:, 1:] - parts[:, :1]) ** 2).mean(axis=2)
    return np.asarray(moved / parts[:, 0].var(axis=1)[:, None])


class _Law:
    """From the unit interval to the values of a canonical column."""

    def __init__(
        self, runs: CanonicalRuns, column: int, given: Array, measures: Sequence[Measure | None] | None
    ) -> None:
        self.points: Array | None = None
        ours, theirs = runs.x[:, column], given[runs.rows, runs.columns[column]]
        measure = None if measures is None else measures[int(runs.columns[column])]
        if measure is not None:
            # canonical columns may be turned round
            low, high = int(np.argmin(ours)), int(np.argmax(ours))
            slope = (ours[high] - ours[low]) / (theirs[high] - theirs[low])
            self.points = ours[low] + slope * (np.asarray(measure.points) - theirs[low])
            self.sums = np.cumsum(measure.weights)
        elif column in runs.labels:
            self.points = np.unique(ours)
            self.sums = np.arange(1, len(self.points) + 1) / len(self.points)
        else:
            self.low, self.width = float(ours.min()), float(np.ptp(ours))

    def __call__(self, u: Array) -> Array:
        if self.points is None:
            return self.low + self.width * u
        return np.asarray(self.points[np.minimum(np.searchsorted(self.sums, u), len(self.points) - 1)])
