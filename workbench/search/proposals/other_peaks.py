"""Other peaks than the highest one, read off the runs.

A run is the top of a hill when no run in the box around it is worse, and when the runs do not exclude that a
valley parts it from the worst run (Ursem 1999, with the lower bound of a prediction in place of runs). A
search that has settled on one peak climbs the next hill, whatever its Kriging expects there: runs that crowd
around one peak teach a Kriging that nothing else rises.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.distance import cdist

from workbench.search.runs.noticeable_gain import runs_since_gain

__all__ = ["HALF_WIDTH", "next_hill"]

Bound = Callable[[np.ndarray], np.ndarray]

HALF_WIDTH = 0.2  # of the unit cube, of the box around a top
FEWEST_TRIES = 3
STEPS = 11  # between two tops


def hill_tops(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Indices of the runs u (n, d) whose values v (n,) no run in their box reaches, highest first."""
    rivals = cdist(u, u, "chebyshev") <= HALF_WIDTH
    np.fill_diagonal(rivals, False)
    tops = np.flatnonzero(v > np.where(rivals, v, -np.inf).max(axis=1))
    found: np.ndarray = tops[np.argsort(-v[tops], kind="stable")]
    return found


def next_hill(u: np.ndarray, v: np.ndarray, low: Bound, *, depth: float, gain: float) -> int | None:
    """The highest hill beside the worst run's own that was not tried in vain; an index of u (n, d), or None.

    A hill is given up when the last d runs in its box (three at least) gained nothing: less than `gain` on
    the best run in the box before. Runs are in the order made; `low` bounds v at unit points from below,
    `depth` is how far a valley lies below the top at least.
    """
    tries = max(FEWEST_TRIES, u.shape[1])
    worst = int(np.argmax(v))
    for top in hill_tops(u, v):
        if top == worst:
            continue
        inside = np.abs(u - u[top]).max(axis=1) <= HALF_WIDTH
        if runs_since_gain(v[inside], gain) >= tries:
            continue
        share = np.linspace(0.0, 1.0, STEPS + 2)[1:-1, None]
        if (low(u[top] + share * (u[worst] - u[top])) < v[top] - depth).any():
            return int(top)
    return None
