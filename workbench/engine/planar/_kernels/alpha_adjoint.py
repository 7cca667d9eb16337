# mypy: ignore-errors
"""The discrete adjoint of generalised-alpha, compiled: the steps of `_kernels_alpha` transposed, backwards.

Every step is linearised at its converged state, so the adjoint is exact to rounding. Several objectives of a
run are rows of one sweep: the tangents are evaluated (or recalled) and factored once per step, and each row
costs one solve and a few products.
"""

from numba import njit

from ...compiler._kernels_dense import lu_factor, lu_solve_transposed
from ...compiler.options import ENTRY, INNER
from .alpha import keep_tangents
from .equations import evaluate, set_state
from .pairs import pair_covector, pull_back
from .saddle import factor_band, fill_band, keep_entries, multiply_band, solve_band


@njit(**ENTRY)
def linearise(T, W, S, first, grid, q, v, lam, z, zdot, k, c, j, b):
    """Fill the tangents of the nodes first..first+len(k)-1: k, c (., n, n), j (., m, n), b (., Z, 10).

    S: the system's `Saddle`, where K, C and Phi_q are then set at its entries alone, or None.
    b holds the slopes of the elements' states, as in `Work`.
    """
    for a in range(k.shape[0]):
        step = first + a
        before = max(step - 1, 0)
        half = 0.5 * grid[0, step] if step > 0 else 0.0
        evaluate(T, W, step, q[step], v[step], lam[step], z[before], zdot[before], half, a >= 0)
        if S is None:
            keep_tangents(W, k[a], c[a], j[a])
        else:
            keep_entries(S, W, k[a], c[a], j[a])
        for e in range(z.shape[1]):
            for i in range(10):
                b[a, e, i] = W.slopes[e, i]


@njit(**INNER)
def states_back(D, at, row, half):
    """Take the costate of a row's states to the start of its step; the seeds of the step come after."""
    eta, lz = D.costate[row, 0], D.costate[row, 1]
    for e in range(eta.shape[0]):
        lz[e] = -eta[e] * (1.0 + half * D.slopes[at, e, 0])
        eta[e] *= -half


@njit(**INNER)
def states_to_motion(D, at, row, out):
    """out (n,) += sum over the states of J^T (eta dg/dX + lz dz/dX)."""
    eta, lz, free = D.costate[row, 0], D.costate[row, 1], out.shape[0] // 3
    for e in range(eta.shape[0]):
        p = D.state_pair[e]
        i, j = D.pair[p, 0], D.pair[p, 1]
        g, d = D.slopes[at, e, 4:7], D.slopes[at, e, 7:10]
        f0, f1, f2 = eta[e] * g[0] + lz[e] * d[0], eta[e] * g[1] + lz[e] * d[1], eta[e] * g[2] + lz[e] * d[2]
        pull_back(D.turn, i, j, free, D.big[p], f0, f1, f2, out)


@njit(**INNER)
def motion_to_states(D, step, at, row, mu, half):
    """eta: the costate of the states at the start of the step, from the adjoint mu (n,) of its forces."""
    eta, lz, w, free = D.costate[row, 0], D.costate[row, 1], D.row_g, mu.shape[0] // 3
    for e in range(eta.shape[0]):
        p = D.state_pair[e]
        pair_covector(D.turn, D.pair[p, 0], D.pair[p, 1], free, mu, D.big[p], w)
        b = D.slopes[at, e]
        eta[e] = -(lz[e] + b[1] * w[0] + b[2] * w[1] + b[3] * w[2]) / (1.0 - half * b[0])
        D.eta[step, row, e] = eta[e]


@njit(**INNER)
def solve_transposed(S, matrix, pivot, rhs, side):
    """Solve the transposed saddle matrix for rhs (n + m,), from dense factors or those of its band."""
    if S is None:
        lu_solve_transposed(matrix, pivot, rhs)
    else:
        solve_band(S, matrix, pivot, True, rhs, side)


