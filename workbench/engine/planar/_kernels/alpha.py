# mypy: ignore-errors
"""Generalised-alpha for the index-3 DAE, compiled: eqs. (2.29), (2.30).

One step, with c = (1 - alpha_f)/(1 - alpha_m) and the unknown dw (scaled: no 1/h^2 appears in the matrix):

    a1 = (alpha_f w - alpha_m a)/(1 - alpha_m) + c w1
    q1 = q + h v + h^2 ((1/2 - beta) a + beta a1),   v1 = v + h ((1 - gamma) a + gamma a1)
    [M + h gamma c C + h^2 beta c K   Phi_q^T] [dw]        [r                  ]
    [Phi_q                            0      ] [dlambda] = -[Phi/(h^2 beta c)   ]
"""

from numba import njit
from numpy import array, cos, sin

from ...compiler._kernels_dense import lu_factor, lu_list, lu_solve, lu_solve_listed
from ...compiler.options import CAREFUL, INNER
from .equations import evaluate
from .pairs import pair_covector
from .row_kinds import COINCIDENT_Y
from .saddle import factor_band, fill_band, solve_band

CONVERGED, STALLED, SINGULAR = 0, 1, 2
KEPT = 1e-13  # of the coordinates: an update this small leaves the tangents as they are
FEW_ENTRIES = 0.5  # of the factors: a list of so many is quicker than all of them
ROUNDING = 3e-16  # of the coordinates: of the joints' residuals; ten times that where it adds up
LOOKS = 6  # nodes that an extrapolation looks at
# weights of these nodes, the latest first: roots of their polynomials are 1, d times, for powers of time
# below d, and -1 for the alternation that rho = 1 leaves in w and lambda
EXTRAPOLATIONS = array([
    [1.0, 1.0, -1.0, 0.0, 0.0, 0.0],  # d = 2 and the alternation
    [3.0, -3.0, 1.0, 0.0, 0.0, 0.0],  # d = 3
    [4.0, -5.0, 0.0, 5.0, -4.0, 1.0],  # d = 5 and the alternation
    [6.0, -15.0, 20.0, -15.0, 6.0, -1.0],  # d = 6
])  # fmt: skip
SIXTH = 3


@njit(**INNER)
def fill_matrix(T, W, hc, h2c, shift, matrix):
    """The saddle matrix of the step; shift > 0 regularises redundant constraints (a proximal term)."""
    n, m = T.mass.shape[0], T.row.shape[0]
    for a in range(n):
        for b in range(n):
            matrix[a, b] = hc * W.c[a, b] + h2c * W.k[a, b]
        matrix[a, a] += T.mass[a]
        for r in range(m):
            matrix[a, n + r] = W.phi_q[r, a]
            matrix[n + r, a] = W.phi_q[r, a]
    for r in range(m):
        for b in range(m):
            matrix[n + r, n + b] = 0.0
        matrix[n + r, n + r] = -shift


@njit(**INNER)
def extrapolated(x, step, i, which):
    """One of the extrapolations to `step` from the nodes before it."""
    total = EXTRAPOLATIONS[which, 0] * x[step - 1, i]
    for j in range(1, LOOKS):
        total += EXTRAPOLATIONS[which, j] * x[step - 1 - j, i]
    return total


@njit(**INNER)
def along_the_line(x, step, i):
    """The first of the extrapolations, which needs three nodes; the last node where there are fewer."""
    return x[step - 1, i] + x[step - 2, i] - x[step - 3, i] if step > 2 else x[step - 1, i]


@njit(**INNER)
def closest(w, step):
    """The extrapolation that came closest to a step that is solved."""
    best, least = 0, 0.0
    for which in range(EXTRAPOLATIONS.shape[0]):
        off = 0.0
        for i in range(w.shape[1]):
            off = max(off, abs(w[step, i] - extrapolated(w, step, i, which)))
        if which == 0 or off < least:
            best, least = which, off
    return best


@njit(**INNER)
def turn_tangent(row, row_data, q, k, update):
    """Add to K what an update of the joint forces (update[n:]) does by the arms of coincident points."""
    n = k.shape[0]
    for r in range(row.shape[0]):
        for side in range(2):
            body = row[r, 2 + side]
            if 3 * body < n:
                c, s = cos(q[3 * body + 2]), sin(q[3 * body + 2])
                sx, sy = row_data[r, 2 * side], row_data[r, 2 * side + 1]
                arm = c * sx - s * sy if row[r, 0] == 0 else s * sx + c * sy
                k[3 * body + 2, 3 * body + 2] -= update[n + r] * (1.0 - 2.0 * side) * arm


@njit(**INNER)
def keep_tangents(W, k, c, j):
    """Copy K, C and Phi_q out of the work space."""
    n, m = k.shape[0], j.shape[0]
    for a in range(n):
        for b in range(n):
            k[a, b] = W.k[a, b]
            c[a, b] = W.c[a, b]
        for r in range(m):
            j[r, a] = W.phi_q[r, a]


