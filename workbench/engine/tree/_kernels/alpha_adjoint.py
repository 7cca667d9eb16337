# mypy: ignore-errors
"""The discrete adjoint of generalised-alpha on the group, compiled: exact for the computed run.

lq, lv, la, lw belong to small motions of q, to v, a and w of a node. Backwards, with the kept K, C and
factors:

    (M + h g c C + h^2 b c K T)^T mu = -(lw + c (la + h g lv + h^2 b T^T lq))
    lq~ = lq + K^T mu,  lv~ = lv + C^T mu,  la~ = la + h g lv~ + h^2 b T^T lq~
    lq <- E^T lq~,  lv <- lv~ + h T^T lq~,  lw <- af/(1 - am) la~
    la <- h^2 (1/2 - b) T^T lq~ + h (1 - g) lv~ - am/(1 - am) la~
    lw <- lw + (1 - s) la,  la <- s la,  s the factor of a before the step

E = exp(-d) carries a small motion of q over the step, T its tangent; both are 3 x 3 blocks of spherical
joints. At node 0: M mu = -(la + lw). The gradient by a parameter is the sum of mu^T dr/dp over the nodes.
"""

from numba import njit

from ...compiler.options import CAREFUL, INNER
from .elimination import solve_transposed
from .rotations import exponential, tangent

SPHERICAL = 3


@njit(**INNER)
def by_move(T, W, d, x, out):
    """out = T(d)^T x; entries of states become 0: they have no place."""
    t = W.small[0]
    joints = T.column.shape[0]
    for i in range(x.shape[0]):
        out[i] = x[i] if i < joints else 0.0
    for l in range(T.link.shape[0]):
        if T.link[l, 0] == SPHERICAL:
            j = T.link[l, 2]
            tangent(d, j, t)
            for e in range(3):
                out[j + e] = t[0, e] * x[j] + t[1, e] * x[j + 1] + t[2, e] * x[j + 2]


@njit(**INNER)
def carried_back(T, W, d, x):
    """x <- E^T x = exp(d) x on spherical joints."""
    t = W.small[0]
    for l in range(T.link.shape[0]):
        if T.link[l, 0] == SPHERICAL:
            j = T.link[l, 2]
            exponential(d, j, t)
            a, b, c = x[j], x[j + 1], x[j + 2]
            for e in range(3):
                x[j + e] = t[e, 0] * a + t[e, 1] * b + t[e, 2] * c


@njit(**CAREFUL)
def sweep(T, W, P, R, numbers, grid, first, K, C, LU, starts, at, seeds, costate, some, mu):
    """Fill mu (nodes, rows, n) over the nodes first..first + len(K) - 1, whose tangents are K, C, LU.

    seeds (E, 3, n) by places, velocities and rates; `at` (E, 2) their node and row, latest first.

    costate (rows, 4, n): lq, lv, la, lw, zero on entry, at node 0 on return: then lq, lv are the gradients by
    the initial places and velocities.  some (1, n).
    """
    am, af, gamma, beta = numbers[0], numbers[1], numbers[2], numbers[3]
    c = (1.0 - af) / (1.0 - am)
    n = W.m.shape[0]
    entry, rows = 0, starts.shape[0]
    moved = some[0]
    last = min(starts[0], first + K.shape[0] - 1)
    while entry < at.shape[0] and at[entry, 0] > last:
        entry += 1
    for node in range(last, first - 1, -1):
        while entry < at.shape[0] and at[entry, 0] == node:
            l = costate[at[entry, 1]]
            for i in range(n):
                l[0, i] += seeds[entry, 0, i]
                l[1, i] += seeds[entry, 1, i]
                l[3, i] += seeds[entry, 2, i]
            entry += 1
        h, along = grid[0, node], grid[1, node]
        k, g, lu, d = K[node - first], C[node - first], LU[node - first], R.move[node]
        for row in range(rows):
            m = mu[node, row]
            if starts[row] < node:
                for i in range(n):
                    m[i] = 0.0
                continue
            lq, lv, la, lw = costate[row, 0], costate[row, 1], costate[row, 2], costate[row, 3]
            if node:
                by_move(T, W, d, lq, moved)
                for i in range(n):
                    m[i] = -(lw[i] + c * (la[i] + h * gamma * lv[i] + h * h * beta * moved[i]))
            else:
                for i in range(n):
                    m[i] = -(la[i] + lw[i])
            solve_transposed(P, lu, m)
            for i in range(n):
                x = m[i]
                if x != 0.0:
                    for j in range(n):
                        lq[j] += k[i, j] * x
                        lv[j] += g[i, j] * x
            if not node:
                continue
            by_move(T, W, d, lq, moved)
            carried_back(T, W, d, lq)
            for i in range(n):
                late = la[i] + h * gamma * lv[i] + h * h * beta * moved[i]
                la[i] = h * h * (0.5 - beta) * moved[i] + h * (1.0 - gamma) * lv[i] - am / (1.0 - am) * late
                lw[i] = af / (1.0 - am) * late + (1.0 - along) * la[i]
                la[i] *= along
                lv[i] += h * moved[i]