@njit(**INNER)
def subtract_product(S, matrix, x, out, side):
    """out (n + m,) -= A^T x."""
    if S is None:
        for a in range(x.shape[0]):
            value = out[a]
            for b in range(x.shape[0]):
                value -= matrix[b, a] * x[b]
            out[a] = value
    else:
        multiply_band(S, matrix, x, out, side)


@njit(**INNER)
def solve_row(S, matrix, unshifted, pivot, rhs, right, n, shift):
    """Solve the transposed saddle matrix for rhs (n + m,), with `right` (3, n + m) as work space.

    Redundant constraints shift it: two corrections follow then, towards the `unshifted` matrix. Without them
    `unshifted` is None, and the corrections are compiled away.
    """
    if unshifted is None:
        solve_transposed(S, matrix, pivot, rhs, right[2])
    else:
        total = rhs.shape[0]
        for a in range(total):
            right[0, a], right[1, a] = rhs[a], rhs[a]
            rhs[a] = 0.0
        for _ in range(3):
            solve_transposed(S, matrix, pivot, right[1], right[2])
            for a in range(total):
                rhs[a] += right[1, a]
                right[1, a] = right[0, a]
            for a in range(n, total):
                right[1, a] -= shift * rhs[a]
            subtract_product(S, unshifted, rhs, right[1], right[2])


@njit(**INNER)
def add_products(S, k, damper, j, x, y, lq, lv):
    """lq (n,) += K^T x + Phi_q^T y and lv (n,) += C^T x."""
    n, m = lq.shape[0], j.shape[0]
    if S is None:
        for a in range(n):
            for i in range(n):
                lq[i] += k[a, i] * x[a]
                lv[i] += damper[a, i] * x[a]
        for r in range(m):
            for i in range(n):
                lq[i] += j[r, i] * y[r]
    else:
        for e in range(S.tangent.shape[0]):
            a, i = S.tangent[e, 0], S.tangent[e, 1]
            lq[i] += k[a, i] * x[a]
            lv[i] += damper[a, i] * x[a]
        for e in range(S.joint.shape[0]):
            r, i = S.joint[e, 0], S.joint[e, 1]
            lq[i] += j[r, i] * y[r]


@njit(**INNER)
def fill_kept(mass, k, c, j, hc, h2c, shift, matrix):
    """The saddle matrix of the step from kept tangents.

    One kernel with `fill_matrix` would slow the forward loop by a third.
    """
    n, m = mass.shape[0], j.shape[0]
    for a in range(n):
        for b in range(n):
            matrix[a, b] = hc * c[a, b] + h2c * k[a, b]
        matrix[a, a] += mass[a]
        for r in range(m):
            matrix[a, n + r] = j[r, a]
            matrix[n + r, a] = j[r, a]
    for r in range(m):
        for b in range(m):
            matrix[n + r, n + b] = 0.0
        matrix[n + r, n + r] = -shift


