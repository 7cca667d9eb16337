# mypy: ignore-errors
"""Member sweeps, compiled: all deviations, forces, rows of B and tangents of one segment at once.

A segment holds members with one law between one pair of bodies. Everything is written in the pair's
coordinates X = (x, y, theta): the position of body 1 seen from body 2, x = A2^T (p1 - p2), and the angle
theta = theta1 - theta2; U = dX/dt. For a member with end points s1, s2 (body frames)

    a = R(theta) s1,  d = a + x - s2,  l = sqrt(d.d + o^2),  delta = l - l0,  e = d/l
    b = d delta/dX = (ex, ey, ax ey - ay ex),  rate = b.U,  the row of B (2.22) is -b mapped to the bodies

o is a constant out-of-plane offset, floored so that coincident end points give b = 0 instead of NaN.
F = sum s f b and its derivatives K = dF/dX, C = dF/dU are sums over 3 x 3; s is alpha^power.
"""

from numba import njit
from numpy import cos, sin, sqrt

from ...compiler.options import INNER


@njit(**INNER)
def springs_force(geo, k, scale, first, last, x, y, th, out):
    """Undamped linear springs, force only: out (3,) += F. One square root per member."""
    c, s = cos(th), sin(th)
    s1x, s1y, s2x, s2y = geo[0, first:last], geo[1, first:last], geo[2, first:last], geo[3, first:last]
    o2, l0 = geo[4, first:last], geo[5, first:last]
    kk, sc = k[first:last], scale[first:last]
    fx, fy, ft = 0.0 * x, 0.0 * x, 0.0 * x
    for i in range(last - first):
        ax = c * s1x[i] - s * s1y[i]
        ay = s * s1x[i] + c * s1y[i]
        dx = ax + x - s2x[i]
        dy = ay + y - s2y[i]
        r = 1.0 / sqrt(dx * dx + dy * dy + o2[i])
        g = kk[i] * sc[i] * (1.0 - l0[i] * r)
        gx = g * dx
        gy = g * dy
        fx += gx
        fy += gy
        ft += ax * gy - ay * gx
    out[0] += fx
    out[1] += fy
    out[2] += ft


@njit(**INNER)
def springs_tangent(geo, k, scale, first, last, x, y, th, out, kout):
    """Undamped linear springs: out (3,) += F and kout (3, 3) += dF/dX; returns their energy.

    With g = f/l and p = (s k - g)/l^2, per member  K = p b b^T + g [1, perp a]^T [1, perp a] - g (d.a) e e^T,
    b = (dx, dy, a x d), and a.a - d.a = a.u with u = s2 - x.
    """
    c, s = cos(th), sin(th)
    s1x, s1y, s2x, s2y = geo[0, first:last], geo[1, first:last], geo[2, first:last], geo[3, first:last]
    o2, l0 = geo[4, first:last], geo[5, first:last]
    kk, sc = k[first:last], scale[first:last]
    zero = 0.0 * x
    fx, fy, ft, sg, sgx, sgy, energy = zero, zero, zero, zero, zero, zero, zero
    k00, k01, k11, k02, k12, k22 = zero, zero, zero, zero, zero, zero
    for i in range(last - first):
        ax = c * s1x[i] - s * s1y[i]
        ay = s * s1x[i] + c * s1y[i]
        ux = s2x[i] - x
        uy = s2y[i] - y
        dx = ax - ux
        dy = ay - uy
        l2 = dx * dx + dy * dy + o2[i]
        r = 1.0 / sqrt(l2)
        ks = kk[i] * sc[i]
        strain = 1.0 - l0[i] * r
        g = ks * strain
        b = ax * dy - ay * dx
        gx = g * ax
        gy = g * ay
        fx += g * dx
        fy += g * dy
        ft += g * b
        sg += g
        sgx += gx
        sgy += gy
        energy += g * strain * l2
        p = (ks - g) * (r * r)
        px = p * dx
        py = p * dy
        k00 += px * dx
        k01 += px * dy
        k11 += py * dy
        k02 += px * b
        k12 += py * b
        k22 += p * b * b + (ux * gx + uy * gy)
    out[0] += fx
    out[1] += fy
    out[2] += ft
    kout[0, 0] += k00 + sg
    kout[0, 1] += k01
    kout[0, 2] += k02 - sgy
    kout[1, 0] += k01
    kout[1, 1] += k11 + sg
    kout[1, 2] += k12 + sgx
    kout[2, 0] += k02 - sgy
    kout[2, 1] += k12 + sgx
    kout[2, 2] += k22
    return 0.5 * energy


@njit(**INNER)
def springs_energy(geo, k, scale, first, last, x, y, th):
    """Energy sum of s k delta^2 / 2."""
    c, s = cos(th), sin(th)
    s1x, s1y, s2x, s2y = geo[0, first:last], geo[1, first:last], geo[2, first:last], geo[3, first:last]
    o2, l0 = geo[4, first:last], geo[5, first:last]
    kk, sc = k[first:last], scale[first:last]
    total = 0.0 * x
    for i in range(last - first):
        dx = c * s1x[i] - s * s1y[i] + x - s2x[i]
        dy = s * s1x[i] + c * s1y[i] + y - s2y[i]
        e = sqrt(dx * dx + dy * dy + o2[i]) - l0[i]
        total += kk[i] * sc[i] * e * e
    return 0.5 * total


@njit(**INNER)
def springs_contract(geo, k, first, last, x, y, c, s, w0, w1, w2, gradient):
    """gradient[i] += (unit force of spring i) (b . w), w a covector's partner in pair coordinates.

    c, s: cosine and sine of the pair's angle.
    """
    s1x, s1y, s2x, s2y = geo[0, first:last], geo[1, first:last], geo[2, first:last], geo[3, first:last]
    o2, l0 = geo[4, first:last], geo[5, first:last]
    kk, gr = k[first:last], gradient[first:last]
    for i in range(last - first):
        ax = c * s1x[i] - s * s1y[i]
        ay = s * s1x[i] + c * s1y[i]
        dx = ax + x - s2x[i]
        dy = ay + y - s2y[i]
        r = 1.0 / sqrt(dx * dx + dy * dy + o2[i])
        gr[i] += kk[i] * (1.0 - l0[i] * r) * (dx * (w0 - ay * w2) + dy * (w1 + ax * w2))


@njit(**INNER)
def springs_contract_two(geo, k, first, last, X, w, Y, z, share, gradient):
    """`springs_contract` at two nodes at once, the second one `share` times: one division for both.

    X, Y (8,): pair coordinates and rates at the nodes, cosine and sine of the angle; w, z (3,): covectors.
    With lengths l and m, 1/l = m/(l m): divisions and roots are most of what a spring takes.
    """
    x, y, c, s, w0, w1, w2 = X[0], X[1], X[6], X[7], w[0], w[1], w[2]
    p, q, d, t, z0, z1, z2 = Y[0], Y[1], Y[6], Y[7], share * z[0], share * z[1], share * z[2]
    s1x, s1y, s2x, s2y = geo[0, first:last], geo[1, first:last], geo[2, first:last], geo[3, first:last]
    o2, l0 = geo[4, first:last], geo[5, first:last]
    kk, gr = k[first:last], gradient[first:last]
    for i in range(last - first):
        ax = c * s1x[i] - s * s1y[i]
        ay = s * s1x[i] + c * s1y[i]
        dx = ax + x - s2x[i]
        dy = ay + y - s2y[i]
        bx = d * s1x[i] - t * s1y[i]
        by = t * s1x[i] + d * s1y[i]
        ex = bx + p - s2x[i]
        ey = by + q - s2y[i]
        one = sqrt(dx * dx + dy * dy + o2[i])
        two = sqrt(ex * ex + ey * ey + o2[i])
        r = l0[i] / (one * two)
        here = (1.0 - r * two) * (dx * (w0 - ay * w2) + dy * (w1 + ax * w2))
        gr[i] += kk[i] * (here + (1.0 - r * one) * (ex * (z0 - by * z2) + ey * (z1 + bx * z2)))


@njit(**INNER)
def measure(geo, first, last, x, y, th, ux, uy, ut, delta, rate):
    """Elongation and its rate of every member of the segment."""
    c, s = cos(th), sin(th)
    for i in range(first, last):
        ax = c * geo[0, i] - s * geo[1, i]
        ay = s * geo[0, i] + c * geo[1, i]
        dx = ax + x - geo[2, i]
        dy = ay + y - geo[3, i]
        l = sqrt(dx * dx + dy * dy + geo[4, i])
        delta[i] = l - geo[5, i]
        rate[i] = (dx * (ux - ay * ut) + dy * (uy + ax * ut)) / l


