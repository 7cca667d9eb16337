"""Total Sobol' indices under an ANOVA correlation: drawn from the posterior, weights and thetas known.

With A and B two samples of the inputs and A_u the first with the columns of unit u out of the second, a path
f has T_u = mean (f(A) - f(A_u))^2 / (2 Var f) (Jansen, Computer Physics Communications 117, 1999, 35-43).
Paths are drawn at A and A_u together, so that no basis cuts a correlation short. A path may be carried to
another scale on the way, `back`: T_u is then that of the response there.

A product of correlations is an ANOVA correlation of weights without end (`as_product`).
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import qmc

from ...analysis.measure import Measure
from .anova import AnovaOptimum
from .canonical import CanonicalRuns

__all__ = ["as_product", "drawn_total_indices"]

Array = NDArray[np.float64]

POINTS = 128  # of a sample
POINTS_CARRIED, POINTS_OF_MEAN = 256, 4096  # of a response over decades
JITTER = 1e-9
TINY = 1e-300
ENDLESS = 1e12  # a weight beside which nothing is constant


def as_product(units: Sequence[int], log_theta: Array, nugget: float) -> AnovaOptimum:
    """The product of correlations of some units, log_theta (k,), as an ANOVA correlation; its l is nan."""
    weight = np.full(len(units), ENDLESS)
    return AnovaOptimum(
        units=tuple(units), weight=weight, log_theta=log_theta, log_nugget=float(np.log(nugget)), value=np.nan
    )


def drawn_total_indices(
    runs: CanonicalRuns,
    at: AnovaOptimum,
    *,
    eta: float,
    given: Array,
    measures: Sequence[Measure | None] | None,
    draws: int,
    rng: np.random.Generator,
    back: Callable[[Array], Array] | None = None,
) -> Array:
    """(draws, k) total indices of the k units of `at`, over the laws of the inputs.

    Indices are those of the standardised response of `runs`, or of what `back` makes of it: one over decades,
    perhaps, for which few points are too few, so that the mean path is looked at on many. `given` (n, d) are
    the runs in their own coordinates, in which `measures` (d,) stand; without one an input is uniform over
    the range of its runs, and a label takes each value as often.
    """
    columns = [runs.units[u] for u in at.units]
    flat = [c for unit in columns for c in unit]
    owner = np.array([i for i, unit in enumerate(columns) for _ in unit])
    laws = [_Law(runs, c, given, measures) for c in flat]
    model = _Posterior(runs, at, flat, owner, eta)

    def sampled(points: int) -> tuple[Array, Array]:
        cube = qmc.Sobol(2 * len(flat), rng=rng).random(points)
        made = [law(cube[:, i :: len(flat)]) for i, law in enumerate(laws)]
        return np.column_stack([m[:, 0] for m in made]), np.column_stack([m[:, 1] for m in made])

    carried = back or np.asarray
    first, second = sampled(POINTS if back is None else POINTS_CARRIED)
    many = None if back is None else sampled(POINTS_OF_MEAN)
    found = np.empty((draws, len(columns)))
    for i in range(len(columns)):
        mean, root = model.at_points(np.vstack([first, np.where(owner == i, second, first)]))
        paths = mean + rng.standard_normal((draws, len(mean))) @ root.T
        found[:, i] = _jansen(carried(paths))
        if many is not None:
            wide = model.mean(np.vstack([many[0], np.where(owner == i, many[1], many[0])]))
            found[:, i] += _jansen(carried(wide[None])) - _jansen(carried(mean[None]))
    return np.maximum(found, 0.0)


def _jansen(paths: Array) -> Array:
    """T of paths (m, 2 q) at q points and the same with one unit moved."""
    half = paths.shape[1] // 2
    moved = 0.5 * ((paths[:, half:] - paths[:, :half]) ** 2).mean(axis=1)
    return np.asarray(moved / np.maximum(paths.var(axis=1), TINY))


class _Posterior:
    """Kriging of canonical runs with a constant mean; points (m, q) hold the columns of the units `at`."""

    def __init__(
        self, runs: CanonicalRuns, at: AnovaOptimum, flat: list[int], owner: NDArray[np.intp], eta: float
    ) -> None:
        self.at, self.owner, self.eta = at, owner, eta
        self.x = runs.x[:, flat]
        self.label = np.array([c in runs.labels for c in flat])
        n = len(runs.y)
        c = self.correlation(self.x, self.x)
        c.flat[:: n + 1] = 1.0 + np.exp(at.log_nugget)
        self.factor = cho_factor(c, lower=True)
        solved = cho_solve(self.factor, np.column_stack([np.ones(n), runs.y]))
        self.ones = solved[:, 0]
        self.level = solved[:, 1].sum() / self.ones.sum()
        self.weights = solved[:, 1] - self.level * self.ones
        self.sigma2 = (runs.y - self.level) @ self.weights / (n - 1)

    def correlation(self, a: Array, b: Array) -> Array:
        """R between points a (m, q) and b (l, q)."""
        out = np.ones((len(a), len(b)))
        for i, (weight, log_theta) in enumerate(zip(self.at.weight, self.at.log_theta, strict=True)):
            distance = np.zeros_like(out)
            for j in np.flatnonzero(self.owner == i):
                h = np.abs(a[:, None, j] - b[None, :, j])
                distance += h > 0.0 if self.label[j] else h**self.eta
            out *= (1.0 + weight * np.exp(-np.exp(log_theta) * distance)) / (1.0 + weight)
        return out

    def mean(self, points: Array) -> Array:
        """The mean path at points."""
        return np.asarray(self.level + self.correlation(points, self.x) @ self.weights)

    def at_points(self, points: Array) -> tuple[Array, Array]:
        """The mean path at points, and a root of the covariance of paths about it."""
        across = self.correlation(points, self.x)
        lack = 1.0 - across @ self.ones
        spread = self.correlation(points, points) - across @ cho_solve(self.factor, across.T)
        spread += np.outer(lack, lack) / self.ones.sum()
        spread.flat[:: len(points) + 1] += JITTER
        values, vectors = np.linalg.eigh(spread)  # rounding may have made it indefinite
        root = vectors * np.sqrt(np.maximum(self.sigma2 * values, 0.0))
        return self.level + across @ self.weights, root


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
