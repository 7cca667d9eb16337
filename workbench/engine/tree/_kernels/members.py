# mypy: ignore-errors
"""Members of a tree, compiled: lengths, forces, and their sums per pair of links as wrenches with slopes.

A pair's wrench on link a about the common origin answers to small motions of a, b held, and to its twist:
dW = A dx + D dv. A member from r_a to r_b with tension f along u pulls with w = -f u, and since its line
passes through both points, W = (r_b x w; w): only w changes with the place of a.
"""

from numba import njit
from numpy import sqrt

from ...compiler.held import only_with
from ...compiler.options import INNER
from ...elements._kernels_laws import held_laws
from ...elements.spring import forces as springs
from ...elements.table import code_of

SPRING = code_of("Spring")
NEAR = 1e-20  # m^2: a member of no length has a direction all the same


@njit(**INNER)
def measure_members(T, W, step):
    """Elongations, rates and lines of all members, then the laws at unit density."""
    for g in range(T.segment.shape[0]):
        pair, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        a, b = T.pair[pair, 0], T.pair[pair, 1]
        A, B, p, q, v, w = W.turn[a], W.turn[b], W.place[a], W.place[b], W.twist[a], W.twist[b]
        for i in range(first, last):
            x, y, z = T.geometry[0, i], T.geometry[1, i], T.geometry[2, i]
            ax = p[0] + A[0] * x + A[1] * y + A[2] * z
            ay = p[1] + A[3] * x + A[4] * y + A[5] * z
            az = p[2] + A[6] * x + A[7] * y + A[8] * z
            x, y, z = T.geometry[3, i], T.geometry[4, i], T.geometry[5, i]
            bx = q[0] + B[0] * x + B[1] * y + B[2] * z
            by = q[1] + B[3] * x + B[4] * y + B[5] * z
            bz = q[2] + B[6] * x + B[7] * y + B[8] * z
            dx, dy, dz = ax - bx, ay - by, az - bz
            length = sqrt(dx * dx + dy * dy + dz * dz + NEAR)
            inverse = 1.0 / length
            gx = v[3] + v[1] * az - v[2] * ay - (w[3] + w[1] * bz - w[2] * by)
            gy = v[4] + v[2] * ax - v[0] * az - (w[4] + w[2] * bx - w[0] * bz)
            gz = v[5] + v[0] * ay - v[1] * ax - (w[5] + w[0] * by - w[1] * bx)
            ux, uy, uz = dx * inverse, dy * inverse, dz * inverse
            line = W.line[i]
            line[0] = ax
            line[1] = ay
            line[2] = az
            line[3] = bx
            line[4] = by
            line[5] = bz
            line[6] = ux
            line[7] = uy
            line[8] = uz
            W.delta[i] = length - T.geometry[6, i]
            W.rate[i] = ux * gx + uy * gy + uz * gz
        unit_forces(T, W, code, first, last, W.rate, T.times[step])


@njit(**INNER)
def unit_forces(T, W, code, first, last, rate, t):
    """W.f, W.fd and W.fv of some members of one law at unit density."""
    if code == SPRING:
        springs(T.law, first, last, W.delta, rate, t, W.f, W.fd, W.fv)
    else:
        other_forces(T, W, code, first, last, rate, t)


@only_with("other_law")
def other_forces(T, W, code, first, last, rate, t):
    """`unit_forces` of other laws than springs."""
    held_laws(T.other_law, code, T.law, first, last, W.delta, rate, t, W.f, W.fd, W.fv)


@njit(**INNER)
def add_member_forces(T, W):
    """Sum the members of every pair into W.pair_force."""
    for g in range(T.segment.shape[0]):
        total = W.pair_force[T.segment[g, 0]]
        m0, m1, m2 = total[0], total[1], total[2]
        f0, f1, f2 = total[3], total[4], total[5]
        for i in range(T.segment[g, 2], T.segment[g, 3]):
            line = W.line[i]
            f = -T.scale[i] * W.f[i]
            x, y, z = f * line[6], f * line[7], f * line[8]
            f0 += x
            f1 += y
            f2 += z
            m0 += line[4] * z - line[5] * y
            m1 += line[5] * x - line[3] * z
            m2 += line[3] * y - line[4] * x
        total[0] = m0
        total[1] = m1
        total[2] = m2
        total[3] = f0
        total[4] = f1
        total[5] = f2


