# mypy: ignore-errors
"""Explicit Runge-Kutta of order 8 and its discrete adjoint, compiled, for systems without joints and states.

    k_i = (v_i, -M^-1 F(q_i, v_i, t_i)),  y_i = y + h sum_j a_ij k_j,  y' = y + h sum_i b_i k_i

Sample 12 n + i of the tables is stage i of step n; the steps may differ in length. The adjoint walks
the stages backwards with the transposed tangents at the stored stage states.
"""

from numba import njit

from ...compiler.options import CAREFUL
from .equations import contract, evaluate

STAGES = 12


@njit(**CAREFUL)
def rk8_forward(T, W, a, b, times, q, v, w, stage_q, stage_v, slope):
    """Fill q, v (steps + 1, n) from node 0, w but for the last node, and stage states (12 steps, n).

    slope (12, n) is work space.
    """
    n = q.shape[1]
    none = W.phi
    for step in range(q.shape[0] - 1):
        h = times[step + 1] - times[step]
        for i in range(STAGES):
            at = STAGES * step + i
            qi, vi = stage_q[at], stage_v[at]
            for c in range(n):
                dq, dv = 0.0 * q[step, c], 0.0 * q[step, c]
                for j in range(i):
                    dq += a[i, j] * stage_v[STAGES * step + j, c]
                    dv += a[i, j] * slope[j, c]
                qi[c] = q[step, c] + h * dq
                vi[c] = v[step, c] + h * dv
            evaluate(T, W, at, qi, vi, none, W.z, W.zdot, 0.0, step < 0)
            for c in range(n):
                slope[i, c] = -W.force[c] / T.mass[c]
                if i == 0:
                    w[step, c] = slope[i, c]
        for c in range(n):
            dq, dv = 0.0 * q[step, c], 0.0 * q[step, c]
            for i in range(STAGES):
                dq += b[i] * stage_v[STAGES * step + i, c]
                dv += b[i] * slope[i, c]
            q[step + 1, c] = q[step, c] + h * dq
            v[step + 1, c] = v[step, c] + h * dv


@njit(**CAREFUL)
def rk8_adjoint(T, W, a, b, times, last, stage_q, stage_v, seed_q, seed_v, costate, yq, yv, mu, gradient):
    """gradient (N,) += sum over stages of (dF/dscale)^T mu; mu (12 steps, n) is filled.

    costate (2, n): the slopes by the start on return.  yq, yv (12, n): work space.
    """
    n = stage_q.shape[1]
    none = W.phi
    lq, lv = costate[0], costate[1]
    for c in range(n):
        lq[c] = seed_q[last, c]
        lv[c] = seed_v[last, c]
    for step in range(last - 1, -1, -1):
        h = times[step + 1] - times[step]
        for back in range(STAGES):
            i = STAGES - 1 - back
            at = STAGES * step + i
            evaluate(T, W, at, stage_q[at], stage_v[at], none, W.z, W.zdot, 0.0, step >= 0)
            for c in range(n):
                kq, kv = b[i] * lq[c], b[i] * lv[c]
                for j in range(i + 1, STAGES):
                    kq += a[j, i] * yq[j, c]
                    kv += a[j, i] * yv[j, c]
                yv[i, c] = h * kq
                mu[at, c] = -h * kv / T.mass[c]
            for c in range(n):
                fq, fv = 0.0 * lq[c], 0.0 * lq[c]
                for d in range(n):
                    fq += W.k[d, c] * mu[at, d]
                    fv += W.c[d, c] * mu[at, d]
                yq[i, c] = fq
                yv[i, c] += fv
            contract(T, W, at, mu[at], gradient)
        for c in range(n):
            lq[c] += seed_q[step, c]
            lv[c] += seed_v[step, c]
            for i in range(STAGES):
                lq[c] += yq[i, c]
                lv[c] += yv[i, c]
