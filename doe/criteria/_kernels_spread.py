# mypy: ignore-errors
"""Pair sums of a design: distances, discrepancies and projections, over all pairs or over sampled rows.

Points come as columns, (d, n). `rows` lists the runs to sum for: with `half` the pairs j > i only (exact,
rows = 0..n-1), else all j != i, so that a sample of rows estimates means over all runs. Loops run over
blocks of runs so that a block's products stay in the first cache.
"""

import numpy as np

from doe._kernel_cache import kernel

BLOCK = 256


@kernel(fastmath=True)
def distances(columns, rows, half, power, nearest, sums):
    """Per sampled row r: nearest[r] = smallest squared distance, sums[r] = sum of d^-(2 power) over others.

    With `half`, nearest is kept for both runs of a pair, so it is complete for every run.
    """
    d, n = columns.shape
    block = np.empty(BLOCK)
    for r in range(rows.size):
        i = rows[r]
        total = 0.0
        for start in range(i + 1 if half else 0, n, BLOCK):
            size = min(BLOCK, n - start)
            squares = block[:size]
            squares[:] = 0.0
            for k in range(d):
                x = columns[k, i]
                others = columns[k, start : start + size]
                for j in range(size):
                    squares[j] += (others[j] - x) * (others[j] - x)
            if start <= i < start + size:
                squares[i - start] = 1.0e300
            least = nearest[r]
            for j in range(size):
                least = min(least, squares[j])
            nearest[r] = least
            if half:
                for j in range(size):
                    if squares[j] < nearest[start + j]:
                        nearest[start + j] = squares[j]
            for j in range(size):
                inverse = 1.0 / squares[j]
                term = inverse
                for _ in range(power - 1):
                    term *= inverse
                total += term
        sums[r] = total


@kernel(fastmath=True)
def discrepancies(columns, rows, half, sums):
    """sums[:, r]: the pair products of the centred, wrap-around and mixture discrepancy, summed over j."""
    d, n = columns.shape
    centred, wrapped, mixed = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for r in range(rows.size):
        i = rows[r]
        c, w, m = 0.0, 0.0, 0.0
        for start in range(i + 1 if half else 0, n, BLOCK):
            size = min(BLOCK, n - start)
            cs, ws, ms = centred[:size], wrapped[:size], mixed[:size]
            cs[:] = 1.0
            ws[:] = 1.0
            ms[:] = 1.0
            for k in range(d):
                x = columns[k, i]
                z = abs(x - 0.5)
                others = columns[k, start : start + size]
                for j in range(size):
                    y = others[j]
                    zy = abs(y - 0.5)
                    gap = abs(x - y)
                    cs[j] *= 1.0 + 0.5 * (z + zy - gap)
                    ws[j] *= 1.5 - gap * (1.0 - gap)
                    ms[j] *= 1.875 - 0.25 * (z + zy) - 0.75 * gap + 0.5 * gap * gap
            if start <= i < start + size:
                cs[i - start] = 0.0
                ws[i - start] = 0.0
                ms[i - start] = 0.0
            for j in range(size):
                c += cs[j]
                w += ws[j]
                m += ms[j]
        sums[0, r], sums[1, r], sums[2, r] = c, w, m


@kernel(fastmath=True)
def centred_products(columns, rows, half, sums):
    """sums[r]: the pair products of the centred discrepancy alone, summed over j.

    1/2 |z| + 1/2 |w| - 1/2 |z - w| is min(|z|, |w|) on the same side of the centre and 0 across it.
    """
    d, n = columns.shape
    block = np.empty(BLOCK)
    for r in range(rows.size):
        i = rows[r]
        total = 0.0
        for start in range(i + 1 if half else 0, n, BLOCK):
            size = min(BLOCK, n - start)
            products = block[:size]
            products[:] = 1.0
            for k in range(d):
                z = columns[k, i] - 0.5
                others = columns[k, start : start + size]
                if z >= 0.0:
                    for j in range(size):
                        products[j] *= 1.0 + min(max(others[j] - 0.5, 0.0), z)
                else:
                    for j in range(size):
                        products[j] *= 1.0 + min(max(0.5 - others[j], 0.0), -z)
            if start <= i < start + size:
                products[i - start] = 0.0
            for j in range(size):
                total += products[j]
        sums[r] = total


@kernel()
def projections(columns, rows, half, sums):
    """sums[r] = sum over j of prod_k (x_ik - x_jk)^-2; infinite when two runs share a value."""
    d, n = columns.shape
    block = np.empty(BLOCK)
    for r in range(rows.size):
        i = rows[r]
        total = 0.0
        for start in range(i + 1 if half else 0, n, BLOCK):
            size = min(BLOCK, n - start)
            products = block[:size]
            products[:] = 1.0
            for k in range(d):
                x = columns[k, i]
                others = columns[k, start : start + size]
                for j in range(size):
                    products[j] *= (others[j] - x) * (others[j] - x)
            if start <= i < start + size:
                products[i - start] = np.inf
            for j in range(size):
                total += 1.0 / products[j]
        sums[r] = total


@kernel(fastmath=True)
def singles(points, out):
    """out: single sums (centred, mixed) and diagonals (centred, mixed) of the discrepancies."""
    for c in range(4):
        out[c] = 0.0
    for i in range(points.shape[0]):
        centred, mixed, own, own_mixed = 1.0, 1.0, 1.0, 1.0
        for k in range(points.shape[1]):
            z = abs(points[i, k] - 0.5)
            centred *= 1.0 + 0.5 * z - 0.5 * z * z
            mixed *= 5.0 / 3.0 - 0.25 * z - 0.25 * z * z
            own *= 1.0 + z
            own_mixed *= 1.875 - 0.5 * z
        out[0] += centred
        out[1] += mixed
        out[2] += own
        out[3] += own_mixed


@kernel(fastmath=True)
def pair_projections(columns, out):
    """out[k, l], l < k: pair products of the centred discrepancy of columns k and l, summed over i < j."""
    d, n = columns.shape
    factors = np.empty((d, BLOCK))
    for i in range(n):
        for start in range(i + 1, n, BLOCK):
            size = min(BLOCK, n - start)
            for k in range(d):
                z = columns[k, i] - 0.5
                for j in range(size):
                    w = columns[k, start + j] - 0.5
                    factors[k, j] = 1.0 + max(min(z, w), 0.0) - min(max(z, w), 0.0)
            for k in range(d):
                for l in range(k):
                    total = 0.0
                    for j in range(size):
                        total += factors[k, j] * factors[l, j]
                    out[k, l] += total


@kernel(fastmath=True)
def probe_distances(columns, probes, out):
    """out[q]: squared distance of probe q (probes: (m, d)) to the nearest of n runs."""
    d, n = columns.shape
    block = np.empty(BLOCK)
    for q in range(out.size):
        least = 1.0e300
        for start in range(0, n, BLOCK):
            size = min(BLOCK, n - start)
            squares = block[:size]
            squares[:] = 0.0
            for k in range(d):
                x = probes[q, k]
                others = columns[k, start : start + size]
                for j in range(size):
                    squares[j] += (others[j] - x) * (others[j] - x)
            for j in range(size):
                least = min(least, squares[j])
        out[q] = least
