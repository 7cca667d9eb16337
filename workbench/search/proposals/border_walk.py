"""The run that gains most on the feasible side of a border of failures.

    score(u) = (m(u) - b - d) P(u)^3,      where  m(u) > b + d  and  P(u) >= 0.3

with the predicted response m, the worst run b and the chance of success P of
`workbench.search.surrogate.growing_failures`. The cube makes a run that succeeds in three of four cases the
likeliest on the way to the border. The gain d that is not counted keeps a search from closing in on one
place of the border to the last digit, as long as another place may hold more. Steps of single coordinates
stop at a border that lies askew; this one is walked along, by random steps of several coordinates that shrink
when none gains.

Every fourth run looks at another place of the border (`workbench.search.proposals.border_elsewhere`), unless
more than a quarter of the runs have failed: the score is local, and a place that is refined to four digits
may be the wrong one.

The walk has its turn until more than 35 % of the search's runs have failed, and in the last two runs. While
it waits, every other run is that of the largest prediction among even points likely to succeed: it shows how
far the border lies from there. To ask the walk for a likelier run instead makes it creep: each step succeeds,
gains next to nothing and tells as little of the border.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.proposals.best_point import CLOSEST
from workbench.search.proposals.border_elsewhere import elsewhere, likely_and_large
from workbench.search.proposals.known import Known
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.growing_failures import GrowingFailures

__all__ = ["BORDER", "BorderWalk"]

BORDER = "border"  # what its runs are recorded as
AVERSION = 3.0  # power of the chance of success
LEAST = 0.3  # chance of success that a run is proposed with
MOST_FAILED = 0.35  # share of the search's runs: while more have failed, others have the turn
ELSEWHERE, FEW_FAILED = 4, 0.25  # every such run of the border is at another place, while so few have failed
SAFE = 0.5  # chance that a turn which the walk leaves goes to a likely run of a large prediction
PASSED_OVER, LAST = 3e-3, 2  # d, of the size of the worst run or of the spread, but in the last runs
WALKS, STEPS, ROUNDS = 3, 150, 40  # places to start from, steps tried in a round
WIDEST, FINEST = 0.2, 2e-3  # of the unit cube: the length of a step
MOVED = 0.5  # share of the coordinates that a step moves
GAIN = 1e-3  # of the log score


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderWalk:
    """`failures` of the search so far, the points (k, d) that it `lost` to them, the share of its runs (start
    design left out) that `failed`, how many were `made` along the border, and how many are `left` of its
    budget."""

    failures: GrowingFailures
    lost: np.ndarray
    failed: float
    made: int
    left: int

    def next_point(self, known: Known, pool: np.ndarray, *, rng: np.random.Generator) -> np.ndarray | None:
        """The point (d,) of the largest score, from starts in `pool` (m, d); None where no admissible point
        likely to succeed is predicted to gain, or where too many runs have failed.
        """
        where, model = known.where, known.model
        if self.failed > MOST_FAILED and self.left > LAST:
            return likely_and_large(known, self.failures, rng=rng) if rng.random() < SAFE else None
        size = max(float(np.ptp(known.v)), abs(model.best))
        passed = max(model.noticeable, PASSED_OVER * size if self.left > LAST else 0.0)
        if self.made % ELSEWHERE == ELSEWHERE - 1 and self.failed <= FEW_FAILED and self.left > LAST:
            other = elsewhere(known, self.failures, self.lost, level=model.best + passed, rng=rng)
            if other is not None:
                return other

        def score(points: np.ndarray) -> np.ndarray:
            features = where.features(points)
            chance = self.failures.probability(features)
            gain = model.mean(features) - model.best - passed
            free = where.allowed(points) & (chance >= LEAST) & (gain > 0)
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