@njit(**INNER)
def work_of(pair, turn, big, fr, w, move, free):
    """Work of the members' forces along a motion of the free bodies, systems of springs alone."""
    total = 0.0 * move[0]
    for p in range(pair.shape[0]):
        pair_covector(turn, pair[p, 0], pair[p, 1], free, move, big[p], w)
        total += fr[p, 0] * w[0] + fr[p, 1] * w[1] + fr[p, 2] * w[2]
    return total


@njit(**CAREFUL)
def alpha_forward(
    T, W, S, L, scheme, grid, q, v, w, lam, z, zdot, acc, matrix, space, pivot, settings, info,
    keep_k, keep_c, keep_j, keep_e, known, carried,
):  # fmt: skip
    """Integrate from the first `known` nodes (all of whose arrays are set) to the end of q (steps + 1, n).

    known: 1 from the start of a system; nodes of an earlier run otherwise, which left acc, matrix, pivot and
    carried (7,) as they are on entry: largest acceleration, strongest joint force, attempts left to take a
    step at once, 1 where the next is tried so, 1 where it uses the factors, steps of the last length in a
    row, the extrapolation that came closest. They are left so on return.

    S: the `Saddle` of the system, whose band the matrix then is, or None: (n + m, n + m), the band compiled
    away. space (2, n + m): work space. L: `Listed` room for what is not zero of factors that are no band.
    grid: (2, steps + 1) lengths of the steps that lead to each node, and the factor s by which the auxiliary
    acceleration goes along with them, a <- w + s (a - w), as from `step_changes`.
    settings: tolerance, most iterations, shift, reuse of factors, 1 when tangents depend on velocities.
    info: status, step, Newton iterations, last update, factorisations.
    keep_k, keep_c (steps + 1, n, n), keep_j (steps + 1, m, n): tangents at the converged states, for the
    adjoint; empty to keep none. keep_e (steps + 1,): the springs' energy there, or empty.
    Where the motion is smooth, accelerations extrapolated to sixth order leave an update of rounding size:
    one full Newton iteration then solves the step, and its tangents are those of the converged state.
    Elsewhere the second iteration evaluates them in passing, or a last evaluation does.
    """
    am, af, gamma, beta = scheme[0], scheme[1], scheme[2], scheme[3]
    steps, n = q.shape[0] - 1, q.shape[1]
    m = lam.shape[1]
    tolerance, most, shift, reuse = settings[0], int(settings[1].real), settings[2], settings[3] > 0.0
    c = (1.0 - af) / (1.0 - am)
    rhs = space[0]
    even = True
    for step in range(1, steps + 1):
        if grid[0, step] != grid[0, 0]:
            even = False
    largest = 0.0
    if known == 1:
        for i in range(n):
            acc[i] = w[0, i]
            largest = max(largest, abs(w[0, i]))
    fresh = False
    keep = keep_k.shape[0] > 0
    pinned = True  # K depends on the joint forces by the arms of coincident points alone, if at all
    for r in range(m):
        if T.row[r, 0] > COINCIDENT_Y:
            pinned = False
    strongest = 0.0
    smooth, attempts = False, 8  # rounding of the joints may hide a smooth motion: then it is given up
    if shift.real > 0.0:
        attempts = 0  # multipliers of redundant joints have no unique value to extrapolate
    entries = 0
    evenly, nearest = 0, 0  # steps of the present length in a row; the extrapolation to take
    if known > 1:
        largest, strongest, attempts = carried[0], carried[1], int(carried[2])
        smooth, fresh = carried[3] > 0.0 and even, carried[4] > 0.0
        evenly, nearest = int(carried[5]), int(carried[6])
        if S is None and fresh:
            entries = lu_list(matrix, L.value, L.column, L.start)
    for step in range(known, steps + 1):
        q1, v1, w1, l1 = q[step], v[step], w[step], lam[step]
        h, along = grid[0, step], grid[1, step]
        hc, h2c = h * gamma * c, h * h * beta * c
        evenly += 1
        if h != grid[0, step - 1]:
            fresh, evenly, nearest = False, 1, 0
            for i in range(n):
                acc[i] = along * acc[i] + (1.0 - along) * w[step - 1, i]
        for i in range(n):
            if evenly > LOOKS:
                w1[i] = extrapolated(w, step, i, SIXTH if smooth else nearest)
            else:
                w1[i] = along_the_line(w, step, i)
            known = (af * w[step - 1, i] - am * acc[i]) / (1.0 - am)
            a1 = known + c * w1[i]
            q1[i] = q[step - 1, i] + h * v[step - 1, i] + h * h * ((0.5 - beta) * acc[i] + beta * a1)
            v1[i] = v[step - 1, i] + h * ((1.0 - gamma) * acc[i] + gamma * a1)
            acc[i] = known  # completed with c w1 after the iteration
        for r in range(m):
            if evenly > LOOKS and shift.real == 0.0:  # rounding of shares that nothing holds would grow
                l1[r] = extrapolated(lam, step, r, SIXTH if smooth else nearest)
            else:
                l1[r] = along_the_line(lam, step, r)
        old, theta = -1.0, 1.0
        done = slow = False
        refresh = (not reuse) or (not fresh) or smooth
        closed = False  # whether W was evaluated after the last update
        seen = settled = False  # whether W holds tangents of this iteration; whether its update is rounding
        for iteration in range(most + 1):
            if iteration == most and not done:
                break
            # one place where the equations are evaluated: they are most of what has to be compiled
            seen = refresh or done or (keep and iteration > 0)
            evaluate(T, W, step, q1, v1, l1, z[step - 1], zdot[step - 1], 0.5 * h, seen)
            if done:
                closed = True
                break
            info[2] += 1
            if refresh:
                info[4] += 1
                if S is None:
                    fill_matrix(T, W, hc, h2c, shift, matrix)
                    lost = lu_factor(matrix, pivot)
                else:
                    fill_band(S, T.mass, W.k, W.c, W.phi_q, hc, h2c, shift, matrix)
                    lost = factor_band(S, matrix, pivot)
                if lost > 0:
                    info[0], info[1] = SINGULAR, step
                    return
                if S is None:
                    entries = lu_list(matrix, L.value, L.column, L.start)
                fresh = True
            for i in range(n):
                rhs[i] = -(T.mass[i] * w1[i] + W.force[i])
            for r in range(m):
                rhs[n + r] = -W.phi[r] / h2c
            if S is None:
                if entries < FEW_ENTRIES * (n + m) * (n + m):
                    lu_solve_listed(pivot, L.value, L.column, L.start, rhs)
                else:
                    lu_solve(matrix, pivot, rhs)
            else:
                solve_band(S, matrix, pivot, False, rhs, space[1])
            size, level, extent, quickest = 0.0, 0.0, 1.0, 0.0
            for i in range(n):
                w1[i] += rhs[i]
                q1[i] += h2c * rhs[i]
                v1[i] += hc * rhs[i]
                size = max(size, abs(rhs[i]))
                level = max(level, abs(w1[i]))
                extent = max(extent, abs(q1[i]))
                quickest = max(quickest, abs(v1[i]))
            change = 0.0
            for r in range(m):
                l1[r] += rhs[n + r]
                change = max(change, abs(rhs[n + r]))
                strongest = max(strongest, abs(l1[r]))
            info[3] = size
            if not size < 1e200:
                break
            level = max(level, largest)
            stiffest = strongest  # joint forces enter K by their arms, beside the stiffness of all else
            if seen:
                for i in range(n):
                    stiffest = max(stiffest, abs(W.k[i, i]) / extent)
            settled = abs(h2c) * size <= KEPT * extent and (pinned or change <= 1e-11 * stiffest)
            if settings[4].real > 0.0 and abs(hc) * size > KEPT * quickest:
                settled = False
            if smooth and refresh and settled:
                if pinned:
                    turn_tangent(T.row, T.row_data, W.q, W.k, rhs)
                theta = 0.0
                done = True
                break
            # error left ~ size theta/(1 - theta); where it no longer shrinks, rounding is reached: that of
            # Phi moves the accelerations by 1/h^2, and far more near singular positions of the joints
            if old > 0.0:
                theta = size / old
            left = size if old < 0.0 else size * min(theta, 0.9) / (1.0 - min(theta, 0.9))
            floor, rounding = 1e-9 * level, 0.0
            if m > 0:
                rounding = ROUNDING * extent / h2c.real
                floor = max(floor, 10.0 * rounding if iteration < 8 else 1e-12 * extent / h2c.real)
            if left <= max(tolerance.real * level, rounding) or (old > 0.0 and theta > 0.3 and size <= floor):
                done = True
                slow = old > 0.0 and size > 0.05 * old + 20.0 * rounding
                if not keep or (seen and settled):
                    break
            refresh = old > 0.0 and theta > 0.1 and (iteration > 4 or not refresh)
            old = size
        if not done:
            info[0], info[1] = STALLED, step
            return
        if smooth and theta > 0.0:
            attempts -= 1
        if slow:
            fresh = False
        if keep:
            keep_tangents(W, keep_k[step], keep_c[step], keep_j[step])
            if keep_e.shape[0] > 0:
                keep_e[step] = W.energy[0]
                if not closed:
                    keep_e[step] += h2c * work_of(T.pair, W.turn, W.big, W.fr, W.row_g, rhs, n // 3)
        for i in range(n):
            acc[i] += c * w1[i]
            largest = max(largest, abs(w1[i]))
        if evenly > LOOKS:
            nearest = closest(w, step)
        smooth = keep and step > 6 and attempts > 0 and even
        if smooth:
            for i in range(n):
                off = abs(h2c) * abs(w1[i] - extrapolated(w, step, i, SIXTH))
                if off > KEPT * extent:  # rho below 1 damps an alternation of the start by rho in a step
                    smooth = False
        for e in range(z.shape[1]):
            z[step, e] = W.z[e]
            zdot[step, e] = W.zdot[e]
    carried[0], carried[1], carried[2] = largest, strongest, attempts if even else 0
    carried[3], carried[4] = 1.0 if smooth else 0.0, 1.0 if fresh else 0.0
    carried[5], carried[6] = evenly, nearest
    info[0], info[1] = CONVERGED, steps
