# mypy: ignore-errors
"""Joint springs with stops and breakable bushings, compiled.

Pair coordinates X, U as in `planar/_kernels/members`. Every element adds F (3,), K = dF/dX and C = dF/dU of
its pair; `planar/_kernels/pairs` maps their sums to the bodies once per pair.
"""

from numba import njit
from numpy import cos, exp, sin, sqrt, tanh

from ..compiler.options import INNER
from ._kernels_rounding import smoothstep, softplus, softplus_integral


@njit(**INNER)
def torsion(p, t, big, fr, kr, cr):
    """Joint spring: k phi + c phi' + k_stop [softplus(phi - upper) - softplus(-phi - lower)], phi = theta -
    rest.

    Column t of p: k, c, rest, k_stop, upper, lower, width.
    """
    phi = big[2] - p[2, t]
    high, high1 = softplus(phi - p[4, t], p[6, t])
    low, low1 = softplus(-phi - p[5, t], p[6, t])
    fr[2] += p[0, t] * phi + p[1, t] * big[5] + p[3, t] * (high - low)
    kr[2, 2] += p[0, t] + p[3, t] * (high1 + low1)
    cr[2, 2] += p[1, t]


@njit(**INNER)
def torsion_parameters(p, t, big, dp):
    """Slopes of the torque with respect to k, c, rest, k_stop, upper, lower."""
    phi = big[2] - p[2, t]
    high, high1 = softplus(phi - p[4, t], p[6, t])
    low, low1 = softplus(-phi - p[5, t], p[6, t])
    dp[0] = phi
    dp[1] = big[5]
    dp[2] = -p[0, t] - p[3, t] * (high1 + low1)
    dp[3] = high - low
    dp[4] = -p[3, t] * high1
    dp[5] = p[3, t] * low1


@njit(**INNER)
def torsion_energy(p, t, big):
    """Elastic energy of a joint spring: k phi^2/2 and the integral of the stops' softplus."""
    phi = big[2] - p[2, t]
    total = 0.5 * p[0, t] * phi * phi
    if p[3, t].real != 0.0:
        total += p[3, t] * (
            softplus_integral(phi - p[4, t], p[6, t]) + softplus_integral(-phi - p[5, t], p[6, t])
        )
    return total


@njit(**INNER)
def directed_cap(p, b, rx, ry, r):
    """Limit of the force at a separation (rx, ry) of length r: value, slope by (rx, ry), slope by the cap.

    cap on the side that opens (e.n >= 0), push cap when pressed on (e.n = -1), smoothstep(-e.n) between.
    """
    if p[17, b].real <= 0.0:
        return p[2, b] + 0.0 * r, 0.0 * r, 0.0 * r, 0.0 * r + 1.0
    e = (rx * p[15, b] + ry * p[16, b]) / r
    part, part1 = smoothstep(-e)
    more = (p[17, b] - p[2, b]) * part1 / r
    x = -more * (p[15, b] - e * rx / r)
    y = -more * (p[16, b] - e * ry / r)
    return p[2, b] + (p[17, b] - p[2, b]) * part, x, y, 1.0 - part


