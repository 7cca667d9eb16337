# mypy: ignore-errors
"""Kernel of the signs of elongations: for each member by itself, signs of its column with small |L^-1 z|^2.

The innovations v = L^-1 z come one after the other, v_t = (z_t - sum_j<t L_tj v_j)/L_tt: after each entry the
best few ways of signing those so far are kept.
"""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def likeliest_signs(size, L, kept):
    """size (members, designs), L (designs, designs) -> signs like size, and |L^-1 z|^2 (members, 2) with the
    best signs and with the next."""
    n, D = size.shape
    signs, misfits = np.ones((n, D)), np.full((n, 2), np.inf)
    # signs and innovations, now and next in turn
    ways, before = np.ones((2, kept, D)), np.zeros((2, kept, D))
    so_far, then = np.zeros(kept), np.zeros(2 * kept)
    new = np.zeros(2 * kept)
    for i in range(n):
        count, now = 1, 0
        so_far[0] = 0.0
        for t in range(D):
            turns = 2 if t > 0 else 1  # the sign of the first is a matter of taste
            for k in range(count):
                foretold = 0.0
                for j in range(t):
                    foretold += L[t, j] * before[now, k, j]
                for turn in range(turns):
                    v = ((1 - 2 * turn) * size[i, t] - foretold) / L[t, t]
                    new[turns * k + turn] = v
                    then[turns * k + turn] = so_far[k] + v * v
            options = turns * count
            count = min(kept, options)
            for place in range(count):
                best = 0
                for k in range(1, options):
                    if then[k] < then[best]:
                        best = k
                source = best // turns
                for j in range(t):
                    ways[1 - now, place, j] = ways[now, source, j]
                    before[1 - now, place, j] = before[now, source, j]
                ways[1 - now, place, t] = 1 - 2 * (best % turns)
                before[1 - now, place, t] = new[best]
                so_far[place] = then[best]
                then[best] = np.inf
            now = 1 - now
        signs[i] = ways[now, 0]
        misfits[i, : min(2, count)] = so_far[: min(2, count)]
    return signs, misfits
