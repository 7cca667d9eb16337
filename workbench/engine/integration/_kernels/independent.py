# mypy: ignore-errors
"""Generalised-alpha in independent coordinates, and its discrete adjoint, compiled.

    v_I' = w_I(q_I, v_I, t):   a1 = (alpha_f w - alpha_m a)/(1 - alpha_m) + c w1 for all coordinates,
    q1_I = q_I + h v_I + h^2 ((1/2 - beta) a_I + beta a1_I),   v1_I = v_I + h ((1 - gamma) a_I + gamma a1_I)

Joints hold on positions, velocities and accelerations, so nothing is left to alternate at rho = 1. Next to a
dead point, where Phi_D is nearly singular, a step takes extrapolated accelerations instead. A split of the
coordinates is kept while it is well conditioned; a belongs to every coordinate, so it may change at any step.
"""

from numba import njit

from ...compiler._kernels_dense import lu_factor, lu_solve, lu_solve_transposed
from ...compiler.options import CAREFUL, ENTRY, INNER
from .chart import (
    BRIDGED,
    add_design,
    keep_split,
    recall_split,
    settle,
    split,
)
from .pull_back import pull_back, pull_force, pull_joints, pull_multiplier

CONVERGED, STALLED = 0, 1
# share of its first pivot ratio at which a split is made anew, which moves results by O(h^2)
WORN = 0.5
LOOSE = 1e-11  # m or rad: a redundant row this far off may have become independent


@njit(**INNER)
def step_matrix(X, hc, h2c, matrix, pivot):
    """Factor 1 - h2c dw_I/dq_I - hc dw_I/dv_I."""
    rank = X.rank[0]
    f = X.zero.shape[0] - rank
    for a in range(f):
        at = X.cols[rank + a]
        for b in range(f):
            matrix[a, b] = -h2c * X.w_by_q[at, b] - hc * X.w_by_v[at, b]
        matrix[a, a] += 1.0
    return lu_factor(matrix[:f, :f], pivot)


