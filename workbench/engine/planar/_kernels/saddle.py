# mypy: ignore-errors
"""The saddle matrix of a step as a band, for systems whose bodies and joints form a long graph.

    [M + hc C + h2c K   Phi_q^T]
    [Phi_q              -shift ]

Bodies and rows of joints are numbered by reverse Cuthill-McKee (Cuthill & McKee 1969) on the graph of who
meets whom, once per system. Rows are exchanged within the band: the pivots of partial pivoting, as in the
dense way.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from ...compiler._kernels_band import band_factor, band_solve, band_solve_transposed
from ...compiler.options import INNER
from ...compiler.records import passed_as_record

__all__ = ["Saddle", "fill_band", "multiply_band", "saddle_of", "solve_band"]

Array = np.ndarray[Any, Any]

LEAST = 30  # unknowns; below, factors are a small part of a step either way
NARROW = 2.0  # widths of the band that the unknowns must be at least, or the dense way is as fast


@passed_as_record
class Saddle(NamedTuple):
    """Where the entries of a system's saddle matrix stand in its band; n coordinates, m rows of joints."""

    tangent: Array  # (E, 2) row and column of each entry of K and C that may differ from zero
    entry: Array  # (E, 2) where they stand in the band
    joint: Array  # (J, 2) row and column of each entry of Phi_q that may differ from zero
    across: Array  # (J, 4) where it and its transpose stand in the band
    order: Array  # (n + m,) place of each unknown
    width: Array  # (2,) diagonals below and above the main one


def saddle_of(n: int, pair: Array, row: Array) -> Saddle | None:
    """The band of a system with n coordinates; None where it is not narrow: the dense way is faster.

    pair (P, 2), row (m, 4) as in `Tables`. Systems of one structure, as many cases of a system, share it.
    """
    total = n + len(row)
    if total < LEAST:
        return None
    ends = tuple(map(tuple, row[:, 2:].tolist()))
    band = _band(n, tuple(map(tuple, pair.tolist())), ends)
    return None if NARROW * (3 * int(band.width[0]) + 1) > total else band


@lru_cache(maxsize=64)
def _band(n: int, pair: tuple[tuple[int, ...], ...], ends: tuple[tuple[int, ...], ...]) -> Saddle:
    """The band, however wide.    ends: the two bodies of every row."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    free, total = n // 3, n + len(ends)
    met = {(body, body) for body in range(free)}
    for i, j in pair:
        if i < free and j < free:
            met |= {(i, j), (j, i)}
    tangent = np.array([(3 * i + a, 3 * j + b) for i, j in sorted(met) for a in range(3) for b in range(3)])
    joint = np.array([
        (r, 3 * body + a)
        for r, both in enumerate(ends)
        for body in sorted(set(both))
        if body < free
        for a in range(3)
    ], np.int64).reshape(-1, 2)  # fmt: skip
    rows = np.concatenate([tangent[:, 0], joint[:, 0] + n, joint[:, 1]])
    columns = np.concatenate([tangent[:, 1], joint[:, 1], joint[:, 0] + n])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(total, total)).tocsr()
    order = np.empty(total, np.int64)
    order[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(total)
    width = int(np.abs(order[rows] - order[columns]).max())
    place = order[tangent]
    there, here = order[joint[:, 0] + n], order[joint[:, 1]]
    return Saddle(
        tangent=tangent, entry=np.stack([place[:, 0], place[:, 1] - place[:, 0] + width], axis=1),
        joint=joint, across=np.stack([there, here - there + width, here, there - here + width], axis=1),
        order=order, width=np.array([width, width]),
    )  # fmt: skip


@njit(**INNER)
def fill_band(S, mass, k, c, j, hc, h2c, shift, band):
    """The saddle matrix; k, c (n, n) and j (m, n) are read at the entries of the pattern alone."""
    n, below = mass.shape[0], S.width[0]
    for i in range(band.shape[0]):
        for t in range(band.shape[1]):
            band[i, t] = 0.0
    for e in range(S.tangent.shape[0]):
        a, b = S.tangent[e, 0], S.tangent[e, 1]
        band[S.entry[e, 0], S.entry[e, 1]] = hc * c[a, b] + h2c * k[a, b]
    for a in range(n):
        band[S.order[a], below] += mass[a]
    for e in range(S.joint.shape[0]):
        value = j[S.joint[e, 0], S.joint[e, 1]]
        band[S.across[e, 0], S.across[e, 1]] = value
        band[S.across[e, 2], S.across[e, 3]] = value
    for a in range(n, band.shape[0]):
        band[S.order[a], below] = -shift


@njit(**INNER)
def factor_band(S, band, pivot):
    """Factor the band in place; 0, or 1 + the column without pivot."""
    return band_factor(band, S.width[0], S.width[1], pivot)


@njit(**INNER)
def solve_band(S, band, pivot, transposed, rhs, side):
    """Solve for rhs (n + m,) in place, in the order of the unknowns; side (n + m,) is work space."""
    for a in range(rhs.shape[0]):
        side[S.order[a]] = rhs[a]
    if transposed:
        band_solve_transposed(band, S.width[0], S.width[1], pivot, side)
    else:
        band_solve(band, S.width[0], S.width[1], pivot, side)
    for a in range(rhs.shape[0]):
        rhs[a] = side[S.order[a]]


@njit(**INNER)
def multiply_band(S, band, x, out, side):
    """out (n + m,) -= A^T x for a band that is not factored; side (n + m,) is work space."""
    below, total = S.width[0], x.shape[0]
    for a in range(total):
        side[a] = 0.0
    for a in range(total):
        at, value = S.order[a], x[a]
        for t in range(max(0, below - at), min(2 * below + 1, below + total - at)):
            side[at + t - below] += band[at, t] * value
    for a in range(total):
        out[a] -= side[S.order[a]]


@njit(**INNER)
def keep_entries(S, W, k, c, j):
    """Copy the entries of K, C and Phi_q that may differ from zero; no others are set."""
    for e in range(S.tangent.shape[0]):
        a, b = S.tangent[e, 0], S.tangent[e, 1]
        k[a, b] = W.k[a, b]
        c[a, b] = W.c[a, b]
    for e in range(S.joint.shape[0]):
        r, a = S.joint[e, 0], S.joint[e, 1]
        j[r, a] = W.phi_q[r, a]
