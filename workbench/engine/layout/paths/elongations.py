"""Elongations of members up to their signs, and the signs that agree with each other.

A compliance f'u of K(x) u = f, K = sum x_i b_i b_i', has the slopes -e_i^2 with the elongations e = B u. The
gradients of a path give |e_i| at each of its designs. Which sign the first has is a matter of taste, member
by member; the signs at the later ones relate to it. As the displacements lie in a space of few dimensions, so
do the elongations of all members, and the table of them (designs, members) has the lowest rank with the true
signs. Where z is a member's column and M = E E' what the columns of all members have in common, a flip of
some of its entries is right, as like as not, when it lowers

    z' M^-1 z        (that of all columns together is the number of designs, and log det M the rank's measure)

Flips of single entries and of all entries from one design on are looked at: an elongation that passes zero
between two designs is the common case.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["settled_signs"]

Array = NDArray[np.float64]

_ROUNDS = 10
_FAINT = 1e-9  # smallest eigenvalue of M, of the largest
_CLEAR = 0.03  # share of z' M^-1 z that a flip has to take away


def settled_signs(table: Array) -> Array:
    """The table (designs, members), oldest design first, with signs that lower z' M^-1 z.

    >>> import numpy as np
    >>> fields = np.random.default_rng(1).standard_normal((3, 200))
    >>> path = np.array([[1.0, np.exp(-t), np.exp(-2 * t)] for t in np.linspace(0.0, 3.0, 20)])
    >>> true = path @ fields
    >>> found = settled_signs(np.abs(true))  # as though no elongation passed zero
    >>> bool((found * np.sign(true[-1] * found[-1]) * true >= 0).all())
    True
    """
    E = np.array(table, dtype=float)
    designs, members = E.shape
    if designs < 3:
        return E
    size = np.linalg.norm(E, axis=1, keepdims=True)
    E /= np.where(size > 0, size, 1.0)
    for _ in range(_ROUNDS):
        values, axes = np.linalg.eigh(E @ E.T)
        inverse = (axes / np.maximum(values, _FAINT * values[-1])) @ axes.T
        seen = inverse @ E
        single = 4 * E * (np.diag(inverse)[:, None] * E - seen)
        # z' M^-1 z between the entries before a design and those from it on, summed up design by design
        moved = E * (np.triu(inverse, 1) @ E - np.tril(inverse, -1) @ E)
        from_one_on = -4 * np.vstack([np.zeros(members), np.cumsum(moved[:-1], axis=0)])
        change = np.vstack([single, from_one_on])
        best = change.argmin(axis=0)
        clear = np.flatnonzero(change.min(axis=0) < -_CLEAR * (E * seen).sum(axis=0))
        if not len(clear):
            break
        for member, which in zip(clear, best[clear], strict=True):
            flipped = slice(which, which + 1) if which < designs else slice(which - designs, None)
            E[flipped, member] *= -1
    return np.asarray(E * size)
