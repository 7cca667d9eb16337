# mypy: ignore-errors
"""The discrete adjoint of generalised-alpha, compiled: the steps of `_kernels_alpha` transposed, backwards.

Every step is linearised at its converged state, so the adjoint is exact to rounding. Several objectives of a
run are rows of one sweep: the tangents are evaluated (or recalled) and factored once per step, and each row
costs one solve and a few products.
"""

from numba import njit

from ._kernels_alpha import keep_tangents
from ._kernels_dense import lu_factor, lu_solve_transposed
from ._kernels_elements import pair_map
from ._kernels_equations import evaluate, pair_covector, set_state
from ._kernels_options import ENTRY, INNER


@njit(**ENTRY)
def linearise(T, W, first, h, q, v, lam, z, zdot, k, c, j, b):
    """Fill the tangents of the nodes first..first+len(k)-1: k, c (., n, n), j (., m, n), b (., B, 10).

    b holds dg/dD (1), dF/dD, dg/dX and dD/dX (3 each) of the bushings.
    """
    for a in range(k.shape[0]):
        step = first + a
        before = max(step - 1, 0)
        half = 0.5 * h if step > 0 else 0.0
        evaluate(T, W, step, q[step], v[step], lam[step], z[before], zdot[before], half, a >= 0)
        keep_tangents(W, k[a], c[a], j[a])
        for e in range(z.shape[1]):
            b[a, e, 0] = W.gz[e]
            for i in range(3):
                b[a, e, 1 + i] = W.fz[e, i]
                b[a, e, 4 + i] = W.gx[e, i]
                b[a, e, 7 + i] = W.zx[e, i]


@njit(**INNER)
def add_bushings(bushing_pair, pair, q_full, v_full, big, jac, vectors, weights, out):
    """out (n,) += sum over the bushings of weight J^T vector, vectors (B, 3) in pair coordinates."""
    free = out.shape[0] // 3
    for e in range(bushing_pair.shape[0]):
        p = bushing_pair[e]
        i, j = pair[p, 0], pair[p, 1]
        pair_map(q_full, v_full, i, j, big[p], jac)
        for a in range(6):
            body = i if a < 3 else j
            if body < free:
                total = vectors[e, 0] * jac[0, a] + vectors[e, 1] * jac[1, a] + vectors[e, 2] * jac[2, a]
                out[3 * body + a % 3] += weights[e] * total


@njit(**INNER)
def refine(matrix, unfactored, pivot, rhs, right, n, shift):
    """Two corrections of the transposed solve towards the unshifted matrix (redundant constraints)."""
    total = rhs.shape[0]
    for _ in range(2):
        for a in range(total):
            value = right[a]
            for b in range(total):
                value -= unfactored[b, a] * rhs[b]
            if a >= n:
                value -= shift * rhs[a]
            right[a + total] = value
        lu_solve_transposed(matrix, pivot, right[total:])
        for a in range(total):
            rhs[a] += right[a + total]


@njit(**INNER)
def solve_row(matrix, unfactored, pivot, rhs, right, n, shift):
    """Solve the transposed saddle matrix; with a shift, corrected towards the unshifted one."""
    if shift > 0.0:
        for a in range(rhs.shape[0]):
            right[a] = rhs[a]
    lu_solve_transposed(matrix, pivot, rhs)
    if shift > 0.0:
        refine(matrix, unfactored, pivot, rhs, right, n, shift)


