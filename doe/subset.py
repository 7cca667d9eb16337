"""Choosing some runs of many: the best-spread rows of a list of candidates."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe import _kernels_subset as kernels
from doe.criteria.spread import check_power, unit_points
from doe.portable.draws import splitmix

__all__ = ["subset"]

Integers = NDArray[np.int64]
GRID = 2**24  # whole coordinates per unit: squared distances stay below 2^62 for any d < 2^14
TRIALS = 20_000


def subset(
    candidates: ArrayLike,
    n: int,
    *,
    keep: Sequence[int] = (),
    p: int = 10,
    trials: int = TRIALS,
    rng: np.random.Generator,
) -> Integers:
    """Numbers of n rows of `candidates` (N, d) that spread out: (n,), those to `keep` first.

    The farthest candidate next (Kennard & Stone 1969), then random exchanges that lower phi_p. For
    sub-sampling a large table, and for spaces whose constraints leave no Latin hypercube: pass feasible
    candidates.

    >>> corners = [[0.0, 0.0], [0.1, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]
    >>> sorted(subset(corners, 4, rng=np.random.default_rng(1)).tolist())
    [0, 2, 3, 5]

    Raises: ValueError when n is not in 1..N, rows to keep do not exist or repeat, or candidates are not
    finite points of the unit cube; the message counts duplicate candidates when too few different ones are
    left.
    """
    check_power(p)
    array = unit_points(candidates, "candidates")
    total = len(array)
    if not 1 <= n <= total:
        raise ValueError(f"n needs 1..{total} of the {total} candidates, got n={n}")
    kept = np.array(list(keep), dtype=np.int64)
    if len(kept) > n or len(np.unique(kept)) < len(kept) or ((kept < 0) | (kept >= total)).any():
        raise ValueError(
            f"keep needs at most n={n} different row numbers in 0..{total - 1}, got {list(keep)}"
        )
    if trials < 0:
        raise ValueError(f"trials needs a whole number >= 0, got {trials}")
    x = np.rint(array * GRID).astype(np.int32)
    different = len(np.unique(x, axis=0))
    if different < n:
        raise ValueError(
            f"candidates holds {different} different points, {total - different} are duplicates; ask for n <="
            f" {different}, got n={n}"
        )
    draws = splitmix(rng)
    chosen = np.empty(n, dtype=np.int64)
    chosen[: len(kept)] = kept
    used = np.zeros(total, np.bool_)
    used[kept] = True
    first = len(kept)
    if first == 0:  # start at an end, not in the middle
        chosen[0] = int(np.argmax(((x - x.mean(axis=0).round()) ** 2).sum(axis=1)))
        used[chosen[0]] = True
        first = 1
    kernels.farthest(x, chosen, first, used)
    if n > len(kept) and n > 1:
        closest = min(kernels.squared(x, chosen[-1], other) for other in chosen[:-1])
        scale = float(2.0**40 * float(max(closest, 1)) ** (p // 2))
        if np.isfinite(scale):
            kernels.exchange_rows(x, chosen, len(kept), used, p // 2, scale, trials, draws)
    return chosen
