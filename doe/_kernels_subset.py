# mypy: ignore-errors
"""Choosing rows: the farthest candidate next, then exchanges that lower phi_p.

Coordinates are whole numbers, so that squared distances are, and the choice is the same on every platform.
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.portable._kernels_draws import below
from doe.portable._kernels_whole_sums import inverse_power, whole


@kernel()
def squared(x, i, j):
    total = np.int64(0)
    for k in range(x.shape[1]):
        step = np.int64(x[i, k]) - np.int64(x[j, k])
        total += step * step
    return total


@kernel()
def farthest(x, chosen, kept, used):
    """Fill chosen[kept:], each time with the candidate farthest from those chosen (Kennard & Stone)."""
    nearest = np.full(x.shape[0], np.int64(2**62))
    for c in range(chosen.size):
        if c >= kept:
            best = -1
            for r in range(x.shape[0]):
                if not used[r] and (best < 0 or nearest[r] > nearest[best]):
                    best = r
            chosen[c] = best
            used[best] = True
        for r in range(x.shape[0]):
            nearest[r] = min(nearest[r], squared(x, r, chosen[c]))


@kernel()
def exchange_rows(x, chosen, kept, used, h, scale, trials, state):
    """Exchange chosen rows for others when the sum over pairs of D^-h falls; returns the exchanges made."""
    n = chosen.size
    rows = np.zeros(n, np.int64)
    for a in range(n):
        for b in range(n):
            if a != b:
                rows[a] += whole(inverse_power(np.float64(squared(x, chosen[a], chosen[b])), h, scale))
    terms = np.empty(n, np.int64)
    made = 0
    for _ in range(trials):
        a = kept + below(state, n - kept)
        other = kept + below(state, n - kept)
        if rows[other] > rows[a]:  # of two, the one that crowds more
            a = other
        r = below(state, x.shape[0])
        if used[r]:
            continue
        total = np.int64(0)
        for b in range(n):
            terms[b] = 0
            if b != a:
                terms[b] = whole(inverse_power(np.float64(squared(x, r, chosen[b])), h, scale))
                total += terms[b]
                if total >= rows[a]:
                    break
        if total < rows[a]:
            made += 1
            for b in range(n):
                if b != a:
                    rows[b] += terms[b]
                    rows[b] -= whole(inverse_power(np.float64(squared(x, chosen[a], chosen[b])), h, scale))
            rows[a] = total
            used[chosen[a]] = False
            used[r] = True
            chosen[a] = r
    return made
