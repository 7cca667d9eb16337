# mypy: ignore-errors
"""Explicit Runge-Kutta steps in a chart about each node, and their discrete adjoint, compiled (Munthe-Kaas
1999).

    q_i = q exp(x_i),  x_i = h sum A_ij y_j,  v_i = v + h sum A_ij w_j
    y_i = T^-1(x_i) v_i,  M(q_i) w_i = -h(q_i, v_i)
    q1 = q exp(x),     x = h sum B_j y_j,     v1 = v + h sum B_j w_j

Points stand in one row: node s at (stages + 1) s, its stages behind it. `move` holds x_i, and at a node the x
that led there. Backwards, with alpha the slopes by y_i and beta those by w_i: M mu = -beta,

    lv_i = C^T mu + T^-T alpha,   lx_i = T^T K^T mu + (d(T^-1 v)/dx)^T alpha,   lq += E_i^T K^T mu
"""

from numba import njit

from ...compiler.options import CAREFUL, INNER
from .alpha_adjoint import by_move, carried_back
from .elimination import factor, solve, solve_transposed
from .forces import evaluate
from .motion import moved
from .rotations import inverse_coefficient, inverse_tangent
from .tangents import motion_mass

SPHERICAL = 3
FAR = 1e50  # m/s, rad/s or m, rad: no motion, and powers of it would overflow


@njit(**INNER)
def chart_rates(T, W, x, v, out):
    """out = T^-1(x) v; entries of states become 0."""
    t = W.small[0]
    joints = T.column.shape[0]
    for i in range(v.shape[0]):
        out[i] = v[i] if i < joints else 0.0
    for l in range(T.link.shape[0]):
        if T.link[l, 0] == SPHERICAL:
            j = T.link[l, 2]
            inverse_tangent(x, j, t)
            for e in range(3):
                out[j + e] = t[e, 0] * v[j] + t[e, 1] * v[j + 1] + t[e, 2] * v[j + 2]


@njit(**INNER)
def rates_at(T, W, P, R, point):
    """R.rate of a point from M w = -h; False without a pivot."""
    n = W.m.shape[0]
    q, v, w = R.position[point], R.velocity[point], R.rate[point]
    for i in range(n):
        w[i] = 0.0
    evaluate(T, W, point, q, v, w, point < 0)
    motion_mass(T, W)
    for i in range(n):
        for j in range(n):
            R.lu[i, j] = W.m[i, j]
        w[i] = -W.force[i]
    if factor(P, R.lu, R.diagonal) != 0:
        return False
    solve(P, R.lu, w)
    return True


@njit(**CAREFUL)
def march_rk8(T, W, P, R, A, B, lengths, steps, y):
    """All points from the first, over steps of `lengths` (steps + 1,); y (stages, n) scratch.

    Returns 0, or the step that failed.
    """
    n, stages = W.m.shape[0], B.shape[0]
    first = n - n  # a value, no literal: see `evaluate`
    evaluate(T, W, first, R.position[0], R.velocity[0], R.rate[0], first == 0)  # W.m of the states
    for step in range(steps):
        node, h = (stages + 1) * step, lengths[step + 1]
        q, v = R.position[node], R.velocity[node]
        for i in range(stages):
            at = node + 1 + i
            x, u = R.move[at], R.velocity[at]
            for a in range(n):
                x[a] = 0.0
                u[a] = v[a]
            for j in range(i):
                if A[i, j] != 0.0:
                    w = R.rate[node + 1 + j]
                    for a in range(n):
                        x[a] += h * A[i, j] * y[j, a]
                        u[a] += h * A[i, j] * w[a]
            for a in range(n):
                if not (abs(u[a]) < FAR and abs(x[a]) < FAR):
                    return step + 1
            moved(T, q, x, R.position[at])
            chart_rates(T, W, x, u, y[i])
            if not rates_at(T, W, P, R, at):
                return -step - 1
        new = node + stages + 1
        x, u = R.move[new], R.velocity[new]
        for a in range(n):
            x[a] = 0.0
            u[a] = v[a]
            R.rate[node, a] = R.rate[node + 1, a]
            for j in range(stages):
                x[a] += h * B[j] * y[j, a]
                u[a] += h * B[j] * R.rate[node + 1 + j, a]
            if not (abs(u[a]) < FAR and abs(x[a]) < FAR):
                return step + 1
        moved(T, q, x, R.position[new])
    if not rates_at(T, W, P, R, (stages + 1) * steps):
        return -steps
    return 0


