# mypy: ignore-errors
"""Mass matrix and slopes of the joint forces by coordinates and velocities, compiled: of the links' motion,
and of the wrenches between links.

A small turn along column S_j moves everything behind its joint rigidly. Seen from there, the twist of the
parent p has changed by psi1 = v_p x S_j and its acceleration by psi2 = a_p x S_j + v_p x psi1, so with sums I
and B over the subtree of the deeper of the two joints (after Singh, Russell & Wensing, IEEE RA-L 7, 2022, and
Carpentier & Mansard, RSS 2018)

    dtau_k/dq_j  = S_k . (I psi2 + B psi1)            + S_k . (S_j x* F_j) where k stands before j
    dtau_k/dqd_j = S_k . (I (psi1 + v_j x S_j) + B S_j)
    M_kj         = S_k . I S_j
    B x = -I (v x x) + x x* I v + v x* I x            per link

B sees the rotation part of x alone: B x = (N a; -2 p x a), p the linear momentum.

Between links: a column j that moves a alone has sign s = +1 in the pair's path, one that moves b alone -1;
one that moves both is not in the path and feels nothing. With y_j = A S_j + D (S_j x v_a + psi1_j) and
x_j = S_j x* W,

    dr_k/dqd_j = -s_k s_j S_k . D S_j,   dr_k/dq_j = -s_k s_j S_k . (y_j - n_kj x_j)

where n is 1 for two columns of a, j not behind k; 1 for two of b, j behind k; 1 where k moves a and j
moves b; else 0. A path holds the columns of a, then those of b, each from the ground outwards. What belongs
to its columns stands in six rows, one for each component: the loops over them become vectors.
"""

from numba import njit

from ...compiler.held import only_with
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
    m0, c0, k0, tmp, w1, sum1 = W.some[0], W.some[1], W.some[2], W.some[3], W.small[0, 0], W.some[3, 6:]
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


@only_with("pair")
def pull_back(T, W):
    """Add the slopes of all pairs to K and C."""
    s, turned, x, y, z = W.path[0], W.path[1], W.path[2], W.path[3], W.path[4]
    by_q, by_v = W.path[5, 0], W.path[5, 1]
    for pair in range(T.pair.shape[0]):
        first, count = T.pair[pair, 2], T.pair[pair, 3] - T.pair[pair, 2]
        none = 0 * count  # a value: with a literal, functions would be compiled once more
        of_a = gather(T, W, pair, s, turned, x)
        by_place_and_twist(W.pair_k[pair], W.pair_c[pair], s, turned, none, count, y, z)
        for m in range(count):
            k, sign = T.path[first + m, 0], T.path[first + m, 1]
            behind = m + 1
            while behind < count and T.column[T.path[first + behind, 0], 0] == T.column[k, 0]:
                behind += 1  # columns of one link stand behind none of each other
            work(W.s[k], y, count, by_q)
            work(W.s[k], z, count, by_v)
            if m < of_a:
                add_work(W.s[k], x, none, behind, by_q)
                add_work(W.s[k], x, of_a, count, by_q)
            else:
                add_work(W.s[k], x, behind, count, by_q)
            for i in range(count):
                j = T.path[first + i, 0]
                W.k[k, j] -= sign * by_q[i]
                W.c[k, j] -= sign * by_v[i]


@njit(**INNER)
def gather(T, W, pair, s, turned, x):
    """s_j S_j, s_j (S_j x v_a + psi1_j) and -s_j x_j of a path; returns how many columns move a."""
    first, last, va = T.pair[pair, 2], T.pair[pair, 3], W.twist[T.pair[pair, 0]]
    some, of_a = W.some[0], 0
    for i in range(last - first):
        j, sign = T.path[first + i, 0], T.path[first + i, 1]
        cross_motion(W.s[j], va, some)
        for e in range(6):
            s[e, i] = sign * W.s[j, e]
            turned[e, i] = sign * (some[e] + W.psi1[j, e])
        cross_force(W.s[j], W.pair_force[pair], some)
        for e in range(6):
            x[e, i] = -sign * some[e]
        if sign > 0:
            of_a += 1
    return of_a


@njit(**INNER)
def by_place_and_twist(A, D, s, turned, none, count, y, z):
    """y = A s + D turned and z = D s of the columns of a path."""
    for e in range(6):
        work(A[6 * e : 6 * e + 6], s, count, y[e])
        work(D[6 * e : 6 * e + 6], s, count, z[e])
        add_work(D[6 * e : 6 * e + 6], turned, none, count, y[e])


@njit(**INNER)
def work(t, rows, count, out):
    """out = t . every column of six rows."""
    a, b, c, d, e, f = t[0], t[1], t[2], t[3], t[4], t[5]
    u, v, w, x, y, z = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    for i in range(count):
        out[i] = a * u[i] + b * v[i] + c * w[i] + d * x[i] + e * y[i] + f * z[i]


@njit(**INNER)
def add_work(t, rows, first, last, out):
    """out += t . some columns of six rows."""
    a, b, c, d, e, f = t[0], t[1], t[2], t[3], t[4], t[5]
    u, v, w, x, y, z = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    for i in range(first, last):
        out[i] += a * u[i] + b * v[i] + c * w[i] + d * x[i] + e * y[i] + f * z[i]
