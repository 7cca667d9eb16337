"""Elongations of members up to their signs, and the signs that agree with each other.

A compliance f'u of K(x) u = f, K = sum x_i b_i b_i', has the slopes -e_i^2 with the elongations e = B u. The
gradients of a path give |e_i| at each of its designs. Which sign the first has is a matter of taste, member
by member; the signs at the later ones relate to it.

Members by the hundred go through the same few designs, so that their elongations are draws of one process
over the designs. Its covariance but for a factor is that of Tyler (1987), the M = L L' that is the mean of

    z z' / (z' M^-1 z)

over the members' columns z, where a column with wrong signs counts for little. An entry is foretold by those
before it: z' M^-1 z = |L^-1 z|^2 is small with the right signs, and large where an elongation that goes on
through zero is turned back. Signs are looked for entry by entry, the best few kept on the way; M is that of
members whose signs are clear, found anew with them. Only recent designs are looked at: older ones keep their
relation to the oldest of these.
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ._kernels_signs import likeliest_signs

__all__ = ["settled_signs"]

Array = NDArray[np.float64]

_WINDOW, _KEPT = 16, 6  # designs looked at, and signs kept of each member on the way
_ENTRIES, _LEAST = 400_000, 3  # looked at: fewer designs where there are many members, and at least
_FIRST_ROUNDS, _ROUNDS = 4, 2  # without enough signs of before, and with them
_STEADY, _ENOUGH = 0.3, 5  # least entry, of its largest, of a column that passes no zero; columns a design
_MEMBERS = 10_000  # that M is found from, and fewer than twice as many
_CLEAR = 4.0  # difference of the log-likelihoods of the best signs and the next
_TIMES = 4  # that columns are weighed anew
_FAINT, _ROUNDING = 1e-12, 1e-13


def settled_signs(table: Array) -> Array:
    """The table (designs, members), oldest design first, with signs by which recent ones foretell each other.

    >>> import numpy as np
    >>> fields = np.random.default_rng(1).standard_normal((3, 200))
    >>> path = np.array([[1.0, np.exp(-t), np.exp(-2 * t)] for t in np.linspace(0.0, 3.0, 10)])
    >>> true = path @ fields
    >>> found = settled_signs(np.abs(true))  # as though no elongation passed zero
    >>> bool((found * np.sign(true[-1] * found[-1]) * true >= 0).all())
    True
    """
    E = np.array(table, dtype=float)
    if len(E) < 3:
        return E
    first = max(0, len(E) - min(_WINDOW, max(_LEAST, _ENTRIES // E.shape[1])))
    try:
        signs = _likeliest(E[first:], anew=len(E) < _WINDOW)
    except np.linalg.LinAlgError:  # columns so alike that nothing is left to foretell
        return E
    E[:first] *= np.where(E[first] < 0, -1.0, 1.0) * signs[0]
    E[first:] = signs * np.abs(E[first:])
    return E


def _likeliest(E: Array, *, anew: bool) -> Array:
    size = np.abs(E)
    most = size.max(axis=0)
    seen = most > _FAINT * most.max()
    steady = np.where(seen, size.min(axis=0) / np.maximum(most, 1e-300), 0.0)
    passing_none = steady >= min(_STEADY, np.sort(steady)[-min(len(steady), _ENOUGH * len(E))])
    columns, every = np.ascontiguousarray(size.T), 1 + len(most) // _MEMBERS
    some = columns[::every]
    M = _in_common(size[:, passing_none & seen] if anew else E[:, ::every][:, seen[::every]])
    for _ in range((_FIRST_ROUNDS if anew else _ROUNDS) - 1):
        signs, misfits = likeliest_signs(some, np.linalg.cholesky(M), _KEPT)
        better = np.diff(np.log(np.maximum(misfits, 1e-300)))[:, 0]
        clear = seen[::every] & (0.5 * len(E) * better > _CLEAR)
        if clear.sum() <= 3 * len(E):
            break
        M = _in_common((signs * some)[clear].T)
    signs, _ = likeliest_signs(columns, np.linalg.cholesky(M), _KEPT)
    return np.asarray(signs.T, dtype=float)


def _in_common(columns: Array) -> Array:
    """Tyler's M of columns (designs, members)."""
    z = columns / np.linalg.norm(columns, axis=0)
    weights = np.ones(z.shape[1])
    for _ in range(_TIMES):
        M = (z * weights) @ z.T / weights.sum()
        M[np.diag_indices_from(M)] = M.diagonal() * (1 + _ROUNDING) + 1e-300
        L = np.linalg.cholesky(M)
        weights = 1 / (scipy.linalg.solve_triangular(L, z, lower=True, check_finite=False) ** 2).sum(axis=0)
    return np.asarray(M, dtype=float)
