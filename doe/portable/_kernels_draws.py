# mypy: ignore-errors
"""Integer generators for kernels: the state is an array of two words, (kind, word), and is moved on in place.

kind 0 is SplitMix64 (Steele, Lea & Flood 2014); kind 1 is the minimal standard generator of Park & Miller
(1988), whose draws the published IHS runs used. Integers only, or one correctly rounded product: the same
draws on every platform.
"""

import numpy as np

from doe._kernel_cache import kernel

GAMMA = np.uint64(0x9E3779B97F4A7C15)
MIX_A = np.uint64(0xBF58476D1CE4E5B9)
MIX_B = np.uint64(0x94D049BB133111EB)
S27, S30, S31, S32, S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(32), np.uint64(11)
MULTIPLIER = np.uint64(16807)
MODULUS = np.uint64(2147483647)
ONE = np.uint64(1)
TO_UNIT = 4.656612875e-10  # 1 / (2^31 - 1) as the published program rounds it
TO_UNIT_53 = 1.0 / 9007199254740992.0


@kernel(allocates=False, inner=True)
def word(state):
    """The next 64 bits of SplitMix64."""
    state[1] += GAMMA
    z = state[1]
    z = (z ^ (z >> S30)) * MIX_A
    z = (z ^ (z >> S27)) * MIX_B
    return z ^ (z >> S31)


@kernel(allocates=False)
def below(state, k):
    """A whole number in 0..k-1, k < 2^31."""
    if state[0] == ONE:
        state[1] = (state[1] * MULTIPLIER) % MODULUS
        return np.int64(np.float64(np.int64(state[1])) * TO_UNIT * k)
    return np.int64(((word(state) >> S32) * np.uint64(k)) >> S32)


@kernel()
def shuffle(state, entries):
    for k in range(entries.size - 1, 0, -1):
        j = below(state, k + 1)
        entries[j], entries[k] = entries[k], entries[j]


@kernel()
def permutations(state, out):
    """Fill each row of out (d, n) with a random permutation of 0..n-1."""
    for k in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[k, i] = i
        shuffle(state, out[k])


@kernel()
def units(state, out):
    """Fill out with numbers in [0, 1), multiples of 2^-53."""
    flat = out.ravel()
    for i in range(flat.size):
        flat[i] = np.float64(np.int64(word(state) >> S11)) * TO_UNIT_53
