# mypy: ignore-errors
"""Mass matrix and slopes of the joint forces by coordinates and velocities, compiled.

A small turn along column S_j moves everything behind its joint rigidly. Seen from there, the twist of the
parent p has changed by psi1 = v_p x S_j and its acceleration by psi2 = a_p x S_j + v_p x psi1, so with sums I
and B over the subtree of the deeper of the two joints (after Singh, Russell & Wensing, IEEE RA-L 7, 2022, and
Carpentier & Mansard, RSS 2018)

    dtau_k/dq_j  = S_k . (I psi2 + B psi1)            + S_k . (S_j x* F_j) where k stands before j
    dtau_k/dqd_j = S_k . (I (psi1 + v_j x S_j) + B S_j)
    M_kj         = S_k . I S_j
    B x = -I (v x x) + x x* I v + v x* I x            per link

B sees the rotation part of x alone: B x = (N a; -2 p x a), p the linear momentum.
"""

from numba import njit

from ...compiler.options import INNER
from .motion import cross_force, cross_motion, dot6, inertia_times

DRIVEN = 0


@njit(**INNER)
def velocity_part(J, v, out):
    """out (12,) = N by rows and p: N = w^ I - I w^ - (I w)^ - 2 h^ u^, p = m u - h x w."""
    a, b, c, u, s, t = v[0], v[1], v[2], v[3], v[4], v[5]
    x, y, z = J[1], J[2], J[3]
    xx, yy, zz, xy, xz, yz = J[4], J[5], J[6], J[7], J[8], J[9]
    n0 = xx * a + xy * b + xz * c
    n1 = xy * a + yy * b + yz * c
    n2 = xz * a + yz * b + zz * c
    # w^ I - I w^ is symmetric: both products of a skew and a symmetric matrix, transposed into one another
    s00 = 2.0 * (b * xz - c * xy)
    s11 = 2.0 * (c * xy - a * yz)
    s22 = 2.0 * (a * yz - b * xz)
    s01 = b * yz - c * yy + (xx * c - xz * a)
    s02 = b * zz - c * yz - (xx * b - xy * a)
    s12 = c * xz - a * zz - (xy * b - yy * a)
    # h^ u^ = u h^T - (h . u)
    g = x * u + y * s + z * t
    out[0] = s00 - 2.0 * (u * x - g)
    out[1] = s01 + n2 - 2.0 * u * y
    out[2] = s02 - n1 - 2.0 * u * z
    out[3] = s01 - n2 - 2.0 * s * x
    out[4] = s11 - 2.0 * (s * y - g)
    out[5] = s12 + n0 - 2.0 * s * z
    out[6] = s02 + n1 - 2.0 * t * x
    out[7] = s12 - n0 - 2.0 * t * y
    out[8] = s22 - 2.0 * (t * z - g)
    m = J[0]
    out[9] = m * u - (y * c - z * b)
    out[10] = m * s - (z * a - x * c)
    out[11] = m * t - (x * b - y * a)


@njit(**INNER)
def column_rates(T, W):
    """psi1, psi2 and the rate of every column."""
    one, two = W.some[0], W.some[1]
    for l in range(T.link.shape[0]):
        parent = T.link[l, 1]
        for j in range(T.link[l, 2], T.link[l, 2] + T.link[l, 3]):
            cross_motion(W.twist[parent], W.s[j], W.psi1[j])
            cross_motion(W.push[parent], W.s[j], one)
            cross_motion(W.twist[parent], W.psi1[j], two)
            for e in range(6):
                W.psi2[j, e] = one[e] + two[e]
            cross_motion(W.twist[l], W.s[j], W.sdot[j])


@njit(**INNER)
def subtree_sums(T, W):
    """Inertia and velocity part of every subtree, in W.body and W.gyro."""
    links = T.link.shape[0]
    for l in range(links):
        velocity_part(W.body[l], W.twist[l], W.gyro[l])
    for l in range(links - 1, -1, -1):
        parent = T.link[l, 1]
        if parent < links:
            for e in range(10):
                W.body[parent, e] += W.body[l, e]
            for e in range(12):
                W.gyro[parent, e] += W.gyro[l, e]


