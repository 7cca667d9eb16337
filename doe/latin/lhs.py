"""Latin hypercube samples (McKay, Beckman & Conover 1979): one point in each of n strata of every factor."""

import numpy as np
from numpy.typing import NDArray

from doe.portable.draws import (
    Draws,
    level_permutations,
    splitmix,
    unit_numbers,
)

__all__ = ["centred_lhs", "checked_size", "lhs", "points_in_cells"]

Floats = NDArray[np.float64]
LARGEST = 2**31 - 1
ROWS = 65536  # of a design that are filled in at a time


def lhs(n: int, d: int, *, rng: np.random.Generator) -> Floats:
    """A random Latin hypercube, (n, d) in [0, 1): each point uniform in its stratum.

        x_ik = (pi_k(i) + u_ik) / n,    pi_k a random permutation of 0..n-1, u uniform in [0, 1)

    >>> points = lhs(5, 2, rng=np.random.default_rng(1))
    >>> np.sort((points * 5).astype(int), axis=0).T.tolist()
    [[0, 1, 2, 3, 4], [0, 1, 2, 3, 4]]

    Raises: ValueError for n < 1 or d < 1; TypeError when `rng` is not a numpy Generator.
    """
    n, d = checked_size(n, d)
    draws = splitmix(rng)
    return points_in_cells(level_permutations(n, d, draws).T, draws)


def centred_lhs(n: int, d: int, *, rng: np.random.Generator) -> Floats:
    """A Latin hypercube with every point in the middle of its stratum, (n, d).

    >>> np.sort(centred_lhs(4, 1, rng=np.random.default_rng(1)), axis=0).ravel().tolist()
    [0.125, 0.375, 0.625, 0.875]
    """
    n, d = checked_size(n, d)
    return np.ascontiguousarray((level_permutations(n, d, splitmix(rng)).T + 0.5) / n)


def points_in_cells(cells: NDArray[np.integer], draws: Draws) -> Floats:
    """Points drawn uniformly inside the cells (n, d) of a Latin hypercube: (n, d) in [0, 1).

    The quotient is kept below the stratum's upper bound, which rounding may reach.
    """
    n = len(cells)
    points = unit_numbers(cells.shape, draws)
    # some rows at a time: of a design that fills the memory there is one array of points
    for begin in range(0, n, ROWS):
        some, part = points[begin : begin + ROWS], cells[begin : begin + ROWS]
        some += part
        some /= n
        np.minimum(some, np.nextafter((part + 1) / n, 0.0), out=some)
    return points


def checked_size(n: int, d: int) -> tuple[int, int]:
    """n and d as plain whole numbers.

    Raises: ValueError when either is not a whole number >= 1.
    """
    for name, value, what in (("n", n, "runs"), ("d", d, "factors")):
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or not 1 <= value <= LARGEST:
            most = f" and <= {LARGEST}" if whole and value > LARGEST else ""
            raise ValueError(f"{name} needs a whole number of {what} >= 1{most}, got {value!r}")
    return int(n), int(d)
