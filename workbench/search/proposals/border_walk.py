"""The run that gains most on the feasible side of a border of failures.

    score(u) = (m(u) - b) P(u)^2,      where  m(u) > b + noticeable  and  P(u) >= least

with the predicted response m, the worst run b and the chance of success P of
`workbench.search.surrogate.growing_failures`. The square makes a run that is half way to the border likelier
than one beyond. Steps of single coordinates stop at a border that lies askew; this one is walked along, by
random steps of several coordinates that shrink when none gains.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.proposals.known import Known
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.growing_failures import GrowingFailures

__all__ = ["BorderWalk"]

CLOSEST = 1e-3  # of the unit cube, largest coordinate: a closer run tells the same
AVERSION = 2.0  # power of the chance of success
# a failed run tells more of the border than one that succeeds, as long as they are few: a search that has
# failed in more than RATE of its runs asks for SLOPE more chance for each share beyond
LEAST, RATE, SLOPE, MOST = 0.3, 0.25, 3.0, 0.95
WALKS, STEPS, ROUNDS = 3, 150, 40  # places to start from, steps tried in a round
WIDEST, FINEST = 0.2, 2e-3  # of the unit cube: the length of a step
MOVED = 0.5  # share of the coordinates that a step moves
GAIN = 1e-3  # of the log score


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderWalk:
    """`failures` of the search so far, and the share of its runs (start design left out) that `failed`."""

    failures: GrowingFailures
    failed: float

    @property
    def least_chance(self) -> float:
        """Of success, for a run to be proposed."""
        return float(np.clip(LEAST + SLOPE * (self.failed - RATE), LEAST, MOST))

    def next_point(self, known: Known, pool: np.ndarray, *, rng: np.random.Generator) -> np.ndarray | None:
        """The point (d,) of the largest score, from starts in `pool` (m, d); None where no admissible point
        likely to succeed is predicted to gain.
        """
        where, model = known.where, known.model

        def score(points: np.ndarray) -> np.ndarray:
            features = where.features(points)
            chance = self.failures.probability(features)
            gain = model.mean(features) - model.best
            free = where.allowed(points) & (chance >= self.least_chance) & (gain > model.noticeable)
            free &= cdist(points, known.u, "chebyshev").min(axis=1) > CLOSEST
            value = np.full(len(points), -np.inf)
            value[free] = np.log(gain[free]) + AVERSION * np.log(chance[free])
            return value

        scores = score(pool)
        first = np.argsort(scores)[::-1][:WALKS]
        ends = [_walked(where, score, pool[i], float(scores[i]), rng) for i in first if scores[i] > -np.inf]
        return max(ends, key=lambda end: end[1])[0] if ends else None


def _walked(
    where: SearchSpace,
    score: Callable[[np.ndarray], np.ndarray],
    point: np.ndarray,
    value: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, float]:
    """The end (d,) of a walk from `point` (d,) with its score."""
    length, share = WIDEST, max(MOVED, 1.5 / len(point))
    for _ in range(ROUNDS):
        reach = length * rng.random((STEPS, 1)) ** 2
        moved = rng.random((STEPS, len(point))) < share
        tried = where.snap(point + reach * moved * rng.standard_normal((STEPS, len(point))))
        values = score(tried)
        best = int(np.argmax(values))
        if values[best] > value + GAIN:
            point, value = tried[best], float(values[best])
        else:
            length /= 2
            if length < FINEST:
                break
    return point, value
