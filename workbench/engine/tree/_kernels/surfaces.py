# mypy: ignore-errors
"""Contacts, tyres and struts between links, compiled, with slopes by complex step.

A law gives the wrench on link a, and the rates of its states, from the places and twists of both links.
The slopes of `members`, A by small motions of a and D by its twist, are the imaginary parts of the law at
a place or twist moved by i 1e-30: exact, whatever the law, at the price of 12 evaluations and one per state.
"""

from cmath import sqrt

from numba import njit
from numba.core import types
from numba.extending import overload

from ...compiler.held import only_with
from ...compiler.options import CAREFUL, INNER
from ...elements._kernels_called_states import POINTS, strut_at
from ...elements._kernels_contact import contact_force, distance
from ...elements._kernels_tyre import tyre
from .members import NEAR
from .motion import columns, places, twists

TYRE, STRUT = 9, 10
TINY = 1e-30


def of_kind(x, sample):
    """A complex number as it is, or its real part where `sample` is real."""
    return x if isinstance(sample, complex) else x.real


@overload(of_kind, jit_options=INNER)
def _of_kind(x, sample):
    return (lambda x, sample: x) if isinstance(sample, types.Complex) else (lambda x, sample: x.real)


@only_with("tyre")
def tyre_law(T, i, origin, A, pa, ta, x, out, some):
    """A tyre: f and arm in some[3], some[4], its moment in out[:3], the rates of its slips in out[6:]."""
    centre, v, w, f, arm, rates = some[0], some[1], some[2], some[3], some[4], some[5]
    v[0] = ta[3] + ta[1] * pa[2] - ta[2] * pa[1]
    v[1] = ta[4] + ta[2] * pa[0] - ta[0] * pa[2]
    v[2] = ta[5] + ta[0] * pa[1] - ta[1] * pa[0]
    for e in range(3):
        centre[e] = pa[e]
        w[e] = ta[e]
    tyre(T.surface_law[i], T.surface_shape[i], A, centre, origin, v, w, x[0], x[1], f, arm, rates)
    for e in range(3):
        out[e] = arm[3 + e]
        out[3 + e] = f[e]
    out[6] = rates[0]
    out[7] = rates[1]


@only_with("strut")
def strut_law(T, i, A, pa, ta, B, pb, tb, t, x, out, some):
    """A strut: f and arm in some[3], some[4], no moment of its own, the rates of its states in out[6:]."""
    row = T.surface_law[i]
    f, arm, other, line, own, found = some[3], some[4], some[0], some[1], some[2], some[5]
    for e in range(3):
        arm[e] = pa[e]
        other[e] = pb[e]
        for j in range(3):
            arm[e] += A[3 * e + j] * row[POINTS + j]
            other[e] += B[3 * e + j] * row[POINTS + 3 + j]
    square = 0.0 * arm[0] + NEAR
    for e in range(3):
        line[e] = arm[e] - other[e]
        square += line[e] * line[e]
    length = sqrt(square)
    line[3] = ta[3] + ta[1] * arm[2] - ta[2] * arm[1] - (tb[3] + tb[1] * other[2] - tb[2] * other[1])
    line[4] = ta[4] + ta[2] * arm[0] - ta[0] * arm[2] - (tb[4] + tb[2] * other[0] - tb[0] * other[2])
    line[5] = ta[5] + ta[0] * arm[1] - ta[1] * arm[0] - (tb[5] + tb[0] * other[1] - tb[1] * other[0])
    own[0] = length - row[POINTS + 6]
    own[1] = (line[0] * line[3] + line[1] * line[4] + line[2] * line[5]) / length
    for k in range(T.surface[i, 3]):
        own[2 + k] = x[k]
    strut_at(row, own, t.real, found)
    for e in range(3):
        f[e] = -found[0] * line[e] / length
        out[e] = 0.0 * f[e]
        out[3 + e] = f[e]
    for k in range(T.surface[i, 3]):
        out[6 + k] = found[1 + k]


