"""Sliced Latin hypercubes (Qian 2012): a Latin hypercube of t m runs made of t Latin hypercubes of m runs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from doe.latin.columns import Columns
from doe.latin.lhs import checked_size
from doe.latin.swaps import swap_search
from doe.portable.draws import shuffled, splitmix

__all__ = ["sliced_lhs"]

Floats = NDArray[np.float64]


def sliced_lhs(
    slices: int,
    m: int,
    d: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    swaps: int = 100_000,
    p: int = 10,
    rng: np.random.Generator,
) -> Floats:
    """t = `slices` Latin hypercubes of m runs, one after the other, together a Latin hypercube: (t m, d).

    Row r belongs to slice r // m. Swaps stay inside a slice and lower the criterion of the whole design.

    >>> points = sliced_lhs(2, 3, 2, swaps=500, rng=np.random.default_rng(1))
    >>> [np.sort((part * 3).astype(int), axis=0)[:, 0].tolist() for part in (points[:3], points[3:])]
    [[0, 1, 2], [0, 1, 2]]
    >>> np.sort((points * 6).astype(int), axis=0)[:, 0].tolist()
    [0, 1, 2, 3, 4, 5]

    Raises: ValueError for slices, m or d < 1.
    """
    if slices < 1:
        raise ValueError(f"slices needs a whole number >= 1, got {slices}")
    m, d = checked_size(m, d)
    n = slices * m
    draws = splitmix(rng)
    entries = np.empty((d, n), np.int32)
    for k in range(d):
        # stratum c of a slice holds the levels c t .. c t + t - 1, dealt out to the slices at random
        dealt = np.stack([c * slices + shuffled(np.arange(slices), draws) for c in range(m)])
        for s in range(slices):
            entries[k, s * m : (s + 1) * m] = shuffled(dealt[:, s], draws)
    columns = Columns(levels=np.tile((np.arange(n) + 0.5) / n, (d, 1)), nominal=np.zeros(d, np.bool_))
    groups = np.array([[s * m, m] for s in range(slices)], dtype=np.int64)
    found = swap_search(columns, entries, criterion=criterion, swaps=swaps, p=p, groups=groups, draws=draws)
    return found.points