@njit(**INNER)
def add_velocity_part(N, a, out):
    """out += B a, N (12,) of `velocity_part`."""
    x, y, z = a[0], a[1], a[2]
    out[0] += N[0] * x + N[1] * y + N[2] * z
    out[1] += N[3] * x + N[4] * y + N[5] * z
    out[2] += N[6] * x + N[7] * y + N[8] * z
    out[3] -= 2.0 * (N[10] * z - N[11] * y)
    out[4] -= 2.0 * (N[11] * x - N[9] * z)
    out[5] -= 2.0 * (N[9] * y - N[10] * x)


@njit(**INNER)
def motion_tangents(T, W):
    """Fill M, K, C (n, n of the joints) from `W.wrench` of the subtrees and the links' inertias."""
    links = T.link.shape[0]
    column_rates(T, W)
    subtree_sums(T, W)
    m0, c0, k0, tmp, w1, sum1 = W.some[0], W.some[1], W.some[2], W.some[3], W.small[0, 0], W.path_k[0]
    for l in range(links):
        J, N = W.body[l], W.gyro[l]
        first, count = T.link[l, 2], T.link[l, 3]
        for j in range(first, first + count):
            s, psi1, psi2, sdot = W.s[j], W.psi1[j], W.psi2[j], W.sdot[j]
            inertia_times(J, s, m0)
            for e in range(6):
                sum1[e] = psi1[e] + sdot[e]
            inertia_times(J, sum1, c0)
            add_velocity_part(N, s, c0)
            inertia_times(J, psi2, k0)
            add_velocity_part(N, psi1, k0)
            cross_force(s, W.wrench[l], tmp)
            for e in range(6):
                k0[e] += tmp[e]
            # S_j . B x = x . w1 for the rotation part of x
            w1[0] = N[0] * s[0] + N[3] * s[1] + N[6] * s[2] + 2.0 * (N[10] * s[5] - N[11] * s[4])
            w1[1] = N[1] * s[0] + N[4] * s[1] + N[7] * s[2] + 2.0 * (N[11] * s[3] - N[9] * s[5])
            w1[2] = N[2] * s[0] + N[5] * s[1] + N[8] * s[2] + 2.0 * (N[9] * s[4] - N[10] * s[3])
            for i in range(first, first + count):  # one joint: everything behind it turns
                t = W.s[i]
                W.m[j, i] = dot6(m0, t)
                W.k[j, i] = dot6(m0, W.psi2[i]) + dot3(w1, W.psi1[i])
                W.c[j, i] = dot6(m0, W.psi1[i]) + dot6(m0, W.sdot[i]) + dot3(w1, t)
            p = T.link[l, 1]
            while p < links:
                begin, some = T.link[p, 2], T.link[p, 3]
                for i in range(begin, begin + some):
                    t = W.s[i]
                    mass = dot6(m0, t)
                    W.m[i, j] = mass
                    W.m[j, i] = mass
                    W.c[i, j] = dot6(c0, t)
                    W.k[i, j] = dot6(k0, t)
                    W.k[j, i] = dot6(m0, W.psi2[i]) + dot3(w1, W.psi1[i])
                    W.c[j, i] = dot6(m0, W.psi1[i]) + dot6(m0, W.sdot[i]) + dot3(w1, t)
                p = T.link[p, 1]


@njit(**INNER)
def dot3(a, b):
    """a . b of the rotation parts."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INNER)
def motion_mass(T, W):
    """Fill M alone; the composite rigid bodies of Featherstone 2008, chapter 6."""
    links = T.link.shape[0]
    for l in range(links - 1, -1, -1):
        parent = T.link[l, 1]
        if parent < links:
            for e in range(10):
                W.body[parent, e] += W.body[l, e]
    m0 = W.some[0]
    for l in range(links):
        first, count = T.link[l, 2], T.link[l, 3]
        for j in range(first, first + count):
            inertia_times(W.body[l], W.s[j], m0)
            for i in range(first, first + count):
                W.m[j, i] = dot6(m0, W.s[i])
            p = T.link[l, 1]
            while p < links:
                for i in range(T.link[p, 2], T.link[p, 2] + T.link[p, 3]):
                    mass = dot6(m0, W.s[i])
                    W.m[i, j] = mass
                    W.m[j, i] = mass
                p = T.link[p, 1]
