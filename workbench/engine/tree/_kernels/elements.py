# mypy: ignore-errors
"""Forces of everything between links and on joint coordinates, with slopes, compiled; see `members` for
pairs and `tangents` for what their slopes are to the joints.
"""

from numba import njit
from numpy import sqrt

from ...compiler.held import only_with
from ...compiler.options import INNER
from ...elements._kernels_spatial_bushing import spatial_bushing
from ...elements.joint_spring import forces as torsion
from .cuts import cut_forces, cut_slopes
from .members import (
    add_lever,
    add_member_forces,
    add_member_slopes,
    add_point_force,
    add_point_slope,
    measure_members,
)
from .motion import dot6
from .rotations import inverse_tangent, logarithm, turned, turned_back
from .surfaces import surface_forces, surface_slopes


@only_with("pair")
def pair_forces(T, W, step, x, w, never):
    """W.pair_force of all pairs, taken off W.force; rates of states with a minus into W.force.

    w: rates, the multipliers of cut joints behind them.  never: False, as a value.
    """
    for pair in range(T.pair.shape[0]):
        for e in range(6):
            W.pair_force[pair, e] = 0.0
    measure_members(T, W, step)
    add_member_forces(T, W)
    bushings(T, W, x, never)
    surface_forces(T, W, step, x)
    loads(T, W, step, never)
    cut_forces(T, W, step, w)
    for pair in range(T.pair.shape[0]):
        for i in range(T.pair[pair, 2], T.pair[pair, 3]):
            k = T.path[i, 0]
            W.force[k] -= T.path[i, 1] * dot6(W.s[k], W.pair_force[pair])


@only_with("pair")
def pair_slopes(T, W, step, x, w, tangent):
    """W.pair_k and W.pair_c of all pairs after `pair_forces`, and the entries of states in K and C."""
    for pair in range(T.pair.shape[0]):
        for e in range(36):
            W.pair_k[pair, e] = 0.0
            W.pair_c[pair, e] = 0.0
    add_member_slopes(T, W)
    bushings(T, W, x, tangent)
    surface_slopes(T, W, step, x)
    loads(T, W, step, tangent)
    cut_slopes(T, W, step, w)


@only_with("bushing_pair")
def bushings(T, W, x, tangent):
    """All bushings, or their slopes."""
    for u in range(T.bushing_pair.shape[0]):
        one_bushing(T, W, u, x, tangent)


@only_with("load")
def loads(T, W, step, tangent):
    """All loads, or their slopes."""
    for i in range(T.load.shape[0]):
        one_load(T, W, step, i, tangent)


@njit(**INNER)
def bushing_state(T, W, u, r, v, point):
    """Separation and its rate in the axes of b, and the point of a less the origin."""
    pair = T.bushing_pair[u, 0]
    a, b = T.pair[pair, 0], T.pair[pair, 1]
    some = W.some[1]
    for e in range(3):
        r[e] = T.bushing[15 + e, u]
    turned(W.turn[a], r, point)
    for e in range(3):
        point[e] += W.place[a, e]
        some[e] = point[e] - W.place[b, e]
    turned_back(W.turn[b], some, r)
    for e in range(3):
        r[e] -= T.bushing[18 + e, u]
        some[6 + e] = W.twist[a, e] - W.twist[b, e]
        some[9 + e] = W.twist[a, 3 + e] - W.twist[b, 3 + e]
    some[0] = some[9] + some[7] * point[2] - some[8] * point[1]
    some[1] = some[10] + some[8] * point[0] - some[6] * point[2]
    some[2] = some[11] + some[6] * point[1] - some[7] * point[0]
    turned_back(W.turn[b], some, v)


