# mypy: ignore-errors
"""Small dense linear algebra, compiled: LU with row exchanges, in place, skipping zeros of chains.

Newton matrices here have 6 to a few hundred rows; a call into LAPACK costs more than the 6 x 6 work itself,
and a chain ordered body by body leaves most multipliers zero.
"""

from numba import njit

from .options import INNER

__all__ = ["lu_factor", "lu_list", "lu_solve", "lu_solve_listed", "lu_solve_transposed"]


@njit(**INNER)
def lu_factor(a, pivot):
    """Overwrite a (n, n) with L and U, pivot (n,) with row exchanges; 0, or 1 + the column without pivot."""
    n = a.shape[0]
    for k in range(n):
        best, p = abs(a[k, k]), k
        for i in range(k + 1, n):
            size = abs(a[i, k])
            if size > best:
                best, p = size, i
        pivot[k] = p
        if best == 0.0:
            return k + 1
        if p != k:
            for j in range(n):
                swap = a[k, j]
                a[k, j] = a[p, j]
                a[p, j] = swap
        inverse = 1.0 / a[k, k]
        upper = a[k]
        for i in range(k + 1, n):
            if a[i, k] != 0.0:
                factor = a[i, k] * inverse
                row = a[i]
                row[k] = factor
                for j in range(k + 1, n):
                    row[j] -= factor * upper[j]
    return 0


@njit(**INNER)
def exchange_rows(pivot, n, b):
    """Bring a right-hand side into the order of the n rows of the factors; pivot may have room for more."""
    for k in range(n):
        p = pivot[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap


@njit(**INNER)
def lu_solve(a, pivot, b):
    """Solve A x = b in place with the factors of `lu_factor`."""
    n = a.shape[0]
    exchange_rows(pivot, n, b)
    for i in range(n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]


@njit(**INNER)
def lu_list(a, value, column, start):
    """List what is not zero of the factors of `lu_factor`, for `lu_solve_listed`; returns how many there are.

    value, column (n n,): row by row left of the diagonal, the inverse of the diagonal, right of it.
    start (n + 1, 2): where a row and its diagonal stand.
    """
    n, at = a.shape[0], 0
    for i in range(n):
        start[i, 0] = at
        for j in range(n):
            if j == i:
                start[i, 1] = at
                value[at], column[at] = 1.0 / a[i, i], i
                at += 1
            elif a[i, j] != 0.0:
                value[at], column[at] = a[i, j], j
                at += 1
    start[n, 0] = at
    return at


@njit(**INNER)
def lu_solve_listed(pivot, value, column, start, b):
    """Solve A x = b in place with the list of `lu_list`: half the time of `lu_solve` for a quarter of it."""
    n = pivot.shape[0]
    exchange_rows(pivot, n, b)
    for i in range(n):
        total = b[i]
        for e in range(start[i, 0], start[i, 1]):
            total -= value[e] * b[column[e]]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for e in range(start[i, 1] + 1, start[i + 1, 0]):
            total -= value[e] * b[column[e]]
        b[i] = total * value[start[i, 1]]


@njit(**INNER)
def lu_solve_transposed(a, pivot, b):
    """Solve A^T x = b in place with the factors of `lu_factor`."""
    n = a.shape[0]
    for i in range(n):
        b[i] = b[i] / a[i, i]
        value = b[i]
        for j in range(i + 1, n):
            b[j] -= a[i, j] * value
    for i in range(n - 1, -1, -1):
        value = b[i]
        for j in range(i):
            b[j] -= a[i, j] * value
    for k in range(n - 1, -1, -1):
        p = pivot[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap
