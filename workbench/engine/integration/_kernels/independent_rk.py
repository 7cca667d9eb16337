# mypy: ignore-errors
"""Explicit Runge-Kutta of order 8 in independent coordinates, and its discrete adjoint, compiled.

    q_I' = v_I,  v_I' = w_I(q_I, v_I, t);   every stage and every node is completed by the joints

Sample 13 n + i of the tables is stage i of step n, sample 13 n + 12 the node at its end. The split of a
step is chosen at its start and holds to the node at its end.
"""

from numba import njit

from ...compiler.options import CAREFUL, ENTRY
from .chart import (
    add_design,
    keep_split,
    recall_split,
    settle,
    split,
)
from .pull_back import pull_back, pull_force, pull_joints, pull_multiplier

STAGES = 12
POINTS = STAGES + 1


@njit(**CAREFUL)
def independent_rk8(
    T, W, R, X, a, b, times, q, v, w, lam, sq, sv, slope, last, rows, cols, rank, tight, info, known
):
    """Fill q, v, w, lam (steps + 1, .) from q[0], v[0], and sq, sv (13 steps + 1, n) at all points.

    known: 1 where node 0 (w, lam and its split among it), sq[0], sv[0], last and the arrays of W and X are as
    an earlier run left them, else 0.

    Point 0 of sq, sv is the start, point 1 + 13 n + i belongs to sample 13 n + i. slope (12, n), last (2, n
    + m): work. info: status, step, -, -, worst redundant row.
    """
    steps, n = q.shape[0] - 1, q.shape[1]
    m = lam.shape[1]
    now, joint = last[0, :n], last[1, :m]
    nearest = 1.0
    for at in range(known, POINTS * steps + 1):
        step, i = (at - 1) // POINTS, (at - 1) % POINTS
        qi, vi = sq[at], sv[at]
        if at == 0:
            for c in range(n):
                qi[c] = q[0, c]
                vi[c] = v[0, c]
        elif i == 0:
            split(W, X)  # W.phi_q is of the node
            keep_split(X, rows, cols, rank, step + 1)
            for r in range(X.rank[0], m):
                joint[X.rows[r]] = 0.0
        if at > 0:
            h = times[step + 1] - times[step]
            for c in range(n):  # the joints correct the dependent ones
                dq, dv = 0.0 * q[step, c], 0.0 * q[step, c]
                for j in range(i):
                    share = a[i, j] if i < STAGES else b[j]
                    dq += share * sv[1 + POINTS * step + j, c]
                    dv += share * slope[j, c]
                qi[c] = q[step, c] + h * dq
                vi[c] = v[step, c] + h * dv
        bad = settle(T, W, R, X, max(at - 1, 0), qi, vi, now, joint, at == 0, False, at < 0)
        nearest = min(nearest, X.tight[0])
        if bad > 0:
            info[0], info[1] = bad, step
            return
        if at == 0:
            keep_split(X, rows, cols, rank, 0)
        elif i < STAGES:
            for c in range(n):
                slope[i, c] = now[c]
        if at == 0 or i == STAGES:
            tight[step + 1] = nearest
            nearest = 1.0
            for c in range(n):
                q[step + 1, c] = qi[c]
                v[step + 1, c] = vi[c]
                w[step + 1, c] = now[c]
            for r in range(m):
                lam[step + 1, r] = joint[r]
            for r in range(X.rank[0], m):
                info[4] = max(info[4], abs(W.phi[X.rows[r]]))
    info[0], info[1] = 0, steps


@njit(**ENTRY)
def independent_rk8_adjoint(
    T, W, R, X, a, b, times, last, sq, sv, rows, cols, rank,
    seed_q, seed_v, seed_w, seed_l, costate, point, sw, sl, yq, yv, mu, nu, gradient,
):  # fmt: skip
    """gradient (N,) += sum over stages and nodes of (dF/dscale)^T mu.

    Filled over the points: sw, mu (points, n), sl (points, m), accelerations, adjoints and multipliers, and,
    unless it is of length 0, nu (points, 3, m), adjoints of Phi, Phi' and Phi''.
    costate (5, n), point (3, n), yq, yv (12, n): work; the first rows of yq, yv are the slopes by q and v at
    the start on return.
    """
    n = sq.shape[1]
    lq, lv, lw, by_q, by_v = costate[0], costate[1], costate[2], costate[3], costate[4]
    for back in range(POINTS * last + 1):
        at = POINTS * last - back
        step, i = (at - 1) // POINTS, (at - 1) % POINTS
        h = times[step + 1] - times[step] if at > 0 else 0.0 * times[0]
        node = at == 0 or i == STAGES
        for c in range(n):
            point[0, c] = sq[at, c]
            point[1, c] = sv[at, c]
        for r in range(sl.shape[1]):
            sl[at, r] = 0.0
        if node:
            recall_split(X, rows, cols, rank, step + 1)
        settle(T, W, R, X, max(at - 1, 0), point[0], point[1], sw[at], sl[at], False, True, at < 0)
        first = X.rank[0]
        f = n - first
        for c in range(n):
            mu[at, c] = 0.0
            point[2, c] = 0.0
        if node:
            for c in range(n):
                lq[c] += seed_q[step + 1, c]
                lv[c] += seed_v[step + 1, c]
                lw[c] = seed_w[step + 1, c]
            if at == 0:
                for c in range(n):
                    yq[0, c] = lq[c]
                    yv[0, c] = lv[c]
            pull_multiplier(W, X, lq, lv, lw, seed_l[step + 1], mu[at])
            pull_back(X, lq, lv, lw, by_q, by_v)
            for c in range(n):
                point[2, c] = mu[at, c]
                point[0, c] = lq[c]
                point[1, c] = lv[c]
                lq[c] = 0.0
                lv[c] = 0.0
            for k in range(f):
                lq[X.cols[first + k]] = by_q[k]
                lv[X.cols[first + k]] = by_v[k]
        else:
            for c in range(n):
                lw[c] = 0.0
                yv[i, c] = 0.0
                yq[i, c] = 0.0
            for k in range(f):
                c = X.cols[first + k]
                kq, kv = b[i] * lq[c], b[i] * lv[c]
                for j in range(i + 1, STAGES):
                    kq += a[j, i] * yq[j, c]
                    kv += a[j, i] * yv[j, c]
                yv[i, c] = h * kq
                lw[c] = h * kv
            for c in range(n):
                point[0, c] = 0.0
                point[1, c] = 0.0
            pull_back(X, point[0], point[1], lw, by_q, by_v)
            for k in range(f):
                c = X.cols[first + k]
                yq[i, c] = by_q[k]
                yv[i, c] += by_v[k]
        pull_force(X, lw, mu[at])
        if nu.shape[0] > 0:
            pull_joints(W, X, point[0], point[1], lw, mu[at], point[2], at < 0, nu[at])
        add_design(T, W, max(at - 1, 0), sq[at], sv[at], mu[at], gradient)
        if i == 0 and at > 0:
            for c in range(n):
                for j in range(STAGES):
                    lq[c] += yq[j, c]
                    lv[c] += yv[j, c]
