"""Other peaks than the highest one, read off the runs.

A run is the top of a peak when no run in the box around it is worse, and when the runs do not exclude that a
valley parts it from the worst run (Ursem 1999, with the lower bound of a prediction in place of runs). A
search that has settled on one peak climbs the next one, whatever its Kriging expects there: runs that crowd
around one peak teach a Kriging that nothing else rises.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.proposals.best_point import best_point, box_levels, start_pool
from workbench.search.proposals.known import Known
from workbench.search.runs.noticeable_gain import runs_since_gain
from workbench.search.surrogate.fitting import fit_local_model
from workbench.search.surrogate.model import SearchModel

__all__ = ["HALF_WIDTH", "Peak", "next_peak", "next_top"]

Bound = Callable[[np.ndarray], np.ndarray]

HALF_WIDTH = 0.2  # of the unit cube, of the box around a top
FEWEST_TRIES = 3
STEPS = 11  # between two tops
VALLEY = 0.03  # of the range of the values: how deep a valley parts two peaks
DOUBT = 1.0  # deviations: a valley that deep is not excluded by the runs
FINE_LEVELS = 81  # of a coordinate of the box


def peak_tops(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Indices of the runs u (n, d) whose values v (n,) no run in their box reaches, highest first."""
    rivals = cdist(u, u, "chebyshev") <= HALF_WIDTH
    np.fill_diagonal(rivals, False)
    tops = np.flatnonzero(v > np.where(rivals, v, -np.inf).max(axis=1))
    found: np.ndarray = tops[np.argsort(-v[tops], kind="stable")]
    return found


def next_top(u: np.ndarray, v: np.ndarray, low: Bound, *, depth: float, gain: float) -> int | None:
    """The highest top beside the worst run's own that was not tried in vain; an index of u (n, d), or None.

    A peak is given up when the last d runs in its box (three at least) gained nothing: less than `gain` on
    the best run in the box before. Runs are in the order made; `low` bounds v at unit points from below,
    `depth` is how far a valley lies below the top at least.
    """
    tries = max(FEWEST_TRIES, u.shape[1])
    worst = int(np.argmax(v))
    for top in peak_tops(u, v):
        if top == worst:
            continue
        inside = np.abs(u - u[top]).max(axis=1) <= HALF_WIDTH
        if runs_since_gain(v[inside], gain) >= tries:
            continue
        share = np.linspace(0.0, 1.0, STEPS + 2)[1:-1, None]
        if (low(u[top] + share * (u[worst] - u[top])) < v[top] - depth).any():
            return int(top)
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Peak:
    """A peak to climb: its top (d,), the value there, a model of the runs around it, starts (m, d)."""

    top: np.ndarray
    value: float
    model: SearchModel
    pool: np.ndarray

    def next_point(self, known: Known) -> np.ndarray | None:
        """By turns the best bound in the box around the top, where the mean gains, and the best gain."""
        here = replace(
            known, model=self.model, incumbent=self.top, under_way=np.empty((0, known.where.dimension))
        )
        levels = box_levels(known.where, self.top, HALF_WIDTH, FINE_LEVELS)
        if len(known.u) % 2:
            point = best_point("ucb", here, self.pool, levels=levels)
            if point is not None:
                mean = self.model.mean(known.where.features(point[None]))[0]
                if mean >= self.value + known.model.noticeable:
                    return point
        return best_point("ei", here, self.pool, target=self.value, levels=levels)


def next_peak(known: Known, *, rng: np.random.Generator) -> Peak | None:
    """The peak to climb next, None where the runs show no other one."""
    where, model = known.where, known.model
    judge = model.cautious or model
    index = next_top(
        known.u_ok,
        known.v,
        lambda points: judge.bound(where.features(points), -DOUBT),
        depth=VALLEY * float(np.ptp(known.v)),
        gain=model.noticeable,
    )
    if index is None:
        return None
    features = where.features(known.u_ok)
    return Peak(
        top=known.u_ok[index],
        value=float(known.v[index]),
        model=fit_local_model(features, known.v, features[index], seed=model.kriging.seed),
        pool=start_pool(where, known.u_ok[index], rng),
    )
