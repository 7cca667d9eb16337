"""Growing a design: new runs beside the old ones, and designs that grow in given steps.

A Latin hypercube of n runs occupies n of the N = n + m strata of every column of the larger design; the new
runs take the empty ones, so that n + m runs are a Latin hypercube again whenever the old runs keep apart
that far.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria.spread import unit_points
from doe.latin.columns import Columns
from doe.latin.decorrelated import ROUNDS, decorrelated
from doe.latin.optimised import optimised_lhs
from doe.latin.swaps import SWAPS, SwapResult, swap_search
from doe.portable.draws import Draws, splitmix
from doe.portable.draws import shuffled as shuffled_integers

__all__ = ["augment", "nested_lhs", "search_augmentation", "search_rearrangement"]

Floats = NDArray[np.float64]


def augment(
    points: ArrayLike,
    m: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    rng: np.random.Generator,
) -> Floats:
    """The design (n, d) with m more runs, (n + m, d): the old rows first and unchanged.

    Every new run lies in the middle of an empty stratum of the n + m; their arrangement is optimised for the
    criterion of the whole design. Beyond 8192 runs only criterion="correlation" is at hand.

    >>> rng = np.random.default_rng(1)
    >>> old = optimised_lhs(8, 3, swaps=2000, rng=rng)
    >>> grown = augment(old, 8, swaps=2000, rng=rng)
    >>> bool(np.array_equal(grown[:8], old)), np.sort((grown * 16).astype(int), axis=0)[:, 0].tolist()
    (True, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])

    Raises: ValueError for points outside [0, 1], m < 1, and what `optimised_lhs` refuses.
    """
    return search_augmentation(
        points, m, criterion=criterion, weights=weights, swaps=swaps, seconds=seconds, p=p, rng=rng
    ).points


def search_augmentation(
    points: ArrayLike,
    m: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    rng: np.random.Generator,
) -> SwapResult:
    """As `augment`, with the record of the search."""
    old = unit_points(points)
    d = old.shape[1]
    if m < 1:
        raise ValueError(f"m needs a number of new runs >= 1, got {m}")
    draws = splitmix(rng)
    new = np.stack([_fill(column, m, draws) for column in old.T], axis=1)
    if criterion == "correlation" and m > d + 1:
        order = np.argsort(new, axis=0, kind="stable").T
        ranks = np.empty((d, m), np.int32)
        np.put_along_axis(ranks, order, np.arange(m, dtype=np.int32)[None], axis=1)
        levels = np.sort(new, axis=0).T
        ranks = decorrelated(levels, ranks, rounds=ROUNDS, beside=old.T)
        new = np.take_along_axis(levels, ranks.astype(np.int64), axis=1).T
    return _rearranged(np.vstack([old, new]), m, criterion, weights, swaps, seconds, p, draws)


def search_rearrangement(
    points: ArrayLike,
    m: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    rng: np.random.Generator,
) -> SwapResult:
    """The last `m` of the points (n + m, d) arranged anew: their values are swapped inside each column.

    The first n stay, and so do the values of every column, whatever they are: strata or levels.

    >>> points = [[0.0, 0.0], [1.0, 1.0], [0.0, 0.2], [1.0, 0.8]]
    >>> result = search_rearrangement(points, 2, swaps=100, rng=np.random.default_rng(1))
    >>> result.points[:2].tolist(), sorted(result.points[2:].tolist())
    ([[0.0, 0.0], [1.0, 1.0]], [[0.0, 0.8], [1.0, 0.2]])

    Raises: ValueError for points outside [0, 1], fewer than m points, and what `optimised_lhs` refuses.
    """
    array = unit_points(points)
    if not 1 <= m <= len(array):
        raise ValueError(f"m needs a number of runs from 1 to {len(array)}, got {m}")
    return _rearranged(array, m, criterion, weights, swaps, seconds, p, splitmix(rng))


def nested_lhs(
    sizes: Sequence[int],
    d: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    swaps: int = SWAPS,
    p: int = 10,
    rng: np.random.Generator,
) -> Floats:
    """Latin hypercubes inside each other: the first sizes[0] rows, the first sizes[1] rows, ... are one each.

    >>> points = nested_lhs([4, 8], 2, swaps=500, rng=np.random.default_rng(1))
    >>> [np.sort((points[:k] * k).astype(int), axis=0)[:, 1].tolist() for k in (4, 8)]
    [[0, 1, 2, 3], [0, 1, 2, 3, 4, 5, 6, 7]]

    Raises: ValueError unless the sizes increase.
    """
    steps = [int(size) for size in sizes]
    if not steps or steps[0] < 1 or any(b <= a for a, b in pairwise(steps)):
        raise ValueError(f"sizes needs increasing numbers of runs >= 1, got {list(sizes)}")
    points = optimised_lhs(steps[0], d, criterion=criterion, swaps=swaps, p=p, rng=rng)
    for before, after in pairwise(steps):
        points = augment(points, after - before, criterion=criterion, swaps=swaps, p=p, rng=rng)
    return points


def _fill(column: Floats, m: int, draws: Draws) -> Floats:
    """m positions in the middle of strata that `column` leaves empty, in random order.

    Where old values share strata there are more empty ones than new runs; then evenly spread ones are taken.
    """
    n = len(column) + m
    taken = np.minimum((column * n).astype(np.int64), n - 1)
    empty = np.setdiff1d(np.arange(n), taken)
    if len(empty) > m:
        empty = empty[((np.arange(m) + 0.5) * len(empty) / m).astype(np.int64)]
    return np.asarray((shuffled_integers(empty, draws) + 0.5) / n)


def _rearranged(
    array: Floats,
    m: int,
    criterion: str | Sequence[str],
    weights: Sequence[float] | None,
    swaps: int | None,
    seconds: float | None,
    p: int,
    draws: Draws,
) -> SwapResult:
    """Swap search over the last `m` rows."""
    total, d = array.shape
    order = np.argsort(array, axis=0, kind="stable")
    entries = np.empty_like(order)
    np.put_along_axis(entries, order, np.arange(total)[:, None], axis=0)
    columns = Columns(levels=np.ascontiguousarray(np.sort(array, axis=0).T), nominal=np.zeros(d, np.bool_))
    return swap_search(
        columns,
        np.ascontiguousarray(entries.T, dtype=np.int32),
        criterion=criterion,
        weights=weights,
        swaps=SWAPS if swaps is None and seconds is None else swaps,
        seconds=seconds,
        p=p,
        groups=np.array([[total - m, m]], dtype=np.int64),
        draws=draws,
    )
