# mypy: ignore-errors
"""The motion of a constrained system in independent coordinates, at one state, compiled.

    q_I, v_I given;  Phi(q) = 0,  Phi' = 0  give q_D, v_D;  N = dq/dq_I
    N^T (M w + F) = 0,  Phi'' = 0  give w;  lambda = -Phi_D^-T (M w + F)_D, 0 for redundant rows

`Chart` holds the arrays. `tangents` differentiates w by q_I and v_I, `pull_back` transposes it. The
three questions to a system (`constraint_rates`, `applied_forces`, `add_design`) are answered by every kind
with a `numba.extending.overload` for its own type of tables, which gives None for those of others.
"""

from numba import njit

from ...compiler._kernels_dense import lu_factor, lu_solve, lu_solve_transposed
from ...compiler.options import INNER

CLOSING, MOVING, BENDING, BRIDGED = 0, 1, 2, -1
SINGULAR, OPEN = 2, 3
NARROW = 1e-3  # of the largest pivot: nearer to a dead point rounding spoils what differentiated joints say
TIE = 1.000001  # of equal pivots the first is taken, whatever rounding says
CLOSED = 3e-15  # of the coordinates: a correction this small ends the closing of the joints


def constraint_rates(T, W, R, X, step, q, v, w):
    """Fill W.phi, W.phi_q, X.rate, X.bend, X.t1, X.t2."""


def applied_forces(T, W, X, step, q, v, lam, tangent):
    """Fill W.force (with Phi_q^T lambda) and, if tangent, W.k and W.c."""


def add_design(T, W, step, q, v, mu, gradient):
    """gradient (N,) += (dF/dscale)^T mu."""


@njit(**INNER)
def split(W, X):
    """Choose independent rows and columns of W.phi_q by complete pivoting; X.rows, X.cols, X.rank."""
    m, n = X.work.shape
    for r in range(m):
        X.rows[r] = r
        for a in range(n):
            X.work[r, a] = W.phi_q[r, a]
    for a in range(n):
        X.cols[a] = a
    first = 0.0
    X.rank[0] = 0
    for k in range(min(m, n)):
        best, at, on = 0.0, k, k
        for r in range(k, m):
            for a in range(k, n):
                size = abs(X.work[X.rows[r], X.cols[a]]) * X.weight[X.cols[a]]
                if size > TIE * best:
                    best, at, on = size, r, a
        if k == 0:
            first = best
        if best <= X.threshold[0] * first:
            return
        row, col = X.rows[at], X.cols[on]
        X.rows[at] = X.rows[k]
        X.rows[k] = row
        X.cols[on] = X.cols[k]
        X.cols[k] = col
        inverse = 1.0 / X.work[row, col]
        for r in range(k + 1, m):
            low = X.rows[r]
            if X.work[low, col] != 0.0:
                factor = X.work[low, col] * inverse
                for a in range(k, n):
                    X.work[low, X.cols[a]] -= factor * X.work[row, X.cols[a]]
        X.rank[0] = k + 1


@njit(**INNER)
def keep_split(X, rows, cols, rank, step):
    """Write the split down for the adjoint."""
    rank[step] = X.rank[0]
    for r in range(rows.shape[1]):
        rows[step, r] = X.rows[r]
    for a in range(cols.shape[1]):
        cols[step, a] = X.cols[a]


@njit(**INNER)
def recall_split(X, rows, cols, rank, step):
    """Take the split of a step back."""
    X.rank[0] = rank[step]
    for r in range(rows.shape[1]):
        X.rows[r] = rows[step, r]
    for a in range(cols.shape[1]):
        X.cols[a] = cols[step, a]


@njit(**INNER)
def factor_dependent(W, X):
    """Factor Phi_D of the independent rows; above 0 when it is singular."""
    rank = X.rank[0]
    lu = X.lu[:rank, :rank]
    for a in range(rank):
        for b in range(rank):
            lu[a, b] = W.phi_q[X.rows[a], X.cols[b]]
    return lu_factor(lu, X.pivot)