@njit(**INNER)
def gather(geo, scale, f, first, last, x, y, th, out):
    """out (3,) += sum of s f b."""
    c, s = cos(th), sin(th)
    fx, fy, ft = 0.0 * x, 0.0 * x, 0.0 * x
    for i in range(first, last):
        ax = c * geo[0, i] - s * geo[1, i]
        ay = s * geo[0, i] + c * geo[1, i]
        dx = ax + x - geo[2, i]
        dy = ay + y - geo[3, i]
        g = scale[i] * f[i] / sqrt(dx * dx + dy * dy + geo[4, i])
        fx += g * dx
        fy += g * dy
        ft += g * (ax * dy - ay * dx)
    out[0] += fx
    out[1] += fy
    out[2] += ft


@njit(**INNER)
def gather_tangent(geo, scale, f, fd, fv, first, last, x, y, th, ux, uy, ut, out, kout, cout):
    """out += F, kout += dF/dX, cout += dF/dU of members with given force and slopes."""
    c, s = cos(th), sin(th)
    for i in range(first, last):
        ax = c * geo[0, i] - s * geo[1, i]
        ay = s * geo[0, i] + c * geo[1, i]
        dx = ax + x - geo[2, i]
        dy = ay + y - geo[3, i]
        r = 1.0 / sqrt(dx * dx + dy * dy + geo[4, i])
        ex = dx * r
        ey = dy * r
        bt = ax * ey - ay * ex
        u = ex * ux + ey * uy + bt * ut
        a2 = ax * ax + ay * ay
        ae = ax * ex + ay * ey
        force = scale[i] * f[i]
        g = force * r
        kd = scale[i] * fd[i]
        kv = scale[i] * fv[i]
        out[0] += force * ex
        out[1] += force * ey
        out[2] += force * bt
        # h = d rate/dX
        hx = r * (ux - ay * ut - ex * u)
        hy = r * (uy + ax * ut - ey * u)
        ht = r * (ax * uy - ay * ux + a2 * ut - bt * u) - ae * ut
        m = kd - g
        kout[0, 0] += m * ex * ex + g + kv * ex * hx
        kout[0, 1] += m * ex * ey + kv * ex * hy
        kout[0, 2] += m * ex * bt - g * ay + kv * ex * ht
        kout[1, 0] += m * ey * ex + kv * ey * hx
        kout[1, 1] += m * ey * ey + g + kv * ey * hy
        kout[1, 2] += m * ey * bt + g * ax + kv * ey * ht
        kout[2, 0] += m * bt * ex - g * ay + kv * bt * hx
        kout[2, 1] += m * bt * ey + g * ax + kv * bt * hy
        kout[2, 2] += m * bt * bt + g * a2 - force * ae + kv * bt * ht
        cout[0, 0] += kv * ex * ex
        cout[0, 1] += kv * ex * ey
        cout[0, 2] += kv * ex * bt
        cout[1, 0] += kv * ey * ex
        cout[1, 1] += kv * ey * ey
        cout[1, 2] += kv * ey * bt
        cout[2, 0] += kv * bt * ex
        cout[2, 1] += kv * bt * ey
        cout[2, 2] += kv * bt * bt


@njit(**INNER)
def project(geo, first, last, x, y, th, w0, w1, w2, along):
    """along[i] = b . w of every member."""
    c, s = cos(th), sin(th)
    for i in range(first, last):
        ax = c * geo[0, i] - s * geo[1, i]
        ay = s * geo[0, i] + c * geo[1, i]
        dx = ax + x - geo[2, i]
        dy = ay + y - geo[3, i]
        r = 1.0 / sqrt(dx * dx + dy * dy + geo[4, i])
        along[i] = r * (dx * (w0 - ay * w2) + dy * (w1 + ax * w2))


@njit(**INNER)
def rows(geo, first, last, x, y, th, b):
    """b (3, N): derivative of every elongation with respect to the pair's coordinates."""
    c, s = cos(th), sin(th)
    for i in range(first, last):
        ax = c * geo[0, i] - s * geo[1, i]
        ay = s * geo[0, i] + c * geo[1, i]
        dx = ax + x - geo[2, i]
        dy = ay + y - geo[3, i]
        r = 1.0 / sqrt(dx * dx + dy * dy + geo[4, i])
        b[0, i] = dx * r
        b[1, i] = dy * r
        b[2, i] = (ax * dy - ay * dx) * r