@njit(**INNER)
def pull_back_point(T, W, P, R, point, beta, mu, by_q, by_v):
    """mu = -M^-T beta at a point; by_q = K^T mu, by_v = C^T mu."""
    n = W.m.shape[0]
    evaluate(T, W, point, R.position[point], R.velocity[point], R.rate[point], point >= 0)
    for i in range(n):
        for j in range(n):
            R.lu[i, j] = W.m[i, j]
        mu[i] = -beta[i]
        by_q[i] = 0.0
        by_v[i] = 0.0
    factor(P, R.lu, R.diagonal)
    solve_transposed(P, R.lu, mu)
    for i in range(n):
        value = mu[i]
        if value != 0.0:
            for j in range(n):
                by_q[j] += W.k[i, j] * value
                by_v[j] += W.c[i, j] * value


@njit(**INNER)
def back_through_chart(T, W, x, v, alpha, by_v, by_x):
    """by_v += T^-T alpha and by_x += (d(T^-1 v)/dx)^T alpha, joints alone."""
    t = W.small[0]
    for l in range(T.link.shape[0]):
        kind, j, count = T.link[l, 0], T.link[l, 2], T.link[l, 3]
        if kind != SPHERICAL:
            for e in range(j, j + count):
                by_v[e] += alpha[e]
            continue
        inverse_tangent(x, j, t)
        for e in range(3):
            by_v[j + e] += t[0, e] * alpha[j] + t[1, e] * alpha[j + 1] + t[2, e] * alpha[j + 2]
        p, q, r = x[j], x[j + 1], x[j + 2]
        a, b, c = v[j], v[j + 1], v[j + 2]
        f, g, h = alpha[j], alpha[j + 1], alpha[j + 2]
        by, slope = inverse_coefficient(p * p + q * q + r * r)
        u0, u1, u2 = q * c - r * b, r * a - p * c, p * b - q * a  # x x v
        s0, s1, s2 = g * r - h * q, h * p - f * r, f * q - g * p  # alpha x x
        w0, w1, w2 = q * u2 - r * u1, r * u0 - p * u2, p * u1 - q * u0
        twice = 2.0 * slope * (f * w0 + g * w1 + h * w2)
        by_x[j] += 0.5 * (b * h - c * g) + by * (u1 * h - u2 * g + b * s2 - c * s1) + twice * p
        by_x[j + 1] += 0.5 * (c * f - a * h) + by * (u2 * f - u0 * h + c * s0 - a * s2) + twice * q
        by_x[j + 2] += 0.5 * (a * g - b * f) + by * (u0 * g - u1 * f + a * s1 - b * s0) + twice * r


@njit(**CAREFUL)
def sweep_rk8(T, W, P, R, A, B, lengths, start, seeds, lq, lv, lx, some, mu):
    """One row, from node `start` back: mu (points, n); seeds (nodes, 3, n) by places, velocities and rates.

    lq, lv (n,): zero on entry, the gradients by the initial places and velocities on return.
    lx (stages, 2, n) and some (7, n): scratch.
    """
    n, stages = W.m.shape[0], B.shape[0]
    alpha, beta, by_q, by_v, top, carried = some[0], some[1], some[2], some[3], some[4], some[5]
    for step in range(start, -1, -1):
        node = (stages + 1) * step
        if step < start:
            h = lengths[step + 1]
            by_move(T, W, R.move[node + stages + 1], lq, top)
            for a in range(n):
                carried[a] = lq[a]
            carried_back(T, W, R.move[node + stages + 1], carried)
            for a in range(n):
                lq[a] = carried[a]
                by_v[a] = lv[a]
            for a in range(n):
                some[6, a] = lv[a]
            for i in range(stages - 1, -1, -1):
                at = node + 1 + i
                for a in range(n):
                    alpha[a] = h * B[i] * top[a]
                    beta[a] = h * B[i] * some[6, a]
                    for j in range(i + 1, stages):
                        alpha[a] += h * A[j, i] * lx[j, 0, a]
                        beta[a] += h * A[j, i] * lx[j, 1, a]
                pull_back_point(T, W, P, R, at, beta, mu[at], by_q, by_v)
                x = R.move[at]
                by_move(T, W, x, by_q, lx[i, 0])
                back_through_chart(T, W, x, R.velocity[at], alpha, by_v, lx[i, 0])
                carried_back(T, W, x, by_q)
                for a in range(n):
                    lx[i, 1, a] = by_v[a]
                    lq[a] += by_q[a]
                    lv[a] += by_v[a]
        loaded = False
        for a in range(n):
            lq[a] += seeds[step, 0, a]
            lv[a] += seeds[step, 1, a]
            beta[a] = seeds[step, 2, a]
            loaded = loaded or beta[a] != 0.0
        if loaded:  # rates at a node are functions of its state
            pull_back_point(T, W, P, R, node, beta, mu[node], by_q, by_v)
            for a in range(n):
                lq[a] += by_q[a]
                lv[a] += by_v[a]