@njit(**INNER)
def bushing(p, b, big, z, rate0, half, tangent, fr, kr, cr, fz, gx, zx, out):
    """Breakable bushing: -(force on body 1) = s [cap tanh(k r/cap) r_/r + c r' sech^2(k r/cap) - preload].

    s = hold (1 - D) w(r), r = sqrt(r_.r_ + eps^2), w falls from 1 at r1 to 0 at r2; the damage obeys
    dD/dt = (1 - D) logistic((r - r2)/width)/tau, taken here at the end of a trapezoidal step:
    D = (z + half (rate0 + a))/(1 + half a), a = logistic/tau; half = 0 leaves D = z.
    Column b of p: k, c, cap, r1, r2, tau, eps, hold, preload x, y, s1x, s1y, s2x, s2y, width, n x, n y,
    push cap; tau = 0: unbreakable; push cap = 0: one cap for all directions.
    out = D, dD/dt, dg/dD; fz = dF/dD, gx = dg/dX, zx = dD/dX of the step.
    """
    c, s = cos(big[2]), sin(big[2])
    ax = c * p[10, b] - s * p[11, b]
    ay = s * p[10, b] + c * p[11, b]
    rx = ax + big[0] - p[12, b]
    ry = ay + big[1] - p[13, b]
    vx = big[3] - ay * big[5]
    vy = big[4] + ax * big[5]
    r = sqrt(rx * rx + ry * ry + p[6, b] * p[6, b])
    k, damping = p[0, b], p[1, b]
    cap, cap_x, cap_y, _ = directed_cap(p, b, rx, ry, r)
    saturation = tanh(k * r / cap)
    g = cap * saturation / r
    h = 1.0 - saturation * saturation
    damage = 0.0 * r
    w = 0.0 * r + 1.0
    w1 = 0.0 * r
    a = 0.0 * r
    a1 = 0.0 * r
    if p[5, b].real > 0.0:
        step, step1 = smoothstep((r - p[3, b]) / (p[4, b] - p[3, b]))
        w = 1.0 - step
        w1 = -step1 / (p[4, b] - p[3, b])
        x = (r - p[4, b]) / p[14, b]
        if x.real > 0.0:
            e = exp(-x)
            lost = 1.0 / (1.0 + e)
        else:
            e = exp(x)
            lost = e / (1.0 + e)
        a = lost / p[5, b]
        a1 = a * (1.0 - lost) / p[14, b]
        damage = (z + half * (rate0 + a)) / (1.0 + half * a)
    out[0] = damage
    out[1] = (1.0 - damage) * a
    out[2] = -a
    hold = p[7, b]
    strength = hold * (1.0 - damage) * w
    qx = g * rx + damping * vx * h - p[8, b]
    qy = g * ry + damping * vy * h - p[9, b]
    fx = strength * qx
    fy = strength * qy
    fr[0] += fx
    fr[1] += fy
    fr[2] += ax * fy - ay * fx
    if not tangent:
        return
    # slopes along r, each divided by r so that they multiply (rx, ry)
    g1 = (k * h - g) / (r * r)
    h1 = -2.0 * saturation * h * k / (cap * r)
    s1 = hold * (1.0 - damage) * w1 / r
    ux = strength * (g1 * rx + damping * vx * h1) + s1 * qx
    uy = strength * (g1 * ry + damping * vy * h1) + s1 * qy
    k00 = strength * g + ux * rx
    k01 = ux * ry
    k10 = uy * rx
    k11 = strength * g + uy * ry
    if p[17, b].real > 0.0:  # the limit turns with the direction
        u = k * r / cap
        by_cap, h_cap = (saturation - u * h) / r, 2.0 * saturation * h * u / cap
        mx = strength * (by_cap * rx + damping * vx * h_cap)
        my = strength * (by_cap * ry + damping * vy * h_cap)
        k00 += mx * cap_x
        k01 += mx * cap_y
        k10 += my * cap_x
        k11 += my * cap_y
    cd = strength * damping * h
    fz[0] = -hold * w * qx
    fz[1] = -hold * w * qy
    fz[2] = ax * fz[1] - ay * fz[0]
    gr = (1.0 - damage) * a1 / r
    gx[0] = gr * rx
    gx[1] = gr * ry
    gx[2] = gr * (ax * ry - ay * rx)
    share = half / (1.0 + half * a)
    # r_ depends on theta by (-ay, ax); the rate r' depends on theta by -theta' (ax, ay)
    col0 = k00 * -ay + k01 * ax - cd * big[5] * ax
    col1 = k10 * -ay + k11 * ax - cd * big[5] * ay
    kr[0, 0] += k00
    kr[0, 1] += k01
    kr[0, 2] += col0
    kr[1, 0] += k10
    kr[1, 1] += k11
    kr[1, 2] += col1
    kr[2, 0] += ax * k10 - ay * k00
    kr[2, 1] += ax * k11 - ay * k01
    kr[2, 2] += ax * col1 - ay * col0 - ax * fx - ay * fy
    cr[0, 0] += cd
    cr[1, 1] += cd
    cr[0, 2] -= cd * ay
    cr[2, 0] -= cd * ay
    cr[1, 2] += cd * ax
    cr[2, 1] += cd * ax
    cr[2, 2] += cd * (ax * ax + ay * ay)
    for m in range(3):
        zx[m] = share * gx[m]
        for n in range(3):
            kr[m, n] += fz[m] * share * gx[n]


@njit(**INNER)
def bushing_parameters(p, b, big, z, dp):
    """dp (5, 3): slopes of F with respect to k, c, cap, hold, at damage z (breakage parameters stay
    fixed)."""
    c, s = cos(big[2]), sin(big[2])
    ax = c * p[10, b] - s * p[11, b]
    ay = s * p[10, b] + c * p[11, b]
    rx = ax + big[0] - p[12, b]
    ry = ay + big[1] - p[13, b]
    vx = big[3] - ay * big[5]
    vy = big[4] + ax * big[5]
    r = sqrt(rx * rx + ry * ry + p[6, b] * p[6, b])
    k, damping = p[0, b], p[1, b]
    cap, _, _, by_cap = directed_cap(p, b, rx, ry, r)
    u = k * r / cap
    saturation = tanh(u)
    h = 1.0 - saturation * saturation
    w = 1.0
    if p[5, b] > 0.0:
        step, _ = smoothstep((r - p[3, b]) / (p[4, b] - p[3, b]))
        w = 1.0 - step
    hold = p[7, b] * (1.0 - z) * w
    slope = -2.0 * saturation * h  # dh/du
    for m in range(5):
        dp[m, 0] = 0.0
        dp[m, 1] = 0.0
    dp[0, 0] = hold * (h * rx + damping * vx * slope * r / cap)
    dp[0, 1] = hold * (h * ry + damping * vy * slope * r / cap)
    dp[1, 0] = hold * vx * h
    dp[1, 1] = hold * vy * h
    dcap = (saturation - u * h) / r
    dp[2, 0] = hold * by_cap * (dcap * rx - damping * vx * slope * u / cap)
    dp[2, 1] = hold * by_cap * (dcap * ry - damping * vy * slope * u / cap)
    share = (1.0 - z) * w
    dp[3, 0] = share * (cap * saturation / r * rx + damping * vx * h - p[8, b])
    dp[3, 1] = share * (cap * saturation / r * ry + damping * vy * h - p[9, b])
    for m in range(5):
        dp[m, 2] = ax * dp[m, 1] - ay * dp[m, 0]
