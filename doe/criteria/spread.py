"""Numbers that judge the spread of a design, each by its own formula.

Notation: n points x_i in [0, 1]^d, d_ij their Euclidean distances, z = x - 1/2.

    phi_p (Morris & Mitchell 1995)    (sum over i < j of d_ij^-p)^(1/p)
    CD2, WD2, MD (Hickernell 1998; Zhou, Fang & Ning 2013)    squared discrepancies, as in scipy.stats.qmc
    MaxPro (Joseph, Gul & Ba 2015)    (mean over i < j of prod_k (x_ik - x_jk)^-2)^(1/d)
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria import _kernels_spread as kernels
from doe.criteria.regression import checked

__all__ = [
    "cd2",
    "correlations",
    "discrepancies",
    "max_correlation",
    "maxpro",
    "min_distance",
    "nearest_distances",
    "phi_p",
    "rms_correlation",
]

Floats = NDArray[np.float64]
P = 10
TINY = 1e-300


def unit_points(points: ArrayLike, name: str = "points") -> Floats:
    """The (n, d) array of points of the unit cube.

    Raises: ValueError when the array is not (n, d), not finite, or leaves [0, 1].
    """
    array = checked(points, name)
    outside = (array < 0.0) | (array > 1.0)
    if outside.any():
        row, column = (int(k) for k in np.argwhere(outside)[0])
        raise ValueError(
            f"{name} needs values in [0, 1], row {row} column {column} holds {array[row, column]:.6g};"
            " map physical values to the unit cube first"
        )
    return array


def columns_of(points: Floats) -> Floats:
    return np.ascontiguousarray(points.T)


def nearest_distances(points: ArrayLike) -> Floats:
    """Distance of each point to its nearest neighbour, (n,); infinite for a single point.

    >>> nearest_distances([[0.0, 0.0], [0.0, 0.5], [1.0, 0.5]]).tolist()
    [0.5, 0.5, 1.0]
    """
    return _distances(unit_points(points), P)[0]


def min_distance(points: ArrayLike) -> float:
    """Smallest distance between two points; infinite for a single point.

    >>> min_distance([[0.0, 0.0], [0.3, 0.4], [1.0, 1.0]])
    0.5
    """
    return float(nearest_distances(points).min())


def phi_p(points: ArrayLike, *, p: int = P) -> float:
    """(sum over pairs of d^-p)^(1/p), even p: close to 1/min_distance for large p. 0 for a single point.

    >>> round(phi_p([[0.0], [1.0]]), 12)
    1.0

    Raises: ValueError when p is not an even whole number >= 2.
    """
    check_power(p)
    return _distances(unit_points(points), p)[1]


def check_power(p: int) -> None:
    """Refuse a power that is not an even whole number >= 2."""
    if p < 2 or p % 2:
        raise ValueError(f"p needs an even whole number >= 2, got {p}")


def _distances(points: Floats, p: int) -> tuple[Floats, float]:
    n = len(points)
    nearest, sums = np.full(n, 1e300), np.empty(n)
    kernels.distances(columns_of(points), np.arange(n), True, p // 2, nearest, sums)
    duplicate = bool((nearest < TINY).any())
    nearest[nearest >= 1e300] = np.inf
    return np.sqrt(nearest), float("inf") if duplicate else float(sums.sum() ** (1.0 / p))


def discrepancies(points: ArrayLike) -> tuple[float, float, float]:
    """Squared centred, wrap-around and mixture discrepancy (CD2, WD2, MD).

    >>> [round(v, 6) for v in discrepancies([[0.5]])]
    [0.083333, 0.166667, 0.125]
    """
    array = unit_points(points)
    n = len(array)
    sums = np.empty((3, n))
    kernels.discrepancies(columns_of(array), np.arange(n), True, sums)
    singles = discrepancy_singles(array)
    pairs = (2.0 * sums.sum(axis=1) + singles[2]) / n**2
    centred, wrapped, mixed = singles[0] - 2.0 / n * singles[1] + pairs
    return float(centred), float(wrapped), float(mixed)


def discrepancy_singles(points: Floats) -> Floats:
    """Constants, single sums and diagonals of the three discrepancies, (3, 3)."""
    n, d = points.shape
    sums = np.empty(4)
    kernels.singles(points, sums)
    return np.array(
        [
            [(13 / 12) ** d, -((4 / 3) ** d), (19 / 12) ** d],
            [sums[0], 0.0, sums[1]],
            [sums[2], n * 1.5**d, sums[3]],
        ]
    )


def cd2(points: ArrayLike) -> float:
    """Squared centred L2 discrepancy; the same number as `discrepancies(points)[0]`, three times as fast.

    >>> round(cd2([[0.25], [0.75]]), 6)
    0.020833
    """
    array = unit_points(points)
    n = len(array)
    sums = np.empty(n)
    kernels.centred_products(columns_of(array), np.arange(n), True, sums)
    constant, single, diagonal = discrepancy_singles(array)[:, 0]
    return float(constant - 2.0 / n * single + (2.0 * sums.sum() + diagonal) / n**2)


def maxpro(points: ArrayLike) -> float:
    """(mean over pairs of prod_k (x_ik - x_jk)^-2)^(1/d): infinite when two points share a coordinate.

    >>> maxpro([[0.0, 0.0], [0.5, 1.0]])
    2.0
    """
    array = unit_points(points)
    n, d = array.shape
    if n == 1:
        return 0.0
    sums = np.empty(n)
    kernels.projections(columns_of(array), np.arange(n), True, sums)
    return float((sums.sum() / (n * (n - 1) / 2)) ** (1.0 / d))


def correlations(points: ArrayLike) -> Floats:
    """Correlation matrix of the columns, (d, d); 0 where a column is constant, 1 on the diagonal.

    >>> correlations([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]).round(12).tolist()
    [[1.0, -1.0], [-1.0, 1.0]]
    """
    array = unit_points(points)
    centred = array - array.mean(axis=0)
    scale = np.sqrt((centred**2).sum(axis=0))
    centred /= np.where(scale > 0.0, scale, 1.0)
    matrix = np.clip(centred.T @ centred, -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return matrix


def max_correlation(points: ArrayLike) -> float:
    """Largest absolute correlation between two columns; 0 for a single column.

    >>> round(max_correlation([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]), 12)
    1.0
    """
    return float(np.abs(_off_diagonal(points)).max(initial=0.0))


def rms_correlation(points: ArrayLike) -> float:
    """Root mean square of the correlations between two columns; 0 for a single column.

    >>> round(rms_correlation([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]), 12)
    1.0
    """
    values = _off_diagonal(points)
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _off_diagonal(points: ArrayLike) -> Floats:
    matrix = correlations(points)
    return np.asarray(matrix[np.triu_indices(len(matrix), 1)])
