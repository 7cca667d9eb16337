# mypy: ignore-errors
"""Branch-sparse LU, compiled: no row exchanges, only the entries of a `Pattern` are visited.

The Newton matrix is the mass matrix plus the step's share of stiffness and damping; where a pivot falls below
a tiny part of its diagonal entry the factors are useless and the caller is told.
"""

from numba import njit

from ...compiler.options import CALLED, INNER

SAFE = 1e-10  # of the diagonal entry before elimination


@njit(**CALLED)
def factor(P, a, diagonal):
    """Overwrite a (n, n) by L (columns divided by the pivot) and U; 0, or 1 + the column of a lost pivot."""
    n = P.order.shape[0]
    for i in range(n):
        diagonal[i] = a[i, i]
    for i in range(n):
        k = P.order[i]
        pivot = a[k, k]
        if not abs(pivot) > SAFE * abs(diagonal[k]):
            return k + 1
        inverse = 1.0 / pivot
        first, last = P.first[i], P.first[i + 1]
        upper = a[k]
        for g in range(first, last):
            for j in range(P.run[g, 0], P.run[g, 1]):
                value = a[j, k]
                if value != 0.0:
                    by = value * inverse
                    row = a[j]
                    row[k] = by
                    for e in range(first, last):
                        for c in range(P.run[e, 0], P.run[e, 1]):
                            row[c] -= by * upper[c]
    return 0


@njit(**CALLED)
def solve(P, a, b):
    """Solve A x = b in place."""
    n = P.order.shape[0]
    for i in range(n):
        k = P.order[i]
        value = b[k]
        if value != 0.0:
            for g in range(P.first[i], P.first[i + 1]):
                for j in range(P.run[g, 0], P.run[g, 1]):
                    b[j] -= a[j, k] * value
    for i in range(n - 1, -1, -1):
        k = P.order[i]
        total = b[k]
        upper = a[k]
        for g in range(P.first[i], P.first[i + 1]):
            for j in range(P.run[g, 0], P.run[g, 1]):
                total -= upper[j] * b[j]
        b[k] = total / a[k, k]


@njit(**INNER)
def solve_transposed(P, a, b):
    """Solve A^T x = b in place."""
    n = P.order.shape[0]
    for i in range(n):
        k = P.order[i]
        value = b[k] / a[k, k]
        b[k] = value
        upper = a[k]
        for g in range(P.first[i], P.first[i + 1]):
            for j in range(P.run[g, 0], P.run[g, 1]):
                b[j] -= upper[j] * value
    for i in range(n - 1, -1, -1):
        k = P.order[i]
        total = b[k]
        for g in range(P.first[i], P.first[i + 1]):
            for j in range(P.run[g, 0], P.run[g, 1]):
                total -= a[j, k] * b[j]
        b[k] = total
