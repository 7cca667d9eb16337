# mypy: ignore-errors
"""Conditions of cut joints, compiled: one row each, with a multiplier behind the states in `w`.

Seen from b, a row is a function phi of the place of a, and the wrench y of a unit multiplier its slope:

    point     phi = e . (p - s),   y = (p x e; e)        p on a, s and direction e on b
    turn      phi = n . e,         y = (n x e; 0)        direction n on a
    distance  phi = |p - s| - L,   y = (s x u; u)        u = (p - s)/|p - s|

The residual of the joints gains sum y lambda. The row itself stands for phi = 0, times the number
closing[step], so that M and h^2 b c K meet symmetrically; for phi'' = 0 where that is 0, phi' = 0 where it is
below 0.
"""

from numba import njit
from numpy import sqrt

from ...compiler.held import only_with
from ...compiler.options import INNER
from .members import add_lever, add_point_force, add_point_slope
from .motion import dot6
from .rotations import turned

POINT, TURN, DISTANCE = 0, 1, 2


@njit(**INNER)
def cross3(a, b, out):
    """out = a x b."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(**INNER)
def inner3(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INNER)
def ends(T, W, c, p, s, e):
    """Point or direction on a, point and direction on b, in global axes, points less the origin."""
    pair = T.cut[c, 0]
    a, b = T.pair[pair, 0], T.pair[pair, 1]
    turned(W.turn[a], T.cut_place[c], p)
    turned(W.turn[b], T.cut_place[c, 3:], s)
    turned(W.turn[b], T.cut_place[c, 6:], e)
    for i in range(3):
        s[i] += W.place[b, i]
        if T.cut[c, 1] != TURN:
            p[i] += W.place[a, i]


@njit(**INNER)
def unit_wrench(T, W, c, y):
    """y (6,) of a row; returns phi. Leaves the ends, u among them, in W.cut[0..2] and p - s in W.cut[3]."""
    p, s, e, d = W.cut[0], W.cut[1], W.cut[2], W.cut[3]
    ends(T, W, c, p, s, e)
    for i in range(6):
        y[i] = 0.0
    if T.cut[c, 1] == TURN:
        cross3(p, e, y)
        return inner3(p, e)
    for i in range(3):
        d[i] = p[i] - s[i]
    if T.cut[c, 1] == POINT:
        add_point_force(y, p, e)
        return inner3(d, e)
    length = sqrt(inner3(d, d))
    for i in range(3):
        e[i] = d[i] / length
    add_point_force(y, s, e)
    return length - T.cut_place[c, 9]


@njit(**INNER)
def carried(W, l, p, speed, push):
    """Velocity and acceleration of the point p of link l, gravity as an acceleration of the ground."""
    v, a, some = W.twist[l], W.push[l], W.cut[4]
    cross3(v, p, speed)
    for i in range(3):
        speed[i] += v[3 + i]
    cross3(a, p, push)
    cross3(v, speed, some)
    for i in range(3):
        push[i] += a[3 + i] + some[i]


@njit(**INNER)
def turning(W, l, n, rate, push):
    """First and second rate of the direction n of link l."""
    v, a, some = W.twist[l], W.push[l], W.cut[4]
    cross3(v, n, rate)
    cross3(a, n, push)
    cross3(v, rate, some)
    for i in range(3):
        push[i] += some[i]


@njit(**INNER)
def condition_rates(T, W, c, phi):
    """phi' and phi'' after `unit_wrench`."""
    pair = T.cut[c, 0]
    a, b = T.pair[pair, 0], T.pair[pair, 1]
    p, s, e, d = W.cut[0], W.cut[1], W.cut[2], W.cut[3]
    dp, ddp, de, dde, ds, dds = W.cut[5], W.cut[6], W.cut[7], W.cut[8], W.cut[9], W.cut[10]
    turning(W, b, e, de, dde)
    if T.cut[c, 1] == TURN:
        turning(W, a, p, dp, ddp)
        return inner3(dp, e) + inner3(p, de), inner3(ddp, e) + 2.0 * inner3(dp, de) + inner3(p, dde)
    carried(W, a, p, dp, ddp)
    carried(W, b, s, ds, dds)
    for i in range(3):
        dp[i] -= ds[i]
        ddp[i] -= dds[i]
    if T.cut[c, 1] == POINT:
        first = inner3(dp, e) + inner3(d, de)
        return first, inner3(ddp, e) + 2.0 * inner3(dp, de) + inner3(d, dde)
    first = inner3(dp, e)
    length = phi + T.cut_place[c, 9]
    return first, inner3(ddp, e) + (inner3(dp, dp) - first * first) / length


@only_with("cut")
def cut_forces(T, W, step, w):
    """Forces of the multipliers into their pairs, and the rows of the conditions into W.force."""
    y = W.some[3]
    first = w.shape[0] - T.cut.shape[0]
    for c in range(T.cut.shape[0]):
        phi = unit_wrench(T, W, c, y)
        for e in range(6):
            W.pair_force[T.cut[c, 0], e] -= w[first + c] * y[e]
        level = T.closing[step].real
        if level > 0.0:
            W.force[first + c] = level * phi
        else:
            rate, second = condition_rates(T, W, c, phi)
            W.force[first + c] = second if level == 0.0 else rate


@only_with("cut")
def cut_slopes(T, W, step, w):
    """Slopes of the forces into the pairs, and the entries of the conditions in M and K.

    Slopes of phi' and phi'' by places and velocities are left out; see `tree.closing`.
    """
    y, G = W.some[3], W.small[0]
    first = w.shape[0] - T.cut.shape[0]
    for c in range(T.cut.shape[0]):
        unit_wrench(T, W, c, y)
        pair, row, force = T.cut[c, 0], first + c, w[first + c]
        p, s, e, A = W.cut[0], W.cut[1], W.cut[2], W.pair_k[pair]
        if T.cut[c, 1] == POINT:
            add_lever(A, p[0], p[1], p[2], -force * e[0], -force * e[1], -force * e[2])
        elif T.cut[c, 1] == TURN:  # d(n x e) = (t x n) x e = n (e . t) - (n . e) t for a turn t
            for i in range(3):
                for j in range(3):
                    A[6 * i + j] -= force * p[i] * e[j]
                A[7 * i] += force * inner3(p, e)
        else:
            by = force / sqrt(inner3(W.cut[3], W.cut[3]))
            for i in range(3):
                for j in range(3):
                    G[i, j] = -by * e[i] * e[j]
                G[i, i] += by
            add_point_slope(A, G, p[0], p[1], p[2], s[0], s[1], s[2])
        level = T.closing[step].real
        for i in range(T.pair[pair, 2], T.pair[pair, 3]):
            j = T.path[i, 0]
            along = T.path[i, 1] * dot6(W.s[j], y)
            W.m[j, row] = along
            W.m[row, j] = along if level <= 0.0 else 0.0
            W.k[row, j] = level * along if level > 0.0 else 0.0
