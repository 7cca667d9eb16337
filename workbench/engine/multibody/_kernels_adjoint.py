# mypy: ignore-errors
"""The discrete adjoint of generalised-alpha, compiled: the steps of `_kernels_alpha` transposed, backwards.

Every step is linearised at its converged state, so the adjoint is exact to rounding. Several objectives of a
run are rows of one sweep: the tangents are evaluated (or recalled) and factored once per step, and each row
costs one solve and a few products.
"""

from numba import njit

from ._kernels_alpha import fill_matrix
from ._kernels_dense import lu_factor, lu_solve_transposed
from ._kernels_elements import pair_map
from ._kernels_equations import evaluate, pair_covector
from ._kernels_options import ENTRY, INNER


@njit(**INNER)
def recall_tangents(W, k, c, j):
    """Copy K, C and Phi_q back into the work space."""
    n, m = k.shape[0], j.shape[0]
    for a in range(n):
        for b in range(n):
            W.k[a, b] = k[a, b]
            W.c[a, b] = c[a, b]
        for r in range(m):
            W.phi_q[r, a] = j[r, a]


@njit(**INNER)
def add_bushings(T, W, vectors, weights, out):
    """out (n,) += sum over the bushings of weight J^T vector, vectors (B, 3) in pair coordinates."""
    free = out.shape[0] // 3
    for e in range(T.bushing_pair.shape[0]):
        p = T.bushing_pair[e]
        i, j = T.pair[p, 0], T.pair[p, 1]
        pair_map(W.q, W.v, i, j, W.big[p], W.jac)
        for a in range(6):
            body = i if a < 3 else j
            if body < free:
                total = (
                    vectors[e, 0] * W.jac[0, a] + vectors[e, 1] * W.jac[1, a] + vectors[e, 2] * W.jac[2, a]
                )
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


@njit(**ENTRY)
def alpha_adjoint(
    T, W, scheme, h, q, v, lam, z, zdot,
    starts, at, seed_q, seed_v, seed_w, seed_l, seed_z,
    matrix, unfactored, rhs, right, pivot, shift, costate, damage, mu, keep_k, keep_c, keep_j,
):  # fmt: skip
    """Fill mu (nodes, R, n), the adjoint of the equations of motion, for R rows at once.

    starts (R,): the latest node of each row, descending; mu of later nodes is left as it is.
    at (E, 2): node and row of every seed, nodes descending; seed_* (E, ...) are dG/d(node state).
    The gradient of a row is the sum over the nodes of (dr/dparameter)^T mu.
    rhs (R, n + m), costate (R, 4, n), damage (R, 2, B) zeros; the other arrays are work space.
    keep_k, keep_c, keep_j: the tangents that the forward run kept, or empty to evaluate them again.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    n, m, bushings = q.shape[1], lam.shape[1], z.shape[1]
    total = n + m
    c = (1.0 - af) / (1.0 - am)
    active, cursor = 0, 0
    last = starts[0]
    for back in range(last + 1):
        step = last - back
        first = step == 0
        # node 0 solves the consistent initial accelerations, where a = w: the same lines with h = 0, c = 1
        half = 0.0 if first else 0.5 * h
        ahead = 0.0 if first else h * gamma
        ahead2 = 0.0 if first else h * h * beta
        share = 1.0 if first else c
        before = step if first else step - 1
        if first or keep_k.shape[0] == 0:
            evaluate(T, W, step, q[step], v[step], lam[step], z[before], zdot[before], half, back >= 0)
        else:
            recall_tangents(W, keep_k[step], keep_c[step], keep_j[step])
        fill_matrix(T, W, share * ahead, share * ahead2, shift, matrix)
        if shift > 0.0:
            for a in range(total):
                for b in range(total):
                    unfactored[a, b] = matrix[a, b]
        lu_factor(matrix, pivot)
        while active < starts.shape[0] and starts[active] >= step:
            active += 1
        for row in range(active):
            eta, lz = damage[row, 0], damage[row, 1]
            for e in range(bushings):
                lz[e] = -eta[e] * (1.0 + 0.5 * h * W.gz[e])
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
                add_bushings(T, W, W.gx, eta, lq)
                add_bushings(T, W, W.zx, lz, lq)
            for i in range(n):
                x[i] = -(lw[i] + share * (la[i] + ahead * lv[i] + ahead2 * lq[i]))
            solve_row(matrix, unfactored, pivot, x, right, n, shift)
            for i in range(n):
                m_row[i] = x[i]
            if first:
                continue
            for e in range(bushings):
                p = T.bushing_pair[e]
                pair_covector(W, T.pair[p, 0], T.pair[p, 1], n // 3, m_row, W.big[p], W.row_g)
                along = W.fz[e, 0] * W.row_g[0] + W.fz[e, 1] * W.row_g[1] + W.fz[e, 2] * W.row_g[2]
                eta[e] = -(lz[e] + along) / (1.0 - half * W.gz[e])
            for b in range(n):
                for i in range(n):
                    lq[i] += W.k[b, i] * x[b]
                    lv[i] += W.c[b, i] * x[b]
            for r in range(m):
                y = x[n + r] / (share * ahead2)
                for i in range(n):
                    lq[i] += W.phi_q[r, i] * y
            for i in range(n):
                tq, tv = lq[i], lv[i]
                ta = la[i] + ahead * tv + ahead2 * tq
                lv[i] = tv + h * tq
                la[i] = h * h * (0.5 - beta) * tq + h * (1.0 - gamma) * tv - am / (1.0 - am) * ta
                lw[i] = af / (1.0 - am) * ta
