"""Starting points of the likelihood search: a function of seed and data, never of the column order.

The inputs are ranked by how strongly they correlate with the response; the random starts are drawn for rank
1, 2, ... and handed to whichever column holds that rank. Permuting columns, or shifting, scaling or reversing
one, permutes the starts with them.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["canonical_columns", "canonical_rows", "draw"]

Array = NDArray[np.float64]

ACTIVE, INERT = 0.5, -5.0  # log theta in a box of width 1: about 13 % correlation across it; none of it lost
LADDER = (1e-2, 1e-4, 1e-6, 1e-1)  # nugget / sigma^2


def canonical_columns(x: Array, y: Array) -> NDArray[np.intp]:
    """Columns by |correlation| with y, then with the squared column: largest first."""
    centred = x - x.mean(axis=0)
    target = (y - y.mean(axis=0))[:, 0]
    keys = []
    for z in (centred**2 - (centred**2).mean(axis=0), centred):
        size = np.linalg.norm(z, axis=0) * np.linalg.norm(target)
        # ten digits: rounding must not decide the order of equal columns
        keys.append(np.round(np.abs(z.T @ target) / np.where(size > 0.0, size, 1.0), 10))
    return np.lexsort(keys)[::-1]


def canonical_rows(x: Array, y: Array) -> NDArray[np.intp]:
    """Rows by response, ties by the inputs in canonical order."""
    columns = canonical_columns(x, y)
    return np.lexsort([*x[:, columns[::-1]].T, y[:, 0]])


def draw(d: int, count: int, *, rng: np.random.Generator) -> Array:
    """(count, d) starts for log theta, columns in canonical order, for inputs scaled to width 1.

    The first is isotropic, the second falls with the rank, the third is isotropic and smooth; then come
    sparse starts (a few inputs active, the rest inert), which find the few factors of a large set, and wide
    Gaussian ones in turn.

    >>> draw(3, 4, rng=np.random.default_rng(0)).shape
    (4, 3)
    """
    out = np.empty((count, d))
    level = -0.7 * np.log(d)
    for i in range(count):
        if i in (0, 2):
            out[i] = level - 1.25 * i
        elif i == 1:
            out[i] = np.linspace(ACTIVE, INERT if d > 3 else -2.0, d)
        elif i % 2 == 1 and d > 3:
            out[i] = INERT
            out[i, rng.choice(d, size=min(5, 1 + d // 3), replace=False)] = ACTIVE
        else:
            out[i] = rng.normal(level + 0.5, 2.0, size=d)
    return out