@njit(**INNER)
def one_bushing(T, W, u, x, tangent):
    """Add a bushing to its pair and its damage's rate to the states, or the slopes of both."""
    n = T.column.shape[0]
    pair, state = T.bushing_pair[u, 0], T.bushing_pair[u, 1]
    b = T.pair[pair, 1]
    r, v, f, fz = W.some[2], W.some[2, 3:], W.some[2, 6:], W.some[2, 9:]
    point, out, gr, w = W.some[2, 12:], W.some[2, 15:], W.some[2, 18:], W.some[2, 21:]
    bushing_state(T, W, u, r, v, point)
    z = 0.0 * r[0]
    if state >= 0:
        z = x[state]
    spatial_bushing(T.bushing, u, r, v, z, tangent, f, W.small[2], W.small[3], fz, gr, out)
    turned(W.turn[b], f, w)
    if not tangent:
        add_point_force(W.pair_force[pair], point, w)
        if state >= 0:
            W.force[n + state] = -out[0]
        return
    in_global_axes(W.turn[b], W.small[2], W.small[4], W.small[1])
    in_global_axes(W.turn[b], W.small[3], W.small[5], W.small[1])
    va, vb = W.twist[T.pair[pair, 0]], W.twist[b]
    A, D = W.pair_k[pair], W.pair_c[pair]
    F, H, G = W.small[4], W.small[5], W.small[1]
    # the rate turns with the place: its slope is (w_a - w_b) x, so G = F + H (w_a - w_b)^
    p, q, s = va[0] - vb[0], va[1] - vb[1], va[2] - vb[2]
    for i in range(3):
        G[i, 0] = -(F[i, 0] + H[i, 1] * s - H[i, 2] * q)
        G[i, 1] = -(F[i, 1] + H[i, 2] * p - H[i, 0] * s)
        G[i, 2] = -(F[i, 2] + H[i, 0] * q - H[i, 1] * p)
    px, py, pz = point[0], point[1], point[2]
    add_point_slope(A, G, px, py, pz, px, py, pz)
    add_lever(A, px, py, pz, w[0], w[1], w[2])
    for i in range(3):
        for j in range(3):
            H[i, j] = -H[i, j]
    add_point_slope(D, H, px, py, pz, px, py, pz)
    if state >= 0:
        state_slopes(T, W, pair, n + state, point, gr, fz, out[1])


@njit(**INNER)
def in_global_axes(R, m, out, some):
    """out = R m R^T."""
    for i in range(3):
        for j in range(3):
            some[i, j] = R[3 * i] * m[0, j] + R[3 * i + 1] * m[1, j] + R[3 * i + 2] * m[2, j]
    for i in range(3):
        for j in range(3):
            out[i, j] = some[i, 0] * R[3 * j] + some[i, 1] * R[3 * j + 1] + some[i, 2] * R[3 * j + 2]


@njit(**INNER)
def state_slopes(T, W, pair, row, point, gr, fz, own):
    """K and C entries of a bushing's damage: its rate by the place of a, the force by the damage."""
    b = T.pair[pair, 1]
    one, two, some = W.some[0], W.some[1], W.some[3]
    turned(W.turn[b], gr, some)
    for e in range(6):
        one[e] = 0.0
        two[e] = 0.0
    add_point_force(one, point, some)  # gA = (p x y; y)
    turned(W.turn[b], fz, some)
    add_point_force(two, point, some)
    for i in range(T.pair[pair, 2], T.pair[pair, 3]):
        j, sign = T.path[i, 0], T.path[i, 1]
        W.k[row, j] = -sign * dot6(one, W.s[j])
        W.c[row, j] = 0.0
        W.c[j, row] = -sign * dot6(two, W.s[j])
    W.c[row, row] = -own


@njit(**INNER)
def one_load(T, W, step, i, tangent):
    """Add a force or torque on a link, fixed in space or following it, to its pair, or its slopes."""
    pair, follows, torque = T.load[i, 0], T.load[i, 1], T.load[i, 2]
    a = T.pair[pair, 0]
    some, p, w = W.some[2], W.some[2, 3:], W.some[2, 6:]
    for e in range(3):
        some[e] = T.load_point[i, e]
        w[e] = T.load_sample[step, i, e]
    turned(W.turn[a], some, p)
    for e in range(3):
        p[e] += W.place[a, e]
    if follows:
        for e in range(3):
            some[e] = w[e]
        turned(W.turn[a], some, w)
    total, A = W.pair_force[pair], W.pair_k[pair]
    if not tangent:
        if torque:
            for e in range(3):
                total[e] += w[e]
        else:
            add_point_force(total, p, w)
        return
    x, y, z = w[0], w[1], w[2]
    if not torque:
        add_lever(A, p[0], p[1], p[2], x, y, z)
    if follows:  # dw = e x w
        if torque:
            A[1] += z
            A[2] -= y
            A[6] -= z
            A[8] += x
            A[12] += y
            A[13] -= x
        else:
            A[19] += z
            A[20] -= y
            A[24] -= z
            A[26] += x
            A[30] += y
            A[31] -= x
            add_crossed(A, p, x, y, z)


