# mypy: ignore-errors
"""The three-axis bushing, compiled: force from separation and its rate in the axes of the bushing.

    q = g k r + h c r' - preload,  e = sqrt(|k r|^2 + (k_mean eps)^2),  g = cap tanh(e/cap)/e,  h =
    sech^2(e/cap) force on a = -hold (1 - D) w(|r|) q,     dD/dt = (1 - D) logistic((|r| - r2)/width)/tau

k and c are diagonal, |r| = sqrt(r.r + eps^2), and w falls from 1 at r1 to 0 at r2 (C2). With equal axes it is
the planar law of `bushing`. Column b of p: k (3), c (3), cap, r1, r2, tau, eps, hold,
preload (3), point on a (3), point on b (3), width, opening direction (3), push cap.
"""

from numba import njit
from numpy import exp, sqrt

from ..compiler.options import ENTRY, INNER
from ._kernels_rounding import saturated, smoothstep


@njit(**INNER)
def logistic(x):
    """1/(1 + exp(-x)) without overflow."""
    if x.real > 0.0:
        return 1.0 / (1.0 + exp(-x))
    e = exp(x)
    return e / (1.0 + e)


@njit(**INNER)
def spatial_bushing(p, b, r, v, z, tangent, f, fr, fv, fz, gr, out):
    """Force f (3,) on a; where `tangent`: fr, fv (3, 3) by r and v, fz (3,) by the damage z, gr (3,) slope of
    the damage's rate by r. out = dD/dt and its slope by D.
    """
    eps = p[10, b]
    mean = (p[0, b] + p[1, b] + p[2, b]) / 3.0
    x, y, t = p[0, b] * r[0], p[1, b] * r[1], p[2, b] * r[2]
    e = sqrt(x * x + y * y + t * t + mean * mean * eps * eps) + 1e-300
    rho = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + eps * eps)
    cap, cap1, along = p[6, b], 0.0 * rho, 0.0 * rho
    if p[25, b].real > 0.0:  # another limit when pressed on than when it opens
        along = (r[0] * p[22, b] + r[1] * p[23, b] + r[2] * p[24, b]) / rho
        part, part1 = smoothstep(-along)
        cap1 = -(p[25, b] - cap) * part1 / rho
        cap = cap + (p[25, b] - cap) * part
    ratio = e / cap
    s = saturated(ratio)
    h = 1.0 - s * s
    g = cap * s / e
    w, w1, a, a1 = 0.0 * rho + 1.0, 0.0 * rho, 0.0 * rho, 0.0 * rho
    if p[9, b].real > 0.0:
        step, step1 = smoothstep((rho - p[7, b]) / (p[8, b] - p[7, b]))
        w = 1.0 - step
        w1 = -step1 / (p[8, b] - p[7, b])
        lost = logistic((rho - p[8, b]) / p[21, b])
        a = lost / p[9, b]
        a1 = a * (1.0 - lost) / p[21, b]
    out[0] = (1.0 - z) * a
    out[1] = -a
    whole = p[11, b] * w
    strength = whole * (1.0 - z)
    for i in range(3):
        f[i] = -strength * (g * p[i, b] * r[i] + p[3 + i, b] * v[i] * h - p[12 + i, b])
    if not tangent:
        return
    g_e, h_e = (h - g) / e, -2.0 * s * h / cap
    g_cap, h_cap = (s - ratio * h) / e, 2.0 * s * h * ratio / cap
    for j in range(3):
        e_r = p[j, b] * p[j, b] * r[j] / e
        cap_r = cap1 * (p[22 + j, b] - along * r[j] / rho)
        slope = p[11, b] * (1.0 - z) * w1 * r[j] / rho
        gr[j] = (1.0 - z) * a1 * r[j] / rho
        for i in range(3):
            q = g * p[i, b] * r[i] + p[3 + i, b] * v[i] * h - p[12 + i, b]
            by_g, by_h = p[i, b] * r[i], p[3 + i, b] * v[i]
            fr[i, j] = -slope * q - strength * (
                by_g * (g_e * e_r + g_cap * cap_r) + by_h * (h_e * e_r + h_cap * cap_r)
            )
            fv[i, j] = 0.0
        fr[j, j] -= strength * g * p[j, b]
        fv[j, j] = -strength * p[3 + j, b] * h
        fz[j] = whole * (g * p[j, b] * r[j] + p[3 + j, b] * v[j] * h - p[12 + j, b])


@njit(**ENTRY)
def bushing_forces(p, b, r, v, z, no, small, out):
    """out (T, 3): forces of bushing b along separations r and rates v (T, 3), damages z (T,); no: False."""
    for node in range(len(z)):
        spatial_bushing(
            p, b, r[node], v[node], z[node], no, out[node], small, small, small[0], small[1], small[2]
        )
