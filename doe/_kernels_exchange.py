# mypy: ignore-errors
"""Row-exchange kernels: model rows, rank-one updates of the inverse information matrix, Fedorov passes.

Notation (Fedorov 1972; Miller & Nguyen 1994): f_j is the model row of candidate j, M = X'X the information
matrix of the design, d_j = f_j' M^-1 f_j the variance of candidate j, d_ij = f_i' M^-1 f_j. Putting j in the
place of i multiplies |M| by 1 + delta,

    delta = d_j - d_i - (d_i d_j - d_ij^2)  <=  d_j - d_i,

so candidates with d_j <= d_i never need their d_ij: this bound is what makes a pass cheap.
Rows of `f` are padded with zeros to a multiple of four, the inverse likewise.
"""

import numpy as np
from numba import njit

TIE = 1e-9  # gains closer than this count as equal and the first one wins: no decision hangs on rounding


@njit(cache=True, fastmath=True, error_model="numpy")
def expand(coded, starts, columns, out):
    """Fill out[:, t] with the product of the coded columns listed in columns[starts[t]:starts[t + 1]]."""
    for r in range(coded.shape[0]):
        for t in range(starts.size - 1):
            value = 1.0
            for q in range(starts[t], starts[t + 1]):
                value *= coded[r, columns[q]]
            out[r, t] = value


@njit(cache=True, fastmath=True, error_model="numpy")
def dot(a, b):
    s = 0.0
    for k in range(a.size):
        s += a[k] * b[k]
    return s


@njit(cache=True, fastmath=True, error_model="numpy")
def times(matrix, vector, out):
    """out = matrix @ vector for a symmetric or row-major matrix."""
    for r in range(matrix.shape[0]):
        out[r] = dot(matrix[r], vector)


@njit(cache=True, fastmath=True, error_model="numpy")
def variances(f, inverse, v, work):
    """v_j = f_j' inverse f_j for every row."""
    for j in range(f.shape[0]):
        times(inverse, f[j], work)
        v[j] = dot(work, f[j])


@njit(cache=True, fastmath=True, error_model="numpy")
def rank_one(f, inverse, v, g, scale):
    """inverse += scale g g' and v_j += scale (f_j' g)^2."""
    p = g.size
    for a in range(p):
        s = scale * g[a]
        for b in range(p):
            inverse[a, b] += s * g[b]
    for j in range(f.shape[0]):
        t = dot(f[j], g)
        v[j] += scale * t * t


@njit(cache=True, fastmath=True, error_model="numpy")
def add_greedily(f, design, used, kept, n, inverse, v, g, replicates):
    """Fill design[kept:n], each time with the candidate of largest variance (Dykstra 1971)."""
    log_gain = 0.0
    for k in range(kept, n):
        best, top = -1, -1.0
        for j in range(f.shape[0]):
            if v[j] > top * (1.0 + TIE) and (replicates or used[j] == 0):
                best, top = j, v[j]
        design[k] = best
        used[best] += 1
        times(inverse, f[best], g)
        log_gain += np.log1p(top)
        rank_one(f, inverse, v, g, -1.0 / (1.0 + top))
    return log_gain


@njit(cache=True, fastmath=True, error_model="numpy")
def fedorov_d(f, design, used, fixed, n, inverse, v, g, h, replicates, max_passes):
    """Exchange rows fixed..n-1 of the design until a pass gains nothing; returns (log gain, exchanges).

    For each design row the best candidate is taken (Cook & Nachtsheim 1980). Both updates of an exchange are
    made at once: with K = [[1 + d_j, d_ij], [d_ij, d_i - 1]], M^-1 loses [h g] K^-1 [h g]'.
    """
    p = g.size
    log_gain, exchanges = 0.0, 0
    idle = 0
    for _ in range(max_passes):
        for k in range(fixed, n):
            i = design[k]
            vi = v[i]
            times(inverse, f[i], g)
            best, gain, vij = -1, TIE, 0.0
            for j in range(f.shape[0]):
                if v[j] - vi > gain and (replicates or used[j] == 0):
                    t = dot(f[j], g)
                    delta = v[j] - vi - (vi * v[j] - t * t)
                    if delta > gain + TIE:
                        best, gain, vij = j, delta, t
            idle += 1
            if best >= 0:
                idle = 0
                exchanges += 1
                times(inverse, f[best], h)
                a = (1.0 - vi) / (1.0 + gain)
                b = vij / (1.0 + gain)
                c = -(1.0 + v[best]) / (1.0 + gain)
                for r in range(p):
                    s = a * h[r] + b * g[r]
                    t = b * h[r] + c * g[r]
                    for q in range(p):
                        inverse[r, q] -= s * h[q] + t * g[q]
                for j in range(f.shape[0]):
                    s, t = 0.0, 0.0
                    for q in range(p):
                        s += f[j, q] * h[q]
                        t += f[j, q] * g[q]
                    v[j] -= a * s * s + 2.0 * b * s * t + c * t * t
                used[i] -= 1
                used[best] += 1
                design[k] = best
                log_gain += np.log1p(gain)
            if idle >= n - fixed:
                return log_gain, exchanges
    return log_gain, exchanges
