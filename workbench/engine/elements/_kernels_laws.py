# mypy: ignore-errors
"""Force laws of the members, compiled: unit force f(delta, rate, t), its slopes, its energy and its parameter
slopes.

delta is the elongation (length minus natural length), rate its time derivative; f > 0 is tension. A law is
one code and one column of the parameter table p (law rows x members). Kinks are rounded by the C2 ramp below;
outside its width the printed law holds exactly.

    code 0  spring-damper   (2.2)     k delta + c rate
    code 1  one-way contact (2.3)     k R(s delta - gap) + c rate R'(...), on the side s = +1 or -1
    code 2  impulse         (2.4)     f0 exp(-sigma (t - t0)^2); the retractor (8.28) is the same law
    code 3  belt            (8.26)    k1 R(delta) + (k2 - k1) R(delta - knee)
    code 4  airbag          (8.27)    C0 - C1/(L - onset - u)^n, u = R(-delta - onset); sign corrected
"""

from numba import njit
from numpy import exp, log

from ..compiler.options import INNER

LINEAR, CONTACT, IMPULSE, BELT, AIRBAG, USER = 0, 1, 2, 3, 4, 9


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
def bag(compression, c0, c1, length, power, cap):
    """Gas spring c0 - c1/(length - x)^power at compression x, continued by its Taylor parabola past x = cap.

    Returns force, slope, curvature with respect to x, and the integral from 0.
    """
    x = compression
    if x.real > cap.real:
        x = 0.0 * compression + cap
    room = length - x
    g = c1 * exp(-power * log(room))
    f0 = c0 - g
    f1 = -power * g / room
    f2 = -power * (power + 1.0) * g / (room * room)
    if abs(power - 1.0) < 1e-9:
        u0 = c0 * x + c1 * log(room / length)
    else:
        u0 = c0 * x - c1 * (exp((1.0 - power) * log(room)) - exp((1.0 - power) * log(length))) / (power - 1.0)
    e = compression - x
    force = f0 + e * (f1 + 0.5 * e * f2)
    return force, f1 + e * f2, f2, u0 + e * (f0 + e * (0.5 * f1 + e * f2 / 6.0))


@njit(**INNER)
def gate(t, t0, rise):
    """0 before t0, 1 after t0 + rise, a quintic (C2) between; value and slope."""
    s = t - t0
    if s.real <= 0.0:
        return 0.0 * s, 0.0 * s
    if s.real >= rise.real:
        return 0.0 * s + 1.0, 0.0 * s
    s = s / rise
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s) / rise


@njit(**INNER)
def laws(code, p, first, last, delta, rate, t, f, fd, fv):
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    if code == LINEAR:
        for i in range(first, last):
            f[i] = p[0, i] * delta[i] + p[1, i] * rate[i]
            fd[i] = p[0, i]
            fv[i] = p[1, i]
    elif code == CONTACT:
        for i in range(first, last):
            side = p[4, i]
            r, r1, r2, _ = ramp(side * delta[i] - p[2, i], p[3, i])
            f[i] = side * p[0, i] * r + p[1, i] * rate[i] * r1
            fd[i] = p[0, i] * r1 + p[1, i] * rate[i] * side * r2
            fv[i] = p[1, i] * r1
    elif code == IMPULSE:
        for i in range(first, last):
            s = t - p[2, i]
            f[i] = p[0, i] * exp(-p[1, i] * s * s)
            fd[i] = 0.0
            fv[i] = 0.0
    elif code == BELT:
        for i in range(first, last):
            a, a1, a2, _ = ramp(delta[i], p[3, i])
            b, b1, _, _ = ramp(delta[i] - p[2, i], p[3, i])
            f[i] = p[0, i] * a + (p[1, i] - p[0, i]) * b + p[4, i] * rate[i] * a1
            fd[i] = p[0, i] * a1 + (p[1, i] - p[0, i]) * b1 + p[4, i] * rate[i] * a2
            fv[i] = p[4, i] * a1
    elif code == AIRBAG:
        for i in range(first, last):
            on, _ = gate(t, p[7, i], p[8, i])
            x, x1, _, _ = ramp(-delta[i] - p[4, i], p[5, i])
            y, y1, _, _ = bag(x, p[0, i], p[1, i], p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i])
            f[i] = on * y
            fd[i] = -on * y1 * x1
            fv[i] = 0.0