@njit(**INNER)
def fill_kept(mass, k, c, j, hc, h2c, shift, matrix):
    """The saddle matrix of the step from kept tangents; `fill_matrix` with these arguments slows the forward
    loop by a third."""
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
    mass, pair, bushing_pair, motion, q_full, v_full, big, jac, row_g,
    scheme, h, first_node, q, v, starts, at, seed_q, seed_v, seed_w, seed_l, seed_z,
    matrix, unfactored, rhs, right, pivot, shift, costate, damage, mu, keep_k, keep_c, keep_j, keep_b,
):  # fmt: skip
    """Fill mu (nodes, R, n), the adjoint of the equations of motion, for R rows at once on some nodes.

    keep_k, keep_c, keep_j, keep_b: tangents as from `linearise` at the nodes from first_node on; stretches
    follow one another backwards, with the same costate and damage.
    starts (R,): the latest node of each row, descending; mu of later nodes is left as it is.
    at (E, 2): node and row of every seed, nodes descending; seed_* (E, ...) are dG/d(node state).
    The gradient of a row is the sum over the nodes of (dr/dparameter)^T mu.
    It takes arrays one by one, not the whole tables: so it is compiled once for all kinds of systems.
    costate (R, 4, n), damage (R, 2, B): zeros at first; rhs (R, n + m) and the rest are work space.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    n, m, bushings = q.shape[1], keep_j.shape[1], keep_b.shape[1]
    total = n + m
    c = (1.0 - af) / (1.0 - am)
    active, cursor = 0, 0
    last = min(starts[0], first_node + keep_k.shape[0] - 1)
    while cursor < at.shape[0] and at[cursor, 0] > last:
        cursor += 1
    for back in range(last - first_node + 1):
        step = last - back
        k, damper, j, b = (
            keep_k[step - first_node],
            keep_c[step - first_node],
            keep_j[step - first_node],
            keep_b[step - first_node],
        )
        first = step == 0
        # node 0 solves the consistent initial accelerations, where a = w: the same lines with h = 0, c = 1
        half = 0.0 if first else 0.5 * h
        ahead = 0.0 if first else h * gamma
        ahead2 = 0.0 if first else h * h * beta
        share = 1.0 if first else c
        if bushings > 0:
            set_state(pair, motion, step, q[step], v[step], q_full, v_full, big)
        fill_kept(mass, k, damper, j, share * ahead, share * ahead2, shift, matrix)
        if shift > 0.0:
            for row in range(total):
                for i in range(total):
                    unfactored[row, i] = matrix[row, i]
        lu_factor(matrix, pivot)
        while active < starts.shape[0] and starts[active] >= step:
            active += 1
        for row in range(active):
            eta, lz = damage[row, 0], damage[row, 1]
            for e in range(bushings):
                lz[e] = -eta[e] * (1.0 + 0.5 * h * b[e, 0])
                eta[e] *= -0.5 * h
            for r in range(m):
                rhs[row, n + r] = 0.0
        while cursor < at.shape[0] and at[cursor, 0] == step:
            row = at[cursor, 1]
            for i in range(n):
                costate[row, 0, i] += seed_q[cursor, i]
                costate[row, 1, i] += seed_v[cursor, i]
                costate[row, 3, i] += seed_w[cursor, i]
            for r in range(m):
                rhs[row, n + r] -= seed_l[cursor, r]
            for e in range(bushings):
                damage[row, 1, e] += seed_z[cursor, e]
            cursor += 1
        for row in range(active):
            lq, lv, la, lw = costate[row, 0], costate[row, 1], costate[row, 2], costate[row, 3]
            eta, lz, x, m_row = damage[row, 0], damage[row, 1], rhs[row], mu[step, row]
            if bushings > 0:
                add_bushings(bushing_pair, pair, q_full, v_full, big, jac, b[:, 4:7], eta, lq)
                add_bushings(bushing_pair, pair, q_full, v_full, big, jac, b[:, 7:10], lz, lq)
            for i in range(n):
                x[i] = -(lw[i] + share * (la[i] + ahead * lv[i] + ahead2 * lq[i]))
            solve_row(matrix, unfactored, pivot, x, right, n, shift)
            for i in range(n):
                m_row[i] = x[i]
            if first:
                continue
            for e in range(bushings):
                p = bushing_pair[e]
                pair_covector(q_full, v_full, jac, pair[p, 0], pair[p, 1], n // 3, m_row, big[p], row_g)
                along = b[e, 1] * row_g[0] + b[e, 2] * row_g[1] + b[e, 3] * row_g[2]
                eta[e] = -(lz[e] + along) / (1.0 - half * b[e, 0])
            for a in range(n):
                for i in range(n):
                    lq[i] += k[a, i] * x[a]
                    lv[i] += damper[a, i] * x[a]
            for r in range(m):
                y = x[n + r] / (share * ahead2)
                for i in range(n):
                    lq[i] += j[r, i] * y
            for i in range(n):
                tq, tv = lq[i], lv[i]
                ta = la[i] + ahead * tv + ahead2 * tq
                lv[i] = tv + h * tq
                la[i] = h * h * (0.5 - beta) * tq + h * (1.0 - gamma) * tv - am / (1.0 - am) * ta
                lw[i] = af / (1.0 - am) * ta