@njit(**INNER)
def correct(W, X, q):
    """One Newton step of q_D onto Phi = 0; its size, or -1 when Phi_D is singular."""
    rank = X.rank[0]
    side = X.side
    if factor_dependent(W, X) > 0:
        return -1.0
    for a in range(rank):
        side[a] = -W.phi[X.rows[a]]
    least, most = 1e300, 1e-300
    for a in range(rank):
        least = min(least, abs(X.lu[a, a]))
        most = max(most, abs(X.lu[a, a]))
    X.tight[0] = least / most
    lu_solve(X.lu[:rank, :rank], X.pivot, side[:rank])
    size = 0.0
    for a in range(rank):
        q[X.cols[a]] += side[a]
        size = max(size, abs(side[a]))
    return size


@njit(**INNER)
def complete(W, X, v):
    """v_D, with the factors of `correct`."""
    rank, n = X.rank[0], v.shape[0]
    lu, side = X.lu[:rank, :rank], X.side
    for a in range(rank):
        r = X.rows[a]
        total = -X.t1[r]
        for b in range(rank, n):
            total -= W.phi_q[r, X.cols[b]] * v[X.cols[b]]
        side[a] = total
    lu_solve(lu, X.pivot, side[:rank])
    for a in range(rank):
        v[X.cols[a]] = side[a]


@njit(**INNER)
def span(W, X):
    """The basis, with the factors of `correct`."""
    rank, n = X.rank[0], X.zero.shape[0]
    lu, side = X.lu[:rank, :rank], X.side
    for b in range(n - rank):
        col = X.cols[rank + b]
        for a in range(rank):
            side[a] = -W.phi_q[X.rows[a], col]
        lu_solve(lu, X.pivot, side[:rank])
        for a in range(n):
            X.basis[a, b] = 0.0
        for a in range(rank):
            X.basis[X.cols[a], b] = side[a]
        X.basis[col, b] = 1.0


@njit(**INNER)
def times_mass(X, x, out):
    """out = M x."""
    n = x.shape[0]
    for a in range(n):
        total = 0.0 * x[0]
        for b in range(n):
            total += X.mass[a, b] * x[b]
        out[a] = total


@njit(**INNER)
def lift(X, f, x, out):
    """out = N x_f, added."""
    for a in range(out.shape[0]):
        for b in range(f):
            out[a] += X.basis[a, b] * x[b]


@njit(**INNER)
def reduce_mass(X, f):
    """Factor N^T M N; above 0 when it is singular."""
    n = X.mass.shape[0]
    for b in range(f):
        times_mass(X, X.basis[:, b], X.part[0])
        for a in range(f):
            total = 0.0 * X.part[0, 0]
            for i in range(n):
                total += X.basis[i, a] * X.part[0, i]
            X.inertia[a, b] = total
            X.reduced[a, b] = total
    return lu_factor(X.reduced[:f, :f], X.reduced_pivot)


@njit(**INNER)
def accelerate(W, X, v, w, lam):
    """w and lambda at a closed state; above 0 when the reduced mass is singular.

    W.force holds Phi_q^T of the lambda given, which N^T removes, so any guess will do.
    """
    rank, n = X.rank[0], v.shape[0]
    f = n - rank
    lu, side, part, known = X.lu[:rank, :rank], X.side, X.part, X.known
    for a in range(rank):
        r = X.rows[a]
        total = -X.t2[r]
        for b in range(n):
            total -= X.rate[r, b] * v[b]
        side[a] = total
    lu_solve(lu, X.pivot, side[:rank])
    for a in range(n):
        known[a] = 0.0
    for a in range(rank):
        known[X.cols[a]] = side[a]
    if reduce_mass(X, f) > 0:
        return SINGULAR
    times_mass(X, known, part[0])
    for b in range(f):
        total = 0.0 * part[0, 0]
        for a in range(n):
            total -= X.basis[a, b] * (W.force[a] + part[0, a])
        side[b] = total
    lu_solve(X.reduced[:f, :f], X.reduced_pivot, side[:f])
    for a in range(n):
        w[a] = known[a]
    lift(X, f, side, w)
    balance(X, W, w, lam)
    return 0


@njit(**INNER)
def dependent(X, by, x, factor, out):
    """out_D += -factor Phi_D^-1 (by x) of the independent rows."""
    rank, n = X.rank[0], x.shape[0]
    side = X.side
    for a in range(rank):
        total = 0.0 * x[0]
        for b in range(n):
            total -= by[X.rows[a], b] * x[b]
        side[a] = factor * total
    lu_solve(X.lu[:rank, :rank], X.pivot, side[:rank])
    for a in range(rank):
        out[X.cols[a]] += side[a]


