# mypy: ignore-errors
"""The candidate loop of improved distributed hypercube sampling.

Two questions decide about a candidate: is some chosen point nearer than `high` = target + best gap, and is
none nearer than `low` = target - best gap? One float32 matrix product over the first few coordinates bounds
all distances of a step from below; what the bound, less a slack for its rounding, cannot settle is summed
again in whole numbers, and only those decide. So the design does not depend on the matrix product.
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.portable._kernels_draws import below

FAR = np.int64(2**62)
ROUNDING = 4.0e-7  # a few units of float32 rounding, relative to the largest partial sum


@kernel(inner=True)
def squared_floor(x):
    """Largest whole number whose root is <= x; -1 for x < 0."""
    if x < 0.0:
        return np.int64(-1)
    s = np.int64(x * x)
    while np.sqrt(np.float64(s)) > x:
        s -= 1
    while np.sqrt(np.float64(s + 1)) <= x:
        s += 1
    return s


@kernel()
def nearest(candidate, chosen, bounds, c, m, limit, bar):
    """Smallest squared distance to the m chosen points, or `limit` when none is below it.

    bounds[:, c]: lower bounds of the distances, less |a|^2; those >= bar are beyond the limit.
    """
    best = limit
    for j in range(m):
        if bounds[j, c] < bar:
            total = np.int64(0)
            for t in range(candidate.size):
                step = np.int64(candidate[t]) - np.int64(chosen[j, t])
                total += step * step
            best = min(best, total)
    return best


@kernel(inner=True)
def smallest_rows(bounds, out):
    """out[c] = min over j of bounds[j, c]."""
    for c in range(out.size):
        out[c] = bounds[0, c]
    for j in range(1, bounds.shape[0]):
        row = bounds[j]
        for c in range(out.size):
            out[c] = row[c] if row[c] < out[c] else out[c]


@kernel(inner=True)
def partial_dimensions(n, d, limit):
    """Coordinates enough for nearly every random pair to be beyond the limit already: mean - 3 std."""
    ratio = np.float64(limit) / (np.float64(n) * n)
    for q in range(1, d):
        if q / 6.0 - 3.0 * np.sqrt(7.0 * q / 180.0) > ratio:
            return q if 10 * q < 7 * d else d  # all of them also tell what is too near
    return d


@kernel(inner=True)
def bound_rows(chosen, m, q, centre, rows):
    """rows[:m, :q] = b and rows[:m, q] = |b|^2 of the first q centred coordinates."""
    for i in range(m):
        total = np.float32(0.0)
        for k in range(q):
            b = np.float32(chosen[i, k] - centre)
            rows[i, k] = b
            total += b * b
        rows[i, q] = total


@kernel()
def cells(n, d, duplication, target, pool, state, out):
    """Fill out (n, d) with cells 1..n.

    pool: most candidates of a step; 0 for duplication times the free levels
    """
    centre = (n + 1) / 2.0
    free = np.empty((d, n), np.int32)
    chosen = np.empty((n, d), np.int32)
    for k in range(d):
        for j in range(n):
            free[k, j] = j + 1
        level = below(state, n) + 1
        out[n - 1, k] = level
        chosen[0, k] = level
        free[k, level - 1] = n
    most = duplication * max(n - 1, 1)
    if pool > 0:
        most = min(most, pool)
    candidates = np.empty((most, d), np.int32)
    stock = np.empty(duplication * n, np.int32)
    buffer = np.empty((d + 1) * most, np.float32)
    row_buffer = np.empty((d + 1) * n, np.float32)
    norms = np.empty(most, np.float32)
    smallest = np.empty(most, np.float32)
    high = FAR
    for count in range(n - 1, 1, -1):
        q = partial_dimensions(n, d, high)  # the limit of the step before: that of this one is close to it
        slack = ROUNDING * (q + 8) * n * n
        m = n - count
        entries = duplication * count
        made = entries if pool == 0 else min(entries, pool)
        skipped = entries - made
        factors = buffer[: (q + 1) * made].reshape(q + 1, made)
        rows = row_buffer[: (q + 1) * m].reshape(m, q + 1)
        bound_rows(chosen, m, q, centre, rows)
        norms[:made] = np.float32(0.0)
        factors[q] = np.float32(1.0)
        for k in range(d):
            for r in range(duplication):
                for j in range(count):
                    stock[r * count + j] = free[k, j]
            for left in range(entries, skipped, -1):
                j = below(state, left)
                level = stock[j]
                candidates[left - 1 - skipped, k] = level
                stock[j] = stock[left - 1]
                if k < q:
                    factors[k, left - 1 - skipped] = np.float32(level - centre)
            if k < q:
                for c in range(made):
                    a = factors[k, c]
                    norms[c] += a * a
                    factors[k, c] = np.float32(-2.0) * a
        bounds = np.dot(rows, factors)
        smallest_rows(bounds, smallest[:made])
        best, gap = 0, np.inf
        low, high = np.int64(-1), FAR
        for c in range(made):
            bound = np.float64(smallest[c]) + np.float64(norms[c])
            if bound - slack >= high or (q == d and bound + slack <= low):
                continue
            bar = np.float32(np.float64(high) - np.float64(norms[c]) + 2.0 * slack)
            found = nearest(candidates[c], chosen, bounds, c, m, high, bar)
            if low < found < high:
                score = np.abs(np.sqrt(np.float64(found)) - target)
                if score < gap:
                    best, gap = c, score
                    low = squared_floor(target - gap)
                    high = squared_floor(target + gap) + 1
        for k in range(d):
            level = candidates[best, k]
            out[count - 1, k] = level
            chosen[m, k] = level
            for j in range(count):
                if free[k, j] == level:
                    free[k, j] = free[k, count - 1]
                    break
    if n > 1:
        for k in range(d):
            out[0, k] = free[k, 0]


@kernel()
def nearest_squares(levels, rows):
    """Squared distance of each listed run of levels (d, n) to its nearest neighbour."""
    d, n = levels.shape
    out = np.empty(rows.size)
    squares = np.empty(n, np.int64)
    for r in range(rows.size):
        squares[:] = 0
        for k in range(d):
            for j in range(n):
                step = np.int64(levels[k, j]) - np.int64(levels[k, rows[r]])
                squares[j] += step * step
        squares[rows[r]] = FAR
        out[r] = squares.min()
    return out
