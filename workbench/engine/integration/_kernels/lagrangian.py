# mypy: ignore-errors
"""What the multipliers of a run see of its equations, compiled: their sum over the points that were solved.

    L = sum over the points of  mu . (M w + F + Phi_q^T lambda) + nu_0 . Phi + nu_1 . Phi' + nu_2 . Phi''

All terms are 0 at the numbers that ran, so dL/dp at held states is the slope of an objective by a number p.
"""

from numba import njit

from ...compiler.options import ENTRY
from .chart import applied_forces, constraint_rates, times_mass

__all__ = ["lagrangian"]


@njit(**ENTRY)
def lagrangian(T, W, R, X, q, v, w, lam, mu, nu, out):
    """out[0] += L; q, v, w, mu (points, n), lam (points, m), nu (points, 3, m), one sample of T a point."""
    n, m = q.shape[1], lam.shape[1]
    total = 0.0 * out[0]
    for at in range(q.shape[0]):
        constraint_rates(T, W, R, X, at, q[at], v[at], w[at])
        for r in range(m):
            rate, bend = X.t1[r], X.t2[r]
            for a in range(n):
                rate += W.phi_q[r, a] * v[at, a]
                bend += W.phi_q[r, a] * w[at, a] + X.rate[r, a] * v[at, a]
            total += nu[at, 0, r] * W.phi[r] + nu[at, 1, r] * rate + nu[at, 2, r] * bend
        applied_forces(T, W, X, at, q[at], v[at], lam[at], at < 0)
        times_mass(X, w[at], X.part[0])
        for a in range(n):
            total += mu[at, a] * (X.part[0, a] + W.force[a])
    out[0] += total
