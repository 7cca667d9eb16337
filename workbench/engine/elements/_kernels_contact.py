# mypy: ignore-errors
"""Smooth contact of a sphere with a shape, compiled: distance and normal, normal force, regularised friction.

    depth d = radius - distance of the centre
    N = k R(d)^e R1(1 + c d'),   friction -mu N v/sqrt(v.v + slow^2)

R is the C2 ramp of the member laws over `width`, R1 the same over 0.5 (Hunt and Crossley 1975, kept from
pulling). Shapes in their body's frame, numbers g[0:9]:

    0 plane    normal (3), offset                     n . x - offset
    1 sphere   centre (3), radius                     |x - c| - r
    2 capsule  ends (3 + 3), radius                   distance of the segment, its ends rounded in C2
    3 ring     centre (3), axis (3), radius, tube     distance of the circle less the tube
    4 box      centre (3), half sizes (3), rounding   distance of the box (outside) less the rounding
"""

from numba import njit
from numpy import exp, log, sqrt

from ..compiler.options import INNER
from ._kernels_rounding import ramp

PLANE, SPHERE, CAPSULE, RING, BOX = 0, 1, 2, 3, 4
NEAR = 1e-24  # m^2
END = 0.1  # of a capsule's length, over which the nearest point slows down to its end
CORNER = 0.25  # of a box's rounding


@njit(**INNER)
def unit_from(x, y, z, n):
    """n = (x, y, z) as a direction; its length."""
    size = sqrt(x * x + y * y + z * z + NEAR)
    n[0] = x / size
    n[1] = y / size
    n[2] = z / size
    return size


@njit(**INNER)
def distance(kind, g, x, n):
    """Distance of point x (3,) from a shape and the direction n (3,) away from it."""
    if kind == PLANE:
        n[0] = 0.0 * x[0] + g[0]
        n[1] = 0.0 * x[0] + g[1]
        n[2] = 0.0 * x[0] + g[2]
        return g[0] * x[0] + g[1] * x[1] + g[2] * x[2] - g[3]
    if kind == CAPSULE:
        u, v, w = g[3] - g[0], g[4] - g[1], g[5] - g[2]
        s = ((x[0] - g[0]) * u + (x[1] - g[1]) * v + (x[2] - g[2]) * w) / (u * u + v * v + w * w)
        low, _, _, _ = ramp(s, END)
        high, _, _, _ = ramp(s - 1.0, END)
        s = low - high
        return unit_from(x[0] - g[0] - s * u, x[1] - g[1] - s * v, x[2] - g[2] - s * w, n) - g[6]
    a, b, c = x[0] - g[0], x[1] - g[1], x[2] - g[2]
    if kind == SPHERE:
        return unit_from(a, b, c, n) - g[3]
    if kind == RING:
        z = a * g[3] + b * g[4] + c * g[5]
        p, q, r = a - z * g[3], b - z * g[4], c - z * g[5]
        out = sqrt(p * p + q * q + r * r + NEAR)
        by = (out - g[6]) / out
        return unit_from(by * p + z * g[3], by * q + z * g[4], by * r + z * g[5], n) - g[7]
    w = CORNER * g[6]
    fa, fb, fc = -1.0 if a.real < 0.0 else 1.0, -1.0 if b.real < 0.0 else 1.0, -1.0 if c.real < 0.0 else 1.0
    p, _, _, _ = ramp(fa * a - g[3], w)
    q, _, _, _ = ramp(fb * b - g[4], w)
    r, _, _, _ = ramp(fc * c - g[5], w)
    return unit_from(fa * p, fb * q, fc * r, n) - g[6]


@njit(**INNER)
def normal_force(k, power, damping, width, depth, rate):
    """k R(depth)^power R1(1 + damping rate)."""
    r, _, _, _ = ramp(depth, width)
    if r.real <= 0.0:
        return 0.0 * depth * rate
    hold, _, _, _ = ramp(1.0 + damping * rate, 0.5)
    return k * exp(power * log(r)) * hold


@njit(**INNER)
def contact_force(p, n, depth, v, f):
    """Force f (3,) on the sphere: normal n, its velocity v (3,) against the shape at the touching point.

    p: stiffness, power, damping (s/m), width (m), friction, slow speed (m/s).
    """
    along = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    normal = normal_force(p[0], p[1], p[2], p[3], depth, -along)
    a, b, c = v[0] - along * n[0], v[1] - along * n[1], v[2] - along * n[2]
    by = p[4] * normal / sqrt(a * a + b * b + c * c + p[5] * p[5])
    f[0] = normal * n[0] - by * a
    f[1] = normal * n[1] - by * b
    f[2] = normal * n[2] - by * c
