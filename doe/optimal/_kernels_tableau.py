# mypy: ignore-errors
"""Exchange kernels that keep the whole tableau of pairs: for designs and candidate lists of moderate size.

w[k, x] = f' M^-1 f for design row k and candidate x; with it the gain of every pair costs three operations,
and an exchange is a rank-two update of w (see `_kernels_exchange` for the notation). The tableau is
float32, eight or sixteen numbers per instruction; it only proposes. The gain of a proposed exchange is
computed from the float64 inverse before it is accepted.

`blocked` adds -1e30 to the gain of candidates already in the design. The largest gain of a row is taken over
the bit patterns as integers, which order positive floats correctly and compile to vector instructions,
where a float maximum does not.
"""

from typing import NamedTuple

import numpy as np

from doe._kernel_cache import kernel
from doe.optimal._kernels_exchange import update_inverse
from doe.portable._kernels_draws import below
from doe.portable._kernels_linear import dot, times

BLOCK = np.float32(-1e30)
SMALLEST = 1e-6  # of a proposal: the resolution of the float32 tableau
PLAUSIBLE = np.float32(0.7)  # a shake takes candidates with at least this share of the leaving variance
TRIALS = 50  # candidates drawn before a shake gives up on a row


class Tableau(NamedTuple):
    """A design among its candidates.

    f: (N, P) model rows of the candidates    ft: (P, N) the same in float32
    design: (n,) candidates in the design, the first `fixed` of them to stay
    blocked: (N,) what is added to a candidate's gain
    w: (n, N) f' M^-1 f    v: (N,) the same of each candidate alone
    inverse: (P, P) M^-1    replicates: whether a candidate may stand in the design several times
    """

    f: np.ndarray
    ft: np.ndarray
    design: np.ndarray
    fixed: int
    blocked: np.ndarray
    w: np.ndarray
    v: np.ndarray
    inverse: np.ndarray
    replicates: bool


class Scratch(NamedTuple):
    """Room for an exchange: wj, wi, gains (N,) float32, gains as bits, and g, h (P,)."""

    wj: np.ndarray
    wi: np.ndarray
    gains: np.ndarray
    bits: np.ndarray
    g: np.ndarray
    h: np.ndarray


@kernel(allocates=False)
def copy(source, target):
    """Target = source; a loop compiles in a tenth of the time of a slice assignment."""
    for k in range(source.size):
        target[k] = source[k]


@kernel(allocates=False, inner=True)
def copy_table(source, target):
    for r in range(source.shape[0]):
        for k in range(source.shape[1]):
            target[r, k] = source[r, k]


@kernel(allocates=False)
def lift(ft, h, out):
    """out = ft' h for ft of shape (terms, candidates), four terms at a time."""
    for x in range(out.size):
        out[x] = np.float32(0.0)
    for q in range(0, h.size, 4):
        a, b = np.float32(h[q]), np.float32(h[q + 1])
        c, d = np.float32(h[q + 2]), np.float32(h[q + 3])
        f0, f1, f2, f3 = ft[q], ft[q + 1], ft[q + 2], ft[q + 3]
        for x in range(out.size):
            out[x] += a * f0[x] + b * f1[x] + c * f2[x] + d * f3[x]


@kernel()
def fill(f, ft, design, inverse, w):
    """w[k, x] = f_k' M^-1 f_x for the design rows k and all candidates x."""
    h = np.empty(f.shape[1])
    for k in range(design.size):
        times(inverse, f[design[k]], h)
        lift(ft, h, w[k])


@kernel()
def add_greedily(f, ft, design, blocked, kept, inverse, v, replicates):
    """Fill design[kept:], each time with the candidate of largest variance (Dykstra 1971)."""
    g = np.empty(f.shape[1])
    wj = np.empty_like(v)
    for k in range(kept, design.size):
        best, top = -1, np.float32(-1.0)
        for j in range(v.size):
            if v[j] + blocked[j] > top:
                best, top = j, v[j]
        design[k] = best
        if not replicates:
            blocked[best] = BLOCK
        times(inverse, f[best], g)
        scale = -1.0 / (1.0 + dot(g, f[best]))
        update_inverse(inverse, g, g, 0.0, 0.0, -scale)
        lift(ft, g, wj)
        factor = np.float32(scale)
        for x in range(v.size):
            v[x] += factor * wj[x] * wj[x]