@njit(**CAREFUL)
def independent_forward(
    T,
    W,
    R,
    X,
    scheme,
    h,
    q,
    v,
    w,
    lam,
    acc,
    rows,
    cols,
    rank,
    tight,
    bridged,
    matrix,
    pivot,
    rhs,
    settings,
    info,
    known,
    carried,
):
    """Integrate from q[0], v[0] to the end of q (steps + 1, n); rows, cols, rank keep the splits,
    tight (steps + 1,) how near a dead point is, bridged (steps + 1,) 1 where it was too near to
    differentiate the joints. acc (n,), matrix, pivot, rhs: work.

    known: 0 from the start of a system; otherwise nodes of an earlier run, which left acc, the arrays of W
    and X and carried (3,) as they are on entry: largest acceleration, the pivot ratio of the split in use
    when it was made, how far off redundant rows are. They are left so on return.

    settings: tolerance, most iterations.  info: status, step, evaluations, last update, worst redundant row.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    steps, n = q.shape[0] - 1, q.shape[1]
    c = (1.0 - af) / (1.0 - am)
    hc, h2c = h * gamma * c, h * h * beta * c
    largest, since, beyond = 0.0, -1.0, 0.0
    if known > 0:
        largest, since, beyond = carried[0], carried[1], carried[2]
    for step in range(known, steps + 1):
        q1, v1, w1 = q[step], v[step], w[step]
        if step > 0:
            if X.tight[0] < WORN * since or beyond > LOOSE or bridged[step - 1] == 1:
                split(W, X)  # W.phi_q is of the accepted state
                since = -1.0
            for r in range(X.rank[0], lam.shape[1]):
                lam[step, X.rows[r]] = 0.0
            for r in range(X.rank[0]):
                lam[step, X.rows[r]] = lam[step - 1, X.rows[r]]
            for a in range(n):
                w1[a] = w[step - 1, a]
                if step > 3:
                    w1[a] = 3.0 * (w[step - 1, a] - w[step - 2, a]) + w[step - 3, a]
                known = (af * w[step - 1, a] - am * acc[a]) / (1.0 - am)
                a1 = known + c * w1[a]
                q1[a] = q[step - 1, a] + h * v[step - 1, a] + h * h * ((0.5 - beta) * acc[a] + beta * a1)
                v1[a] = v[step - 1, a] + h * ((1.0 - gamma) * acc[a] + gamma * a1)
                acc[a] = known
            for b in range(n - X.rank[0]):
                rhs[b] = w1[X.cols[X.rank[0] + b]]  # the accelerations that q1 and v1 were made with
        done, old = False, -1.0
        for iteration in range(int(settings[1])):
            bad = settle(
                T, W, R, X, step, q1, v1, w1, lam[step], step == 0, step > 0 and iteration == 0,
                iteration == 0 and step > 3,
            )  # fmt: skip
            info[2] += 1
            if bad > 0:
                info[0], info[1] = bad, step
                return
            bridged[step] = 1 if bad == BRIDGED else 0
            if step == 0 or bad == BRIDGED:
                done = True  # a bridged node keeps the extrapolated accelerations
                break
            r0 = X.rank[0]
            f = n - r0
            if iteration == 0 and step_matrix(X, hc, h2c, matrix, pivot) > 0:
                break
            size, level, extent = 0.0, largest, 1.0
            for b in range(f):
                at = X.cols[r0 + b]
                X.side[b] = w1[at] - rhs[b]
                size = max(size, abs(X.side[b]))
                level = max(level, abs(w1[at]))
            for a in range(n):
                extent = max(extent, abs(q1[a]))
            info[3] = size
            if not size < 1e200:
                break
            # near singular positions rounding of the positions moves the accelerations far more
            floor = max(1e-9 * level, (3e-15 if iteration < 8 else 1e-11) * extent / h2c)
            # this update is not applied to q1 and v1 any more: it is what they are off
            if size <= settings[0] * level or (old > 0.0 and size > 0.3 * old and size <= floor):
                done = True
                break
            lu_solve(matrix[:f, :f], pivot, X.side[:f])
            for b in range(f):
                at = X.cols[r0 + b]
                rhs[b] += X.side[b]
                q1[at] += h2c * X.side[b]
                v1[at] += hc * X.side[b]
            old = size
        if not done:
            info[0], info[1] = STALLED, step
            return
        keep_split(X, rows, cols, rank, step)
        tight[step] = X.tight[0]
        if since < 0.0:
            since = X.tight[0]
        for a in range(n):
            acc[a] = w1[a] if step == 0 else acc[a] + c * w1[a]
            largest = max(largest, abs(w1[a]))
        beyond = 0.0
        for r in range(X.rank[0], lam.shape[1]):
            beyond = max(beyond, abs(W.phi[X.rows[r]]))
        info[4] = max(info[4], beyond)
    carried[0], carried[1], carried[2] = largest, since, beyond
    info[0], info[1] = CONVERGED, steps


@njit(**ENTRY)
def independent_adjoint(
    T, W, R, X, scheme, h, last, q, v, w, lam, rows, cols, rank, bridged,
    seed_q, seed_v, seed_w, seed_l, costate, point, reduced, matrix, pivot, mu, nu, gradient, given,
):  # fmt: skip
    """gradient (N,) += sum over the nodes of (dF/dscale)^T mu; mu (steps + 1, n) is kept.

    given: whether node 0 comes from an earlier run, so that no equations were solved there.

    nu (steps + 1, 3, m), or of length 0: adjoints of Phi, Phi' and Phi''.
    costate (6, n): of q, v, a, w and of the two w before it; on return the last two are slopes by the start
    (q and v). reduced (4, n), point (3, n): work. lam is settled again by rounding.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    n = q.shape[1]
    c = (1.0 - af) / (1.0 - am)
    hc, h2c = h * gamma * c, h * h * beta * c
    lq, lv, la, lw = costate[0], costate[1], costate[2], costate[3]
    earlier, earliest = costate[4], costate[5]
    by_q, by_v, back, known = reduced[0], reduced[1], reduced[2], reduced[3]
    for backwards in range(last + 1):
        step = last - backwards
        if given and step == 0:
            for a in range(n):
                earlier[a] = lq[a] + seed_q[0, a]
                earliest[a] = lv[a] + seed_v[0, a]
            return
        recall_split(X, rows, cols, rank, step)
        r0 = X.rank[0]
        f = n - r0
        for a in range(n):
            point[0, a] = q[step, a]
            point[1, a] = v[step, a]
            point[2, a] = w[step, a]
        over = settle(
            T, W, R, X, step, point[0], point[1], point[2], lam[step], False, True, bridged[step] == 1
        ) == BRIDGED  # fmt: skip
        share = 1.0 if step == 0 else c
        for a in range(n):
            lq[a] += seed_q[step, a]
            lv[a] += seed_v[step, a]
            lw[a] += seed_w[step, a] + share * la[a]
        if step == 0:
            for a in range(n):
                earlier[a] = lq[a]
                earliest[a] = lv[a]
        pull_multiplier(W, X, lq, lv, lw, seed_l[step], mu[step])
        for a in range(n):
            point[0, a] = mu[step, a]
        if over:
            for b in range(f):
                by_q[b] = 0.0 * h
                for a in range(n):
                    by_q[b] += X.basis[a, b] * lq[a]
                lw[X.cols[r0 + b]] += h2c * by_q[b]
            for a in range(n):
                lw[a] += hc * lv[a]
        elif step > 0:
            pull_back(X, lq, lv, lw, by_q, by_v)
            step_matrix(X, hc, h2c, matrix, pivot)
            for b in range(f):
                back[b] = h2c * by_q[b] + hc * by_v[b]
            lu_solve_transposed(matrix[:f, :f], pivot, back[:f])
            for b in range(f):
                lw[X.cols[r0 + b]] += back[b]
            pull_back(X, lq, lv, lw, by_q, by_v)
        if not over:
            pull_force(X, lw, mu[step])
        if nu.shape[0] > 0:
            pull_joints(W, X, lq, lv, lw, mu[step], point[0], over, nu[step])
        if not over:
            for a in range(n):
                lw[a] = 0.0  # what follows from the accelerations has been followed
        add_design(T, W, step, q[step], v[step], mu[step], gradient)
        if step == 0:
            return
        for a in range(n):
            lq[a] = 0.0
            known[a] = la[a]
            la[a] = 0.0
            if not over:
                lv[a] = 0.0
        for b in range(f):
            at = X.cols[r0 + b]
            lq[at] = by_q[b]
            la[at] = h * h * (0.5 - beta) * by_q[b]
            known[at] += h * h * beta * by_q[b]
            if not over:
                lv[at] = by_v[b]
        for a in range(n):
            la[a] += h * (1.0 - gamma) * lv[a]
            known[a] += h * gamma * lv[a]
        for b in range(f):
            lv[X.cols[r0 + b]] += h * by_q[b]
        for a in range(n):
            ahead = lw[a]  # of the extrapolation 3 w_(n-1) - 3 w_(n-2) + w_(n-3)
            lw[a] = af / (1.0 - am) * known[a] + 3.0 * ahead + earlier[a]
            earlier[a] = earliest[a] - 3.0 * ahead
            earliest[a] = ahead
            la[a] -= am / (1.0 - am) * known[a]
