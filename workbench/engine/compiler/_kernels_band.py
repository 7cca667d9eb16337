# mypy: ignore-errors
"""LU with row exchanges of band matrices, compiled: chains of bodies cost what their joints do.

Entry (i, j) of a matrix with `below` diagonals under the main one and `above` over it stands in
a[i, j - i + below], a (n, 2 below + above + 1): exchanges of rows fill `below` further diagonals over the
main one (Golub & Van Loan, Matrix Computations, section 4.3.5).
"""

from numba import njit

from .options import INNER

__all__ = ["band_factor", "band_solve", "band_solve_transposed"]


@njit(**INNER)
def band_factor(a, below, above, pivot):
    """Overwrite a by L and U, pivot (n,) by row exchanges; 0, or 1 + the column without pivot."""
    n = a.shape[0]
    reach = 0  # last column that the rows above have filled
    for k in range(n):
        end = min(k + below + 1, n)
        best, p = abs(a[k, below]), k
        for i in range(k + 1, end):
            size = abs(a[i, k - i + below])
            if size > best:
                best, p = size, i
        pivot[k] = p
        if best == 0.0:
            return k + 1
        reach = max(reach, min(p + above, n - 1))
        count = reach - k + 1
        upper = a[k, below : below + count]
        if p != k:
            other = a[p, below + k - p : below + k - p + count]
            for j in range(count):
                swap = upper[j]
                upper[j] = other[j]
                other[j] = swap
        inverse = 1.0 / upper[0]
        for i in range(k + 1, end):
            at = k - i + below
            if a[i, at] != 0.0:
                row = a[i, at : at + count]
                factor = row[0] * inverse
                row[0] = factor
                for j in range(1, count):
                    row[j] -= factor * upper[j]
    return 0


@njit(**INNER)
def band_solve(a, below, above, pivot, b):
    """Solve A x = b in place with the factors of `band_factor`."""
    n = a.shape[0]
    for k in range(n):
        p = pivot[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap
        value = b[k]
        if value != 0.0:
            for i in range(k + 1, min(k + below + 1, n)):
                b[i] -= a[i, k - i + below] * value
    for k in range(n - 1, -1, -1):
        total = b[k]
        for j in range(1, min(below + above, n - 1 - k) + 1):
            total -= a[k, below + j] * b[k + j]
        b[k] = total / a[k, below]


@njit(**INNER)
def band_solve_transposed(a, below, above, pivot, b):
    """Solve A^T x = b in place with the factors of `band_factor`."""
    n = a.shape[0]
    for k in range(n):
        value = b[k] / a[k, below]
        b[k] = value
        for j in range(1, min(below + above, n - 1 - k) + 1):
            b[k + j] -= a[k, below + j] * value
    for k in range(n - 1, -1, -1):
        total = b[k]
        for i in range(k + 1, min(k + below + 1, n)):
            total -= a[i, k - i + below] * b[i]
        b[k] = total
        p = pivot[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap
