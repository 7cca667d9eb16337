"""Cases far from all that were run: where an adversary has not been yet.

    next = the one of many random cases whose nearest neighbour, drawn ones included, is furthest

Greedy maximin, as Johnson, Moore and Ylvisaker 1990 ask of a design. In few inputs it fills the gaps that a
random draw leaves; in many, every case is far from every other, and it does no harm.
"""

import numpy as np

__all__ = ["CANDIDATES", "emptiest"]

CANDIDATES = 2000  # random cases that the emptiest are chosen from


def emptiest(candidates: np.ndarray, known: np.ndarray, size: int) -> np.ndarray:
    """The places (size,) of those candidates (m, p) that are furthest from `known` (n, p) and each other.

    >>> emptiest(np.array([[0.1], [0.5], [0.9]]), np.array([[0.0]]), 2).tolist()
    [2, 1]
    """
    squares = (candidates**2).sum(axis=1)[:, None] + (known**2).sum(axis=1) - 2 * candidates @ known.T
    nearest = np.maximum(squares, 0.0).min(axis=1)
    chosen = []
    for _ in range(min(size, len(candidates))):
        i = int(np.argmax(nearest))
        chosen.append(i)
        nearest = np.minimum(nearest, ((candidates - candidates[i]) ** 2).sum(axis=1))
    return np.array(chosen, dtype=int)