@only_with("contact")
def contact_law(T, i, A, pa, ta, B, pb, tb, out, some):
    """A contact: f and arm in some[3], some[4], no moment of its own."""
    p, g = T.surface_law[i], T.surface_shape[i]
    point, r, n, v, f, arm = some[0], some[1], some[2], some[5], some[3], some[4]
    for e in range(3):
        point[e] = pa[e] + A[3 * e] * p[6] + A[3 * e + 1] * p[7] + A[3 * e + 2] * p[8]
    a, b, c = point[0] - pb[0], point[1] - pb[1], point[2] - pb[2]
    for e in range(3):
        r[e] = B[e] * a + B[3 + e] * b + B[6 + e] * c
    depth = p[9] - distance(T.surface[i, 2], g, r, v)
    for e in range(3):
        n[e] = B[3 * e] * v[0] + B[3 * e + 1] * v[1] + B[3 * e + 2] * v[2]
    for e in range(3):
        arm[e] = point[e] - p[9] * n[e]
    w0, w1, w2 = ta[0] - tb[0], ta[1] - tb[1], ta[2] - tb[2]
    v[0] = ta[3] - tb[3] + w1 * arm[2] - w2 * arm[1]
    v[1] = ta[4] - tb[4] + w2 * arm[0] - w0 * arm[2]
    v[2] = ta[5] - tb[5] + w0 * arm[1] - w1 * arm[0]
    contact_force(p, n, depth, v, f)
    for e in range(3):
        out[e] = 0.0 * f[e]
        out[3 + e] = f[e]


@njit(**INNER)
def surface_law(T, i, origin, A, pa, ta, B, pb, tb, t, x, out, some):
    """out (8,) = wrench on a about the origin and rates of up to two states; some (6, 9) scratch."""
    if T.surface[i, 2] == TYRE:
        tyre_law(T, i, origin, A, pa, ta, x, out, some)
    elif T.surface[i, 2] == STRUT:
        strut_law(T, i, A, pa, ta, B, pb, tb, t, x, out, some)
    else:
        contact_law(T, i, A, pa, ta, B, pb, tb, out, some)
    f, arm = some[3], some[4]
    out[0] += arm[1] * f[2] - arm[2] * f[1]
    out[1] += arm[2] * f[0] - arm[0] * f[2]
    out[2] += arm[0] * f[1] - arm[1] * f[0]


@njit(**INNER)
def surface_start(T, W, i, x, A, pa, ta, own):
    """Place and twist of a surface's link a, and its states, as complex numbers; the laws are compiled for
    those alone."""
    a, state = T.pair[T.surface[i, 0], 0], T.surface[i, 1]
    for e in range(9):
        A[e] = W.turn[a, e]
    for e in range(3):
        pa[e] = W.place[a, e]
    for e in range(6):
        ta[e] = W.twist[a, e]
    for k in range(T.surface[i, 3]):
        own[k] = x[state + k]


@only_with("surface")
def surface_forces(T, W, step, x):
    """Add every contact and tyre to W.pair_force; rates of states into W.force."""
    n = T.column.shape[0]
    Z = W.complex
    A, pa, ta, own, out, some = Z[0, 0], Z[0, 1], Z[0, 2], Z[0, 3], Z[0, 4], Z[1]
    t = T.times[step]
    for i in range(T.surface.shape[0]):
        pair, state = T.surface[i, 0], T.surface[i, 1]
        b = T.pair[pair, 1]
        surface_start(T, W, i, x, A, pa, ta, own)
        surface_law(T, i, W.origin, A, pa, ta, W.turn[b], W.place[b], W.twist[b], t, own, out, some)
        for e in range(6):
            W.pair_force[pair, e] += of_kind(out[e], W.origin[0])
        for k in range(T.surface[i, 3]):
            W.force[n + state + k] = -of_kind(out[6 + k], W.origin[0])


