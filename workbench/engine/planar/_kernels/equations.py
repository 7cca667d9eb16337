# mypy: ignore-errors
"""The equations of motion of a planar system, compiled: residual, tangents and design derivatives.

    r = M w + F(q, v, z, t) + Phi_q^T lambda = 0,   Phi(q, t) = 0,   dz/dt = g(q, v, z, t)

F is internal minus external (the signs of (2.8); (2.27) prints the other). K = d(F + Phi_q^T lambda)/dq holds
the geometric term of the joints, C = dF/dv. `Tables` and `Work` are described in `tables`. A segment has
the code FUSED (undamped springs: one sweep) or that of its law (measure, law, gather).
"""

from numba import njit
from numba.extending import overload
from numpy import cos, sin

from ...compiler.options import ENTRY, INNER
from ...elements._kernels_elements import forces, forces_with_state
from ...elements._kernels_laws import USER, laws
from ...elements.table import code_of
from .joint_rows import pair_row
from .members import (
    gather,
    gather_tangent,
    measure,
    project,
    rows,
    springs_contract,
    springs_force,
    springs_tangent,
)
from .pairs import (
    pair_coordinates,
    pair_covector,
    pull_back,
    spread,
)
from .row_kinds import COINCIDENT_Y
from .tables import SpringTables

SPRING = code_of("Spring")
FEW = 24  # coordinates; up to so many all of K and C is cleared as fast as its entries
FUSED = -1  # segment code of undamped linear springs


@njit(**INNER)
def set_state(pair, motion, step, q, v, q_full, v_full, turn, big):
    """Fill the full coordinates, cosine and sine of every body's angle, and every pair's coordinates."""
    n = q.shape[0]
    for a in range(n):
        q_full[a] = q[a]
        v_full[a] = v[a]
    for a in range(q_full.shape[0] - n):
        q_full[n + a] = motion[step, 0, a]
        v_full[n + a] = motion[step, 1, a]
    for body in range(turn.shape[1]):
        turn[0, body], turn[1, body] = cos(q_full[3 * body + 2]), sin(q_full[3 * body + 2])
    for p in range(pair.shape[0]):
        pair_coordinates(q_full, v_full, turn, pair[p, 0], pair[p, 1], big[p])


@njit(**ENTRY)
def place(T, W, step, q, v):
    """`set_state` for callers from Python."""
    set_state(T.pair, T.motion, step, q, v, W.q, W.v, W.turn, W.big)


@njit(**INNER)
def _elements(T, W, step, lam, z, zrate, half, tangent):
    """Members with other laws, force elements and the constraint rows of pair coordinates."""
    n = W.force.shape[0]
    free = n // 3
    t = T.times[step]
    for g in range(T.segment.shape[0]):
        p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        if code == FUSED or code == USER:
            continue  # forces of a user's law are added outside
        X = W.big[p]
        measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
        laws(code, T.law, first, last, W.delta, W.rate, t, W.f, W.fd, W.fv)
        if tangent:
            gather_tangent(
                T.geometry, T.scale, W.f, W.fd, W.fv, first, last,
                X[0], X[1], X[2], X[3], X[4], X[5], W.fr[p], W.kr[p], W.cr[p],
            )  # fmt: skip
        else:
            gather(T.geometry, T.scale, W.f, first, last, X[0], X[1], X[2], W.fr[p])

    for e in range(T.element.shape[0]):
        p, code, s = T.element[e, 0], T.element[e, 1], T.element[e, 2]
        if s < 0:
            forces(code, T.element_data, e, W.big[p], W.fr[p], W.kr[p], W.cr[p])
        else:
            forces_with_state(
                code, T.element_data, e, W.big[p], z[s], zrate[s], half, tangent,
                W.fr[p], W.kr[p], W.cr[p], W.slopes[s], W.out,
            )  # fmt: skip
            W.z[s] = W.out[0]
            W.zdot[s] = W.out[1]

    for r in range(T.row.shape[0]):
        kind, p = T.row[r, 0], T.row[r, 1]
        if kind <= COINCIDENT_Y:
            continue
        i, j = T.pair[p, 0], T.pair[p, 1]
        value = pair_row(kind, T.row_data, r, W.big[p], W.row_g, W.row_h)
        W.phi[r] = value - T.drive[step, r]
        pull_back(W.turn, i, j, free, W.big[p], W.row_g[0], W.row_g[1], W.row_g[2], W.phi_q[r])
        for a in range(3):
            W.fr[p, a] += lam[r] * W.row_g[a]
            for b in range(3):
                W.kr[p, a, b] += lam[r] * W.row_h[a, b]


def rich_elements(T, W, step, lam, z, zrate, half, tangent):
    """Everything but undamped springs and coincident points; compiled away for `SpringTables`."""


@overload(rich_elements, jit_options=INNER, strict=False)
def _rich_elements(T, W, step, lam, z, zrate, half, tangent):
    if T.instance_class is SpringTables:
        return lambda T, W, step, lam, z, zrate, half, tangent: None
    return lambda T, W, step, lam, z, zrate, half, tangent: _elements(
        T, W, step, lam, z, zrate, half, tangent
    )