@njit(**ENTRY)
def alpha_adjoint(
    mass, S, scheme, grid, first_node, q, starts, at, seed_q, seed_v, seed_w, seed_l,
    matrix, unshifted, rhs, right, pivot, shift, costate, mu, nu, keep_k, keep_c, keep_j, D,
):  # fmt: skip
    """Fill mu (nodes, R, n) and nu (nodes, R, m), the adjoints of the equations of motion and of Phi.

    For R rows at once on some nodes; at node 0 nu belongs to Phi'' instead.

    keep_k, keep_c, keep_j, D.slopes: tangents as from `linearise` at the nodes from first_node on; stretches
    follow one another backwards, with the same costates.
    grid (2, steps + 1): as in `alpha_forward`.
    starts (R,): the latest node of each row, descending; mu of later nodes is left as it is.
    at (E, 2): node and row of every seed, nodes descending; seed_* (E, ...) are dG/d(node state).
    The gradient of a row is the sum over the nodes of (dr/dparameter)^T mu.
    It takes arrays one by one, not the whole tables: so it is compiled once for all kinds of systems. What
    only some have is None for the others, and compiled away: D, a `DamageSweep`, without states; unshifted,
    of the matrix's shape, without redundant constraints; S, a `Saddle`, whose band the matrix then is.
    costate (R, 4, n): zeros at first; rhs (R, n + m) and the rest are work space.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    n, m = q.shape[1], keep_j.shape[1]
    c = (1.0 - af) / (1.0 - am)
    active, cursor = 0, 0
    last = min(starts[0], first_node + keep_k.shape[0] - 1)
    while cursor < at.shape[0] and at[cursor, 0] > last:
        cursor += 1
    for back in range(last - first_node + 1):
        step = last - back
        here = step - first_node
        k, damper, j = keep_k[here], keep_c[here], keep_j[here]
        first = step == 0
        h, along = grid[0, step], grid[1, step]
        # node 0 solves the consistent initial accelerations, where a = w: the same lines with h = 0, c = 1
        ahead = 0.0 if first else h * gamma
        ahead2 = 0.0 if first else h * h * beta
        share = 1.0 if first else c
        if S is None:
            fill_kept(mass, k, damper, j, share * ahead, share * ahead2, shift, matrix)
        else:
            fill_band(S, mass, k, damper, j, share * ahead, share * ahead2, shift, matrix)
        if unshifted is not None:
            for row in range(n + m):
                for i in range(matrix.shape[1]):
                    unshifted[row, i] = matrix[row, i]
        if S is None:
            lu_factor(matrix, pivot)
        else:
            factor_band(S, matrix, pivot)
        while active < starts.shape[0] and starts[active] >= step:
            active += 1
        for row in range(active):
            for r in range(m):
                rhs[row, n + r] = 0.0
        if D is not None:
            set_state(D.pair, D.motion, step, q[step], D.rates[step], D.q, D.v, D.turn, D.big)
            for row in range(active):
                states_back(D, here, row, 0.5 * grid[0, min(step + 1, grid.shape[1] - 1)])
        while cursor < at.shape[0] and at[cursor, 0] == step:
            row = at[cursor, 1]
            for i in range(n):
                costate[row, 0, i] += seed_q[cursor, i]
                costate[row, 1, i] += seed_v[cursor, i]
                costate[row, 3, i] += seed_w[cursor, i]
            for r in range(m):
                rhs[row, n + r] -= seed_l[cursor, r]
            if D is not None:
                for e in range(D.seed.shape[1]):
                    D.costate[row, 1, e] += D.seed[cursor, e]
            cursor += 1
        for row in range(active):
            lq, lv, la, lw = costate[row, 0], costate[row, 1], costate[row, 2], costate[row, 3]
            x, m_row = rhs[row], mu[step, row]
            if D is not None:
                states_to_motion(D, here, row, lq)
            for i in range(n):
                x[i] = -(lw[i] + share * (la[i] + ahead * lv[i] + ahead2 * lq[i]))
            solve_row(S, matrix, unshifted, pivot, x, right, n, shift)
            for i in range(n):
                m_row[i] = x[i]
            scale = 1.0 if first else share * ahead2
            for r in range(m):
                nu[step, row, r] = x[n + r] / scale
            if first:
                continue
            if D is not None:
                motion_to_states(D, step, here, row, m_row, 0.5 * h)
            add_products(S, k, damper, j, x, nu[step, row], lq, lv)
            for i in range(n):
                tq, tv = lq[i], lv[i]
                ta = la[i] + ahead * tv + ahead2 * tq
                lv[i] = tv + h * tq
                la[i] = h * h * (0.5 - beta) * tq + h * (1.0 - gamma) * tv - am / (1.0 - am) * ta
                lw[i] = af / (1.0 - am) * ta + (1.0 - along) * la[i]
                la[i] *= along
