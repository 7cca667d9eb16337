# mypy: ignore-errors
"""Transposes of a state in independent coordinates: from seeds of q, v, w and lambda to seeds of q_I and v_I.

`settle` must have run with tangents at the state. mu is the adjoint of the equations of motion:
dG/dparameter = (dF/dparameter)^T mu.
"""

from numba import njit

from ...compiler._kernels_dense import lu_solve, lu_solve_transposed
from ...compiler.options import INNER
from .chart import lift, times_mass

__all__ = ["pull_back", "pull_force", "pull_joints", "pull_multiplier"]


@njit(**INNER)
def pull_multiplier(W, X, sq, sv, sw, sl, mu):
    """Turn seeds of lambda into seeds of q, v, w and the part of mu they need; mu is overwritten."""
    rank, n = X.rank[0], mu.shape[0]
    some = False
    for a in range(n):
        mu[a] = 0.0
    for a in range(rank):
        X.side[a] = sl[X.rows[a]]
        some = some or sl[X.rows[a]] != 0.0
    if not some:
        return
    lu_solve(X.lu[:rank, :rank], X.pivot, X.side[:rank])
    for a in range(rank):
        mu[X.cols[a]] = -X.side[a]
    times_mass(X, mu, X.part[0])
    for a in range(n):
        sw[a] += X.part[0, a]
        for b in range(n):
            sq[a] += W.k[b, a] * mu[b]
            sv[a] += W.c[b, a] * mu[b]


@njit(**INNER)
def pull_back(X, sq, sv, sw, by_position, by_velocity):
    """Seeds of q, v, w as seeds of q_I (f,) and v_I (f,); `tangents` must have run."""
    n = sq.shape[0]
    f = n - X.rank[0]
    for b in range(f):
        first, second = 0.0 * sq[0], 0.0 * sq[0]
        for a in range(n):
            first += X.basis[a, b] * sq[a] + X.by_q[a, b] * sv[a] + X.w_by_q[a, b] * sw[a]
            second += X.basis[a, b] * sv[a] + X.w_by_v[a, b] * sw[a]
        by_position[b] = first
        by_velocity[b] = second


@njit(**INNER)
def pull_force(X, sw, mu):
    """mu -= N (N^T M N)^-1 N^T sw: the adjoint of a force in w."""
    n = sw.shape[0]
    f = n - X.rank[0]
    for b in range(f):
        total = 0.0 * sw[0]
        for a in range(n):
            total -= X.basis[a, b] * sw[a]
        X.side[b] = total
    lu_solve_transposed(X.reduced[:f, :f], X.reduced_pivot, X.side[:f])
    lift(X, f, X.side, mu)


@njit(**INNER)
def pull_joints(W, X, sq, sv, sw, mu, known, bridged, nu):
    """nu (3, m): adjoints of Phi, Phi' and Phi'' at a point, 0 for rows set aside.

    sq, sv, sw, known: the seeds and the part of mu that `pull_multiplier` left.  bridged: v and w were given.
    """
    rank, n = X.rank[0], sq.shape[0]
    lu, side, y, rest = X.lu[:rank, :rank], X.side, X.part[1], X.part[2]
    for level in range(3):
        for r in range(nu.shape[1]):
            nu[level, r] = 0.0
    for a in range(n):
        y[a] = mu[a] - known[a]
    for back in range(3):
        level = 2 - back
        if bridged and level > 0:
            continue
        if level == 2:
            times_mass(X, y, rest)
        for a in range(rank):
            c = X.cols[a]
            if level == 2:
                total = sw[c] + rest[c]
            else:
                total = sv[c] if level == 1 else sq[c]
                for b in range(n):
                    total += (W.c[b, c] if level == 1 else W.k[b, c]) * y[b]
                for r in range(nu.shape[1]):
                    if level == 1:
                        total += 2.0 * X.rate[r, c] * nu[2, r]
                    else:
                        total += X.rate[r, c] * nu[1, r] + X.bend[r, c] * nu[2, r]
            side[a] = -total
        lu_solve_transposed(lu, X.pivot, side[:rank])
        for a in range(rank):
            nu[level, X.rows[a]] = side[a]
