"""Designs as columns of prescribed levels: what a swap search rearranges."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CRITERIA", "Columns", "Feasible"]

Floats = NDArray[np.float64]
CRITERIA = ("phi_p", "cd2", "maxpro", "correlation")
GRID_RANGE = 2**30  # squared distances in whole numbers stay below
FINEST = 2**12

Feasible = Callable[[Floats], NDArray[np.bool_]]
"""From points (m, d) in [0, 1] to m truth values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """What a swap may rearrange: the levels of every column, with repeats, and which columns have no order.

    levels: (d, n) positions in [0, 1], sorted along each row    nominal: (d,) true for unordered levels
    """

    levels: Floats
    nominal: NDArray[np.bool_]

    def grid(self, names: Sequence[str]) -> tuple[NDArray[np.int32], int]:
        """Whole coordinates (d, n) for the criteria, and the coordinate that stands for 1.

        The levels of a Latin hypercube are whole numbers already; others are rounded so finely that squared
        distances stay below 2^30, or to 2^24 parts when only correlations are wanted.
        """
        d, n = self.levels.shape
        exact = names == ("correlation",) or d * n * n < GRID_RANGE
        if exact and np.array_equal(self.levels, np.broadcast_to((np.arange(n) + 0.5) / n, (d, n))):
            return np.tile(np.arange(n, dtype=np.int32), (d, 1)), n
        fine = min(int((GRID_RANGE / (2 * d)) ** 0.5), FINEST)
        if names == ("correlation",):
            fine = FINEST**2
        return np.rint(self.levels * fine).astype(np.int32), fine

    def points(self, entries: NDArray[np.integer]) -> Floats:
        """Points (n, d) of the entries (d, n)."""
        return np.ascontiguousarray(np.take_along_axis(self.levels, entries.astype(np.int64), axis=1).T)