@njit(**INNER)
def _contract_segment(T, W, step, p, code, first, last, w, gradient):
    t = T.times[step]
    X = W.big[p]
    measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
    laws(code, T.law, first, last, W.delta, W.rate, t, W.f, W.fd, W.fv)
    project(T.geometry, first, last, X[0], X[1], X[2], w[0], w[1], w[2], W.delta)
    for i in range(first, last):
        gradient[i] += W.f[i] * W.delta[i]


def rich_contract(T, W, step, p, code, first, last, w, gradient):
    """Contract a segment that is not of undamped springs; compiled away for `SpringTables`."""


@overload(rich_contract, jit_options=INNER, strict=False)
def _rich_contract(T, W, step, p, code, first, last, w, gradient):
    if T.instance_class is SpringTables:
        return lambda T, W, step, p, code, first, last, w, gradient: None
    return lambda T, W, step, p, code, first, last, w, gradient: _contract_segment(
        T, W, step, p, code, first, last, w, gradient
    )


@njit(**INNER)
def _spring_forces(T, W, first, last):
    for i in range(first, last):
        W.f[i] = T.law[0, i] * W.delta[i]


@njit(**INNER)
def _law_forces(T, W, step, code, first, last):
    laws(
        SPRING if code == FUSED else code, T.law, first, last, W.delta, W.rate, T.times[step], W.f, W.fd, W.fv
    )


def unit_forces(T, W, step, code, first, last):
    """Fill W.f with the force of each member at unit density."""


@overload(unit_forces, jit_options=INNER, strict=False)
def _choose_forces(T, W, step, code, first, last):
    if T.instance_class is SpringTables:
        return lambda T, W, step, code, first, last: _spring_forces(T, W, first, last)
    return lambda T, W, step, code, first, last: _law_forces(T, W, step, code, first, last)


@njit(**INNER)
def clear_tangents(T, W):
    """Set K and C to zero, in large systems where bodies meet alone: nothing is written elsewhere."""
    n = W.force.shape[0]
    if n <= FEW:
        for a in range(n):
            for b in range(n):
                W.k[a, b] = 0.0
                W.c[a, b] = 0.0
    else:
        for a in range(n):
            for b in range(a - a % 3, a - a % 3 + 3):
                W.k[a, b] = 0.0
                W.c[a, b] = 0.0
        for p in range(T.pair.shape[0]):
            i, j = 3 * T.pair[p, 0], 3 * T.pair[p, 1]
            if i < n and j < n:
                for a in range(3):
                    for b in range(3):
                        W.k[i + a, j + b] = 0.0
                        W.c[i + a, j + b] = 0.0
                        W.k[j + a, i + b] = 0.0
                        W.c[j + a, i + b] = 0.0


@njit(**ENTRY)
def evaluate(T, W, step, q, v, lam, z, zrate, half, tangent):
    """Fill W.force = F + Phi_q^T lambda, W.phi, W.phi_q, W.z, W.zdot and, if tangent, W.k, W.c, W.energy.

    z, zrate, half: states and their rates at the start of a trapezoidal step of length 2 half (half = 0: z as
    given).
    """
    n = q.shape[0]
    m = T.row.shape[0]
    free = n // 3
    set_state(T.pair, T.motion, step, q, v, W.q, W.v, W.turn, W.big)
    for a in range(n):
        W.force[a] = -T.gravity[a]
    if tangent:
        clear_tangents(T, W)
    for p in range(T.pair.shape[0]):
        for a in range(3):
            W.fr[p, a] = 0.0
            for b in range(3):
                W.kr[p, a, b] = 0.0
                W.cr[p, a, b] = 0.0
    W.energy[0] = 0.0

    for g in range(T.segment.shape[0]):
        p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        if code != FUSED:
            continue
        X = W.big[p]
        if tangent:
            W.energy[0] += springs_tangent(
                T.geometry, T.law[0], T.scale, first, last, X[0], X[1], X[2], W.fr[p], W.kr[p]
            )
        else:
            springs_force(T.geometry, T.law[0], T.scale, first, last, X[0], X[1], X[2], W.fr[p])

    for r in range(m):
        for side in range(2):
            body = T.row[r, 2 + side]
            if body < free:
                for a in range(3 * body, 3 * body + 3):
                    W.phi_q[r, a] = 0.0
        axis = T.row[r, 0]
        if axis > COINCIDENT_Y:
            continue
        # coincident points: p1 + A1 s1 - p2 - A2 s2 = 0, one row per axis
        value = 0.0 * q[0] - T.drive[step, r]
        for side in range(2):
            body = T.row[r, 2 + side]
            sign = 1.0 - 2.0 * side
            c, s = W.turn[0, body], W.turn[1, body]
            sx, sy = T.row_data[r, 2 * side], T.row_data[r, 2 * side + 1]
            ax = c * sx - s * sy
            ay = s * sx + c * sy
            arm = ax if axis == 0 else ay
            turn = -ay if axis == 0 else ax
            value += sign * (W.q[3 * body + axis] + arm)
            if body < free:
                W.phi_q[r, 3 * body + axis] += sign
                W.phi_q[r, 3 * body + 2] += sign * turn
                W.force[3 * body + axis] += lam[r] * sign
                W.force[3 * body + 2] += lam[r] * sign * turn
                if tangent:
                    W.k[3 * body + 2, 3 * body + 2] -= lam[r] * sign * arm
        W.phi[r] = value

    rich_elements(T, W, step, lam, z, zrate, half, tangent)

    for p in range(T.pair.shape[0]):
        spread(
            W.turn, W.v, T.pair[p, 0], T.pair[p, 1], free, W.big[p], W.fr[p], W.kr[p], W.cr[p],
            tangent, W.force, W.k, W.c, W.half,
        )  # fmt: skip

    for e in range(T.load.shape[0]):
        body = T.load[e, 0]
        if body >= free:
            continue
        at, follower = 3 * body, T.load[e, 1] == 1
        fx, fy = T.load_sample[step, e, 0], T.load_sample[step, e, 1]
        sx, sy = T.load_point[e, 0], T.load_point[e, 1]
        c, s = W.turn[0, body], W.turn[1, body]
        gx, gy = fx + 0.0 * c, fy + 0.0 * c
        if follower:
            gx, gy = c * fx - s * fy, s * fx + c * fy
        ax, ay = c * sx - s * sy, s * sx + c * sy
        W.force[at] -= gx
        W.force[at + 1] -= gy
        W.force[at + 2] -= T.load_sample[step, e, 2] + ax * gy - ay * gx
        if not tangent:
            continue
        if follower:
            W.k[at, at + 2] += gy
            W.k[at + 1, at + 2] -= gx
        else:
            W.k[at + 2, at + 2] += ay * gy + ax * gx


