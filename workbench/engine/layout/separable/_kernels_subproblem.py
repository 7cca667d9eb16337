# mypy: ignore-errors
"""Kernels of the separable subproblem: the minimiser of the Lagrangian, coordinate by coordinate.

L_i'(x) = sum_j w_j [ g_ji r^(p_ji - 1) + q_ji (x - x_i^k) ],  r = 1 + (x - x_i^k)/s_ji,  is monotone for a
convex model: safeguarded Newton inside a shrinking bracket. Infinite s (linear terms) must be seen, so no
fastmath.
"""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def slope(i, x, w, g, s, p, q, x0):
    d = x - x0[i]
    first, second = 0.0, 0.0
    for j in range(len(w)):
        if w[j] == 0.0:
            continue
        if p[j, i] == 1.0:
            first += w[j] * (g[j, i] + q[j, i] * d)
            second += w[j] * q[j, i]
        else:
            r = 1.0 + d / s[j, i]
            power = g[j, i] * r ** (p[j, i] - 1.0)
            first += w[j] * (power + q[j, i] * d)
            second += w[j] * (power * (p[j, i] - 1.0) / (r * s[j, i]) + q[j, i])
    return first, second


@numba.njit(cache=True, error_model="numpy")
def lagrangian_slopes(x, w, g, s, p, q, x0):
    """First and second derivatives (n,) of the weighted sum of the rows."""
    first, second = np.empty_like(x), np.empty_like(x)
    for i in range(len(x)):
        first[i], second[i] = slope(i, x[i], w, g, s, p, q, x0)
    return first, second


@numba.njit(cache=True, error_model="numpy")
def minimise_lagrangian(w, g, s, p, q, x0, lo, hi, x, curvature):
    """x (n,) and curvature (n,) are filled; curvature is 0 where x sits on a bound."""
    for i in range(len(x0)):
        curvature[i] = 0.0
        if hi[i] <= lo[i]:
            x[i] = lo[i]
            continue
        a, b = lo[i], hi[i]
        fa, _ = slope(i, a, w, g, s, p, q, x0)
        fb, _ = slope(i, b, w, g, s, p, q, x0)
        if fa == 0.0 and fb == 0.0:  # the Lagrangian does not see this variable: stay
            x[i] = min(max(x0[i], a), b)
            continue
        if fa >= 0.0:
            x[i] = a
            continue
        if fb <= 0.0:
            x[i] = b
            continue
        # one power term in the objective, linear constraints: the closed form (7.11)
        rest, plain = 0.0, q[0, i] == 0.0 and p[0, i] != 1.0
        for j in range(1, len(w)):
            rest += w[j] * g[j, i]
            if w[j] != 0.0 and (p[j, i] != 1.0 or q[j, i] != 0.0):
                plain = False
        if plain:
            ratio = -rest / (w[0] * g[0, i])
            if ratio > 0.0:
                z = x0[i] + s[0, i] * (ratio ** (1.0 / (p[0, i] - 1.0)) - 1.0)
                x[i] = min(max(z, a), b)
                curvature[i] = slope(i, x[i], w, g, s, p, q, x0)[1] if a < z < b else 0.0
                continue
        z = min(max(x0[i], a), b)
        width = b - a
        for _ in range(200):
            f, c = slope(i, z, w, g, s, p, q, x0)
            if f == 0.0:
                break
            if f < 0.0:
                a = z
            else:
                b = z
            new = z - f / c if c > 0.0 else a
            if not (a < new < b) or b - a > 0.5 * width:
                # Newton left the bracket, or the bracket does not shrink: halve it
                if not (a < new < b):
                    new = 0.5 * (a + b)
            width = b - a
            if new == z or abs(new - z) <= 2e-16 * max(abs(z), abs(new)):
                z = new
                break
            z = new
        x[i] = z
        curvature[i] = slope(i, z, w, g, s, p, q, x0)[1]


@numba.njit(cache=True, error_model="numpy")
def model_rows(x, f, g, s, p, q, x0):
    """Values (m,) and gradients (m, n) of all model functions at x."""
    m, n = g.shape
    values = f.copy()
    gradients = np.empty((m, n))
    for j in range(m):
        for i in range(n):
            d = x[i] - x0[i]
            gji, sji, pji = g[j, i], s[j, i], p[j, i]
            if pji == 1.0:
                values[j] += gji * d + 0.5 * q[j, i] * d * d
                gradients[j, i] = gji + q[j, i] * d
            else:
                log = np.log1p(d / sji)
                term = log if pji == 0.0 else np.expm1(pji * log) / pji
                values[j] += gji * sji * term + 0.5 * q[j, i] * d * d
                gradients[j, i] = gji * np.exp((pji - 1.0) * log) + q[j, i] * d
    return values, gradients


@numba.njit(cache=True, error_model="numpy")
def term(i, j, d, g, s, p, q):
    """What a variable adds to a row when it moves by d."""
    gji, sji, pji = g[j, i], s[j, i], p[j, i]
    if pji == 1.0:
        return gji * d + 0.5 * q[j, i] * d * d
    log = np.log1p(d / sji)
    power = log if pji == 0.0 else np.expm1(pji * log) / pji
    return gji * sji * power + 0.5 * q[j, i] * d * d


@numba.njit(cache=True, error_model="numpy")
def shorten(limits, g, s, p, q, x0, lo, hi):
    """Draws lo and hi (n,) in to where no term of a constraint is above its limit (m,)."""
    for i in range(len(x0)):
        if not lo[i] <= x0[i] <= hi[i]:
            continue
        for j in range(len(limits)):
            for side in range(2):
                far = (lo[i] if side == 0 else hi[i]) - x0[i]
                if not term(i, j + 1, far, g, s, p, q) > limits[j]:
                    continue
                near = 0.0
                while abs(far - near) > 0.01 * abs(far):
                    middle = 0.1 * far if near == 0.0 else 0.5 * (near + far)
                    if term(i, j + 1, middle, g, s, p, q) > limits[j]:
                        far = middle
                    else:
                        near = middle
                if side == 0:
                    lo[i] = x0[i] + far
                else:
                    hi[i] = x0[i] + far
