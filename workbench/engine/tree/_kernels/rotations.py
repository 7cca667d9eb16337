# mypy: ignore-errors
"""Rotations, compiled: exponential coordinates with their tangents, and unit quaternions (scalar first).

    exp(x) = I + a X + b X^2,           a = sin t/t, b = (1 - cos t)/t^2, t = |x|, X = x as a cross product
    T(x)   = I - b X + d X^2,           d = (t - sin t)/t^3
    T^-1   = I + X/2 + f X^2,           f = (1 - (t/2) cot(t/2))/t^2

T is the right tangent: exp(x + dx) = exp(x) exp(T dx). Every coefficient is a function of t^2, summed as its
series where t is small, so complex steps pass.
"""

from numba import njit
from numpy import arctan, cos, sin, sqrt, tan

from ...compiler.options import INNER

SMALL = 0.3  # of t^2: below, eight terms of the series reach rounding


@njit(**INNER)
def coefficients(s):
    """sin t/t, (1 - cos t)/t^2, (t - sin t)/t^3 at s = t^2."""
    if s.real < SMALL:
        a = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0 * (
            1.0 - s / 156.0 * (1.0 - s / 210.0))))))  # fmt: skip
        b = 0.5 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0 * (
            1.0 - s / 132.0 * (1.0 - s / 182.0 * (1.0 - s / 240.0)))))))  # fmt: skip
        d = (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0 * (
            1.0 - s / 156.0 * (1.0 - s / 210.0 * (1.0 - s / 272.0))))))) / 6.0  # fmt: skip
        return a, b, d
    t = sqrt(s)
    return sin(t) / t, (1.0 - cos(t)) / s, (t - sin(t)) / (s * t)


@njit(**INNER)
def inverse_coefficient(s):
    """f = (1 - (t/2) cot(t/2))/t^2 at s = t^2, and df/ds."""
    if s.real < SMALL:
        f = 1.0 / 12.0 + s * (1.0 / 720.0 + s * (1.0 / 30240.0 + s * (1.0 / 1209600.0 + s * (
            1.0 / 47900160.0 + s * (691.0 / 1307674368000.0 + s / 74724249600.0)))))  # fmt: skip
        g = 1.0 / 720.0 + s * (2.0 / 30240.0 + s * (3.0 / 1209600.0 + s * (4.0 / 47900160.0 + s * (
            5.0 * 691.0 / 1307674368000.0 + s * 6.0 / 74724249600.0))))  # fmt: skip
        return f, g
    t = sqrt(s)
    half = 0.5 * t
    cot = 1.0 / tan(half)
    f = (1.0 - half * cot) / s
    # d/dt (t/2 cot(t/2)) = cot/2 - t/4 (1 + cot^2)
    slope = -(0.5 * cot - 0.25 * t * (1.0 + cot * cot))
    return f, (slope / (2.0 * t) - f) / s


@njit(**INNER)
def tangent(x, at, out):
    """out (3, 3) = T of x[at:at + 3]."""
    p, q, r = x[at], x[at + 1], x[at + 2]
    s = p * p + q * q + r * r
    _, b, d = coefficients(s)
    out[0, 0] = 1.0 + d * (p * p - s)
    out[1, 1] = 1.0 + d * (q * q - s)
    out[2, 2] = 1.0 + d * (r * r - s)
    out[0, 1] = b * r + d * p * q
    out[1, 0] = -b * r + d * p * q
    out[0, 2] = -b * q + d * p * r
    out[2, 0] = b * q + d * p * r
    out[1, 2] = b * p + d * q * r
    out[2, 1] = -b * p + d * q * r


@njit(**INNER)
def inverse_tangent(x, at, out):
    """out (3, 3) = T^-1 of x[at:at + 3]."""
    p, q, r = x[at], x[at + 1], x[at + 2]
    s = p * p + q * q + r * r
    f, _ = inverse_coefficient(s)
    out[0, 0] = 1.0 + f * (p * p - s)
    out[1, 1] = 1.0 + f * (q * q - s)
    out[2, 2] = 1.0 + f * (r * r - s)
    out[0, 1] = -0.5 * r + f * p * q
    out[1, 0] = 0.5 * r + f * p * q
    out[0, 2] = 0.5 * q + f * p * r
    out[2, 0] = -0.5 * q + f * p * r
    out[1, 2] = -0.5 * p + f * q * r
    out[2, 1] = 0.5 * p + f * q * r


