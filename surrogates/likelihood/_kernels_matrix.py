# mypy: ignore-errors
"""Algebra of one correlation matrix: packed sums, exponentials, factor, inverse, product.

Loops take four rows at a time: what is loaded serves all four.
"""

import numpy as np

from .._kernel_cache import kernel

__all__ = ["FAILED", "exp_minus", "factor", "lower_gram", "weighted"]

FAILED = -1e300  # a log-likelihood that no start can have: R is not positive definite here
ROUND = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the nearest whole number in the lowest bits
LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # the first with zeros for 20 bits of a factor


@kernel()
def weighted(D, at, theta, alive, R):
    """Add sum_k theta_k D[at_k] over the k in `alive` to R (pairs,)."""
    pairs = D.shape[1]
    count = alive.shape[0]
    whole = count - count % 4
    for g in range(0, whole, 4):
        k0, k1, k2, k3 = alive[g], alive[g + 1], alive[g + 2], alive[g + 3]
        c0, c1, c2, c3 = theta[k0], theta[k1], theta[k2], theta[k3]
        u0, u1, u2, u3 = at[k0], at[k1], at[k2], at[k3]
        for t in range(pairs):
            R[t] += c0 * D[u0, t] + c1 * D[u1, t] + c2 * D[u2, t] + c3 * D[u3, t]
    for g in range(whole, count):
        c = theta[alive[g]]
        u = at[alive[g]]
        for t in range(pairs):
            R[t] += c * D[u, t]


# fastmath would undo the roundings; not named here, it would be inherited from the caller
@kernel(fastmath=False)
def exp_minus(R, S):
    """Replace R >= 0 by exp(-R), to one unit in the last place; S is scratch of the same length.

    exp(x) = 2^k exp(r) with |r| <= log(2) / 2: a polynomial, and k put into the exponent's bits. The
    compiler makes vectors of it, and none of calls of the library's exp, a third of the time of 130 runs.
    """
    n = R.shape[0]
    for t in range(n):
        x = max(-R[t], -708.0)
        z = x * LOG2_E + ROUND
        S[t] = z
        k = z - ROUND
        r = (x - k * LN2_HIGH) - k * LN2_LOW
        p = 1.0 / 6227020800.0
        p = p * r + 1.0 / 479001600.0
        p = p * r + 1.0 / 39916800.0
        p = p * r + 1.0 / 3628800.0
        p = p * r + 1.0 / 362880.0
        p = p * r + 1.0 / 40320.0
        p = p * r + 1.0 / 5040.0
        p = p * r + 1.0 / 720.0
        p = p * r + 1.0 / 120.0
        p = p * r + 1.0 / 24.0
        p = p * r + 1.0 / 6.0
        p = p * r + 0.5
        p = p * r + 1.0
        R[t] = p * r + 1.0
    bits = S.view(np.int64)
    for t in range(n):
        bits[t] = (bits[t] + 1023) << 52
    for t in range(n):
        R[t] *= S[t]


@kernel()
def factor(R, diagonal, L, M):
    """Factor the matrix with packed R and a constant diagonal into L L'; returns its log-determinant.

    L is filled below its diagonal and M with L^-1. FAILED where there is no factor. Four rows at a time: what
    is loaded from L or M serves all four.
    """
    n = L.shape[0]
    log_det = 0.0
    start = 0
    i = 0
    while i < n:
        rows = min(4, n - i)
        if rows == 4:
            t1 = start + i
            t2 = t1 + i + 1
            t3 = t2 + i + 2
            for j in range(i):
                s0 = R[start + j]
                s1 = R[t1 + j]
                s2 = R[t2 + j]
                s3 = R[t3 + j]
                for k in range(j):
                    c = L[j, k]
                    s0 -= c * L[i, k]
                    s1 -= c * L[i + 1, k]
                    s2 -= c * L[i + 2, k]
                    s3 -= c * L[i + 3, k]
                c = M[j, j]
                L[i, j] = s0 * c
                L[i + 1, j] = s1 * c
                L[i + 2, j] = s2 * c
                L[i + 3, j] = s3 * c
        for r in range(i, i + rows):
            for j in range(i if rows == 4 else 0, r):
                s = R[start + j]
                for k in range(j):
                    s -= L[r, k] * L[j, k]
                L[r, j] = s * M[j, j]
            s = diagonal
            for k in range(r):
                s -= L[r, k] * L[r, k]
            if not s > 1e-14:
                return FAILED
            root = np.sqrt(s)
            log_det += 2.0 * np.log(root)
            M[r, r] = 1.0 / root
            start += r
        i += rows
    for i in range(n):
        whole = i - i % 4
        for k in range(0, whole, 4):
            c0 = L[i, k]
            c1 = L[i, k + 1]
            c2 = L[i, k + 2]
            c3 = L[i, k + 3]
            for j in range(k + 4):  # M is 0 above its diagonal
                M[i, j] -= c0 * M[k, j] + c1 * M[k + 1, j] + c2 * M[k + 2, j] + c3 * M[k + 3, j]
        for k in range(whole, i):
            c = L[i, k]
            for j in range(k + 1):
                M[i, j] -= c * M[k, j]
        c = M[i, i]
        for j in range(i):
            M[i, j] *= c
    return log_det


@kernel()
def lower_gram(M, W):
    """Add M' M to the lower triangle of W, for a lower triangular M."""
    n = M.shape[0]
    whole = n - n % 4
    for k in range(0, whole, 4):
        for i in range(k + 4):
            c0 = M[k, i]
            c1 = M[k + 1, i]
            c2 = M[k + 2, i]
            c3 = M[k + 3, i]
            for j in range(i + 1):
                W[i, j] += c0 * M[k, j] + c1 * M[k + 1, j] + c2 * M[k + 2, j] + c3 * M[k + 3, j]
    for k in range(whole, n):
        for i in range(k + 1):
            c = M[k, i]
            for j in range(i + 1):
                W[i, j] += c * M[k, j]
