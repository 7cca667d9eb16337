"""Other peaks than the highest one, read off the runs.

A run is the top of a hill when none of its nearest neighbours is worse (topographical multistart, Toern and
Viitanen 1994), and when the way to the worst run leads through a valley (Ursem 1999, with predictions in
place of runs). A search that has settled on one peak climbs the next hill, whatever its Kriging expects
there: runs that crowd around one peak teach a Kriging that nothing else rises.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.distance import cdist

__all__ = ["HALF_WIDTH", "next_hill"]

Mean = Callable[[np.ndarray], np.ndarray]

FEWEST_NEIGHBOURS = 4
HALF_WIDTH = 0.2  # of the unit cube, of the box that is searched around a top
FEWEST_TRIES = 3
STEPS = 11  # between two tops


def hill_tops(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Indices of the runs u (n, d) whose values v (n,) no near neighbour exceeds, highest first."""
    n, d = u.shape
    count = min(max(FEWEST_NEIGHBOURS, d), n - 1)
    near = np.argsort(cdist(u, u), axis=1, kind="stable")[:, 1 : count + 1]
    tops = np.flatnonzero(v > v[near].max(axis=1)) if count else np.arange(n)
    found: np.ndarray = tops[np.argsort(-v[tops], kind="stable")]
    return found


def next_hill(u: np.ndarray, v: np.ndarray, mean: Mean, *, depth: float) -> int | None:
    """The highest hill beside the worst run's own that was not tried in vain; an index of u (n, d), or None.

    A hill is given up when d further runs (three at least) in its box did not exceed its top. Runs are in the
    order made; `mean` predicts v at unit points, `depth` is how far a valley lies below the top at least.
    """
    tries = max(FEWEST_TRIES, u.shape[1])
    best = u[int(np.argmax(v))]
    for top in hill_tops(u, v):
        later = np.abs(u[top + 1 :] - u[top]).max(axis=1) <= HALF_WIDTH
        if later.sum() >= tries:
            continue
        share = np.linspace(0.0, 1.0, STEPS + 2)[1:-1, None]
        if (mean(u[top] + share * (best - u[top])) < v[top] - depth).any():
            return int(top)
    return None