@njit(**ENTRY)
def contract(T, W, step, mu, gradient):
    """gradient (N,) += (dF/dscale)^T mu at the state that `evaluate` or `place` left in W."""
    free = mu.shape[0] // 3
    w = W.row_g
    for g in range(T.segment.shape[0]):
        p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        if code == USER:
            continue
        X = W.big[p]
        pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], free, mu, X, w)
        if code == FUSED:
            springs_contract(
                T.geometry, T.law[0], first, last, X[0], X[1], cos(X[2]), sin(X[2]),
                w[0], w[1], w[2], gradient,
            )  # fmt: skip
        else:
            rich_contract(T, W, step, p, code, first, last, w, gradient)


@njit(**ENTRY)
def unit_rows(T, W, step, b):
    """Fill b (3, N) with unit force times d delta/dX of every member: dF/dscale in pair coordinates.

    `place` or `evaluate` must have set W.
    """
    for g in range(T.segment.shape[0]):
        p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        X = W.big[p]
        rows(T.geometry, first, last, X[0], X[1], X[2], b)
        measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
        if code == USER:
            continue  # the user's law fills W.f outside
        unit_forces(T, W, step, code, first, last)
        for i in range(first, last):
            b[0, i] *= W.f[i]
            b[1, i] *= W.f[i]
            b[2, i] *= W.f[i]


@njit(**ENTRY)
def measure_segment(T, W, p, first, last):
    """Fill W.delta and W.rate of one segment; `evaluate` or `place` must have set W."""
    X = W.big[p]
    measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)


@njit(**ENTRY)
def add_segment(T, W, p, first, last, tangent):
    """Add members with the forces and slopes given in W.f, W.fd, W.fv to W.force, W.k and W.c."""
    for a in range(3):
        W.fr[p, a] = 0.0
        for b in range(3):
            W.kr[p, a, b] = 0.0
            W.cr[p, a, b] = 0.0
    X = W.big[p]
    gather_tangent(
        T.geometry, T.scale, W.f, W.fd, W.fv, first, last,
        X[0], X[1], X[2], X[3], X[4], X[5], W.fr[p], W.kr[p], W.cr[p],
    )  # fmt: skip
    spread(
        W.turn, W.v, T.pair[p, 0], T.pair[p, 1], W.force.shape[0] // 3, X, W.fr[p], W.kr[p], W.cr[p],
        tangent, W.force, W.k, W.c, W.half,
    )  # fmt: skip


@njit(**ENTRY)
def contract_segment(T, W, p, first, last, mu, gradient):
    """gradient[first:last] += W.f (b . J mu) for members with the unit forces given in W.f."""
    w = W.row_g
    X = W.big[p]
    pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], mu.shape[0] // 3, mu, X, w)
    project(T.geometry, first, last, X[0], X[1], X[2], w[0], w[1], w[2], W.fd)
    for i in range(first, last):
        gradient[i] += W.f[i] * W.fd[i]
