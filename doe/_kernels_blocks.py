# mypy: ignore-errors
"""Runs dealt out to blocks: swaps that bring the means of all blocks together."""

from doe._kernel_cache import kernel
from doe.portable._kernels_draws import below


@kernel()
def deal(columns, label, sums, sizes, trials, state):
    """Swap runs between blocks while the sum over blocks of |sum of columns|^2 / size falls.

    columns: (n, q) whole numbers; label: (n,) block of each run; sums: (blocks, q).
    """
    n, q = columns.shape
    for _ in range(trials):
        i, j = below(state, n), below(state, n)
        a, b = label[i], label[j]
        if a == b:
            continue
        change = 0.0
        for k in range(q):
            step = columns[j, k] - columns[i, k]
            change += (2.0 * step * sums[a, k] + step * step) / sizes[a]
            change += (-2.0 * step * sums[b, k] + step * step) / sizes[b]
        if change < -1.0e-9:
            for k in range(q):
                step = columns[j, k] - columns[i, k]
                sums[a, k] += step
                sums[b, k] -= step
            label[i], label[j] = b, a
