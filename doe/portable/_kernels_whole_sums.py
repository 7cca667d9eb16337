# mypy: ignore-errors
"""Sums whose order, vector width and platform do not matter: their terms are whole numbers.

Each term is computed in double precision, every operation rounded on its own (no fastmath), then put on a
whole-number scale by adding MAGIC, whose last bit is worth one.
"""

import numpy as np

from doe._kernel_cache import kernel

MAGIC = 6755399441055744.0  # 1.5 * 2^52: the sum of it and |t| < 2^51 holds t rounded to a whole number
MAGIC_BITS = np.int64(np.float64(MAGIC).view(np.int64))
CLAMP = 2.0**48  # largest single term: n of them stay far below 2^63


@kernel(allocates=False, inner=True)
def inverse_power(q, h, scale):
    """scale * q^-h, at most CLAMP."""
    inverse = 1.0 / q
    t = scale * inverse
    for _ in range(h - 1):
        t *= inverse
    return min(t, CLAMP)


@kernel(allocates=False, inner=True)
def whole(t):
    """t on the whole-number scale, rounded as MAGIC rounds."""
    return np.int64((t + MAGIC) - MAGIC)
