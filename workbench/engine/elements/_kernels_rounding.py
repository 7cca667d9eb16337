# mypy: ignore-errors
"""Rounded kinks and steps, compiled; outside their width the printed law holds exactly."""

from numba import njit
from numpy import exp, log, tanh

from ..compiler.options import INNER

__all__ = ["given_back", "limited", "ramp", "saturated", "smoothstep", "softplus", "softplus_integral"]

CORNER = 0.1  # of a limit: over so much the corner at it is rounded


@njit(**INNER)
def ramp(x, w):
    """max(0, x) rounded in C2 over |x| < w/2; returns value, slope, curvature, integral."""
    half = 0.5 * w.real
    if x.real <= -half:
        return 0.0 * x, 0.0 * x, 0.0 * x, 0.0 * x
    if x.real >= half:
        # the integral of the rounded ramp over its width is w^2 (1/4 - 1/10) = 0.15 w^2
        return x, 0.0 * x + 1.0, 0.0 * x, 0.5 * (x * x - half * half) + 0.15 * w * w
    s = x / w + 0.5
    return (
        w * s * s * s * (1.0 - 0.5 * s),
        s * s * (3.0 - 2.0 * s),
        6.0 * s * (1.0 - s) / w,
        w * w * s * s * s * s * (0.25 - 0.1 * s),
    )


@njit(**INNER)
def saturated(x):
    """tanh(x), of any size: complex tanh is not a number beyond 355, where it has long been 1 to rounding."""
    if x.real > 40.0:
        return 0.0 * x + 1.0
    if x.real < -40.0:
        return 0.0 * x - 1.0
    return tanh(x)


@njit(**INNER)
def smoothstep(s):
    """0 below 0, 1 above 1, s^3 (10 - 15 s + 6 s^2) between (C2); value and slope."""
    if s.real <= 0.0:
        return 0.0 * s, 0.0 * s
    if s.real >= 1.0:
        return 0.0 * s + 1.0, 0.0 * s
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s)


@njit(**INNER)
def limited(x, limit):
    """min(x, limit), its corner rounded in C2 over a tenth of the limit; value, slopes by x and by limit."""
    over, over1, _, _ = ramp(x - limit, CORNER * limit)
    # the rounding is as wide as the limit asks for: ramp(x, w) = w phi(x/w)
    return x - over, 1.0 - over1, over1 - (over - (x - limit) * over1) / limit


@njit(**INNER)
def given_back(rate, share, speed):
    """1 for rate >= 0 (loading), `share` for rate <= -speed (unloading), a quintic (C2) between.

    A force F(x) > 0 times this does the work of F on the way out and returns `share` of it on a way back that
    is faster than `speed`; slower ways return more, up to all of it at rest. Value, slopes by rate and share.
    """
    s, s1 = smoothstep(-rate / speed)
    return 1.0 - (1.0 - share) * s, (1.0 - share) * s1 / speed, s


@njit(**INNER)
def softplus(x, w):
    """w log(1 + exp(x/w)) and its slope, without overflow."""
    s = x / w
    if s.real > 0.0:
        e = exp(-s)
        return x + w * log(1.0 + e), 1.0 / (1.0 + e)
    e = exp(s)
    return w * log(1.0 + e), e / (1.0 + e)


@njit(**INNER)
def softplus_integral(x, w):
    """Integral of w log(1 + exp(x/w)) from minus infinity: -w^2 Li2(-exp(x/w))."""
    s = x / w
    total = 0.0 * s
    if s.real > 0.0:  # inversion formula of the dilogarithm
        total += s * s / 2.0 + 1.6449340668482264365
        z = exp(-s)
        sign = -1.0
    else:
        z = exp(s)
        sign = 1.0
    # -Li2(-z) = sum (-1)^(k+1) z^k / k^2 converges slowly at z = 1: use u = log(1 + z) (Bernoulli series)
    u = log(1.0 + z)
    u2 = u * u
    # -Li2(-z) = u + u^2/4 + sum B_2k u^(2k+1)/(2k+1)!
    series = (
        u
        + u2 / 4.0
        + u
        * u2
        * (
            1.0 / 36.0
            + u2
            * (
                -1.0 / 3600.0
                + u2
                * (
                    1.0 / 211680.0
                    + u2 * (-1.0 / 10886400.0 + u2 * (1.0 / 526901760.0 - u2 * 4.0647616451442255e-11))
                )
            )
        )
    )
    return w * w * (total + sign * series)
