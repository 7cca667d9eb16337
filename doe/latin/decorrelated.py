"""Latin hypercubes without correlation, for any number of runs.

Rank-preserving decorrelation (Iman & Conover 1982; Owen 1994): the scores of the columns are multiplied by
the inverse Cholesky factor of their correlation matrix, and each column takes the order of its new scores. A
few rounds square the correlations each time until the rounding of ranks stops them at about n^-3/2; swaps
finish the work. Scores are whole numbers small enough for products to be exact in any order of summation, so
that the design is the same to the last bit with every linear algebra library.
"""

import math

import numpy as np
from numpy.typing import NDArray

from doe.latin.columns import Columns
from doe.latin.lhs import checked_size
from doe.latin.swaps import swap_search
from doe.portable.draws import level_permutations, splitmix
from doe.portable.linear import inverse_root, product

__all__ = ["decorrelated", "decorrelated_lhs"]

Floats = NDArray[np.float64]
ROUNDS = 2
EXACT_BITS = 53
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
    unit = _unit(everything - mean)
    values = np.rint((levels - mean) / unit)
    fixed = np.zeros((d, 0)) if beside is None else np.rint((beside - mean) / unit)
    scale = np.sqrt(np.sum(values**2, axis=1) + np.sum(fixed**2, axis=1))
    scale[scale == 0.0] = 1.0
    rest = fixed @ fixed.T / np.outer(scale, scale)
    best, least = entries, np.inf
    for k in range(rounds + 1):
        scores = np.take_along_axis(values, entries.astype(np.int64), axis=1)
        have = scores @ scores.T / np.outer(scale, scale)
        total = have + rest
        np.fill_diagonal(total, 0.0)
        worst = float(np.abs(total).max(initial=0.0))
        if worst < least:
            best, least = entries, worst
        if k == rounds:
            break
        wanted = have - total  # the products that the new scores should have
        before, after = inverse_root(have), inverse_root(wanted)
        if before is None or after is None:
            break
        # wanted = L L' and after = L^-1, so L = wanted after'
        change = product(product(wanted, np.ascontiguousarray(after.T)), before) / scale
        moved = _whole_rows(change, scores) @ scores
        entries = np.empty((d, n), np.int32)
        for column, score in zip(entries, moved, strict=True):
            column[np.argsort(score, kind="stable")] = np.arange(n, dtype=np.int32)
    return best


def _unit(centred: Floats) -> Floats:
    """Of each row of (d, n): multiples of it, rounded to whole numbers, have products below 2^53."""
    reach = np.abs(centred).max(axis=1, keepdims=True, initial=0.0)
    reach[reach == 0.0] = 1.0
    return np.asarray(reach / 2.0 ** ((EXACT_BITS - math.log2(centred.shape[1])) // 2))


def _whole_rows(change: Floats, scores: Floats) -> Floats:
    """Rows of `change`, each on its own scale, as whole numbers: their product with the scores is exact."""
    bits = EXACT_BITS - math.log2(len(change) * max(float(np.abs(scores).max()), 1.0))
    return np.asarray(np.rint(change / np.abs(change).max(axis=1, keepdims=True) * 2.0 ** (bits // 1)))