@njit(**INNER)
def tangents(W, X):
    """X.by_q = dv/dq_I, X.w_by_q = dw/dq_I, X.w_by_v = dw/dv_I (leading f columns)."""
    rank, n = X.rank[0], X.zero.shape[0]
    f = n - rank
    for b in range(f):
        for kind in range(2):  # 0: q_I moves, 1: v_I moves
            out = X.w_by_q if kind == 0 else X.w_by_v
            for a in range(n):
                X.part[1, a] = X.basis[a, b]
                X.part[2, a] = 0.0  # dw at rest of w_I
                X.part[3, a] = 0.0  # dv
            if kind == 0:
                dependent(X, X.rate, X.part[1], 1.0, X.part[3])
                for a in range(n):
                    X.by_q[a, b] = X.part[3, a]
                dependent(X, X.bend, X.part[1], 1.0, X.part[2])
                dependent(X, X.rate, X.part[3], 2.0, X.part[2])
            else:
                dependent(X, X.rate, X.part[1], 2.0, X.part[2])
            times_mass(X, X.part[2], X.part[0])
            for a in range(n):
                total = X.part[0, a]
                for i in range(n):
                    if kind == 0:
                        total += W.k[a, i] * X.part[1, i] + W.c[a, i] * X.part[3, i]
                    else:
                        total += W.c[a, i] * X.part[1, i]
                X.known[a] = total
            for g in range(f):
                total = 0.0 * X.known[0]
                for a in range(n):
                    total -= X.basis[a, g] * X.known[a]
                X.side[g] = total
            lu_solve(X.reduced[:f, :f], X.reduced_pivot, X.side[:f])
            lift(X, f, X.side, X.part[2])
            for a in range(n):
                out[a, b] = X.part[2, a]


@njit(**INNER)
def balance(X, W, w, lam):
    """lambda of the independent rows that balances the dependent rows of M w + F."""
    rank = X.rank[0]
    times_mass(X, w, X.part[0])
    for a in range(rank):
        X.side[a] = -(X.part[0, X.cols[a]] + W.force[X.cols[a]])
    lu_solve_transposed(X.lu[:rank, :rank], X.pivot, X.side[:rank])
    for a in range(rank):
        lam[X.rows[a]] += X.side[a]


@njit(**INNER)
def settle(T, W, R, X, step, q, v, w, lam, fresh, tangent, may_bridge):
    """Complete the state from q_I, v_I and the guess of the rest; 0, BRIDGED, or why it could not be done.

    may_bridge: next to a dead point, where rounding spoils what differentiated joints say, leave v and w as
    they are guessed, close q_D and balance lambda, and say so.
    fresh: split the coordinates anew.  tangent: fill W.k, W.c and `tangents` as well. One call of each
    question to the system, visited in turn: every further one would be compiled again.
    """
    n = q.shape[0]
    rank = X.rank[0]
    old, extent, phase = 1e300, 1.0, CLOSING
    for count in range(60):
        constraint_rates(T, W, R, X, step, q, v, w)
        if phase == CLOSING:
            if fresh and count == 0:
                split(W, X)
                rank = X.rank[0]
                for r in range(rank, lam.shape[0]):
                    lam[X.rows[r]] = 0.0
            gap = 0.0
            for r in range(rank):
                gap = max(gap, abs(W.phi[X.rows[r]]))
            size = correct(W, X, q)
            if size < 0.0:
                return SINGULAR
            if not size < 1e100:
                return OPEN
            for a in range(n):
                extent = max(extent, abs(q[a]))
            # near singular positions the correction is rounding long before it is small
            if size <= CLOSED * extent or (gap <= CLOSED * extent and size > 0.3 * old):
                span(W, X)
                if may_bridge and X.tight[0] < NARROW:
                    phase = BRIDGED
                else:
                    phase = MOVING
                    complete(W, X, v)
            old = size
            continue
        applied_forces(T, W, X, step, q, v, lam, tangent)
        if phase == BRIDGED:
            balance(X, W, w, lam)
            return BRIDGED
        if phase == BENDING:
            tangents(W, X)
            return 0
        if accelerate(W, X, v, w, lam) > 0:
            return SINGULAR
        if not tangent:
            return 0
        phase = BENDING
    return OPEN
