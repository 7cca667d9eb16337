# mypy: ignore-errors
"""Joint rows along a motion: Phi, Phi_q and the first and second time derivatives of Phi_q, compiled.

With q' = v and q'' = w the derivatives that a scheme on the level of accelerations needs are time
derivatives:

    Phi' = Phi_q v + t1,   Phi'' = Phi_q w + (Phi_q)' v + t2
    dPhi'/dq = (Phi_q)',   dPhi''/dv = 2 (Phi_q)',   dPhi''/dq = (Phi_q)''

t1 and t2 hold what prescribed bodies and drives add. A body-fixed arm a = A(theta) s turns as a' = omega a~,
a'' = alpha a~ - omega^2 a with a~ = (-a_y, a_x).
"""

from numba import njit
from numpy import cos, sin

from ...compiler.options import INNER
from .row_kinds import ANGLE, COINCIDENT_Y, LINE


@njit(**INNER)
def turned(theta, omega, alpha, x, y, out):
    """out (3, 4): arm (2) and the arm turned by a right angle (2), with two time derivatives."""
    c, s = cos(theta), sin(theta)
    ax, ay = c * x - s * y, s * x + c * y
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = ax, ay, -ay, ax
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = -omega * ay, omega * ax, -omega * ax, -omega * ay
    out[2, 0] = -alpha * ay - omega * omega * ax
    out[2, 1] = alpha * ax - omega * omega * ay
    out[2, 2] = -out[2, 1]
    out[2, 3] = out[2, 0]


@njit(**INNER)
def dotted(a, p, b, q, scale, out, k):
    """out (3, 6), column k = scale a . b and its two time derivatives; a from column p, b from column q."""
    out[0, k] = scale * (a[0, p] * b[0, q] + a[0, p + 1] * b[0, q + 1])
    first, second = 0.0 * out[0, k], 0.0 * out[0, k]
    for i in range(2):
        first += a[1, p + i] * b[0, q + i] + a[0, p + i] * b[1, q + i]
        second += a[2, p + i] * b[0, q + i] + 2.0 * a[1, p + i] * b[1, q + i] + a[0, p + i] * b[2, q + i]
    out[1, k] = scale * first
    out[2, k] = scale * second


@njit(**INNER)
def one_row(kind, p, r, Q, V, A, i, j, X):
    """Fill X.row (3, 6) with the row's slopes on (q_i, q_j) and two time derivatives; returns Phi."""
    row, arm, other, gap = X.row, X.arm, X.other, X.gap
    for k in range(3):
        for a in range(6):
            row[k, a] = 0.0
    a, b = 3 * i, 3 * j
    if kind == ANGLE:
        row[0, 2] = 1.0
        row[0, 5] = -1.0
        return Q[a + 2] - Q[b + 2] - p[r, 6]
    turned(Q[a + 2], V[a + 2], A[a + 2], p[r, 0], p[r, 1], arm)
    turned(Q[b + 2], V[b + 2], A[b + 2], p[r, 2], p[r, 3], other)
    if kind <= COINCIDENT_Y:
        row[0, kind] = 1.0
        row[0, 3 + kind] = -1.0
        for k in range(3):
            row[k, 2] = arm[k, 2 + kind]
            row[k, 5] = -other[k, 2 + kind]
        return Q[a + kind] + arm[0, kind] - Q[b + kind] - other[0, kind]
    for e in range(2):
        gap[0, e] = Q[a + e] - Q[b + e] + arm[0, e]
        gap[1, e] = V[a + e] - V[b + e] + arm[1, e]
        gap[2, e] = A[a + e] - A[b + e] + arm[2, e]
    if kind == LINE:
        turned(Q[b + 2], V[b + 2], A[b + 2], p[r, 4], p[r, 5], other)  # the normal of the line
        for k in range(3):
            for e in range(2):
                row[k, e] = other[k, e]
                row[k, 3 + e] = -other[k, e]
        dotted(other, 0, arm, 2, 1.0, row, 2)
        dotted(other, 2, gap, 0, 1.0, row, 5)
        along = other[0, 0] * gap[0, 0] + other[0, 1] * gap[0, 1]
        return along - p[r, 4] * p[r, 2] - p[r, 5] * p[r, 3] - p[r, 6]
    length = p[r, 6]
    for k in range(3):
        for e in range(2):
            gap[k, e] -= other[k, e]
            row[k, e] = gap[k, e] / length
            row[k, 3 + e] = -gap[k, e] / length
    dotted(gap, 0, arm, 2, 1.0 / length, row, 2)
    dotted(gap, 0, other, 2, -1.0 / length, row, 5)
    return 0.5 * ((gap[0, 0] * gap[0, 0] + gap[0, 1] * gap[0, 1]) / length - length)


@njit(**INNER)
def joint_rates(T, W, R, X, step, q, v, w):
    """Fill W.phi, W.phi_q, X.rate = (Phi_q)', X.bend = (Phi_q)'', X.t1, X.t2 of a planar system."""
    n = q.shape[0]
    free = n // 3
    for a in range(n):
        W.q[a] = q[a]
        W.v[a] = v[a]
        X.full[a] = w[a]
    for a in range(W.q.shape[0] - n):
        W.q[n + a] = T.motion[step, 0, a]
        W.v[n + a] = T.motion[step, 1, a]
        X.full[n + a] = R.motion[step, a]
    for r in range(T.row.shape[0]):
        i, j = T.row[r, 2], T.row[r, 3]
        value = one_row(T.row[r, 0], T.row_data, r, W.q, W.v, X.full, i, j, X)
        W.phi[r] = value - T.drive[step, r]
        X.t1[r] = -R.drive[step, 0, r]
        X.t2[r] = -R.drive[step, 1, r]
        for a in range(n):
            W.phi_q[r, a] = 0.0
            X.rate[r, a] = 0.0
            X.bend[r, a] = 0.0
        for a in range(6):
            at = 3 * i + a if a < 3 else 3 * j + a - 3
            if at < 3 * free:
                W.phi_q[r, at] = X.row[0, a]
                X.rate[r, at] = X.row[1, a]
                X.bend[r, at] = X.row[2, a]
            else:
                X.t1[r] += X.row[0, a] * W.v[at]
                X.t2[r] += X.row[0, a] * X.full[at] + X.row[1, a] * W.v[at]