@njit(**INNER)
def add_crossed(A, p, x, y, z):
    """A (36,) += the moment p x (e x w) = e (p . w) - w (p . e)."""
    dot = p[0] * x + p[1] * y + p[2] * z
    for i in range(3):
        w = x if i == 0 else (y if i == 1 else z)
        for j in range(3):
            A[6 * i + j] -= w * p[j]
        A[6 * i + i] += dot


@njit(**INNER)
def coordinate_forces(T, W, step, q, v, tangent):
    """Add springs, stops, dampers and constant torques of single coordinates, balls and couplings."""
    coordinate_springs(T, W, q, v, tangent)
    coordinate_dampers(T, W, step, v, tangent)
    ball_springs(T, W, q, v, tangent)
    couplings(T, W, q, v, tangent)


@only_with("spring_column")
def coordinate_springs(T, W, q, v, tangent):
    """Springs, stops, dampers and constant torques of single coordinates."""
    big, fr, kr, cr = W.some[0], W.some[1], W.small[2], W.small[3]
    for t in range(T.spring_column.shape[0]):
        j, at = T.spring_column[t, 0], T.spring_column[t, 1]
        big[2] = q[at]
        big[5] = v[j]
        fr[2] = -T.spring[7, t]
        kr[2, 2] = 0.0
        cr[2, 2] = 0.0
        torsion(T.spring, t, big, fr, kr, cr)
        W.force[j] += fr[2]
        if tangent:
            W.k[j, j] += kr[2, 2]
            W.c[j, j] += cr[2, 2]


@only_with("damper_column")
def coordinate_dampers(T, W, step, v, tangent):
    """Two rates of damping, and friction over time, on single coordinates."""
    for t in range(T.damper_column.shape[0]):
        j = T.damper_column[t]
        mean, half, slow = T.damper[t, 0], T.damper[t, 1], T.damper[t, 2]
        friction, rate = T.friction_sample[step, t], v[j]
        s = sqrt(rate * rate + slow * slow)
        W.force[j] += mean * rate + half * (s - slow) + friction * rate / s
        if tangent:
            W.c[j, j] += mean + half * rate / s + friction * slow * slow / (s * s * s)


@only_with("ball_column")
def ball_springs(T, W, q, v, tangent):
    """Springs and dampers about all axes of a rotation."""
    big, kr = W.some[0], W.small[2]
    for t in range(T.ball_column.shape[0]):
        j, at = T.ball_column[t, 0], T.ball_column[t, 1]
        logarithm(q, at, T.ball_rest, t, big)
        for e in range(3):
            W.force[j + e] += T.ball[t, 0] * big[e] + T.ball[t, 1] * v[j + e]
        if tangent:
            inverse_tangent(big, 0, kr)
            for e in range(3):
                W.c[j + e, j + e] += T.ball[t, 1]
                for g in range(3):
                    W.k[j + e, j + g] += T.ball[t, 0] * kr[e, g]


@only_with("coupling_column")
def couplings(T, W, q, v, tangent):
    """Springs and dampers between two coordinates."""
    for t in range(T.coupling_column.shape[0]):
        i, j = T.coupling_column[t, 0], T.coupling_column[t, 1]
        a, b = T.coupling_column[t, 2], T.coupling_column[t, 3]
        k, c = T.coupling[t, 0], T.coupling[t, 1]
        f = k * (q[a] - q[b] - T.coupling[t, 2]) + c * (v[i] - v[j])
        W.force[i] += f
        W.force[j] -= f
        if tangent:
            W.k[i, i] += k
            W.k[j, j] += k
            W.k[i, j] -= k
            W.k[j, i] -= k
            W.c[i, i] += c
            W.c[j, j] += c
            W.c[i, j] -= c
            W.c[j, i] -= c
