# mypy: ignore-errors
"""Kernels of the interior point of the separable subproblem: one pass over the variables each.

g, s, p, q (m + 1, n): gradients, distances, exponents and curvatures of objective and constraints. No
fastmath: infinite distances (linear terms) must be seen.
"""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def conditions(x, y, below, above, f, g, s, p, q, x0, unit, size, slopes, bend, rest):
    """Values (m + 1,); fills slopes (m + 1, n), the Lagrangian's curvature bend (n,) and what is left of its
    slope, rest (n,)."""
    rows, n = g.shape
    values = f.copy()
    for i in range(n):
        d = x[i] - x0[i]
        slope, curve = 0.0, 0.0
        for j in range(rows):
            gji, pji, qji = g[j, i], p[j, i], q[j, i]
            weight = 1.0 / unit if j == 0 else y[j - 1] / size[j - 1]
            if pji == 1.0:
                values[j] += gji * d + 0.5 * qji * d * d
                now = gji + qji * d
                curve += weight * qji
            else:
                sji = s[j, i]
                r = 1.0 + d / sji
                if pji == -1.0:
                    power, term = 1.0 / (r * r), d / (sji * r)
                elif pji == 0.0:
                    power, term = 1.0 / r, np.log(r)
                else:
                    log = np.log1p(d / sji)
                    power = np.exp((pji - 1.0) * log)
                    change = pji * log
                    term = (power * r - 1.0 if abs(change) > 0.1 else np.expm1(change)) / pji
                values[j] += gji * sji * term + 0.5 * qji * d * d
                now = gji * power + qji * d
                curve += weight * (gji * power * (pji - 1.0) / (r * sji) + qji)
            slopes[j, i] = now
            slope += weight * now
        rest[i], bend[i] = slope + above[i] - below[i], curve
    return values


@numba.njit(cache=True, error_model="numpy")
def residuals(x, below, above, mu, lo, hi, rest):
    """The sum of squares and the largest of what is left of the conditions by variable."""
    squares, largest = 0.0, 0.0
    for i in range(len(x)):
        for part in (
            rest[i] * (hi[i] - lo[i]),
            below[i] * (x[i] - lo[i]) - mu,
            above[i] * (hi[i] - x[i]) - mu,
        ):
            squares += part * part
            largest = max(largest, abs(part))
            if part != part:
                largest = np.inf
    return squares, largest


@numba.njit(cache=True, error_model="numpy")
def assemble(x, below, above, mu, lo, hi, size, slopes, bend, rest, theta, first):
    """J diag(1/theta) J' (m, m) and J (first/theta) (m,), J the constraints' slopes over their sizes; fills
    theta (n,) and first (n,)."""
    rows, n = slopes.shape
    m = rows - 1
    matrix, right = np.zeros((m, m)), np.zeros(m)
    for i in range(n):
        width = hi[i] - lo[i]
        sl, su = max(x[i] - lo[i], 1e-16 * width), max(hi[i] - x[i], 1e-16 * width)
        t = bend[i] + below[i] / sl + above[i] / su
        b = -(rest[i] + below[i] - above[i]) + mu / sl - mu / su
        theta[i], first[i] = t, b
        for j in range(m):
            along = slopes[j + 1, i] / (size[j] * t)
            right[j] += along * b
            for k in range(j + 1):
                matrix[j, k] += along * slopes[k + 1, i] / size[k]
    for j in range(m):
        for k in range(j):
            matrix[k, j] = matrix[j, k]
    return matrix, right


@numba.njit(cache=True, error_model="numpy")
def directions(x, below, above, mu, lo, hi, size, slopes, theta, first, dy, dx, dbelow, dabove):
    """The longest step, at most 1, that keeps 0.5 % of each distance and multiplier; fills the moves (n,)."""
    m, n = len(size), len(x)
    length = 1.0
    for i in range(n):
        width = hi[i] - lo[i]
        sl, su = max(x[i] - lo[i], 1e-16 * width), max(hi[i] - x[i], 1e-16 * width)
        along = first[i]
        for j in range(m):
            along -= dy[j] * slopes[j + 1, i] / size[j]
        d = along / theta[i]
        dx[i] = d
        dbelow[i] = mu / sl - below[i] - below[i] / sl * d
        dabove[i] = mu / su - above[i] + above[i] / su * d
        if d < 0.0:
            length = min(length, -0.995 * sl / d)
        elif d > 0.0:
            length = min(length, 0.995 * su / d)
        if dbelow[i] < 0.0:
            length = min(length, -0.995 * below[i] / dbelow[i])
        if dabove[i] < 0.0:
            length = min(length, -0.995 * above[i] / dabove[i])
    return length