@njit(**INNER)
def exponential(x, at, out):
    """out (3, 3) = exp of x[at:at + 3]."""
    p, q, r = x[at], x[at + 1], x[at + 2]
    s = p * p + q * q + r * r
    a, b, _ = coefficients(s)
    out[0, 0] = 1.0 + b * (p * p - s)
    out[1, 1] = 1.0 + b * (q * q - s)
    out[2, 2] = 1.0 + b * (r * r - s)
    out[0, 1] = -a * r + b * p * q
    out[1, 0] = a * r + b * p * q
    out[0, 2] = a * q + b * p * r
    out[2, 0] = -a * q + b * p * r
    out[1, 2] = -a * p + b * q * r
    out[2, 1] = a * p + b * q * r


@njit(**INNER)
def turn(q, at, x, by, out):
    """out[at:at + 4] = quaternion q[at:at + 4] times that of the rotation vector x[by:by + 3]."""
    p1, p2, p3 = 0.5 * x[by], 0.5 * x[by + 1], 0.5 * x[by + 2]
    s = p1 * p1 + p2 * p2 + p3 * p3
    a, b, _ = coefficients(s)
    c = 1.0 - b * s
    x1, x2, x3 = a * p1, a * p2, a * p3
    w, i, j, k = q[at], q[at + 1], q[at + 2], q[at + 3]
    out[at] = w * c - i * x1 - j * x2 - k * x3
    out[at + 1] = w * x1 + i * c + j * x3 - k * x2
    out[at + 2] = w * x2 - i * x3 + j * c + k * x1
    out[at + 3] = w * x3 + i * x2 - j * x1 + k * c


@njit(**INNER)
def logarithm(q, at, rest, row, out):
    """out (3,) = rotation vector from the quaternion rest[row] to q[at:at + 4], shorter than pi."""
    a, b, c, d = rest[row, 0], -rest[row, 1], -rest[row, 2], -rest[row, 3]
    w, i, j, k = q[at], q[at + 1], q[at + 2], q[at + 3]
    w1 = a * w - b * i - c * j - d * k
    x = a * i + b * w + c * k - d * j
    y = a * j - b * k + c * w + d * i
    z = a * k + b * j - c * i + d * w
    if w1.real < 0.0:
        w1, x, y, z = -w1, -x, -y, -z
    s = x * x + y * y + z * z
    u = s / (w1 * w1)
    if u.real < 1e-3:
        by = 2.0 / w1 * (1.0 - u * (1.0 / 3.0 - u * (0.2 - u * (1.0 / 7.0 - u * (1.0 / 9.0 - u / 11.0)))))
    elif u.real < 1.0:
        t = sqrt(s)
        by = 2.0 * arctan(t / w1) / t
    else:
        t = sqrt(s)
        by = (3.141592653589793 - 2.0 * arctan(w1 / t)) / t
    out[0] = by * x
    out[1] = by * y
    out[2] = by * z


@njit(**INNER)
def turned(R, x, out):
    """out = R x of a rotation by rows."""
    out[0] = R[0] * x[0] + R[1] * x[1] + R[2] * x[2]
    out[1] = R[3] * x[0] + R[4] * x[1] + R[5] * x[2]
    out[2] = R[6] * x[0] + R[7] * x[1] + R[8] * x[2]


@njit(**INNER)
def turned_back(R, x, out):
    """out = R^T x of a rotation by rows."""
    out[0] = R[0] * x[0] + R[3] * x[1] + R[6] * x[2]
    out[1] = R[1] * x[0] + R[4] * x[1] + R[7] * x[2]
    out[2] = R[2] * x[0] + R[5] * x[1] + R[8] * x[2]
