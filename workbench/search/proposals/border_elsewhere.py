"""Another place of a border of failures: as large a response as the worst run has, far from every failure.

    score(u) = log min_f |u - f| + log P(u)/2        where  m(u) = b + d,

with the failed runs f, the predicted response m, the worst run b, the gain d and the chance of success P of
`workbench.search.surrogate.growing_failures`. A walk along the border goes on from where it is: what it takes
for the border elsewhere rests on few runs, and an exchange of two inputs may gain more than all its steps.
The points of the level are found by bisection between the runs or even points below it and corners or even
points above it. Distance counts more than the chance, which is what the classifier says of places that no run
has tried.

While too many runs have failed for that, a run which is likely to succeed tells how far the border lies from
it: that of the largest prediction among even points with P >= 0.8.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.proposals.best_point import CLOSEST
from workbench.search.proposals.known import Known
from workbench.search.surrogate.growing_failures import GrowingFailures

__all__ = ["elsewhere", "likely_and_large"]

BELOW, ABOVE, CORNERS = 200, 400, 600  # even points below the level and above it, and corners above it
LINES, HALVINGS = 1500, 14  # between a point below and one above
LEAST = 1e-3  # chance of success below which a point is as good as lost
CHANCE = 0.5  # power of the chance
EVEN, LIKELY = 600, 0.8  # even points, and the chance of success of those that count as likely


def elsewhere(
    known: Known, failures: GrowingFailures, lost: np.ndarray, *, level: float, rng: np.random.Generator
) -> np.ndarray | None:
    """The point (d,) of the largest score whose prediction is `level` = b + d, after failures at `lost`
    (k, d); None where the model predicts as much nowhere, or nothing failed.
    """
    where, d = known.where, known.where.dimension

    def mean(points: np.ndarray) -> np.ndarray:
        return known.model.mean(where.features(points))

    low = np.vstack([known.u, rng.random((BELOW, d))])
    high = np.vstack([rng.random((ABOVE, d)), rng.integers(0, 2, (CORNERS, d)).astype(float)])
    low, high = where.snap(low), where.snap(high)
    low, high = low[mean(low) <= level], high[mean(high) > level]
    if not len(low) or not len(high) or not len(lost):
        return None
    points = where.snap(_crossings(mean, level, low, high, rng))
    free = where.allowed(points) & (mean(points) > known.model.best + known.model.noticeable)
    free &= cdist(points, known.u, "chebyshev").min(axis=1) > CLOSEST
    points = points[free]
    if not len(points):
        return None
    chance = np.maximum(failures.probability(where.features(points)), LEAST)
    score = np.log(cdist(points, lost).min(axis=1)) + CHANCE * np.log(chance)
    found: np.ndarray = points[int(np.argmax(score))]
    return found


def _crossings(
    mean: Callable[[np.ndarray], np.ndarray],
    level: float,
    low: np.ndarray,
    high: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Points (LINES, d) just beyond the level, each between one of `low` (m, d) and one of `high` (n, d)."""
    below, above = low[rng.integers(0, len(low), LINES)], high[rng.integers(0, len(high), LINES)]
    for _ in range(HALVINGS):
        middle = 0.5 * (below + above)
        is_above = (mean(middle) > level)[:, None]
        below, above = np.where(is_above, below, middle), np.where(is_above, middle, above)
    return above


def likely_and_large(
    known: Known, failures: GrowingFailures, *, rng: np.random.Generator
) -> np.ndarray | None:
    """The point (d,) of the largest prediction among even ones likely to succeed, None if none is."""
    where = known.where
    points = where.snap(rng.random((EVEN, where.dimension)))
    free = where.allowed(points) & (cdist(points, known.u, "chebyshev").min(axis=1) > CLOSEST)
    free &= failures.probability(where.features(points)) >= LIKELY
    points = points[free]
    if not len(points):
        return None
    found: np.ndarray = points[int(np.argmax(known.model.mean(where.features(points))))]
    return found
