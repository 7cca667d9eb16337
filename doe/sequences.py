"""Low-discrepancy sequences and Latin hypercubes on orthogonal arrays, by scipy.stats.qmc."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from doe.latin.lhs import checked_size

__all__ = ["halton", "oa_lhs", "sobol"]

Floats = NDArray[np.float64]
SOBOL_FACTORS = 21201


def sobol(n: int, d: int, *, scramble: bool = True, rng: np.random.Generator) -> Floats:
    """The first n points of a (scrambled) Sobol' sequence, (n, d) in [0, 1).

    Balance holds for n a power of two; other n take the head of the next one. The unscrambled sequence
    starts at the corner 0 and needs no random numbers.

    >>> sobol(4, 2, scramble=False, rng=np.random.default_rng(1)).tolist()
    [[0.0, 0.0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.75]]

    Raises: ValueError for n or d < 1 and d > 21201.
    """
    n, d = checked_size(n, d)
    if d > SOBOL_FACTORS:
        raise ValueError(f"d needs at most {SOBOL_FACTORS} factors for Sobol' points, got {d}")
    engine = qmc.Sobol(d, scramble=scramble, rng=rng)
    return np.ascontiguousarray(engine.random_base2((n - 1).bit_length())[:n])


def halton(n: int, d: int, *, scramble: bool = True, rng: np.random.Generator) -> Floats:
    """The first n points of a (scrambled) Halton sequence, (n, d) in [0, 1).

    Beyond about ten factors neighbouring columns are strongly correlated for small n; compare `doe.quality`.

    >>> halton(2, 2, scramble=False, rng=np.random.default_rng(1)).round(4).tolist()
    [[0.0, 0.0], [0.5, 0.3333]]
    """
    n, d = checked_size(n, d)
    return np.ascontiguousarray(qmc.Halton(d, scramble=scramble, rng=rng).random(n))


def oa_lhs(n: int, d: int, *, rng: np.random.Generator) -> Floats:
    """A Latin hypercube on an orthogonal array of strength 2 (Tang 1993): n = q^2, q prime, d <= q + 1.

    Every pair of columns has one point in each of the q x q cells.

    >>> points = oa_lhs(9, 3, rng=np.random.default_rng(1))
    >>> len({tuple(cell) for cell in (points[:, :2] * 3).astype(int).tolist()})
    9

    Raises: ValueError when n is not the square of a prime (the message names the nearest) or d > q + 1.
    """
    n, d = checked_size(n, d)
    q = round(n**0.5)
    if q * q != n or not _is_prime(q):
        near = sorted((k for k in range(2, q + 20) if _is_prime(k)), key=lambda k: (abs(k * k - n), k))
        raise ValueError(
            f"n needs the square of a prime for an orthogonal array, got {n}; the nearest are"
            f" {', '.join(str(k * k) for k in sorted(near[:2]))}"
        )
    if d > q + 1:
        raise ValueError(f"d needs at most {q + 1} factors for an array of {n} runs, got {d}")
    return np.ascontiguousarray(qmc.LatinHypercube(d, strength=2, rng=rng).random(n))


def _is_prime(q: int) -> bool:
    return q > 1 and all(q % k for k in range(2, int(q**0.5) + 1))
