"""Latin hypercubes without correlation, for any number of runs.

Rank-preserving decorrelation (Iman & Conover 1982; Owen 1994): the scores of the columns are multiplied by
the inverse Cholesky factor of their correlation matrix, and each column takes the order of its new scores. A
few rounds square the correlations each time until the rounding of ranks stops them at about n^-3/2; swaps
finish the work.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from doe.draws import level_permutations, splitmix
from doe.lhs import checked_size
from doe.swaps import Columns, swap_search

__all__ = ["decorrelated", "decorrelated_lhs"]

Floats = NDArray[np.float64]
ROUNDS = 2
SWAPS = 20_000


def decorrelated_lhs(
    n: int, d: int, *, rounds: int = ROUNDS, swaps: int = SWAPS, rng: np.random.Generator
) -> Floats:
    """A Latin hypercube with nearly uncorrelated columns, points in the middle of their strata: (n, d).

    rounds: of decorrelation    swaps: trials afterwards
    Time grows as n d (log n + d), so that n = 1e5, d = 100 takes seconds. For n <= d no design has
    uncorrelated columns; then only the swaps work.

    >>> points = decorrelated_lhs(500, 4, rng=np.random.default_rng(1))
    >>> bool(np.abs(np.corrcoef(points.T) - np.eye(4)).max() < 1e-3)
    True

    Raises: ValueError for n or d < 1, rounds or swaps < 0.
    """
    n, d = checked_size(n, d)
    if rounds < 0:
        raise ValueError(f"rounds needs a whole number >= 0, got {rounds}")
    draws = splitmix(rng)
    levels = np.broadcast_to((np.arange(n) + 0.5) / n, (d, n))
    entries = level_permutations(n, d, draws)
    if n > d + 1:
        entries = decorrelated(levels, entries, rounds=rounds)
    columns = Columns(levels=levels, nominal=np.zeros(d, np.bool_))
    if swaps == 0:
        return columns.points(entries)
    found = swap_search(columns, entries, criterion="correlation", swaps=swaps, heat=0.0, draws=draws)
    return found.points


def decorrelated(
    levels: Floats, entries: NDArray[np.int32], *, rounds: int = ROUNDS, beside: Floats | None = None
) -> NDArray[np.int32]:
    """Other entries (d, n) of the sorted columns `levels` (d, n), so that correlations vanish.

    beside: more columns (d, k) that stay as they are; the correlations of all together vanish.
    """
    d, n = levels.shape
    everything = levels if beside is None else np.hstack([levels, beside])
    mean = everything.mean(axis=1, keepdims=True)
    scale = everything.std(axis=1, keepdims=True) * np.sqrt(everything.shape[1])
    scale[scale == 0.0] = 1.0
    values = (levels - mean) / scale
    rest = np.zeros((d, d))
    if beside is not None:
        fixed = (beside - mean) / scale
        rest = fixed @ fixed.T
    best, least = entries, np.inf
    for k in range(rounds + 1):
        scores = np.take_along_axis(values, entries.astype(np.int64), axis=1)
        have = scores @ scores.T
        total = have + rest
        np.fill_diagonal(total, 0.0)
        worst = float(np.abs(total).max(initial=0.0))
        if worst < least:
            best, least = entries, worst
        if k == rounds:
            break
        try:
            before = np.linalg.cholesky(have)
            after = np.linalg.cholesky(have - total)  # the products that the new scores should have
        except np.linalg.LinAlgError:
            break
        moved = after @ solve_triangular(before, scores, lower=True)
        entries = np.empty((d, n), np.int32)
        for column, score in zip(entries, moved, strict=True):
            column[np.argsort(score)] = np.arange(n, dtype=np.int32)
    return best
