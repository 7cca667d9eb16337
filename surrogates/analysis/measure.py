"""Weights over the inputs: the one-dimensional measures that effects and Sobol' indices are averaged with.

The inputs are independent, each with a discrete measure of points and weights. A uniform input is a
Gauss-Legendre rule on twelve panels, exact to about 1e-10 for the correlations in use; a label or a discrete
input is its levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kriging.posterior import Posterior

__all__ = ["Measure", "discrete", "resolve", "uniform", "weighted"]

Array = NDArray[np.float64]
PANELS, NODES = 12, 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """Points (q,) in the coordinates of X, weights (q,) that sum to one, and the interval they stand for.

    `levels` says that the points are the only values, and no rule for a continuum.
    """

    points: Array
    weights: Array
    low: float
    high: float
    levels: bool = False


def uniform(low: float = 0.0, high: float = 1.0) -> Measure:
    """The uniform distribution on [low, high].

    >>> m = uniform(0.0, 2.0)
    >>> print(round(float(m.weights @ m.points**3), 12))
    2.0
    """
    x, w = np.polynomial.legendre.leggauss(NODES)
    edges = np.linspace(low, high, PANELS + 1)
    half = np.diff(edges)[:, None] / 2
    return Measure(
        points=(edges[:-1, None] + half * (1 + x)).ravel(),
        weights=np.tile(w / w.sum(), PANELS) / PANELS,
        low=low,
        high=high,
    )


def weighted(low: float, high: float, density: ArrayLike) -> Measure:
    """A density given on equally spaced points of [low, high], linear in between; normalised here."""
    rule = uniform(low, high)
    values = np.asarray(density, dtype=np.float64)
    if values.ndim != 1 or len(values) < 2 or (values < 0).any() or not values.sum() > 0:
        raise ValueError("density needs at least two numbers >= 0 that are not all zero")
    w = rule.weights * np.interp(rule.points, np.linspace(low, high, len(values)), values)
    return Measure(points=rule.points, weights=w / w.sum(), low=low, high=high)


def discrete(levels: ArrayLike, weights: ArrayLike | None = None) -> Measure:
    """Levels with weights, equal ones by default."""
    points = np.atleast_1d(np.asarray(levels, dtype=np.float64))
    w = np.ones(len(points)) if weights is None else np.asarray(weights, dtype=np.float64)
    if w.shape != points.shape or (w < 0).any() or not w.sum() > 0:
        raise ValueError(f"weights needs {len(points)} numbers >= 0 that are not all zero, got {w.tolist()}")
    low, high = float(points.min()), float(points.max())
    return Measure(points=points, weights=w / w.sum(), low=low, high=high, levels=True)


def resolve(posterior: Posterior, measures: Sequence[Measure | None] | None) -> list[Measure]:
    """One measure per input; None becomes the default.

    The default is uniform on [0, 1] when all runs lie in the unit cube, else on the range of the runs;
    labels get the levels of the runs, each with the same weight.
    """
    scaling, d = posterior.scaling, posterior.u.shape[1]
    low, high = scaling.low, scaling.low + scaling.width
    runs = (posterior.u + 0.5) * scaling.width + scaling.low
    numbers = [k for k in range(d) if k not in posterior.correlation.labels]
    if (runs[:, numbers] >= -1e-12).all() and (runs[:, numbers] <= 1 + 1e-12).all():
        low, high = np.zeros(d), np.ones(d)
    if measures is None:
        measures = [None] * d
    if len(measures) != d:
        raise ValueError(f"measures needs one entry per input, got {len(measures)} for {d} inputs")
    found = []
    for k, given in enumerate(measures):
        if given is not None:
            found.append(given)
        elif k in posterior.correlation.labels:
            found.append(discrete(np.unique(runs[:, k])))
        else:
            found.append(uniform(float(low[k]), float(high[k])))
    return found