@kernel(allocates=False, inner=True)
def best_pair(tableau, scratch):
    """Design row and candidate with the largest gain; (-1, -1) when none is positive."""
    gains, bits = scratch.gains, scratch.bits
    design, blocked, w, v = tableau.design, tableau.blocked, tableau.w, tableau.v
    top, row = np.int32(0), -1
    for r in range(tableau.fixed, design.size):
        wr = w[r]
        vi = v[design[r]]
        keep = np.float32(1.0) - vi
        for x in range(wr.size):
            gains[x] = blocked[x] + v[x] * keep + wr[x] * wr[x] - vi
        largest = np.int32(0)
        for x in range(wr.size):
            largest = max(largest, bits[x])
        if largest > top:
            top, row = largest, r
    if row < 0:
        return -1, -1
    wr = w[row]
    vi = v[design[row]]
    keep = np.float32(1.0) - vi
    column, largest_gain = -1, np.float32(SMALLEST)
    for x in range(wr.size):
        gain = blocked[x] + v[x] * keep + wr[x] * wr[x] - vi
        if gain > largest_gain:
            column, largest_gain = x, gain
    return row, column


@kernel(allocates=False, inner=True)
def put(tableau, scratch, k, j, least):
    """Exchange design row k for candidate j if that gains more than `least`: the gain, or -1 if refused."""
    wj, wi, g, h = scratch.wj, scratch.wi, scratch.g, scratch.h
    f, design, w, v, inverse = tableau.f, tableau.design, tableau.w, tableau.v, tableau.inverse
    i = design[k]
    times(inverse, f[j], h)
    times(inverse, f[i], g)
    vj, vi, t = dot(h, f[j]), dot(g, f[i]), dot(h, f[i])
    gain = vj - vi - (vi * vj - t * t)
    if gain <= least:
        return -1.0
    a, b, c = (1.0 - vi) / (1.0 + gain), t / (1.0 + gain), -(1.0 + vj) / (1.0 + gain)
    update_inverse(inverse, g, h, a, b, c)
    lift(tableau.ft, h, wj)
    copy(w[k], wi)
    a32, b32, c32 = np.float32(a), np.float32(b), np.float32(c)
    twice = np.float32(2.0) * b32
    for x in range(v.size):
        v[x] -= a32 * wj[x] * wj[x] + twice * wj[x] * wi[x] + c32 * wi[x] * wi[x]
    for r in range(design.size):
        wr = w[r]
        s = a32 * wj[design[r]] + b32 * wi[design[r]]
        u = b32 * wj[design[r]] + c32 * wi[design[r]]
        for x in range(wr.size):
            wr[x] -= s * wj[x] + u * wi[x]
    wr = w[k]
    s, u = np.float32(1.0 - a * vj - b * t), np.float32(b * vj + c * t)
    for x in range(wr.size):
        wr[x] = s * wj[x] - u * wi[x]
    design[k] = j
    if not tableau.replicates:
        tableau.blocked[i], tableau.blocked[j] = np.float32(0.0), BLOCK
    return gain


@kernel(allocates=False)
def climb(tableau, scratch, max_exchanges):
    """Take the best pair until none gains: the gain in log|M|."""
    total = 0.0
    for _ in range(max_exchanges):
        k, j = best_pair(tableau, scratch)
        if j < 0:
            break
        gain = put(tableau, scratch, k, j, SMALLEST)
        if gain < 0.0:
            break
        total += np.log1p(gain)
    return total


@kernel()
def shake(tableau, scratch, state, depth, shakes, floor, max_exchanges):
    """Iterated climbing: exchange `depth` random rows, climb, keep what is better; the gain in log|M|.

    A random exchange may lose at most the share -floor of |M|, so M stays regular (also when n = p).
    """
    design, blocked, w, v, inverse = (
        tableau.design,
        tableau.blocked,
        tableau.w,
        tableau.v,
        tableau.inverse,
    )
    n, m = w.shape
    p = inverse.shape[0]
    old_design, old_blocked, old_v = np.empty_like(design), np.empty_like(v), np.empty_like(v)
    old_w, old_inverse = np.empty((n, m), np.float32), np.empty((p, p))
    copy(design, old_design)
    copy(blocked, old_blocked)
    copy(v, old_v)
    copy_table(w, old_w)
    copy_table(inverse, old_inverse)
    total = 0.0
    for _ in range(shakes):
        change = 0.0
        for _ in range(depth):
            k = tableau.fixed + below(state, design.size - tableau.fixed)
            for _ in range(TRIALS):
                j = below(state, v.size)
                vi = v[design[k]]
                if j == design[k] or blocked[j] < 0.0 or v[j] < PLAUSIBLE * vi:
                    continue
                if v[j] - vi - vi * v[j] + w[k, j] * w[k, j] < floor:
                    continue
                gain = put(tableau, scratch, k, j, floor)
                if gain > -1.0:
                    change += np.log1p(gain)
                    break
        change += climb(tableau, scratch, max_exchanges)
        if change > SMALLEST:
            total += change
            copy(design, old_design)
            copy(blocked, old_blocked)
            copy(v, old_v)
            copy_table(w, old_w)
            copy_table(inverse, old_inverse)
        else:
            copy(old_design, design)
            copy(old_blocked, blocked)
            copy(old_v, v)
            copy_table(old_w, w)
            copy_table(old_inverse, inverse)
    return total
