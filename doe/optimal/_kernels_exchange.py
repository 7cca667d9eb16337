# mypy: ignore-errors
"""Row-exchange kernels: rank-one updates, one design row at a time against all candidates.

Notation (Fedorov 1972; Miller & Nguyen 1994): f_j is the model row of candidate j, M = X'X the information
matrix of the design, v_j = f_j' M^-1 f_j, t = f_i' M^-1 f_j. Putting j in the place of i multiplies |M| by
1 + delta,

    delta = v_j - v_i - (v_i v_j - t^2)  <=  v_j - v_i,

so a candidate with v_j <= v_i never needs its t: this bound is what makes a pass cheap. For the criteria
trace M^-1 B (A: B = 1; I: B the moments), with C = M^-1 B M^-1, c_j = f_j' C f_j and s = f_i' C f_j, the
trace changes by ((v_i - 1) c_j - 2 t s + (1 + v_j) c_i) / (1 + delta).

Both updates of an exchange are made at once: with K = [[1 + v_j, t], [t, v_i - 1]], g = M^-1 f_i and
h = M^-1 f_j, M^-1 loses [h g] K^-1 [h g]'. Rows of `f` are padded with zeros to a multiple of four.
No fastmath: the same candidates give the same design on every processor (see `_kernels_linear`).
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.portable._kernels_linear import dot, times

TIE = 1e-9  # gains closer than this count as equal and the first one wins: no decision hangs on rounding


@kernel()
def add_greedily(f, design, used, kept, inverse, v, replicates):
    """Fill design[kept:], each time with the candidate of largest variance (Dykstra 1971)."""
    p = f.shape[1]
    g = np.empty(p)
    for k in range(kept, design.size):
        best, top = -1, -1.0
        for j in range(f.shape[0]):
            if v[j] > top * (1.0 + TIE) and (replicates or used[j] == 0):
                best, top = j, v[j]
        design[k] = best
        used[best] += 1
        times(inverse, f[best], g)
        scale = 1.0 / (1.0 + dot(g, f[best]))
        for a in range(p):
            s = scale * g[a]
            for b in range(p):
                inverse[a, b] -= s * g[b]
        for j in range(f.shape[0]):
            t = dot(f[j], g)
            v[j] -= scale * t * t


@kernel(allocates=False, inner=True)
def update_inverse(inverse, g, h, a, b, c):
    """Inverse -= a h h' + b (h g' + g h') + c g g'."""
    p = g.size
    for r in range(p):
        s = a * h[r] + b * g[r]
        t = b * h[r] + c * g[r]
        row = inverse[r]
        for q in range(p):
            row[q] -= s * h[q] + t * g[q]


@kernel(inner=True)
def update_middle(middle, g, h, gc, hc, a, b, e, s11, s12, s22):
    """M^-1 B M^-1 after the exchange whose update of M^-1 has the coefficients a, b, e; gc, hc = middle f."""
    for r in range(g.size):
        x, y = a * h[r] + b * g[r], b * h[r] + e * g[r]
        z = s11 * h[r] + s12 * g[r]
        u = s12 * h[r] + s22 * g[r]
        xc, yc = a * hc[r] + b * gc[r], b * hc[r] + e * gc[r]
        for q in range(g.size):
            middle[r, q] += z * h[q] + u * g[q] - x * hc[q] - y * gc[q] - xc * h[q] - yc * g[q]


@kernel()
def climb_d(f, design, used, fixed, inverse, v, replicates, max_exchanges):
    """Give rows fixed.. of the design their best candidate in turn until none gains; the exchanges made.

    One best candidate per design row is the variant of Cook & Nachtsheim (1980).
    """
    n, p = design.size, f.shape[1]
    g, h = np.empty(p), np.empty(p)
    exchanges, idle, k = 0, 0, fixed
    while idle < n - fixed and exchanges < max_exchanges:
        i = design[k]
        times(inverse, f[i], g)
        vi = dot(g, f[i])
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
            update_inverse(inverse, g, h, a, b, c)
            for j in range(f.shape[0]):
                s, t = dot(f[j], h), dot(f[j], g)
                v[j] -= a * s * s + 2.0 * b * s * t + c * t * t
            used[i] -= 1
            used[best] += 1
            design[k] = best
        k = k + 1 if k + 1 < n else fixed
    return exchanges


@kernel()
def climb_trace(f, design, used, fixed, inverse, middle, v, c, trace, replicates, max_exchanges):
    """The same for trace M^-1 B, with `middle` = M^-1 B M^-1 and c_j = f_j' middle f_j kept up to date.

    By Cauchy and Schwarz t s <= sqrt(v_i v_j c_i c_j): candidates that cannot gain even then are passed over.
    """
    n, p = design.size, f.shape[1]
    g, h, gc, hc = np.empty(p), np.empty(p), np.empty(p), np.empty(p)
    exchanges, idle, k = 0, 0, fixed
    while idle < n - fixed and exchanges < max_exchanges:
        i = design[k]
        times(inverse, f[i], g)
        times(middle, f[i], gc)
        vi, ci = dot(g, f[i]), dot(gc, f[i])
        best, drop, vij, cij = -1, TIE * trace, 0.0, 0.0
        for j in range(f.shape[0]):
            if replicates or used[j] == 0:
                bound = np.sqrt(max(0.0, vi * v[j] * ci * c[j]))
                if (1.0 - vi) * c[j] + 2.0 * bound > (1.0 + v[j]) * ci:
                    t, s = dot(f[j], g), dot(f[j], gc)
                    ratio = 1.0 + v[j] - vi - (vi * v[j] - t * t)
                    if ratio > TIE:
                        fall = ((1.0 - vi) * c[j] + 2.0 * t * s - (1.0 + v[j]) * ci) / ratio
                        if fall > drop * (1.0 + TIE):
                            best, drop, vij, cij = j, fall, t, s
        idle += 1
        if best >= 0:
            idle = 0
            exchanges += 1
            times(inverse, f[best], h)
            times(middle, f[best], hc)
            vj, cj = dot(h, f[best]), dot(hc, f[best])
            ratio = 1.0 + vj - vi - (vi * vj - vij * vij)
            a, b, e = (1.0 - vi) / ratio, vij / ratio, -(1.0 + vj) / ratio
            # U'BU = [[c_j, c_ij], [c_ij, c_i]] in the basis (h, g); K^-1 = [[a, b], [b, e]]
            k11, k12, k21, k22 = a * cj + b * cij, a * cij + b * ci, b * cj + e * cij, b * cij + e * ci
            s11, s12, s22 = k11 * a + k12 * b, k11 * b + k12 * e, k21 * b + k22 * e
            update_inverse(inverse, g, h, a, b, e)
            update_middle(middle, g, h, gc, hc, a, b, e, s11, s12, s22)
            for j in range(f.shape[0]):
                s, t = dot(f[j], h), dot(f[j], g)
                sc, tc = dot(f[j], hc), dot(f[j], gc)
                v[j] -= a * s * s + 2.0 * b * s * t + e * t * t
                c[j] += (
                    s11 * s * s
                    + 2.0 * s12 * s * t
                    + s22 * t * t
                    - 2.0 * (s * (a * sc + b * tc) + t * (b * sc + e * tc))
                )
            trace -= drop
            used[i] -= 1
            used[best] += 1
            design[k] = best
        k = k + 1 if k + 1 < n else fixed
    return exchanges