@njit(**INNER)
def add_member_slopes(T, W):
    """Sum A and D of the members of every pair into W.pair_k and W.pair_c."""
    G, e = W.small[2], W.some[0]
    for g in range(T.segment.shape[0]):
        pair = T.segment[g, 0]
        A, D = W.pair_k[pair], W.pair_c[pair]
        va, vb = W.twist[T.pair[pair, 0]], W.twist[T.pair[pair, 1]]
        for i in range(T.segment[g, 2], T.segment[g, 3]):
            line, scale = W.line[i], T.scale[i]
            f, fd, fv = scale * W.f[i], scale * W.fd[i], scale * W.fv[i]
            if f == 0.0 and fd == 0.0 and fv == 0.0:
                continue
            ax, ay, az, bx, by, bz = line[0], line[1], line[2], line[3], line[4], line[5]
            ux, uy, uz = line[6], line[7], line[8]
            dx, dy, dz = ax - bx, ay - by, az - bz
            inverse = 1.0 / sqrt(dx * dx + dy * dy + dz * dz + NEAR)
            # slope of the tension by the place of a
            hx, hy, hz = fd * ux, fd * uy, fd * uz
            if fv != 0.0:
                gx = va[3] + va[1] * az - va[2] * ay - (vb[3] + vb[1] * bz - vb[2] * by)
                gy = va[4] + va[2] * ax - va[0] * az - (vb[4] + vb[2] * bx - vb[0] * bz)
                gz = va[5] + va[0] * ay - va[1] * ax - (vb[5] + vb[0] * by - vb[1] * bx)
                along = W.rate[i]
                hx += fv * ((gx - along * ux) * inverse + uy * va[2] - uz * va[1])
                hy += fv * ((gy - along * uy) * inverse + uz * va[0] - ux * va[2])
                hz += fv * ((gz - along * uz) * inverse + ux * va[1] - uy * va[0])
                e[0] = ay * uz - az * uy
                e[1] = az * ux - ax * uz
                e[2] = ax * uy - ay * ux
                e[3] = ux
                e[4] = uy
                e[5] = uz
                add_outer(D, -fv, e)
            r = f * inverse
            G[0, 0] = ux * hx + r * (1.0 - ux * ux)
            G[0, 1] = ux * hy - r * ux * uy
            G[0, 2] = ux * hz - r * ux * uz
            G[1, 0] = uy * hx - r * uy * ux
            G[1, 1] = uy * hy + r * (1.0 - uy * uy)
            G[1, 2] = uy * hz - r * uy * uz
            G[2, 0] = uz * hx - r * uz * ux
            G[2, 1] = uz * hy - r * uz * uy
            G[2, 2] = uz * hz + r * (1.0 - uz * uz)
            add_point_slope(A, G, ax, ay, az, bx, by, bz)


@njit(**INNER)
def add_outer(D, s, x):
    """D (36,) += s x x^T, x (6,)."""
    for i in range(6):
        by = s * x[i]
        for j in range(6):
            D[6 * i + j] += by * x[j]


@njit(**INNER)
def add_point_slope(A, G, ax, ay, az, bx, by, bz):
    """A (36,) += [b x; 1] (-G) [-a^, 1]: the force -G dr at b answers to the motion of a point at a."""
    for j in range(6):
        if j < 3:  # a turn moves the point by e_j x a
            if j == 0:
                x, y, z = 0.0 * ax, -az, ay
            elif j == 1:
                x, y, z = az, 0.0 * ax, -ax
            else:
                x, y, z = -ay, ax, 0.0 * ax
            p = -(G[0, 0] * x + G[0, 1] * y + G[0, 2] * z)
            q = -(G[1, 0] * x + G[1, 1] * y + G[1, 2] * z)
            r = -(G[2, 0] * x + G[2, 1] * y + G[2, 2] * z)
        else:
            p, q, r = -G[0, j - 3], -G[1, j - 3], -G[2, j - 3]
        A[j] += by * r - bz * q
        A[6 + j] += bz * p - bx * r
        A[12 + j] += bx * q - by * p
        A[18 + j] += p
        A[24 + j] += q
        A[30 + j] += r


@njit(**INNER)
def add_lever(A, px, py, pz, x, y, z):
    """A (36,) += the moment dr x w of a force w whose point moves by dr = s + e x p."""
    # dr x w: s part -w^, e part (e x p) x w = p (e . w) - e (p . w)
    dot = px * x + py * y + pz * z
    A[0] += px * x - dot
    A[1] += px * y
    A[2] += px * z
    A[6] += py * x
    A[7] += py * y - dot
    A[8] += py * z
    A[12] += pz * x
    A[13] += pz * y
    A[14] += pz * z - dot
    A[4] += z
    A[5] -= y
    A[9] -= z
    A[11] += x
    A[15] += y
    A[16] -= x


@njit(**INNER)
def add_point_force(total, p, w):
    """total += (p x w; w)."""
    total[0] += p[1] * w[2] - p[2] * w[1]
    total[1] += p[2] * w[0] - p[0] * w[2]
    total[2] += p[0] * w[1] - p[1] * w[0]
    total[3] += w[0]
    total[4] += w[1]
    total[5] += w[2]
