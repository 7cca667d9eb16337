# mypy: ignore-errors
"""Forward sensitivities of the alpha family, compiled: dq/dalpha of all members at every node.

All arrays (., N) are gone through along the members, so that the few products of a step run on whole vectors.
"""

from numba import njit

from ...compiler._kernels_dense import lu_factor, lu_solve
from ...compiler.options import ENTRY, INNER
from .alpha import fill_matrix
from .equations import contract, evaluate


@njit(**INNER)
def add_product(factor, a, b, out):
    """out (p, N) += factor a (p, r) b (r, N)."""
    for i in range(a.shape[0]):
        row = out[i]
        for j in range(a.shape[1]):
            share, other = factor * a[i, j], b[j]
            if share != 0.0:
                for k in range(row.shape[0]):
                    row[k] += share * other[k]


@njit(**ENTRY)
def forward_sweep(
    T, W, scheme, h, q, v, lam, nothing, slope, unit, matrix, pivot, inverse, known, F, phi, V, A, U, B,
    table, rates,
):  # fmt: skip
    """Fill table (nodes, n, N) by dq/dalpha, rates (2, nodes, n, N), or (2, 0, n, N), those of v, w.

    unit (n + m, n + m): the identity. matrix, pivot, inverse of that size, known, F, V, A, U, B (n, N) and
    phi (m, N) are work space, V, A, U, B zero at first: derivatives of v, of the scheme's a, of v before the
    step is solved, and of w. The matrices are those the run was solved with, so they have pivots.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    c = (1.0 - af) / (1.0 - am)
    n, m, N = q.shape[1], lam.shape[1], slope.shape[0]
    for node in range(q.shape[0]):
        evaluate(T, W, node, q[node], v[node], lam[node], nothing, nothing, 0.0, node >= 0)
        for i in range(n):
            row = F[i]
            for k in range(N):
                row[k] = 0.0
            contract(T, W, node, unit[i, :n], row)
            for k in range(N):
                row[k] *= slope[k]
        h2c = c * h * h * beta if node > 0 else 0.0
        fill_matrix(T, W, c * h * gamma if node > 0 else 0.0, h2c, 0.0, matrix)
        lu_factor(matrix, pivot)
        for i in range(n + m):
            for k in range(n + m):
                inverse[i, k] = unit[i, k]
            lu_solve(matrix, pivot, inverse[i])  # column i, kept as a row
        X = table[node]
        if node == 0:
            for i in range(n):
                for k in range(N):
                    X[i, k] = 0.0
                    B[i, k] = 0.0
        else:
            before = table[node - 1]
            for i in range(n):
                for k in range(N):
                    old = A[i, k]
                    known[i, k] = (af * B[i, k] - am * old) / (1.0 - am)
                    X[i, k] = before[i, k] + h * V[i, k] + h * h * ((0.5 - beta) * old + beta * known[i, k])
                    U[i, k] = V[i, k] + h * ((1.0 - gamma) * old + gamma * known[i, k])
                    B[i, k] = 0.0
            add_product(1.0, W.k, X, F)
            add_product(1.0, W.c, U, F)
            for i in range(m):
                for k in range(N):
                    phi[i, k] = 0.0
            if m > 0:
                add_product(1.0 / h2c, W.phi_q, X, phi)
        for i in range(n):
            row = B[i]
            for j in range(n):
                share, other = inverse[j, i], F[j]
                for k in range(N):
                    row[k] -= share * other[k]
            if node > 0:
                for j in range(m):
                    share, other = inverse[n + j, i], phi[j]
                    for k in range(N):
                        row[k] -= share * other[k]
        for i in range(n):
            for k in range(N):
                A[i, k] = known[i, k] + c * B[i, k] if node > 0 else B[i, k]
                X[i, k] += h2c * B[i, k]
                V[i, k] = U[i, k] + c * h * gamma * B[i, k] if node > 0 else 0.0
        if rates.shape[1] > 0:
            for i in range(n):
                for k in range(N):
                    rates[0, node, i, k] = V[i, k]
                    rates[1, node, i, k] = B[i, k]
