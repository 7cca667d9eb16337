# mypy: ignore-errors
"""Kernel of the swaps inside columns that raise |X'X| and leave a Latin hypercube one.

Swapping one coordinate of rows r and s changes two model rows, a rank-four change of M = X'X. With
U = [f_r, f_s, f_r', f_s'] (old, old, new, new) and S = diag(-1, -1, 1, 1),

    |M + U S U'| = |M| |1 + S U' M^-1 U|,    (M + U S U')^-1 = M^-1 - M^-1 U (S + U' M^-1 U)^-1 U' M^-1.
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.criteria._kernels_model_rows import expand_row
from doe.optimal._kernels_exchange import TIE
from doe.portable._kernels_draws import below
from doe.portable._kernels_linear import dot, times


@kernel()
def swap_columns(coded, x, inverse, starts, columns, state, swaps):
    """Try `swaps` random swaps, keep those that raise |X'X|; coded, x and inverse are updated in place.

    Returns (gain in log|X'X|, swaps kept).
    """
    n, d = coded.shape
    p = x.shape[1]
    u, v = np.empty((4, p)), np.empty((4, p))
    small, right = np.empty((4, 4)), np.empty((4, 4))
    total, kept = 0.0, 0
    if n < 2:
        return total, kept
    for _ in range(swaps):
        column, r, s = below(state, d), below(state, n), below(state, n - 1)
        s += s >= r
        u[0], u[1] = x[r], x[s]
        coded[r, column], coded[s, column] = coded[s, column], coded[r, column]
        expand_row(coded[r], starts, columns, u[2])
        expand_row(coded[s], starts, columns, u[3])
        for k in range(4):
            times(inverse, u[k], v[k])
        for i in range(4):
            for k in range(4):
                small[i, k] = dot(u[i], v[k])
                right[i, k] = 1.0 if i == k else 0.0
            small[i, i] += -1.0 if i < 2 else 1.0
        # |1 + S W| = |S| |S + W| and |S| = 1; Gauss-Jordan with row pivots gives it and the inverse
        determinant = 1.0
        for k in range(4):
            pivot = k
            for i in range(k + 1, 4):
                if abs(small[i, k]) > abs(small[pivot, k]):
                    pivot = i
            if pivot != k:
                for q in range(4):
                    small[k, q], small[pivot, q] = small[pivot, q], small[k, q]
                    right[k, q], right[pivot, q] = right[pivot, q], right[k, q]
                determinant = -determinant
            head = small[k, k]
            determinant *= head
            if head == 0.0:
                break
            for q in range(4):
                small[k, q] /= head
                right[k, q] /= head
            for i in range(4):
                if i != k:
                    factor = small[i, k]
                    for q in range(4):
                        small[i, q] -= factor * small[k, q]
                        right[i, q] -= factor * right[k, q]
        if determinant > 1.0 + TIE:
            total += np.log(determinant)
            kept += 1
            x[r], x[s] = u[2], u[3]
            for i in range(4):
                for k in range(4):
                    w = right[i, k]
                    for a in range(p):
                        t = w * v[i, a]
                        for b in range(p):
                            inverse[a, b] -= t * v[k, b]
        else:
            coded[r, column], coded[s, column] = coded[s, column], coded[r, column]
    return total, kept