@only_with("surface")
def surface_slopes(T, W, step, x):
    """Add the slopes of every contact and tyre to W.pair_k, W.pair_c, and those of their states to K and
    C."""
    n = T.column.shape[0]
    Z = W.complex
    A, pa, ta, own, out, some = Z[0, 0], Z[0, 1], Z[0, 2], Z[0, 3], Z[0, 4], Z[1]
    t = T.times[step]
    for i in range(T.surface.shape[0]):
        pair, state = T.surface[i, 0], T.surface[i, 1]
        b = T.pair[pair, 1]
        if state < 0:
            surface_start(T, W, i, x, A, pa, ta, own)
            surface_law(T, i, W.origin, A, pa, ta, W.turn[b], W.place[b], W.twist[b], t, own, out, some)
            if out[3].real == 0.0 and out[4].real == 0.0 and out[5].real == 0.0:
                continue  # out of touch: the law is flat there
        R, p = W.turn[T.pair[pair, 0]], W.place[T.pair[pair, 0]]
        for j in range(12 + T.surface[i, 3]):
            surface_start(T, W, i, x, A, pa, ta, own)
            if j < 3:  # a turn about axis j
                u, v = (j + 1) % 3, (j + 2) % 3
                for e in range(3):
                    A[3 * u + e] = R[3 * u + e] - 1j * TINY * R[3 * v + e]
                    A[3 * v + e] = R[3 * v + e] + 1j * TINY * R[3 * u + e]
                pa[u] = p[u] - 1j * TINY * p[v]
                pa[v] = p[v] + 1j * TINY * p[u]
            elif j < 6:
                pa[j - 3] += 1j * TINY
            elif j < 12:
                ta[j - 6] += 1j * TINY
            else:
                own[j - 12] += 1j * TINY
            surface_law(T, i, W.origin, A, pa, ta, W.turn[b], W.place[b], W.twist[b], t, own, out, some)
            for e in range(6):
                slope = out[e].imag / TINY
                if j < 6:
                    W.pair_k[pair, 6 * e + j] += slope
                elif j < 12:
                    W.pair_c[pair, 6 * e + j - 6] += slope
                else:
                    W.surface[3, j - 12, e] = slope
            if state >= 0:
                W.surface[4, j // 7, j % 7] = out[6].imag / TINY
                W.surface[5, j // 7, j % 7] = out[7].imag / TINY
        if state >= 0:
            state_rows(T, W, pair, n + state, T.surface[i, 3])


@only_with("tyre", "strut")
def state_rows(T, W, pair, row, states):
    """K and C of a surface's states, from W.surface: wrench by state (3), rates by place, twist and states
    (4, 5)."""
    va = W.twist[T.pair[pair, 0]]
    for g in range(states):
        D = W.surface[4 + g]  # entry j of place, twist, slips stands at [j // 7, j % 7]
        for h in range(states):
            W.c[row + g, row + h] = -D[(12 + h) // 7, (12 + h) % 7]
        for i in range(T.pair[pair, 2], T.pair[pair, 3]):
            j, sign = T.path[i, 0], T.path[i, 1]
            s, psi = W.s[j], W.psi1[j]
            by_place = 0.0 * s[0]
            by_twist = 0.0 * s[0]
            drift = W.surface[6, 0]
            drift[0] = s[1] * va[2] - s[2] * va[1]
            drift[1] = s[2] * va[0] - s[0] * va[2]
            drift[2] = s[0] * va[1] - s[1] * va[0]
            drift[3] = s[1] * va[5] - s[2] * va[4] + s[4] * va[2] - s[5] * va[1]
            drift[4] = s[2] * va[3] - s[0] * va[5] + s[5] * va[0] - s[3] * va[2]
            drift[5] = s[0] * va[4] - s[1] * va[3] + s[3] * va[1] - s[4] * va[0]
            force = 0.0 * s[0]
            for e in range(6):
                t = 6 + e
                by_place += D[e // 7, e % 7] * s[e] + D[t // 7, t % 7] * (drift[e] + psi[e])
                by_twist += D[t // 7, t % 7] * s[e]
                force += W.surface[3, g, e] * s[e]
            W.k[row + g, j] = -sign * by_place
            W.c[row + g, j] = -sign * by_twist
            W.c[j, row + g] = -sign * force


@njit(**CAREFUL)
def surface_histories(T, W, q, v, w, n, force, point):
    """Force on link a, and its place in global axes, (nodes, K, 3) each; n velocities of joints."""
    for node in range(q.shape[0]):
        places(T, W, node, q[node])
        columns(T, W)
        twists(T, W, node, v[node], w[node])
        at_node(T, W, node, v[node, n:], force[node], point[node])


@only_with("surface")
def at_node(T, W, step, x, force, point):
    """Forces and places of all surfaces at one node."""
    Z = W.complex
    A, pa, ta, own, out, some = Z[0, 0], Z[0, 1], Z[0, 2], Z[0, 3], Z[0, 4], Z[1]
    t = T.times[step]
    for i in range(T.surface.shape[0]):
        b = T.pair[T.surface[i, 0], 1]
        surface_start(T, W, i, x, A, pa, ta, own)
        surface_law(T, i, W.origin, A, pa, ta, W.turn[b], W.place[b], W.twist[b], t, own, out, some)
        for e in range(3):
            force[i, e] = some[3, e].real
            point[i, e] = some[4, e].real + W.origin[e]