@njit(**INNER)
def energies(code, p, first, last, delta, t, energy):
    """Fill the stored energy of each member at unit density (impulses store none)."""
    if code == LINEAR:
        for i in range(first, last):
            energy[i] = 0.5 * p[0, i] * delta[i] * delta[i]
    elif code == CONTACT:
        for i in range(first, last):
            _, _, _, u = ramp(p[4, i] * delta[i] - p[2, i], p[3, i])
            energy[i] = p[0, i] * u
    elif code == BELT:
        for i in range(first, last):
            _, _, _, a = ramp(delta[i], p[3, i])
            _, _, _, b = ramp(delta[i] - p[2, i], p[3, i])
            energy[i] = p[0, i] * a + (p[1, i] - p[0, i]) * b
    elif code == AIRBAG:
        for i in range(first, last):
            on, _ = gate(t, p[7, i], p[8, i])
            energy[i] = on * bag_energy(
                -delta[i] - p[4, i], p[0, i], p[1, i], p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i], p[5, i]
            )
    else:
        for i in range(first, last):
            energy[i] = 0.0


# Gauss-Legendre nodes and weights on [0, 1], eight points: the rounded corner of the bag has no closed
# integral
_NODES = (
    0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.40828267875217510,
    0.59171732124782490, 0.7627662049581645, 0.89833323870681336, 0.98014492824876812,
)  # fmt: skip
_WEIGHTS = (
    0.05061426814518813, 0.11119051722668724, 0.15685332293894364, 0.18134189168918100,
    0.18134189168918100, 0.15685332293894364, 0.11119051722668724, 0.05061426814518813,
)  # fmt: skip


@njit(**INNER)
def bag_energy(x, c0, c1, length, power, cap, w):
    """Integral of -force over compression, through the rounded corner and beyond (>= 0)."""
    half = 0.5 * w.real
    if x.real <= -half:
        return 0.0 * x
    top = x
    if x.real > half:
        top = 0.0 * x + half
    total = 0.0 * x
    for i in range(8):
        u, _, _, _ = ramp(-half + (top + half) * _NODES[i], w)
        y, _, _, _ = bag(u, c0, c1, length, power, cap)
        total -= (top + half) * _WEIGHTS[i] * y
    if x.real > half:
        _, _, _, a = bag(x, c0, c1, length, power, cap)
        _, _, _, b = bag(top, c0, c1, length, power, cap)
        total -= a - b
    return total


@njit(**INNER)
def law_parameters(code, p, i, delta, rate, t, dp):
    """Fill dp with the slopes of the unit force of member i with respect to its parameters."""
    for j in range(dp.shape[0]):
        dp[j] = 0.0
    if code == LINEAR:
        dp[0] = delta
        dp[1] = rate
    elif code == CONTACT:
        side = p[4, i]
        r, r1, r2, _ = ramp(side * delta - p[2, i], p[3, i])
        dp[0] = side * r
        dp[1] = rate * r1
        dp[2] = -side * p[0, i] * r1 - p[1, i] * rate * r2
    elif code == IMPULSE:
        s = t - p[2, i]
        e = exp(-p[1, i] * s * s)
        dp[0] = e
        dp[1] = -s * s * p[0, i] * e
        dp[2] = 2.0 * p[1, i] * s * p[0, i] * e
    elif code == BELT:
        a, a1, _, _ = ramp(delta, p[3, i])
        b, b1, _, _ = ramp(delta - p[2, i], p[3, i])
        dp[0] = a - b
        dp[1] = b
        dp[2] = -(p[1, i] - p[0, i]) * b1
        dp[4] = rate * a1
    elif code == AIRBAG:
        on, on1 = gate(t, p[7, i], p[8, i])
        x, x1, _, _ = ramp(-delta - p[4, i], p[5, i])
        length, power, cap = p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i]
        y, y1, _, _ = bag(x, p[0, i], p[1, i], length, power, cap)
        e = max(x - cap, 0.0)
        room = length - min(x, cap)
        # slopes of f = c0 - g (1 + n e/room + n (n + 1) e^2 / (2 room^2)), g = c1/room^n
        g = exp(-power * log(room))
        z = e / room
        shape = 1.0 + power * z + 0.5 * power * (power + 1.0) * z * z
        dp[0] = on
        dp[1] = -on * g * shape
        by_room = on * p[1, i] * g / room * (power * shape + power * z + power * (power + 1.0) * z * z)
        dp[3] = on * p[1, i] * g * (log(room) * shape - z - (power + 0.5) * z * z)
        dp[2] = by_room
        # onset: moves x by -x1, the room by -1 + x1 (below the cap); past the cap x - cap moves by 1 - x1
        if x < cap:
            dp[4] = -by_room - on * y1 * x1
        else:
            dp[4] = on * y1 * (1.0 - x1)
        dp[7] = -on1 * y


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
def smoothstep(s):
    """0 below 0, 1 above 1, s^3 (10 - 15 s + 6 s^2) between (C2); value and slope."""
    if s.real <= 0.0:
        return 0.0 * s, 0.0 * s
    if s.real >= 1.0:
        return 0.0 * s + 1.0, 0.0 * s
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s)
