# mypy: ignore-errors
"""Kernels of the interior point of the separable subproblem: one pass over the variables each.

All is in units of the subproblem: variables x in [0, 1], up = 1 - x kept apart for its digits; objective
and constraints over their reach, rows 0 and 1 to m of g, s, p and q (m + 1, n): gradients, distances,
exponents and curvatures. y (m,) are the constraints' multipliers, below and above (n,) those of the box. No
fastmath: infinite distances (linear terms) must be seen.
"""

import numba
import numpy as np

TAKEN_UP = 3.0  # times or parts of its target that a product may become to take up what is left


@numba.njit(cache=True, error_model="numpy")
def conditions(x, up, y, below, above, target, f, g, s, p, q, x0, slopes, bend, rest):
    """Values (m + 1,); the largest of the Lagrangian's slopes, the sum and the least of the products of the
    box's multipliers with their distances; fills slopes (m + 1, n), the Lagrangian's curvature bend (n,) and
    its slope rest (n,), of which below and above take up what they can with products near the target."""
    rows, n = g.shape
    values = f.copy()
    largest, total, least = 0.0, 0.0, np.inf
    for i in range(n):
        d = x[i] - x0[i]
        slope, curve = 0.0, 0.0
        for j in range(rows):
            gji, pji, qji = g[j, i], p[j, i], q[j, i]
            weight = 1.0 if j == 0 else y[j - 1]
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
        slope += above[i] - below[i]
        most, fewest = TAKEN_UP * target, target / TAKEN_UP
        if slope > 0.0:
            change = min(slope, max(most / x[i] - below[i], 0.0))
            below[i] += change
            slope -= change
            change = min(slope, max(above[i] - fewest / up[i], 0.0))
            above[i] -= change
            slope -= change
        elif slope < 0.0:
            change = min(-slope, max(most / up[i] - above[i], 0.0))
            above[i] += change
            slope += change
            change = min(-slope, max(below[i] - fewest / x[i], 0.0))
            below[i] -= change
            slope += change
        rest[i], bend[i] = slope, curve
        largest = max(largest, abs(slope))
        if slope != slope:
            largest = np.inf
        low, high = below[i] * x[i], above[i] * up[i]
        total += low + high
        least = min(least, low, high)
    return values, largest, total, least


@numba.njit(cache=True, error_model="numpy")
def barrier_bend(x, up, below, above, slopes, bend, theta, weight):
    """Fills theta (n,), the Lagrangian's curvature with that of the barrier, and weight (n,), what a variable
    brings into the system of the constraints."""
    rows, n = slopes.shape
    for i in range(n):
        theta[i] = bend[i] + below[i] / x[i] + above[i] / up[i]
        square = 0.0
        for j in range(1, rows):
            square += slopes[j, i] * slopes[j, i]
        weight[i] = square / theta[i]


@numba.njit(cache=True, error_model="numpy")
def assemble(slopes, theta, kept):
    """J diag(1/theta) J' (m, m), J the constraints' slopes, without the variables that are kept."""
    rows, n = slopes.shape
    m = rows - 1
    matrix = np.zeros((m, m))
    for i in range(n):
        if kept[i]:
            continue
        t = 1.0 / theta[i]
        for j in range(m):
            along = slopes[j + 1, i] * t
            for k in range(j + 1):
                matrix[j, k] += along * slopes[k + 1, i]
    for j in range(m):
        for k in range(j):
            matrix[k, j] = matrix[j, k]
    return matrix


@numba.njit(cache=True, error_model="numpy")
def right_side(x, up, below, above, mu, slopes, rest, theta, kept, plow, phigh, first):
    """J (first/theta) (m,) without the variables that are kept; fills first (n,), what the slopes ask of each
    variable where the products of the box are to become mu less plow, phigh (n,), their second-order
    terms."""
    rows, n = slopes.shape
    m = rows - 1
    right = np.zeros(m)
    for i in range(n):
        b = -(rest[i] + below[i] - above[i]) + (mu - plow[i]) / x[i] - (mu - phigh[i]) / up[i]
        first[i] = b
        if kept[i]:
            continue
        b /= theta[i]
        for j in range(m):
            right[j] += slopes[j + 1, i] * b
    return right


@numba.njit(cache=True, error_model="numpy")
def directions(x, up, below, above, mu, slopes, theta, kept, first, dy, plow, phigh, dx, dbelow, dabove):
    """The longest step that stays inside; fills the moves (n,), dx but for the variables that are kept."""
    m, n = len(dy), len(x)
    longest = 1e300
    for i in range(n):
        low, high = x[i], up[i]
        if not kept[i]:
            along = first[i]
            for j in range(m):
                along -= dy[j] * slopes[j + 1, i]
            dx[i] = along / theta[i]
        d = dx[i]
        dbelow[i] = (mu - plow[i]) / low - below[i] - below[i] / low * d
        dabove[i] = (mu - phigh[i]) / high - above[i] + above[i] / high * d
        if d < 0.0:
            longest = min(longest, -low / d)
        elif d > 0.0:
            longest = min(longest, high / d)
        if dbelow[i] < 0.0:
            longest = min(longest, -below[i] / dbelow[i])
        if dabove[i] < 0.0:
            longest = min(longest, -above[i] / dabove[i])
    return longest


@numba.njit(cache=True, error_model="numpy")
def products(x, up, below, above, length, dx, dbelow, dabove, plow, phigh):
    """The sum of the products after a step; fills the second-order terms of the products (n,)."""
    total = 0.0
    for i in range(len(x)):
        d = length * dx[i]
        total += (x[i] + d) * (below[i] + length * dbelow[i])
        total += (up[i] - d) * (above[i] + length * dabove[i])
        plow[i], phigh[i] = dx[i] * dbelow[i], -dx[i] * dabove[i]
    return total
