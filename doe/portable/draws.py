"""Where the samplers' random numbers come from: a small integer generator started from a `Generator`.

numpy promises the stream of a bit generator, not that of `Generator.permuted` or `shuffle`; so one word is
taken from the bit generator and everything else is drawn by SplitMix64 inside the kernels. The same seed then
gives the same bits under every numpy and numba version.
"""

import numpy as np
from numpy.typing import NDArray

from doe.portable import _kernels_draws as kernels

__all__ = [
    "Draws",
    "level_permutations",
    "park_miller",
    "shuffled",
    "splitmix",
    "splitmix_at",
    "unit_numbers",
]

Draws = NDArray[np.uint64]
"""State of a generator: (kind, word), moved on in place by whoever draws from it."""

PARK_MILLER_MODULUS = 2**31 - 1
WORD = 2**64 - 1


def splitmix(rng: np.random.Generator) -> Draws:
    """SplitMix64 started from the next two raw words of the bit generator of `rng`.

    >>> int(splitmix(np.random.default_rng(1))[0])
    0

    Raises: TypeError when `rng` is not a numpy Generator.
    """
    if not isinstance(rng, np.random.Generator):
        raise TypeError(
            f"rng needs a numpy.random.Generator, got {rng!r}; use numpy.random.default_rng(seed)"
        )
    first, second = (int(w) for w in rng.bit_generator.random_raw(2))
    return splitmix_at(((first << 32) ^ second) & WORD)


def splitmix_at(word: int) -> Draws:
    """SplitMix64 in the given state, a whole number below 2^64."""
    return np.array([0, word], dtype=np.uint64)


def park_miller(seed: int) -> Draws:
    """The minimal standard generator seed <- 16807 seed mod (2^31 - 1), as in the published IHS runs.

    >>> park_miller(17).tolist()
    [1, 17]

    Raises: ValueError for a seed outside 1..2^31 - 2.
    """
    if not 0 < seed < PARK_MILLER_MODULUS:
        raise ValueError(f"seed of the Park-Miller generator needs 1..{PARK_MILLER_MODULUS - 1}, got {seed}")
    return np.array([1, seed], dtype=np.uint64)


def level_permutations(n: int, d: int, draws: Draws) -> NDArray[np.int32]:
    """d random permutations of 0..n-1, (d, n)."""
    out = np.empty((d, n), dtype=np.int32)
    kernels.permutations(draws, out)
    return out


def unit_numbers(shape: tuple[int, ...], draws: Draws) -> NDArray[np.float64]:
    """Numbers in [0, 1)."""
    out = np.empty(shape)
    kernels.units(draws, out)
    return out


def shuffled(entries: NDArray[np.int64], draws: Draws) -> NDArray[np.int64]:
    """The entries in random order, a copy."""
    out = np.array(entries, dtype=np.int64)
    kernels.shuffle(draws, out)
    return out
